"""One OpenGL context for the whole session; every test leaves it without an error."""

import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import pytest

from raytracer import glsl_source, watch
from raytracer.renderer import Renderer, _shared, shared_renderer


def pytest_configure() -> None:
    """Let tests that are terminated, as by a time limit, end what they started."""
    signal.signal(signal.SIGTERM, _end)


def _end(number: int, _frame: object) -> NoReturn:
    pytest.exit("terminated", 128 + number)


@pytest.fixture
def renderer() -> Renderer:
    """The session's renderer, on the backend that RAYTRACER_BACKEND names. No context is a failure."""
    return shared_renderer()


@pytest.fixture
def shaders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the shaders' folder, which takes its place."""
    folder = tmp_path / "shaders"
    shutil.copytree(glsl_source.shaders_folder(), folder)
    for module in (glsl_source, watch):
        monkeypatch.setattr(module, "shaders_folder", lambda: folder)
    return folder


@pytest.fixture(autouse=True)
def no_opengl_error() -> Iterator[None]:
    yield
    for shared in _shared.values():
        assert shared.context.error == "GL_NO_ERROR"
