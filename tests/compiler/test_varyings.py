"""Drivers with few varyings: no vertex shader declares more than the limit, and pictures have the same bits."""

from __future__ import annotations

import re

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.glsl.preprocessor import Source
from raytracer.gpu import gl
from raytracer.gpu.device import Device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import sources
from tests.shader_text import code

SIZE = (40, 24)
# The number of components beside gl_PointSize: the least that OpenGL 3.3 guarantees, and the number of many drivers.
PROMISED, USUAL = 59, 123
_COMPONENTS = {"float": 1, "int": 1, "double": 2, "ivec2": 2} | {f"vec{n}": n for n in (2, 3, 4)}
_COMPONENTS |= {f"dvec{n}": 2 * n for n in (2, 3, 4)}

GROUND = rt.Plane((0, 1, 0), -1.2, rt.Material(model="ggx", f0=(0.9, 0.6, 0.3)))
WALL = rt.Plane((0.1, 0, 1), -6, rt.Material(model="blinn", kd=(0.2, 0.3, 0.4)))
BALLS = [rt.Sphere((x % 5 - 2, x // 5 - 1, -(x % 3)), 0.45, scenes.COLORS[x % 4]) for x in range(20)]
QUADS = [(BALLS[i] | BALLS[i + 1]) - BALLS[i + 5] & BALLS[i + 6] for i in range(5)]
BORED = [
    rt.Box((x, 0, 0), (x + 0.7, 0.6, 1)) - rt.Cylinder((x + 0.3, 0.3, -1), (x + 0.3, 0.3, 2), 0.2) for x in range(-4, 4)
]
MIRROR = rt.Sphere((0, 0.2, 1), 0.7, rt.Material(model="mirror"))
SCENES = {
    "few": scenes.lit_scene(*BALLS[:2], GROUND),
    "six surfaces": scenes.lit_scene(*BALLS[:2], BALLS[6] - BALLS[7], GROUND, WALL),
    "many planes": scenes.lit_scene(BALLS[0], *(rt.Plane((0.1 * k, 1, 0), -1 - 0.1 * k) for k in range(6))),
    "shapes": scenes.lit_scene(*BALLS, GROUND, WALL),
    "shapes of four": scenes.lit_scene(*QUADS, GROUND, WALL),
    "shapes of bodies": scenes.lit_scene(*BORED, GROUND, WALL),
    "shapes and a tree": scenes.lit_scene(*BALLS, scenes.random_scene(4).objects[0], GROUND),
    "mirrors": scenes.lit_scene(*BALLS[:3], MIRROR, GROUND),
    "mirrors in lists": scenes.lit_scene(*BALLS, MIRROR, GROUND),
    "no lights": msgspec.structs.replace(scenes.lit_scene(*BALLS[:2], GROUND), lights=(), ambient=(1, 1, 1)),
}
SETTINGS = {
    "hard": Settings(samples=2),
    "walk": Settings(evaluator="walk"),
    "roth": Settings(evaluator="roth"),
    "64 bits": Settings(precision=64),
    "diluted": Settings(shadows="diluted"),
    "soft": Settings(shadows="soft", samples=2),
}


def with_soft_lights(scene: rt.Scene, settings: Settings) -> rt.Scene:
    """Return `scene`; with soft shadows, its lights have radii and falloff."""
    if settings.shadows != "soft":
        return scene
    lights = [msgspec.structs.replace(light, falloff="inverse_square") for light in scene.lights]
    return scenes.with_light_radii(msgspec.structs.replace(scene, lights=lights), 0.5, 0.2)


def components(vertex: Source) -> int:
    """Return the number of components of the varyings that a vertex shader declares."""
    text = re.sub(r"\breal\b", "double" if "#define DOUBLES" in vertex.text else "float", code(vertex))
    text = re.sub(r"\breal(\d)\b", r"dvec\1" if "#define DOUBLES" in vertex.text else r"vec\1", text)
    sizes = dict(_COMPONENTS)
    for name, body in re.findall(r"struct (\w+) \{(.*?)\};", text, re.DOTALL):
        members = re.findall(r"^\s*(\w+) \w+;", body, re.MULTILINE)
        sizes[name] = sum(sizes[kind] for kind in members) if all(kind in sizes for kind in members) else 10**6
    declared = re.findall(r"^flat out (\w+) \w+;", text, re.MULTILINE)
    assert declared and len(re.findall(r"\bout \w+ \w+;", text)) == len(declared)
    return sum(sizes[kind] for kind in declared)


@pytest.mark.parametrize("name", SCENES)
def test_no_shader_declares_more_varyings_than_the_limit(name: str) -> None:
    for settings in SETTINGS.values():
        scene = with_soft_lights(SCENES[name], settings)
        for limit in (PROMISED, USUAL):
            programs = sources(scene, settings, varyings=limit, several=True)
            for vertex in {source.vertex for name, source in programs.items() if name != "empty"}:
                assert components(vertex) <= limit


def test_without_a_tight_limit_all_handed_constants_are_varyings() -> None:
    most = max(
        components(source.vertex)
        for scene in SCENES.values()
        for settings in SETTINGS.values()
        for name, source in sources(with_soft_lights(scene, settings), settings).items()
        if name != "empty"
    )
    assert PROMISED < most <= 128
    assert components(sources(SCENES["shapes of four"])["shapes"].vertex) > PROMISED


@pytest.mark.gl
def test_the_limit_of_varyings_is_the_drivers_limit(renderer: Renderer) -> None:
    with renderer.device.context:
        assert gl.varying_components(renderer.device.context) == renderer.device.limits.varyings >= PROMISED


@pytest.mark.gl
@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("few", ("walk", "roth", "64 bits", "diluted", "soft")),
        ("six surfaces", ("hard", "64 bits", "soft")),
        ("many planes", ("hard",)),
        ("shapes", ("hard",)),
        ("shapes of four", ("hard", "64 bits")),
        ("shapes of bodies", ("hard",)),
        ("shapes and a tree", ("hard", "soft")),
        ("mirrors", ("hard",)),
        ("mirrors in lists", ("hard",)),
        ("no lights", ("hard",)),
    ],
)
def test_pictures_have_the_same_bits_with_few_varyings(renderer: Renderer, name: str, keys: tuple[str, ...]) -> None:
    few = Renderer(Device(renderer.device.context))
    few.device.limits = msgspec.structs.replace(few.device.limits, varyings=PROMISED)
    for key in keys:
        settings = SETTINGS[key]
        if settings.precision not in renderer.device.limits.precisions:
            continue
        scene = with_soft_lights(SCENES[name], settings)
        own, other = (maker.render(scene, SIZE, settings) for maker in (renderer, few))
        np.testing.assert_array_equal(other.radiance, own.radiance, err_msg=key)
        np.testing.assert_array_equal(other.depth, own.depth, err_msg=key)
        np.testing.assert_array_equal(other.normal, own.normal, err_msg=key)
        np.testing.assert_array_equal(other.material, own.material, err_msg=key)
    with renderer.device.context:
        few.device.forget()
