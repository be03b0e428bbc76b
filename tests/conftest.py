"""Fixtures: one OpenGL context for the whole session, and a check that every test leaves it without an error."""

import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from raytracer.app.viewer import file_watcher
from raytracer.compiler import compiled_scene
from raytracer.compiler.glsl import preprocessor
from raytracer.gpu.device import _shared, shared_device
from raytracer.rendering.renderer import Renderer

# The files whose tests take minutes. They start first: no process is left alone with one of them at the end.
LONG = "test_window.py", "test_pages.py"

pytest.register_assert_rewrite("tests.pictures")  # a failed assertion of this module then shows its values


def pytest_configure() -> None:
    """Let tests that are terminated, for example by a time limit, end the processes that they started."""
    signal.signal(signal.SIGTERM, _end)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the tests of the long files first."""
    items.sort(key=lambda item: item.path.name not in LONG)


def _end(number: int, _frame: object) -> NoReturn:
    pytest.exit("terminated", 128 + number)


@pytest.fixture
def renderer() -> Renderer:
    """Return the session's renderer, on the backend that RAYTRACER_BACKEND names. A missing context is a failure."""
    return Renderer(shared_device())


@pytest.fixture
def has_round_limit(renderer: Renderer) -> bool:
    """Return whether the driver ends every loop of a shader after 65,535 rounds, which cut_short.glsl must detect.

    llvmpipe of Mesa 22.3 does; llvmpipe of Mesa 25.0 does not.
    """
    context = renderer.device.context
    vertex = "#version 330\nvoid main() { gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }"
    fragment = """#version 330
        uniform int many, two;
        out vec4 cut_short;
        void main() {
            int n = 1, rounds = 0;
            for (int k = 0; k < many; k++) n = (n * 5) ^ k;
            for (int k = 0; k < two; k++) rounds++;
            cut_short = vec4(rounds < two, n, 0, 0);
        }"""
    with renderer.device.turn():
        program = context.program(vertex_shader=vertex, fragment_shader=fragment)
        program["many"], program["two"] = 70_000, 2
        framebuffer = context.simple_framebuffer((8, 8), 4, dtype="f4")
        framebuffer.use()
        array = context.vertex_array(program, [])
        array.render(vertices=3)
        value = np.frombuffer(framebuffer.read(components=1, dtype="f4"), np.float32)[0]
        context.detect_framebuffer(0).use()
        for resource in (array, framebuffer, program):
            resource.release()
    return bool(value)


@pytest.fixture
def shaders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of the shaders' folder, which the program uses instead of the original."""
    folder = tmp_path / "shaders"
    shutil.copytree(preprocessor.shaders_folder(), folder)
    for module in (preprocessor, file_watcher):
        monkeypatch.setattr(module, "shaders_folder", lambda: folder)
    return folder


@pytest.fixture
def always_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use candidate lists for any number of objects.

    Scenes with few objects can then be compared with the walk, whose shader text grows with the scene.
    """
    monkeypatch.setattr(compiled_scene, "FEW", 0)


@pytest.fixture(autouse=True)
def no_opengl_error() -> Iterator[None]:
    yield
    for shared in _shared.values():
        assert shared.context.error == "GL_NO_ERROR"
