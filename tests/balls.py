"""Spheres around a point, rays from the point, and the direction cells of the rays, by brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import Array, Ints


def random_balls(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return spheres all around the origin: near and far, tiny and huge.

    Some contain or touch the origin, or touch a plane through it.
    """
    centers = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-2, 2, (count, 1))
    distance = np.linalg.norm(centers, axis=1)
    radii = distance * 10.0 ** rng.uniform(-4, 0.3, count)
    groups = np.array_split(rng.permutation(count), 6)
    radii[groups[0]] = distance[groups[0]]
    radii[groups[1]] = np.abs(centers[groups[1], 2])
    radii[groups[2]] = np.abs(centers[groups[2], 0])
    radii[groups[3]] = np.abs(distance[groups[3]] - 10.0 ** rng.uniform(-9, 0, len(groups[3])))
    return centers, radii


def find_hits(directions: Array, centers: Array, radii: Array) -> tuple[Ints, Ints]:
    """Return (ray, ball), each [N]: which rays from the origin hit which spheres."""
    d = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    along = np.maximum(d @ centers.T, 0.0)
    nearest = np.linalg.norm(along[:, :, None] * d[:, None, :] - centers, axis=2)
    ray, ball = np.nonzero(nearest <= radii)
    return ray.astype(np.int64), ball.astype(np.int64)


def count_missing(cell: Ints, item: Ints, wanted_cell: Ints, wanted_item: Ints) -> int:
    """Count the wanted pairs that are not listed."""
    listed = np.sort(cell << 20 | item)
    wanted = wanted_cell << 20 | wanted_item
    return int((listed[np.minimum(np.searchsorted(listed, wanted), len(listed) - 1)] != wanted).sum())


def direction_cell(D: NDArray[np.floating[Any]], grid: int) -> Ints:
    """Return the cells of directions, one at a time by the definition in hemisphere_cells(), in the precision of D."""
    result = []
    for d in D:
        half, size = d.dtype.type(0.5), np.sqrt(np.sum(d * d))
        column, row = (int((d[i] / (np.abs(d[2]) + size) * half + half) * d.dtype.type(grid)) for i in (0, 1))
        result.append((int(d[2] < 0) * grid + min(row, grid - 1)) * grid + min(column, grid - 1))
    return np.array(result)


def edge_directions(rng: np.random.Generator, count: int, grid: int) -> Array:
    """Return directions at the edges and corners of cells and at the equator, to within 1e-7 [count, 3]."""
    at = rng.uniform(-0.7, 0.7, (count, 2))
    on_line = np.rint(0.5 * grid * at) * 2.0 / grid  # on the edges of an even grid
    at = np.where(rng.random((count, 2)) < 0.7, on_line, at)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    at[::3] = np.column_stack((np.cos(angle), np.sin(angle)))[::3]
    z = (1.0 - np.sum(at * at, axis=1)) * rng.choice([-1.0, 1.0], count)
    return np.column_stack((2.0 * at, z)) + rng.uniform(-1e-7, 1e-7, (count, 3))
