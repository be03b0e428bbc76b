"""Grids of long chains: pictures with a grid have the bits of pictures without one."""

from __future__ import annotations

import functools
import itertools
import operator

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import chain_grids, long_chains
from raytracer.compiler.compiled_scene import compile
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import CompileOptions

pytestmark = pytest.mark.gl

SIZE = (160, 90)
SAND, RED, GREY = rt.Material(kd=(0.8, 0.7, 0.5)), rt.Material(kd=(0.7, 0.1, 0.1)), rt.Material(kd=0.6)
CUBE = rt.Box((0, 0, 0), (1, 1, 1), SAND)
OUTSIDE = rt.Camera((2.2, 1.9, 2.6), (0.5, 0.45, 0.5), vertical_fov=35)


@pytest.fixture
def any_chain_is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give grids to chains whose holes a line seldom crosses, too."""
    monkeypatch.setattr(long_chains, "CROSSED", 0.0)


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


@pytest.mark.usefixtures("any_chain_is_long")
@pytest.mark.parametrize("case", CASES)
def test_pictures_have_the_same_bits_with_and_without_a_grid(
    case: str, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    solid, camera = CASES[case]
    pictures = []
    for longest in (long_chains.LONG, 10**9):
        monkeypatch.setattr(long_chains, "LONG", longest)
        ground = rt.Plane((0, 1, 0), -0.2, GREY)
        scene = rt.Scene([solid, ground], [rt.PointLight((4, 5, 3)), rt.PointLight((0.5, 0.5, 0.5))], camera)
        has_grids = compile(scene, CompileOptions()).batches.has_grids
        assert has_grids == (longest < 10**9)
        pictures.append(renderer.render(scene, SIZE, rt.Settings(samples=1)))
    assert np.array_equal(pictures[0].radiance, pictures[1].radiance)
    assert np.array_equal(pictures[0].material, pictures[1].material)


@pytest.mark.usefixtures("any_chain_is_long")
@pytest.mark.parametrize(
    ("objects", "expected"),
    [
        ([less(CUBE, tunnels(3))], True),
        ([less(CUBE, tunnels(3)), less(CUBE, tunnels(3)).rotate((1, 2, 3), 40)], True),  # one frame for each object
        ([less(CUBE, [*tunnels(3), CUBE.rotate((0, 0, 1), 1)])], False),
        ([less(CUBE, [*tunnels(3), rt.Sphere((0.5, 0.5, 0.5), 0.6)])], False),
        ([less(CUBE, tunnels(3)) & rt.Plane((1, 1, 1), 1.5)], False),
        ([less(CUBE, tunnels(3)), less(CUBE, holes(0))], False),
    ],
)
def test_a_scene_has_grids_of_boxes_if_all_leaves_of_each_have_three_normals_in_common(
    objects: list[rt.Solid], expected: bool
) -> None:
    compiled = compile(rt.Scene(objects, [rt.PointLight((4, 5, 3))], OUTSIDE), CompileOptions())
    assert chain_grids.are_boxes(compiled.batches, compiled.surfaces) == expected


def steps(order: int) -> rt.Scene:
    """Return a cube with a tunnel into 300 small holes of one cell, each of which begins in the one before."""
    holes = [rt.Box((0.49, 0.49, 0.49 + k * 5e-5), (0.51, 0.51, 0.49 + (k + 1.5) * 5e-5)) for k in range(300)]
    corners = [rt.Box((x, x, x), (x + 0.01, x + 0.01, x + 0.01)) for x in (0, 0.99)]
    solid = less(CUBE, [*corners, rt.Box((0.49, 0.49, -1), (0.51, 0.51, 0.4900001)), *holes[::order]])
    return rt.Scene([solid], [], rt.Camera((0.5, 0.5, -1), (0.5, 0.5, 0), vertical_fov=1))


@pytest.mark.usefixtures("any_chain_is_long")
def test_grids_whose_rays_take_more_steps_than_the_driver_allows_are_refused(
    renderer: Renderer, has_round_limit: bool
) -> None:
    # In the tree's order, a ray passes all holes at once; in the opposite order, one after the other.
    image = renderer.render(steps(1), (64, 40), rt.Settings(samples=1))
    assert image.depth is not None
    assert image.depth[20, 32] == pytest.approx(1.49 + 300.5 * 5e-5, abs=1e-6)
    if has_round_limit:
        with pytest.raises(rt.InputError, match="at most 65535 steps"):
            renderer.render(steps(-1), (64, 40), rt.Settings(samples=1))


@pytest.mark.usefixtures("any_chain_is_long")
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


def test_only_a_chain_whose_holes_are_crossed_one_after_another_has_a_grid() -> None:
    def plate(count: int) -> rt.Solid:
        places = [(x + 0.5, y + 0.5) for x in range(count) for y in range(count)]
        return less(
            rt.Box((0, 0, 0), (count, count, 0.5)), [rt.Cylinder((x, y, -1), (x, y, 1), 0.3) for x, y in places]
        )

    def lattice(count: int) -> rt.Solid:
        return less(CUBE, [bar for k in range(count) for bar in bars(k / count, 0.3 / count)])

    def bars(start: float, side: float) -> list[rt.Solid]:
        starts = [j / 5 for j in range(5)]
        along = [rt.Box((start, y, -1), (start + side, y + 0.15, 2)) for y in starts]
        return [*along, *(rt.Box((-1, y, start), (2, y + 0.15, start + side)) for y in starts)]

    def has_grids(solid: rt.Solid) -> bool:
        return compile(rt.Scene([solid], [], OUTSIDE), CompileOptions()).batches.has_grids

    assert not has_grids(plate(12)) and has_grids(lattice(5))
