"""The lists of direction cells around lights hold every sphere that a ray through a cell can hit, and few others."""

import numpy as np
import pytest

from raytracer.compiler.direction_cells import MAX_PAIRS, Array, Ints, Lists, hemisphere_cells
from raytracer.compiler.hemisphere_lists import LightBalls, hemisphere_lists, light_balls
from raytracer.core.validation import InputError
from tests.balls import count_missing, direction_cell, edge_directions, find_hits, random_balls

ORIGIN = np.zeros(3)


def separate_balls(centers: Array, radii: Array) -> LightBalls:
    return light_balls(centers, radii, np.zeros(len(radii)))


def checked_lists(
    balls: LightBalls, place: Array, wider: float, passing: float, grid: int, most: int = MAX_PAIRS
) -> Lists:
    lists, longest = hemisphere_lists(balls, place, wider, passing, grid, most)
    assert longest == lists.longest()
    return lists


def pairs(lists: Lists) -> tuple[Ints, Ints]:
    """Return (cell, ball) of all entries of all lists, each [M]."""
    begin, end = lists.ends.T.astype(np.int64)
    cell = np.repeat(np.arange(len(begin)), end - begin)
    assert len(cell) == len(lists.entries), "cells share no entries"
    filled = lists.ends[lists.occupied()]
    entries = [lists.entries[first:last] for first, last in filled]
    return cell.astype(np.int64), np.concatenate([np.zeros(0), *entries]).astype(np.int64)


@pytest.mark.parametrize(("grid", "scale"), [(1, 1.0), (3, 1e6), (16, 1e-25), (20, 1e-6), (32, 1.0), (24, 1e25)])
def test_the_cell_of_every_light_ray_lists_the_spheres_that_the_ray_hits(grid: int, scale: float) -> None:
    rng = np.random.default_rng(2)
    centers, radii = random_balls(rng, 300)
    directions = rng.normal(size=(2000, 3))
    directions[:500, 2] = 0.0  # along the equator between the two hemispheres
    directions[:250] += rng.choice([-1e-9, 0, 1e-9], (250, 3))
    place = rng.normal(size=3)
    balls = separate_balls(scale * (centers + place), scale * radii)
    cell, ball = pairs(checked_lists(balls, scale * place, 0, 0, grid))
    ray, met = find_hits(directions, centers, radii)
    assert len(np.unique(met)) > 200
    assert count_missing(cell, ball, direction_cell(directions, grid)[ray], met) == 0
    assert len(np.unique(cell << 20 | ball)) == len(cell)


@pytest.mark.parametrize("grid", [1, 7, 32, 256])
@pytest.mark.parametrize("count", [2, 300, 9000])
def test_float32_lists_all_pairs_of_float64_and_few_more(grid: int, count: int) -> None:
    rng = np.random.default_rng(count)
    centers = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-1, 1, (count, 1))
    radii = np.linalg.norm(centers, axis=1) * 10.0 ** rng.uniform(-5, -1.2, count)
    centers[::4, 2] *= 1e-3  # near the equator
    place, wider = rng.normal(size=3), 1e-5
    cell, ball = pairs(checked_lists(separate_balls(centers + place, radii), place, wider, 0, grid))
    exact = hemisphere_cells(centers, radii + wider, grid)
    assert count_missing(cell, ball, *exact) == 0
    assert len(np.unique(cell << 20 | ball)) == len(cell) <= 1.35 * len(exact[0]) + 20


def test_cells_list_tiny_spheres_for_float32_rays_at_their_edges() -> None:
    rng = np.random.default_rng(4)
    grid = 192
    centers = edge_directions(rng, 3000, grid)
    cell, ball = pairs(checked_lists(separate_balls(centers, np.full(3000, 1e-12)), ORIGIN, 0, 0, grid))
    assert count_missing(cell, ball, direction_cell(centers.astype(np.float32), grid), np.arange(3000)) == 0
    assert len(cell) <= 4 * 3000


def test_spheres_are_enlarged_by_the_light_radius_and_the_rounding_bound() -> None:
    centers = np.array([(10.0, 0.0, 0.0)])
    balls = light_balls(centers, np.array([0.1]), np.array([3.0]))
    for wider, passing in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.2), (3.0, 1.0)):
        cell, _ = pairs(checked_lists(balls, ORIGIN, wider, passing, 64))
        exact, _ = hemisphere_cells(centers, np.array([0.1 + wider + 3.0 * passing]), 64)
        assert set(exact.tolist()) == set(cell.tolist())


def test_lists_are_roughly_in_order_of_distance() -> None:
    rng = np.random.default_rng(6)
    distance = rng.uniform(1, 3, 500)
    directions = np.column_stack((np.ones(500), rng.uniform(-1, 1, (500, 2))))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lists = checked_lists(separate_balls(distance[:, None] * directions, np.full(500, 1e-3)), ORIGIN, 0, 0, 4)
    for begin, end in lists.ends:
        assert np.all(np.diff(distance[lists.entries[begin:end]]) > -0.1)


def test_more_pairs_than_the_limit_are_refused() -> None:
    near, far = (np.full((20, 3), place) for place in (0.0, 9.0))
    for centers in (near, far):
        balls = separate_balls(centers, np.ones(20))
        cell, _ = pairs(checked_lists(balls, ORIGIN, 0, 0, 64))
        with pytest.raises(InputError, match="expected at most 300 pairs"):
            checked_lists(balls, ORIGIN, 0, 0, 64, 300)
        assert len(cell) > 300


def test_no_spheres_give_empty_lists() -> None:
    lists = checked_lists(separate_balls(np.zeros((0, 3)), np.zeros(0)), ORIGIN, 0, 0, 8)
    assert len(lists.entries) == 0 and not lists.ends.any() and lists.ends.shape == (2 * 64, 2)
    assert lists.longest() == 0 and not lists.occupied().any()
