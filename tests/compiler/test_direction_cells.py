"""Direction cells list every sphere that a ray through them can hit, and few others."""

import numpy as np
import pytest

from raytracer.compiler import direction_cells
from raytracer.compiler.direction_cells import MARGIN
from raytracer.core.validation import InputError
from tests.balls import count_missing, direction_cell, edge_directions, find_hits, random_balls


@pytest.mark.parametrize("extent", [0.01, 1.0, 300.0])
def test_the_cell_of_every_camera_ray_lists_the_spheres_that_the_ray_hits(extent: float) -> None:
    rng = np.random.default_rng(1)
    centers, radii = random_balls(rng, 600)
    centers[300:, :2] *= extent  # half of the spheres are more or less ahead of the camera
    lo, hi = direction_cells.tangents(centers, radii)
    shape = (40, 30)
    origin, step = (-extent, 0.75 * extent), (2 * extent / 40, -1.5 * extent / 30)
    cell, item = direction_cells.overlaps(lo, hi, origin, step, shape)
    slope = rng.uniform(-1, 1, (2000, 2)) * (extent, 0.75 * extent)
    ray, ball = find_hits(np.column_stack((slope, np.full(2000, -1.0))), centers, radii)
    column, row = np.floor((slope[ray] - origin) / step).astype(np.int64).T
    assert len(np.unique(ball)) > 200
    assert count_missing(cell, item, row * shape[0] + column, ball) == 0
    # No cell lists a sphere twice, or a sphere behind the camera.
    assert np.all(radii[item] * (1 + 2 * MARGIN) > centers[item, 2])
    assert len(np.unique(cell << 20 | item)) == len(cell)


def test_the_cell_of_every_light_ray_lists_the_spheres_that_the_ray_hits() -> None:
    rng = np.random.default_rng(2)
    centers, radii = random_balls(rng, 400)
    directions = rng.normal(size=(2000, 3))
    directions[:500, 2] = 0.0  # along the equator between the two hemispheres
    directions[:250] += rng.choice([-1e-9, 0, 1e-9], (250, 3))
    cell, item = direction_cells.hemisphere_cells(centers, radii, 16)
    ray, ball = find_hits(directions, centers, radii)
    assert len(np.unique(ball)) > 300
    assert count_missing(cell, item, direction_cell(directions, 16)[ray], ball) == 0
    holds = np.linalg.norm(centers, axis=1) < radii
    assert np.all(np.bincount(item, minlength=400)[holds] == 2 * 16**2)
    assert len(np.unique(cell << 20 | item)) == len(cell)


def test_bounds_of_a_sphere_hold_for_grazing_rays_in_float32() -> None:
    rng = np.random.default_rng(3)
    centers = rng.normal(size=(10_000, 3)) * 10.0 ** rng.uniform(-3, 3, (10_000, 3))
    radii = np.linalg.norm(centers, axis=1) * 10.0 ** rng.uniform(-9, -0.01, 10_000)
    lo, hi = direction_cells.tangents(centers.astype(np.float32).astype(float), radii.astype(np.float32).astype(float))
    for axis in (0, 1):
        sine = radii / np.hypot(centers[:, axis], centers[:, 2])
        for side in (-1, 1):
            angle = np.arctan2(centers[:, axis], -centers[:, 2]) + side * np.arcsin(np.minimum(sine, 1))
            seen = (sine < 1) & (np.abs(angle) < np.radians(89.99))
            slope = np.tan(angle[seen]).astype(np.float32)
            assert np.all((lo[seen, axis] <= slope) & (slope <= hi[seen, axis]))


def test_cells_list_tiny_spheres_for_float32_rays_at_their_edges() -> None:
    rng = np.random.default_rng(4)
    grid = 256
    centers = edge_directions(rng, 3000, grid)
    cell, item = direction_cells.hemisphere_cells(centers, np.full(3000, 1e-12), grid)
    assert count_missing(cell, item, direction_cell(centers.astype(np.float32), grid), np.arange(3000)) == 0
    assert len(cell) <= 4 * 3000


