"""Grids of long chains: pictures with a grid have the bits of pictures without one."""

from __future__ import annotations

import functools
import itertools
import operator

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import batches, chain_grids
from raytracer.compiler.compiled_scene import compile
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import CompileOptions

pytestmark = pytest.mark.gl

SIZE = (160, 90)
SAND, RED, GREY = rt.Material(kd=(0.8, 0.7, 0.5)), rt.Material(kd=(0.7, 0.1, 0.1)), rt.Material(kd=0.6)
CUBE = rt.Box((0, 0, 0), (1, 1, 1), SAND)
OUTSIDE = rt.Camera((2.2, 1.9, 2.6), (0.5, 0.45, 0.5), vertical_fov=35)


def lift(point: tuple[float, float], axis: int, value: float) -> tuple[float, float, float]:
    """Insert a coordinate into a point of a plane."""
    x, y, z = np.insert(point, axis, value).tolist()
    return x, y, z


def tunnels(level: int) -> list[rt.Solid]:
    """Return the tunnels of a Menger sponge, which end at the faces of the unit cube."""
    boxes: list[rt.Solid] = []
    for k in range(1, level + 1):
        for i, j in itertools.product(range(3**k), repeat=2):
            digits = [(i // 3**d % 3 == 1, j // 3**d % 3 == 1) for d in range(k)]
            if [all(pair) for pair in digits] != [True] + [False] * (k - 1):
                continue
            low, high = (i / 3**k, j / 3**k), ((i + 1) / 3**k, (j + 1) / 3**k)
            for axis in range(3):
                boxes.append(rt.Box(lift(low, axis, 0.0), lift(high, axis, 1.0), SAND))
    return boxes


def holes(seed: int) -> list[rt.Solid]:
    """Return holes of several kinds in the unit cube, under random maps."""
    rng = np.random.default_rng((3, seed))
    solids: list[rt.Solid] = []
    for k in range(90):
        kind = (
            rt.Sphere((0, 0, 0), 0.1, RED),
            rt.Box((-0.05, -0.6, -0.04), (0.05, 0.6, 0.04), RED),
            rt.Cylinder((0, -0.5, 0), (0, 0.5, 0), 0.05, GREY),
            rt.Cone((0, -0.3, 0), (0, 0.3, 0), 0.1, 0, RED),
            rt.Ellipsoid((0, 0, 0), (0.2, 0.05, 0.1), GREY),
        )[k % 5]
        axis, place = rng.normal(size=3), rng.random(3)
        solids.append(kind.rotate(tuple(axis.tolist()), 360.0 * rng.random()).translate(tuple(place.tolist())))
    return solids


def less(solid: rt.Solid, others: list[rt.Solid]) -> rt.Solid:
    return functools.reduce(operator.sub, others, solid)


CASES = {
    "sponge": (less(CUBE, tunnels(3)), OUTSIDE),
    "turned sponge": (less(CUBE, tunnels(3)).rotate((1, 2, 3), 40).scale((1, 1.3, 0.8)), OUTSIDE),
    "camera in a tunnel": (less(CUBE, tunnels(3)), rt.Camera((0.5, 0.5, 0.9), (0.5, 0.4, 0))),
    "camera in the solid": (less(CUBE, tunnels(3)), rt.Camera((1 / 6, 0.51 / 9, 0.9), (0.5, 0.4, 0))),
    "cut by a half-space": (less(CUBE, holes(0)) & rt.Plane((1, 1, 1), 1.5, GREY), OUTSIDE),
    "ball less holes": (less(rt.Sphere((0.5, 0.5, 0.5), 0.6, SAND), holes(1)), OUTSIDE),
    "union": (functools.reduce(operator.or_, holes(2)), OUTSIDE),
    "camera in a union": (functools.reduce(operator.or_, holes(2)), rt.Camera((0.5, 0.5, 0.9), (0.5, 0.4, 0))),
    "coincident holes": (less(CUBE, [*holes(3)[:30], *holes(3)]), OUTSIDE),
}


@pytest.mark.parametrize("case", CASES)
def test_pictures_have_the_same_bits_with_and_without_a_grid(
    case: str, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    solid, camera = CASES[case]
    pictures = []
    for longest in (batches.LONG, 10**9):
        monkeypatch.setattr(batches, "LONG", longest)
        ground = rt.Plane((0, 1, 0), -0.2, GREY)
        scene = rt.Scene([solid, ground], [rt.PointLight((4, 5, 3)), rt.PointLight((0.5, 0.5, 0.5))], camera)
        has_grids = compile(scene, CompileOptions()).batches.has_grids
        assert has_grids == (longest < 10**9)
        pictures.append(renderer.render(scene, SIZE, rt.Settings(samples=1)))
    assert np.array_equal(pictures[0].radiance, pictures[1].radiance)
    assert np.array_equal(pictures[0].material, pictures[1].material)


def test_a_cell_lists_each_hole_around_it_and_only_one_that_holds_it() -> None:
    scene = rt.Scene([less(CUBE, holes(4)[:60:5] * 6)], [rt.PointLight((4, 5, 3))], OUTSIDE)
    compiled = compile(scene, CompileOptions())
    growth = 1e-4
    (grid,) = chain_grids.make_grids(compiled.batches, compiled.surfaces, growth)
    rng = np.random.default_rng(5)
    points = rng.random((2000, 3))
    cells = np.floor(points @ grid.axes.T - grid.low).astype(int)
    radii, centers = compiled.surfaces.radii, compiled.surfaces.centers
    spheres = compiled.surfaces.spheres
    for point, (x, y, z) in zip(points, cells, strict=True):
        within = set(np.flatnonzero(np.linalg.norm(centers[:spheres] - point, axis=1) < radii[:spheres]).tolist())
        if not (0 <= x < grid.shape[0] and 0 <= y < grid.shape[1] and 0 <= z < grid.shape[2]):
            assert not within
            continue
        begin, end = grid.ends[(z * grid.shape[1] + y) * grid.shape[0] + x]
        listed = set((grid.leaves[begin:end, 0] >> 5).tolist())
        assert within <= listed or (len(listed) == 1 and listed <= within)
