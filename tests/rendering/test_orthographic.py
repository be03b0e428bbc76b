"""Orthographic pictures: closed forms, any distance of the camera, and the float64 ray tracer."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.bright_features import bright_features
from raytracer.compiler.view_space import project_point
from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.converged import trace_converged
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import compiled
from tests.pictures import assert_same

pytestmark = pytest.mark.gl

RED, BLUE, GREEN, GREY = scenes.COLORS
SIZE = (64, 40)
LIGHTS = [rt.PointLight((4, 7, 4)), rt.PointLight((-5, 3, 6), (0.4, 0.4, 0.5))]
FLOOR = rt.Plane((0, 1, 0), 0, GREY)
EVERYTHING = [
    rt.Sphere((0, 1, 0), 1, RED) - rt.Sphere((0.5, 1.6, 0.6), 0.7, BLUE),
    rt.Box((1.5, 0, -1), (2.5, 1.2, 1), GREEN),
    rt.Cylinder((-2.5, 0, 0), (-2.5, 1.5, 0), 0.6, BLUE),
    rt.Cone((0, 0, 2), (0, 1, 2), 0.6, 0.2, GREEN),
    rt.Torus((-1.2, 0.3, 1.8), (0, 1, 0), 0.5, 0.2, RED),
    rt.Ellipsoid((1.6, 0.5, 2), (0.7, 0.5, 0.4), BLUE),
    rt.Polyhedron(((2.5, 0, 1.8), (3.5, 0, 1.8), (3, 0, 2.6), (3, 1, 2.1)), RED),
    FLOOR,
]


def looking(
    *objects: rt.Solid, eye: Any = (0, 0, 4), at: Any = (0, 0, 0), height: float = 4.0, **more: Any
) -> rt.Scene:
    """Return a scene of the objects with an orthographic camera."""
    camera = rt.Camera(eye, at, projection="orthographic", height=height)
    return rt.Scene(objects, more.pop("lights", LIGHTS), camera, **more)


def shown(renderer: Renderer, scene: rt.Scene, size: tuple[int, int], **settings: object) -> np.ndarray:
    """Return which pixels show a surface (H, W)."""
    image = renderer.render(scene, size, Settings(samples=1, **settings))  # pyright: ignore[reportArgumentType]
    assert image.material is not None
    return image.material >= 0


def test_a_sphere_covers_pi_r_squared_of_the_picture_at_any_depth(renderer: Renderer) -> None:
    for z in (0.0, -30.0, -1e5):
        seen = shown(renderer, looking(rt.Sphere((0.3, -0.2, z), 1.2)), (320, 200))
        assert seen.sum() * (4.0 / 200) ** 2 == pytest.approx(math.pi * 1.44, rel=3e-3)


def test_a_cube_along_its_axis_is_a_square(renderer: Renderer) -> None:
    seen = shown(renderer, looking(rt.Box((-1, -1, -9), (1, 1, 1))), (80, 40))
    expected = np.zeros((40, 80), bool)
    expected[10:30, 30:50] = True
    np.testing.assert_array_equal(seen, expected)


def test_a_long_bar_is_as_wide_far_away_as_near(renderer: Renderer) -> None:
    seen = shown(renderer, looking(rt.Box((-1, -1, -400), (1, 0, 400)), eye=(0, 3, 4), at=(0, 0, 0)), (80, 40))
    np.testing.assert_array_equal(seen, np.tile(np.abs(np.arange(80) - 39.5) < 10, (40, 1)))


def test_the_distance_of_the_camera_does_not_matter(renderer: Renderer) -> None:
    solids = [solid.translate((0, -1, 0)) for solid in EVERYTHING[:-1]]
    near, far = (renderer.render(looking(*solids, eye=(0, 0, z), height=5), SIZE, Settings()) for z in (4.0, 2.0**20))
    for name in ("radiance", "normal", "material"):
        np.testing.assert_array_equal(getattr(near, name), getattr(far, name))
    assert near.depth is not None and far.depth is not None
    hit = np.isfinite(near.depth)
    np.testing.assert_allclose(far.depth[hit], near.depth[hit] + (2.0**20 - 4.0), rtol=2.0**-23)


def test_nothing_behind_the_cameras_plane_is_visible(renderer: Renderer) -> None:
    front, behind, around = rt.Sphere((-1, 0, 3), 0.5), rt.Sphere((1, 0, 5), 0.5), rt.Sphere((0, 0, 4), 1.9)
    np.testing.assert_array_equal(shown(renderer, looking(front, behind), SIZE), shown(renderer, looking(front), SIZE))
    image = renderer.render(looking(around), (81, 81), Settings())
    assert image.depth is not None and image.depth[40, 40] == pytest.approx(1.9)


@pytest.mark.parametrize(("evaluator", "precision"), list(itertools.product(("cells", "walk", "roth"), (32, 64))))
def test_all_solids_and_their_shadows_agree_with_the_ground_truth(
    renderer: Renderer, evaluator: str, precision: int
) -> None:
    settings = Settings(shadows="hard", evaluator=evaluator, precision=precision)  # pyright: ignore[reportArgumentType]
    scene = looking(*EVERYTHING, eye=(6, 7, 12), at=(0, 0.7, 0.5), height=5)
    image, truth = renderer.render(scene, SIZE, settings), ray_tracer.trace(scene, SIZE, settings)
    np.testing.assert_array_equal(image.material, truth.material)
    np.testing.assert_allclose(image.radiance, truth.radiance, atol=1e-5)
    assert image.depth is not None and truth.depth is not None
    np.testing.assert_allclose(image.depth, truth.depth, rtol=1e-6)


def test_faces_at_one_place_are_crossed_at_once(renderer: Renderer) -> None:
    box = rt.Box((-1, -1, -1), (1, 1, 1)).rotate((1, 2, 3), 40)
    sides = [rt.Plane(tuple(s * np.eye(3)[k]), 1.0).rotate((1, 2, 3), 40) for k in range(3) for s in (1, -1)]
    cut = sides[0] & sides[1] & sides[2] & sides[3] & sides[4] & sides[5]
    halves = rt.Box((-1, -1, -1), (0, 1, 1)) | rt.Box((0, -1, -1), (1, 1, 1))
    empty = looking(box - box, box - cut, cut - box, rt.Box((-1, -1, -1), (1, 1, 1)) - halves, eye=(1, 2, 3))
    for evaluator in ("cells", "walk"):
        assert not shown(renderer, empty, SIZE, evaluator=evaluator).any()
    assert not shown(renderer, looking(box - cut, eye=(1, 2, 3)), SIZE, evaluator="roth").any()


def test_many_objects_look_the_same_with_candidate_lists(renderer: Renderer) -> None:
    rng = np.random.default_rng(3)
    balls = [rt.Sphere(tuple(p), 0.3, RED) - rt.Sphere(tuple(p + 0.2), 0.2, BLUE) for p in rng.uniform(-2, 2, (12, 3))]
    scene = looking(*balls, rt.Box((1, 1, 1), (2, 2, 2), GREEN), rt.Plane((0, 1, 0), -2, GREY), eye=(30, 40, 50))
    assert compiled(scene).has_lists
    lists, walk = (
        renderer.render(scene, SIZE, Settings(shadows="hard", evaluator=evaluator))  # pyright: ignore
        for evaluator in ("cells", "walk")
    )
    assert_same(renderer, lists, walk)


def test_a_sphere_has_the_same_normals_with_any_evaluator(renderer: Renderer) -> None:
    scene = looking(rt.Sphere((0.3, 0.2, 0), 1.3, RED) | rt.Sphere((-0.9, 0.7, 0.3), 0.8, BLUE), eye=(1, 2, 3))
    walk, roth = (
        renderer.render(scene, SIZE, Settings(evaluator=evaluator))  # pyright: ignore
        for evaluator in ("walk", "roth")
    )
    assert_same(renderer, walk, roth)


def test_a_mirror_shows_the_ground_truth(renderer: Renderer) -> None:
    scene = looking(
        rt.Sphere((0, 1, 0), 1, rt.Material("mirror")), rt.Box((1.5, 0, -1), (2.5, 1.2, 1), RED), FLOOR, eye=(1, 2, 3)
    )
    image, truth = renderer.render(scene, SIZE, Settings()), ray_tracer.trace(scene, SIZE)
    off = np.abs(image.radiance - truth.radiance).max(axis=-1)
    assert np.mean(off > 1e-3) < 0.002


def test_a_converged_picture_of_a_glowing_ball_has_the_mean_of_its_area() -> None:
    glow = rt.Sphere((0, 0, 0), 1, rt.Material(ka=0, kd=0, ks=0, le=(1, 1, 1)))
    scene = looking(glow, lights=[], background=(0, 0, 0), height=3)
    image = trace_converged(scene, (9, 9), samples=1024, tolerance=1e-3, cache=False, workers=1)
    assert image.radiance.mean() == pytest.approx(math.pi / 9.0, rel=5e-3)


def test_a_small_glowing_ball_is_a_feature_of_its_area(renderer: Renderer) -> None:
    glow = rt.Material(ka=0, kd=0, ks=0, le=(1, 1, 1))
    scene = looking(rt.Sphere((1, 0.5, -3), 0.02, glow), rt.Sphere((0, 0, 9), 0.02, glow), eye=(0, 0, 8), lights=[])
    features = bright_features(compiled(scene), (80, 40))
    assert features.x == pytest.approx([50.0], abs=1e-3) and features.y == pytest.approx([15.0], abs=1e-3)
    assert features.areas == pytest.approx([math.pi * 0.02**2 / 0.01], rel=1e-3)


def test_a_marker_is_at_the_place_of_its_light() -> None:
    camera = looking(FLOOR, eye=(0, 0, 9)).camera
    assert project_point(camera, (1.0, 0.5, -7.0), (80, 40), 2.0) == (pytest.approx(50.0), pytest.approx(25.0), True)
    x, y, in_view = project_point(camera, (1.0, 0.0, 10.0), (80, 40), 2.0)
    assert (x, y, in_view) == (78.0, 20.0, False)
