"""Balls around a point, rays from there, and the cells that these are in, by brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import Array, Ints


def some_balls(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """All around the origin: near and far, tiny and huge, holding it, touching it or the planes through it."""
    centers = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-2, 2, (count, 1))
    distance = np.linalg.norm(centers, axis=1)
    radii = distance * 10.0 ** rng.uniform(-4, 0.3, count)
    kinds = np.array_split(rng.permutation(count), 6)
    radii[kinds[0]] = distance[kinds[0]]
    radii[kinds[1]] = np.abs(centers[kinds[1], 2])
    radii[kinds[2]] = np.abs(centers[kinds[2], 0])
    radii[kinds[3]] = np.abs(distance[kinds[3]] - 10.0 ** rng.uniform(-9, 0, len(kinds[3])))
    return centers, radii


def meets(directions: Array, centers: Array, radii: Array) -> tuple[Ints, Ints]:
    """(ray, ball): which rays from the origin meet which balls."""
    d = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    along = np.maximum(d @ centers.T, 0.0)
    nearest = np.linalg.norm(along[:, :, None] * d[:, None, :] - centers, axis=2)
    ray, ball = np.nonzero(nearest <= radii)
    return ray.astype(np.int64), ball.astype(np.int64)


def missing(cell: Ints, item: Ints, wanted_cell: Ints, wanted_item: Ints) -> int:
    """Count the wanted pairs that are not listed."""
    listed = np.sort(cell << 20 | item)
    wanted = wanted_cell << 20 | wanted_item
    return int((listed[np.minimum(np.searchsorted(listed, wanted), len(listed) - 1)] != wanted).sum())


def direction_cell(D: NDArray[np.floating[Any]], grid: int) -> Ints:
    """The definition of hemisphere_cells(), of one direction at a time; in the precision of D."""
    result = []
    for d in D:
        half, size = d.dtype.type(0.5), np.sqrt(np.sum(d * d))
        column, row = (int((d[i] / (np.abs(d[2]) + size) * half + half) * d.dtype.type(grid)) for i in (0, 1))
        result.append((int(d[2] < 0) * grid + min(row, grid - 1)) * grid + min(column, grid - 1))
    return np.array(result)


def edge_directions(rng: np.random.Generator, count: int, grid: int) -> Array:
    """(count, 3): directions at the edges and corners of cells, and at the equator, to within 1e-7."""
    at = rng.uniform(-0.7, 0.7, (count, 2))
    on_line = np.rint(0.5 * grid * at) * 2.0 / grid  # for even grids
    at = np.where(rng.random((count, 2)) < 0.7, on_line, at)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    at[::3] = np.column_stack((np.cos(angle), np.sin(angle)))[::3]
    z = (1.0 - np.sum(at * at, axis=1)) * rng.choice([-1.0, 1.0], count)
    return np.column_stack((2.0 * at, z)) + rng.uniform(-1e-7, 1e-7, (count, 3))