def test_bounds_are_the_slopes_of_the_tangents() -> None:
    # The centres are in the xz plane, at `angle` from straight ahead. The tangents are at angle +- asin(r / distance).
    angle, distance, radius = np.radians([0.0, 30.0, -30.0, 80.0, 120.0]), 7.0, np.array([1.0, 2.0, 1e-4, 3.0, 6.5])
    centers = distance * np.column_stack((np.sin(angle), np.zeros(5), -np.cos(angle)))
    lo, hi = direction_cells.tangents(centers, radius)
    half = np.arcsin(radius / distance)
    np.testing.assert_allclose(lo[:, 0], np.tan(angle - half), rtol=1e-4)  # the margin is a fraction of each bound
    np.testing.assert_allclose(hi[:3, 0], np.tan(angle + half)[:3], rtol=1e-4)
    assert np.all(hi[3:, 0] == np.inf)  # these spheres reach the plane of the eye
    across = radius[:3] / np.sqrt(centers[:3, 2] ** 2 - radius[:3] ** 2)
    np.testing.assert_allclose(hi[:3, 1], across, rtol=1e-4, atol=2 * MARGIN)
    np.testing.assert_array_equal(lo[:, 1], -hi[:, 1])


def test_bounds_are_infinite_or_empty_for_spheres_around_or_behind_the_eye() -> None:
    no_front, all_front = ([np.inf] * 2, [-np.inf] * 2), ([-np.inf] * 2, [np.inf] * 2)
    for center, radius, expected in [
        ((0, 0, 5), 1, no_front),
        ((3, -4, 1), 0.5, no_front),
        ((1e6, 1e6, 1e6), 0.99e6, no_front),
        ((0, 0, 0), 1, all_front),
        ((0, 0, 5), 5.1, all_front),
        ((0, 0, -5), 5, all_front),  # the sphere touches the eye
        ((0, 0, 5), 5, all_front),  # the sphere touches the eye from behind, within the margin
    ]:
        lo, hi = direction_cells.tangents(np.array([center], float), np.array([radius], float))
        assert (lo[0].tolist(), hi[0].tolist()) == expected


@pytest.mark.parametrize("step", [(0.5, 0.25), (0.5, -0.25), (-0.5, 0.25)])
def test_pairs_equal_those_of_a_loop_over_all_cells_and_rectangles(step: tuple[float, float]) -> None:
    rng = np.random.default_rng(4)
    origin, shape = np.array((1.0, -2.0)), (9, 7)
    corner = origin + np.array(step) * shape
    lo = rng.uniform(np.minimum(origin, corner) - 1, np.maximum(origin, corner) + 1, (50, 2))
    hi = lo + rng.uniform(0, 1.5, (50, 2))
    lo[0], hi[1], hi[2] = -np.inf, np.inf, lo[2] - 0.01
    lo[3], hi[3] = np.inf, -np.inf
    expected = []
    for item in range(50):
        for row in range(shape[1]):
            for column in range(shape[0]):
                edges = origin + np.array([(column, row), (column + 1, row + 1)]) * step
                low, high = edges.min(axis=0), edges.max(axis=0)
                if np.all(lo[item] <= hi[item]) and np.all((lo[item] <= high) & (low <= hi[item])):
                    expected.append((row * shape[0] + column, item))
    cell, item = direction_cells.overlaps(lo, hi, (1.0, -2.0), step, shape)
    assert list(zip(cell.tolist(), item.tolist(), strict=True)) == expected
    assert {2, 3}.isdisjoint(item.tolist())


def test_more_pairs_than_the_limit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(direction_cells, "MAX_PAIRS", 2 * 64)
    at_light, radius = np.zeros((1, 3)), np.ones(1)
    assert len(direction_cells.hemisphere_cells(at_light, radius, 8)[0]) == 2 * 64
    with pytest.raises(InputError, match=r"at most 128 pairs .* got 162"):
        direction_cells.hemisphere_cells(at_light, radius, 9)
    with pytest.raises(InputError, match=r"at most 7 pairs .* got 8"):
        direction_cells.hemisphere_cells(at_light, radius, 2, most=7)


def test_no_spheres_give_no_pairs() -> None:
    cell, item = direction_cells.hemisphere_cells(np.zeros((0, 3)), np.zeros(0), 8)
    assert cell.dtype == item.dtype == np.int64 and len(cell) == len(item) == 0
