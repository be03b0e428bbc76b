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
    """How many of the wanted pairs are not listed."""
    listed = np.sort(cell << 20 | item)
    wanted = wanted_cell << 20 | wanted_item
    return int((listed[np.minimum(np.searchsorted(listed, wanted), len(listed) - 1)] != wanted).sum())


def face_cell(D: NDArray[np.floating[Any]], grid: int) -> Ints:
    """The definition of cube_faces(), of one direction at a time; in the precision of D."""
    result = []
    for d in D:
        axis = int(np.argmax(np.abs(d)))
        b, c = (0, 1, 2)[:axis] + (0, 1, 2)[axis + 1 :]
        half = d.dtype.type(0.5)
        column, row = (int((d[i] / abs(d[axis]) * half + half) * d.dtype.type(grid)) for i in (b, c))
        face = 2 * axis + (d[axis] < 0)
        result.append((face * grid + min(row, grid - 1)) * grid + min(column, grid - 1))
    return np.array(result)
