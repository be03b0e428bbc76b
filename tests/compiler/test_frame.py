"""A frame lends its unchanged parts to the next frame, as the same objects, which are not uploaded again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import frame as frame_module
from raytracer.compiler import packing, surfaces
from raytracer.compiler.compiled_scene import compile as compile_scene
from raytracer.compiler.frame import Frame, make_frame
from raytracer.gpu.gl import BufferTexture
from raytracer.gpu.scene_buffers import SceneBuffers
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import LIMITS, frame

SIZE = (64, 36)
BALLS = [rt.Sphere((x % 5 - 2, x // 5 - 1, -(x % 3)), 0.45, scenes.COLORS[x % 4]) for x in range(20)]
GROUND = rt.Plane((0, 1, 0), -1.5, scenes.COLORS[3])
FEW, MANY = scenes.lit_scene(*BALLS[:2], GROUND), scenes.lit_scene(*BALLS, GROUND)
SETTINGS = [Settings(), Settings(shadows="soft"), Settings(precision=64), Settings(evaluator="walk")]


def next_frame(before: Frame, scene: rt.Scene, settings: Settings) -> Frame:
    compiled = compile_scene(scene, settings.compile_options, before.compiled)
    return make_frame(compiled, before.size, LIMITS, before)


def parts(frame: Frame) -> dict[tuple[str, int], Any]:
    """Return the parts of a frame by name, and by number where a texture has several."""
    alone = {**frame.blocks, "measured": frame.measured, "cells": frame.cells}
    textures = {(name, i): part for name, texels in frame.textures.items() for i, part in enumerate(texels)}
    return {(name, 0): part for name, part in alone.items()} | textures


def changed_names(before: Frame, after: Frame) -> set[str]:
    """Return the names of the parts that are other objects in `after` than in `before`."""
    return {name for name, _ in changed_parts(before, after)}


def changed_parts(before: Frame, after: Frame) -> set[tuple[str, int]]:
    old, new = parts(before), parts(after)
    assert old.keys() == new.keys()
    return {part for part in new if new[part] is not old[part]}


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("scene", [FEW, MANY])
def test_settings_of_sampling_change_no_part(scene: rt.Scene, settings: Settings) -> None:
    before = frame(scene, SIZE, settings)
    for sampling in ({"samples": 64}, {"samples": 9, "adaptive": 0.01}, {"samples": 9, "max_error": 0.1}, {"time": 9}):
        assert changed_names(before, next_frame(before, scene, settings.replace(**sampling))) == set()
    assert changed_names(before, next_frame(before, msgspec.structs.replace(scene), settings)) == set()


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("scene", [FEW, MANY])
def test_a_light_changes_only_the_parts_that_depend_on_lights(scene: rt.Scene, settings: Settings) -> None:
    before = frame(scene, SIZE, settings)
    (light, *rest) = scene.lights
    colored = msgspec.structs.replace(scene, lights=[msgspec.structs.replace(light, color=(0.1, 0.2, 0.3)), *rest])
    assert changed_names(before, next_frame(before, colored, settings)) == {"Lights"}
    moved = msgspec.structs.replace(scene, lights=[msgspec.structs.replace(light, position=(1, 5, 2)), *rest])
    lists = {"lists", "ends"} if before.lists else set()
    assert changed_names(before, next_frame(before, moved, settings)) <= {"Lights", "cells"} | lists


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("scene", [FEW, MANY])
def test_a_frame_made_from_another_frame_equals_a_frame_made_alone(scene: rt.Scene, settings: Settings) -> None:
    (light, *rest) = scene.lights
    lights = [msgspec.structs.replace(light, position=BALLS[0].center, radius=0.45), *rest]
    cameras = [scene.camera, rt.Camera((1, 2, 7), (0, 0, 0))]
    before = frame(scene, SIZE, settings)
    for other in (
        msgspec.structs.replace(scene, lights=lights),
        msgspec.structs.replace(scene, camera=cameras[1], lights=rest),
        msgspec.structs.replace(scene, objects=BALLS[2:5], materials=()),
        msgspec.structs.replace(scene, ambient=(1, 0, 0)),
        FEW,
        MANY,
    ):
        before = next_frame(before, other, settings)
        alone = frame(other, SIZE, settings)
        assert before.uniforms == alone.uniforms and before.rounds == alone.rounds
        assert dict(before.blocks) == dict(alone.blocks) and before.textures.keys() == alone.textures.keys()
        for name, texels in alone.textures.items():
            for after_another, part in zip(before.textures[name], texels, strict=True):
                np.testing.assert_array_equal(after_another, part, err_msg=name)
        np.testing.assert_array_equal(before.rectangles, alone.rectangles)
        for name in ("plane_only", "empty"):
            np.testing.assert_array_equal(getattr(before.cells, name), getattr(alone.cells, name))


@pytest.mark.parametrize("shadows", ["hard", "soft"])
def test_moving_a_light_changes_no_list_of_another_light(shadows: str) -> None:
    settings = Settings(shadows=shadows)  # pyright: ignore[reportArgumentType]
    lights = [rt.PointLight((x, 4, 3), radius=0.2) for x in range(4)]
    scene = msgspec.structs.replace(MANY, lights=lights)
    before = frame(scene, SIZE, settings)
    moved = [*lights[:1], rt.PointLight((1, 4.5, 3), radius=0.2), *lights[2:]]
    after = next_frame(before, msgspec.structs.replace(scene, lights=moved), settings)
    # In "lists", all objects and the picture come before the lights. In "ends", the texels of the lights come first.
    assert changed_parts(before, after) == {("Lights", 0), ("cells", 0), ("lists", 3), ("ends", 0), ("ends", 2)}
    assert before.lists and after.lists and after.lists.picture_ends is before.lists.picture_ends
    shadows_before, shadows_after = before.cells.shadows, after.cells.shadows
    assert len(shadows_before) == len(shadows_after) == 4
    assert sum(shadow is shadows_before.get(caster) for caster, shadow in shadows_after.items()) == 3
    reversed_ = next_frame(after, msgspec.structs.replace(scene, lights=moved[::-1]), settings)
    assert reversed_.lists and all(a is b for a, b in zip(reversed_.lists.own, after.lists.own[::-1], strict=True))
    camera = rt.Camera((1, 2, 7), (0, 0, 0))
    turned = next_frame(after, msgspec.structs.replace(scene, lights=moved, camera=camera), settings)
    assert {("lists", i) for i in range(2, 6)} <= changed_parts(after, turned)


def test_lights_at_one_place_share_their_lists() -> None:
    lights = [rt.PointLight((1, 4, 3), (0.1 * i, 0, 0)) for i in range(1, 4)]
    lists = frame(msgspec.structs.replace(MANY, lights=lights), SIZE).lists
    assert lists and len({id(one) for one in lists.own}) == 1 and len(lists.own) == 3


def test_lights_on_surfaces_are_not_searched_again_unless_they_change(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []

    def count_calls(module: Any, name: str, times: Callable[..., int]) -> None:
        function = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *arguments: (calls.extend([name] * times(*arguments)), function(*arguments))[1]
        )

    count_calls(packing, "coincidences", lambda *_: 1)
    count_calls(frame_module, "touched_surfaces", lambda _, lights: len(lights))
    lights = [rt.PointLight((0.1 * i, -1.5, 0)) for i in range(20)]
    scene = msgspec.structs.replace(MANY, lights=lights)
    before = frame(scene, SIZE)
    assert calls == ["coincidences", *["touched_surfaces"] * 20]
    assert set(before.lights.touched.values()) == {20}, "the lights touch the ground, surface 20 after 20 spheres"
    calls.clear()
    moved = msgspec.structs.replace(scene, lights=[*lights[1:], rt.PointLight((0, 1, 0), (0.5, 0.5, 0.5))])
    after = next_frame(before, moved, Settings())
    assert calls == ["touched_surfaces"], "only the new light is searched"
    calls.clear()
    next_frame(after, msgspec.structs.replace(moved, camera=rt.Camera((1, 2, 7), (0, 0, 0))), Settings())
    assert calls == ["coincidences"], "coincidences are computed once per camera"
    assert surfaces.touched_surfaces is not frame_module.touched_surfaces


@pytest.mark.gl
def test_only_changed_parts_are_written_to_buffers(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []
    write_texels, write_block = BufferTexture.write, SceneBuffers._write_block

    def texels(self: BufferTexture, data: Any) -> None:
        written.append("texels")
        write_texels(self, data)

    def block(self: SceneBuffers, name: str, data: bytes) -> None:
        written.append(name)
        write_block(self, name, data)

    monkeypatch.setattr(BufferTexture, "write", texels)
    monkeypatch.setattr(SceneBuffers, "_write_block", block)
    with renderer.device.context:
        buffers = SceneBuffers(renderer.device.context)
        before = frame(MANY, SIZE)
        buffers.upload(before)
        assert sorted(written) == ["Lights", *["texels"] * 6]
        written.clear()
        buffers.upload(next_frame(before, MANY, Settings(samples=256)))
        assert written == []
        (light, *rest) = MANY.lights
        brighter = msgspec.structs.replace(MANY, lights=[msgspec.structs.replace(light, color=(1, 0, 0)), *rest])
        buffers.upload(next_frame(before, brighter, Settings()))
        assert written == ["Lights"]
        buffers.close()


@pytest.mark.gl
def test_buffers_hold_all_parts_after_a_change_of_any_part(renderer: Renderer) -> None:
    rng = np.random.default_rng(9)
    with renderer.device.context:
        buffers = SceneBuffers(renderer.device.context)
        before = frame(MANY, SIZE)
        lights = list(MANY.lights)
        for step in range(12):
            place = tuple(rng.normal(size=3).tolist())
            match step % 4:
                case 0:
                    lights = [*lights, rt.PointLight(place)]
                case 1 | 2:
                    lights = [rt.PointLight(place), *lights[1:]]
                case _:
                    lights = lights[1:]
            before = next_frame(before, msgspec.structs.replace(MANY, lights=lights), Settings())
            buffers.upload(before)
            for name, texels in before.textures.items():
                buffer = buffers._textures[name]._buffer
                assert buffer
                assert buffer.read(sum(part.nbytes for part in texels)) == b"".join(part.tobytes() for part in texels)
        buffers.close()
