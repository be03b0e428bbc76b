"""The default evaluator makes bit-identical pictures to `walk`, which tests every object for every ray."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial
from typing import get_args

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import compiled_scene
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Shadows
from raytracer.scene.settings import Settings
from raytracer.scene.solids.flattening import leaves, with_leaves
from raytracer.scene.solids.solid import Primitive
from tests import scenes
from tests.pictures import assert_same

pytestmark = pytest.mark.gl

RED, BLUE, _, GREY = scenes.COLORS


def check(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, scene: rt.Scene, size: tuple[int, int], settings: Settings
) -> int:
    """Compare the pictures of `cells` and `walk`, and return the number of pixels that show an object.

    `cells` renders with a program for plane-only cells, without this program, and by candidate lists.
    """
    walk = renderer.render(scene, size, msgspec.structs.replace(settings, evaluator="walk"), estimates=False)
    images = [
        renderer.render(scene, size, settings, single_picture=single, estimates=False) for single in (False, True)
    ]
    if settings.precision == 32:
        with monkeypatch.context() as patch:
            patch.setattr(compiled_scene, "FEW", 0)
            images.append(renderer.render(scene, size, settings, estimates=False))
    for image in images:
        assert_same(renderer, image, walk)
    assert walk.material is not None
    return int((walk.material >= 0).sum())


@pytest.mark.parametrize("precision", [32, 64])
def test_a_ball_at_the_border_of_a_very_wide_view_is_visible(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, precision: int
) -> None:
    # The corners of the only cell span more than a hemisphere of directions.
    ball = rt.Sphere((-0.014780587448385951, -1.4029576615647563, 0.8244669686621453), 0.5152236804388914)
    at = (-2.614875843337293, 0.4450579249211968, 0.7516415816610956)
    settings = Settings(precision=precision)  # pyright: ignore[reportArgumentType]
    for fov, seen in ((160.0, 5), (170.0, 7), (179.0, 8), (179.9, 8)):
        camera = rt.Camera((0, 0, 0), at, vertical_fov=fov)
        scene = rt.Scene([ball], [], camera, background=(1, 1, 1))
        assert check(renderer, monkeypatch, scene, (16, 9), settings) == seen


def direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


class Surroundings:
    """Random primitives around a camera, in a scene of any scale."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.scale = 10.0 ** rng.uniform(-3, 3)
        self.eye = rng.normal(size=3) * self.scale * 10.0 ** rng.uniform(-1, 1)

    def ball(self) -> rt.Solid:
        distance = self.scale * 10.0 ** self._rng.uniform(-1, 1.5)
        share = self._rng.choice([10.0 ** self._rng.uniform(-3, 0), 1.0 - 10.0 ** self._rng.uniform(-4, -1), 1.3])
        return self._sphere(self.eye + distance * direction(self._rng), distance * share)

    def lens(self) -> rt.Solid:
        """Return the intersection of two balls that overlap, some of them hardly."""
        distance = self.scale * 10.0 ** self._rng.uniform(-1, 1)
        radius = distance * 10.0 ** self._rng.uniform(-4, -0.3)
        center, axis = self.eye + distance * direction(self._rng), direction(self._rng)
        axis *= radius * (1.0 - 10.0 ** self._rng.uniform(-9, -0.5))
        return self._sphere(center - axis, radius) & self._sphere(center + axis, radius)

    def half_space(self) -> rt.Solid:
        n = self._rng.choice([direction(self._rng), np.array((0.0, 1.0, 0.0))])
        depth = self.scale * 10.0 ** self._rng.uniform(-2, 1)
        return rt.Plane(tuple(n.tolist()), float(n @ self.eye - depth), self._color())

    def _sphere(self, center: np.ndarray, radius: float) -> rt.Solid:
        return rt.Sphere(tuple(center.tolist()), float(radius), self._color())

    def _color(self) -> rt.Material:
        return scenes.COLORS[self._rng.integers(4)]

    def light(self, *, soft: bool) -> rt.PointLight:
        place = self.eye + direction(self._rng) * self.scale * 10.0 ** self._rng.uniform(-1, 1.5)
        radius = self.scale * 10.0 ** self._rng.uniform(-3, 0.3) if soft else 0.0
        return rt.PointLight(tuple(place.tolist()), radius=float(radius))

    def camera(self, seen: rt.Solid) -> rt.Camera:
        """Return a camera that looks at an object with a narrow view, or anywhere with a wide view."""
        spheres = [leaf for leaf in leaves(seen) if isinstance(leaf, rt.Sphere)]
        fov = float(self._rng.choice([10.0 ** self._rng.uniform(-3, 2), self._rng.uniform(150, 179.9), 179.9]))
        at = self.eye + direction(self._rng)
        if spheres and fov < 150.0:
            at = spheres[-1].center + direction(self._rng) * spheres[-1].radius * self._rng.choice([0.3, 1.0])
        return rt.Camera(tuple(self.eye.tolist()), tuple(at.tolist()), vertical_fov=fov)


def _balls_and_trees(around: Surroundings, balls: int) -> list[rt.Solid]:
    """Return balls, and ten more primitives in trees and alone."""
    trees = [around.ball() - around.ball(), around.ball() | around.ball() | around.ball(), around.lens()]
    return [*(around.ball() for _ in range(balls)), *trees, around.half_space(), ~around.ball(), around.half_space()]


