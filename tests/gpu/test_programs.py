"""The program cache keeps the most recently used programs within a limit, and all programs of an unfinished picture."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

import raytracer as rt
from raytracer import glsl
from raytracer.app.viewer.canvas import Canvas
from raytracer.gpu import device
from raytracer.gpu.device import Device
from raytracer.gpu.texture_units import UNITS
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes

pytestmark = pytest.mark.gl

SIZE = (32, 18)
FEW = 40_000  # characters, about the programs of two of these scenes


def scene_with(spheres: int) -> rt.Scene:
    """Return a scene whose structure, and so its programs, depend on the number of spheres."""
    return scenes.lit_scene(*(rt.Sphere((i, 0, 0), 0.7) for i in range(spheres)))


def count_cached_text(renderer: Renderer) -> int:
    """Return the characters of all cached programs, without the text that all programs share."""
    return sum(max(len(vertex) + len(text) - device._COMMON_TEXT, 0) for vertex, text in renderer.device._programs)


def are_released(programs: list[moderngl.Program]) -> list[bool]:
    """Return for each program whether OpenGL has released it."""
    return [isinstance(program.mglo, moderngl.InvalidObject) for program in programs]


def test_many_scenes_keep_programs_within_the_limit(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "KEPT_TEXT", FEW)
    own = Renderer(Device(renderer.device.context))
    made: dict[int, moderngl.Program] = {}
    newest = 0
    first = own.render(scene_with(1), SIZE, Settings())
    for spheres in (*range(2, 9), 8):
        before = dict(own.device._programs)
        own.render(scene_with(spheres), SIZE, Settings())
        made |= {id(program): program for program in own.device._programs.values()}
        new = [key for key, program in own.device._programs.items() if before.get(key) is not program]
        newest = sum(len(vertex) + len(text) for vertex, text in new)
        assert count_cached_text(own) <= FEW + newest
    assert not newest, "the programs of the last scene are kept"
    assert len(made) > 2 * len(own.device._programs)
    alive = {id(program) for program in own.device._programs.values()}
    assert are_released([*made.values()]) == [i not in alive for i in made]
    np.testing.assert_array_equal(own.render(scene_with(1), SIZE, Settings()).radiance, first.radiance)


def test_function_calls_keep_programs_within_the_limit(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "KEPT_TEXT", FEW)
    own = Renderer(Device(renderer.device.context))
    for k in range(8):
        text = f"float plus{k}(float x) {{ return x + {k}.0; }}\n" + "// Long.\n" * 4000
        assert glsl.call(f"plus{k}", [1.0], device=own.device, file="plus.glsl", generated={"plus.glsl": text}) == [
            k + 1.0
        ]
    assert len(own.device._programs) <= 4 < 8


def test_the_window_keeps_the_programs_that_it_draws_with(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "KEPT_TEXT", 0)
    own, settings = Renderer(Device(renderer.device.context)), Settings(samples=4)
    with renderer.device.context:
        live, canvas = ProgressivePicture(own.device, budget=1.0), Canvas(own.device)
        screen = own.device.context.framebuffer([own.device.context.texture(SIZE, 4)])
        for spheres in (2, 3, 4):
            live.start(scene_with(spheres), settings, "picture", SIZE, moving=False)
            while not live.is_done:
                live.step()
                own.render(scene_with(1), SIZE, Settings())  # another picture in between
                renderer.device.context.__enter__()  # render() leaves no context current
            canvas.present(screen, live, None, scene_with(spheres).camera, 1.0)
        radiance, programs = live.image({}).radiance, len(own.device._programs)
        live.close()
        canvas.close()
    assert programs <= 12, "the programs of the last scene, the window and the error estimate"
    np.testing.assert_allclose(radiance, renderer.render(scene_with(4), SIZE, settings).radiance, rtol=1e-6)


def test_each_sampler_has_a_texture_unit_of_its_own() -> None:
    # A draw with two types of samplers at one unit draws nothing.
    assert len({*UNITS.values()}) == len(UNITS)
