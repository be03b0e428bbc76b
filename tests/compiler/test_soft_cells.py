"""Soft shadows with candidate lists and plane-only cells look the same as with the walk, which tests all primitives."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import candidate_lists, compiled_scene, culling
from raytracer.compiler.scene_lists import GRIDS
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import cell_masks
from tests.pictures import assert_cells_agree, assert_lists_agree
from tests.scenes import lens, random_light, still_life, with_lights

pytestmark = pytest.mark.gl

SIZE = (128, 72)
RADII = [1e-6, 0.05, 1.0, 6.0, 40.0]
RED, BLUE, GREEN, GREY = scenes.COLORS


def soft_settings(**fields: object) -> Settings:
    return Settings(samples=3, shadows="soft", **fields)  # pyright: ignore[reportArgumentType]


def some_lights(rng: np.random.Generator, size: float) -> list[rt.PointLight]:
    """Return three lights of random radii for a scene of `size`: some below the ground, among or around the objects."""
    lights = []
    for _ in range(3):
        light = random_light(rng, np.log10(size) - 1.0, np.log10(size) + 1.0)
        radius = size * 10.0 ** rng.uniform(-4, 1)
        lights.append(msgspec.structs.replace(light, radius=radius if rng.random() < 0.9 else 0.0))
    return lights


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("precision", [32, 64])
def test_the_assignment_looks_the_same_by_cells(renderer: Renderer, radius: float, precision: int) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), radius)
    assert_cells_agree(renderer, scene, (160, 90), soft_settings(precision=precision))
    assert_cells_agree(renderer, scene, (101, 67), soft_settings(precision=precision), tile=48)


@pytest.mark.parametrize("seed", range(16))
def test_few_objects_look_the_same_by_cells(renderer: Renderer, seed: int) -> None:
    rng = np.random.default_rng((7, seed))
    second = rt.Plane(tuple(rng.normal(size=3).tolist()), -3.0, GREEN)
    eye = tuple((rng.normal(size=3) + np.array((0, 2, 5))).tolist())
    scene = still_life(*([second] if seed % 2 else []), lights=some_lights(rng, 3.0), eye=eye)
    assert_cells_agree(renderer, scene, SIZE, soft_settings())


@pytest.mark.parametrize("seed", range(8))
def test_random_trees_look_the_same_with_candidate_lists(renderer: Renderer, always_listed: None, seed: int) -> None:
    rng = np.random.default_rng((8, seed))
    scene = with_lights(scenes.random_scene(seed), *some_lights(rng, 2.0))
    assert_lists_agree(renderer, scene, SIZE, shadows="soft", samples=2)


@pytest.mark.parametrize("scale", [1e-5, 1.0, 1e5])
def test_many_objects_look_the_same_with_candidate_lists(renderer: Renderer, scale: float) -> None:
    rng = np.random.default_rng(3)
    places = scale * rng.uniform((-4, -2, -6), (4, 3, 1), (10, 3))
    many = rt.Instances(lens(0, 0, 0, scale), places, rng.uniform(0.2, 0.6, 10))
    cut = lens(0, 3 * scale, -2 * scale, scale) - rt.Sphere((0, 3 * scale, -2 * scale), 0.3 * scale, RED)
    floor = rt.Plane((0, 1, 0), -2.5 * scale, GREY)
    camera = rt.Camera((0, scale, 6 * scale), (0, 0, 0), vertical_fov=60)
    for objects in ([many, floor], [many, floor, cut & rt.Sphere((0, 3 * scale, -2 * scale), scale, BLUE)]):
        for _ in range(3):
            scene = rt.Scene(objects, some_lights(rng, 4.0 * scale), camera)
            assert_lists_agree(renderer, scene, SIZE, shadows="soft", samples=2)


@pytest.mark.parametrize("radius", [0.1, 2.0, 1e3])
def test_a_light_may_touch_or_contain_points_and_spheres(
    renderer: Renderer, always_listed: None, radius: float
) -> None:
    balls = [rt.Sphere((1.5 * i, 0.6, 0), 0.6, scenes.COLORS[i % 4]) for i in range(-2, 3)]
    floor = rt.Plane((0, 1, 0), 0, GREY)
    for place in ((0.0, 0.6 + 0.6 + radius, 0.0), (0.0, 0.0, 0.0), (0.75, 0.6, 0.0), (0.0, -0.5, 2.0), (0.0, 0.6, 0.0)):
        light = rt.PointLight(place, radius=radius)
        scene = rt.Scene([*balls, floor], [light], rt.Camera((0, 2, 5), (0, 0.5, 0)))
        assert_lists_agree(renderer, scene, (96, 54), shadows="soft", samples=2)
        assert_cells_agree(renderer, scene, (96, 54), soft_settings())


def test_lights_that_differ_only_in_radius_have_separate_lists(renderer: Renderer, always_listed: None) -> None:
    scene = scenes.lit_scene(*(rt.Sphere((i, 0, 0), 0.4, RED) for i in range(-2, 3)), rt.Plane((0, 1, 0), -1, GREY))
    for radius in (0.1, 3.0, 0.1):
        assert_lists_agree(renderer, scenes.with_light_radii(scene, radius, 0.0), SIZE, shadows="soft")


def test_large_lights_among_many_objects_use_a_grid_that_is_coarse_enough(renderer: Renderer) -> None:
    assert GRIDS[-1] == 1, "the coarsest grid always fits"
    rng = np.random.default_rng(1)
    near, far = rng.uniform(-40, 40, (20_000, 3)), rng.uniform(-1e5, 1e5, (30_000, 3))
    for places in (near, np.concatenate([near, far])):
        many = rt.Instances(lens(0, 0, 0), places, 0.2)
        scene = rt.Scene([many], [rt.PointLight((0, 60, 0), radius=100.0)], rt.Camera((0, 0, 100), (0, 0, 0)))
        assert np.isfinite(renderer.render(scene, (32, 18), soft_settings(), geometry=False).radiance).all()


def test_larger_lights_leave_fewer_plane_only_cells_but_some() -> None:
    scene, size = scenes.assignment(), (640, 360)
    hard, soft_, large = (
        cell_masks(scenes.with_light_radii(scene, radius), size, soft_settings())[0].mean()
        for radius in (0.0, 0.5, 2.0)
    )
    assert hard > soft_ > large > 0.3


@pytest.mark.parametrize(("case", "radius", "size"), [("widening", 2.0, (640, 360)), ("listed", 1.5, (320, 180))])
def test_pictures_differ_if_spheres_are_not_enlarged_by_the_light_radius(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, case: str, radius: float, size: tuple[int, int]
) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), radius)
    if case == "listed":
        monkeypatch.setattr(compiled_scene, "FEW", 0)
    for module in (culling, candidate_lists):
        monkeypatch.setattr(module, "ball_growth", lambda *_: 0.0)
    with pytest.raises(AssertionError):
        assert_cells_agree(renderer, scene, size, soft_settings())
