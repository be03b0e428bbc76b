"""Arrays of affine maps x -> A x + t, each the rows of [A | t]: the formulas of affine.py for many maps at a time.

Equal numbers give the same bits here as there. NumPy sums up to eight numbers of a row in its own order, and a matrix
product of a library in any order, so all sums are written out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def compose(outer: Array, inner: Array) -> Array:
    """Return the maps x -> outer(inner(x)) of two arrays of maps (..., 3, 4), as affine.compose()."""
    product = (
        outer[..., 0, None] * inner[..., None, 0, :]
        + outer[..., 1, None] * inner[..., None, 1, :]
        + outer[..., 2, None] * inner[..., None, 2, :]
    )
    product[..., 3] += outer[..., 3]
    product += 0.0  # -0 becomes 0
    return product


def apply(maps: Array, points: Array) -> Array:
    """Return the images (..., 3) of points (..., 3) under maps (..., 3, 4), as affine.apply()."""
    x, y, z = points[..., None, 0], points[..., None, 1], points[..., None, 2]
    return maps[..., 0] * x + maps[..., 1] * y + maps[..., 2] * z + maps[..., 3]


def similarities(maps: Array) -> Array:
    """Return the factors (...) by which maps (..., 3, 4) scale all lengths, as affine.similarity().

    The maps must be similarities.
    """
    x, y, z = maps[..., 0, 0], maps[..., 1, 0], maps[..., 2, 0]
    return np.sqrt(x * x + y * y + z * z)


def cofactors(maps: Array) -> Array:
    """Return the cofactor matrices (N, 3, 3) of maps (N, 3, 4), as affine.cofactors()."""
    a, b, c = (maps[:, 0, j] for j in range(3))
    d, e, f = (maps[:, 1, j] for j in range(3))
    g, h, i = (maps[:, 2, j] for j in range(3))
    rows = (
        (e * i - f * h, f * g - d * i, d * h - e * g),
        (c * h - b * i, a * i - c * g, b * g - a * h),
        (b * f - c * e, c * d - a * f, a * e - b * d),
    )
    return np.moveaxis(np.array(rows).reshape(3, 3, -1), -1, 0)


def determinants(maps: Array, cofactor: Array) -> Array:
    """Return det(A) (N,) of maps (N, 3, 4) with the cofactor matrices (N, 3, 3), as affine.determinant()."""
    return maps[:, 0, 0] * cofactor[:, 0, 0] + maps[:, 0, 1] * cofactor[:, 0, 1] + maps[:, 0, 2] * cofactor[:, 0, 2]


def map_slabs(
    maps: Array, owner: NDArray[np.int64], normals: Array, low: Array, high: Array
) -> tuple[Array, Array, Array]:
    """Return the images of slabs low <= dot(normal, x) <= high, as affine.map_plane() and affine.unit_plane().

    Args:
        maps: the maps (N, 3, 4).
        owner: the number of each slab's map (K,).
        normals: the normals (K, 3), of any length.
        low: the lower bounds (K,); -inf for none.
        high: the upper bounds (K,); inf for none.

    Returns:
        The unit normals (K, 3), the lower bounds (K,) and the upper bounds (K,) of the images.
    """
    cofactor = cofactors(maps)
    volume = determinants(maps, cofactor)
    cofactor, place, volume = cofactor[owner], maps[owner, :, 3], volume[owner]
    mapped = (
        cofactor[:, :, 0] * normals[:, :1] + cofactor[:, :, 1] * normals[:, 1:2] + cofactor[:, :, 2] * normals[:, 2:]
    )
    shift = mapped[:, 0] * place[:, 0] + mapped[:, 1] * place[:, 1] + mapped[:, 2] * place[:, 2]
    unit, low, high = unit_slabs(mapped, volume * low + shift, volume * high + shift)
    # A map with a negative determinant turns the inequalities: map_plane() negates the normal and the bounds.
    turned = volume < 0.0
    return np.where(turned[:, None], -unit, unit), np.where(turned, -low, low), np.where(turned, -high, high)


def map_planes(maps: Array, normals: Array, offsets: Array) -> tuple[Array, Array]:
    """Return the images of half-spaces dot(normal, x) <= offset, as affine.map_plane() and affine.unit_plane().

    Args:
        maps: the maps (N, 3, 4).
        normals: the normals (P, 3), of any length.
        offsets: the offsets (P,).

    Returns:
        The unit normals (N, P, 3) and the offsets (N, P) of all images under each map.
    """
    count, planes = len(maps), len(normals)
    high = np.tile(offsets, count)
    owner = np.repeat(np.arange(count), planes)
    unit, _, high = map_slabs(maps, owner, np.tile(normals, (count, 1)), np.full(len(high), -np.inf), high)
    return unit.reshape(count, planes, 3), high.reshape(count, planes)


def unit_slabs(normals: Array, low: Array, high: Array) -> tuple[Array, Array, Array]:
    """Return unit normals (K, 3) and both bounds (K,) of slabs with normals of any length, as affine.unit_plane()."""
    # The largest component is 1 after the division. Its sign comes back with the length.
    scale = normals[np.arange(len(normals)), np.argmax(np.abs(normals), axis=1)]
    x, y, z = (normals / scale[:, None]).T
    length = np.copysign(np.sqrt(x * x + y * y + z * z), scale)
    return np.column_stack([x / length, y / length, z / length]), low / scale / length, high / scale / length