STRUCTURES: dict[str, Callable[[Surroundings], list[rt.Solid]]] = {
    "half-spaces": lambda around: [around.half_space(), around.half_space()],
    "a ball": lambda around: [around.ball()],
    "a ball and a half-space": lambda around: [around.half_space(), around.ball()],
    "lenses": lambda around: [around.lens(), around.half_space(), around.lens() - around.ball()],
    "bounded trees": lambda around: [
        around.half_space(),
        around.ball() & around.half_space(),
        around.ball() - ~around.ball(),
    ],
    "unbounded trees": lambda around: [~(around.ball() | around.ball()), around.half_space() & around.half_space()],
    "many": lambda around: _balls_and_trees(
        around, 3
    ),  # more primitives than compiled_scene.FEW, so that lists are used
}
SIZES = [(1, 1), (2, 3), (16, 9), (40, 30), (1, 300), (300, 1), (33, 17), (5, 90), (97, 64)]


# With forty primitives `walk` takes long to compile, and longer with shadows.
CASES = [("forty", "off"), *itertools.product(STRUCTURES, get_args(Shadows))]


@pytest.mark.parametrize(
    ("structure", "shadows"),
    [pytest.param(*case, marks=[] if case[1] == "hard" else pytest.mark.slow) for case in CASES],
)
def test_random_scenes_have_identical_pictures(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, structure: str, shadows: Shadows
) -> None:
    rng = np.random.default_rng(list(structure.encode()))
    seen = 0
    for k in range(10):
        around = Surroundings(rng)
        objects = STRUCTURES[structure](around) if structure in STRUCTURES else _balls_and_trees(around, 30)
        lights = [around.light(soft=shadows == "soft") for _ in range(shadows != "off")]
        scene = rt.Scene(objects, lights, around.camera(objects[-1]))
        settings = Settings(samples=1 + k % 2, shadows=shadows, precision=64 if shadows == "hard" and k < 4 else 32)
        seen += check(renderer, monkeypatch, scene, SIZES[rng.integers(len(SIZES))], settings)
    assert seen


def test_lenses_thinner_than_rounding_have_identical_pictures(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    for seed in range(40):
        rng = np.random.default_rng((2, seed))
        distance = 10.0 ** rng.uniform(-1, 3)
        radius = distance * 10.0 ** rng.uniform(-5, -0.3)
        thickness = radius * 10.0 ** rng.uniform(-9, -3)
        center, axis = distance * direction(rng), direction(rng)
        a, b = (center + side * axis * (radius - thickness / 2.0) for side in (-1, 1))
        lens = rt.Sphere(tuple(a.tolist()), radius, RED) & rt.Sphere(tuple(b.tolist()), radius, BLUE)
        wall = rt.Plane(tuple(direction(rng).tolist()), -2.0 * distance, GREY)
        across = np.sqrt(thickness * radius) * 10.0 ** rng.uniform(0, 1)
        fov = max(1e-3, float(np.degrees(2.0 * np.arctan(across / distance))))
        camera = rt.Camera((0, 0, 0), tuple(center.tolist()), vertical_fov=fov)
        light = rt.PointLight(tuple((center + 3.0 * radius * direction(rng)).tolist()))
        check(renderer, monkeypatch, rt.Scene([lens, wall], [light], camera), (48, 32), Settings())


def test_shadows_of_balls_near_a_light_reach_the_horizon(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    # A ball a thousandth from the light: seen from 10,000 away, rounding changes its direction from the light.
    ball = rt.Sphere((13.499337784279483, 0.015016279536337902, 3.7377614922057627), 0.0009825381433037344, RED)
    small = rt.Sphere((13.500432136289325, 0.014857904919942946, 3.759413986688433), 5.0524277934676656e-05, BLUE)
    light = rt.PointLight((13.499862026723557, 0.014860939645087633, 3.7589143269416994))
    camera = rt.Camera((0.0, 69.36451708498775, 0.0), (0.0, 69.3643331505536, -0.9999999830840619), vertical_fov=60.0)
    scene = rt.Scene([ball, small, rt.Plane((0, 1, 0), 0, GREY)], [light], camera)
    check(renderer, monkeypatch, scene, (128, 72), Settings(samples=2))


def test_a_mirror_inside_an_unbounded_object_shows_the_object(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    mirror = rt.Material("mirror")
    room = rt.Sphere((0, 0, 0), 2, mirror) | rt.Plane((0.45, -0.73, 0.47), 0.96, GREY)
    camera = rt.Camera((-1, 0.3, -1.3), (0, 0, 0))
    for more in ([], [rt.Sphere((0.3, 0.1, -0.4), 0.2, RED) - rt.Sphere((0.3, 0.1, -0.5), 0.2, BLUE)]):
        scene = rt.Scene([room, *more], [rt.PointLight((0.5, 0.5, -0.5))], camera)
        for bounces in (1, 3):
            check(renderer, monkeypatch, scene, (64, 36), Settings(bounces=bounces))


@pytest.mark.slow
def test_random_scenes_with_mirrors_have_identical_pictures(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    mirror = rt.Material("mirror")
    for k, structure in enumerate(["a ball and a half-space", "bounded trees", "unbounded trees", "unbounded trees"]):
        rng = np.random.default_rng((7, k))
        for _ in range(4):
            around = Surroundings(rng)
            objects = [
                with_leaves(solid, partial(_maybe_repaint, rng, mirror)) for solid in STRUCTURES[structure](around)
            ]
            scene = rt.Scene(objects, [around.light(soft=False)], around.camera(objects[-1]))
            check(renderer, monkeypatch, scene, SIZES[rng.integers(2, len(SIZES))], Settings(bounces=3))


def _maybe_repaint(rng: np.random.Generator, material: rt.Material, leaf: Primitive) -> rt.Solid:
    """Return the primitive, or with a probability of 1/2 a copy with the material."""
    return leaf.with_material(material) if rng.random() < 0.5 else leaf
