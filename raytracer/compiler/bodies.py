"""The bodies of a scene, in world space, as arrays: primitives other than spheres and half-spaces.

A body is the intersection of slabs (pairs of parallel plane faces) and at most one curved wall; see Slab and Wall in
raytracer/scene/solids/solid.py. A part of a torus is a body, too: one of the two intervals of a ray in the torus. Faces
that coincide have equal bits here, up to the sign of a plane's normal: then the shaders compute equal roots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.scene.solids.body import Placed, Slab, Wall

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
T = TypeVar("T")

# The kinds of walls, by their numbers in body.glsl; 0 is a body without a wall.
WALLS = "", "round", "cone", "torus"
# Forms that are orthogonal to within this share stay as they are. Maps of other forms are rotated among each other, so
# that the shaders' errors do not grow with the condition number of the map.
_ORTHOGONAL = 1e-9
# The unit to which the numbers of walls are rounded, as a share of the largest number. Walls that coincide, but are
# stated by other points of their axis, differ by a few 2^-53, which this rounding removes.
_GRID = 2.0**-44


class Bodies(msgspec.Struct, frozen=True, eq=False):
    """B bodies with K slabs and W walls."""

    leaves: list[Placed]
    corners: Array  # (B, 8, 3): their convex hull holds the body
    centers: Array  # (B, 3), of bounding balls
    radii: Array  # (B,), of bounding balls
    starts: Ints  # (B + 1,): the slabs of body i are starts[i] to starts[i + 1]
    normals: Array  # (K, 3), unit
    low: Array  # (K,): dot(normal, x) is at least this, -inf for no face
    high: Array  # (K,): and at most this, inf for no face
    kinds: Ints  # (B,): the kind of each body's wall, an index into WALLS
    walls: Ints  # (B,): the number of each body's wall, -1 for none
    forms: Array  # (W, 4, 4): the forms of Wall: (w, c)
    parts: Ints  # (B,): for a torus, the number of the ray's interval


def make_bodies(leaves: list[Placed]) -> Bodies:
    """Collect the bodies of leaves."""
    matrices = np.array([leaf.matrix for leaf in leaves]).reshape(-1, 3, 4)
    slabs = _of_shapes(leaves, lambda leaf: leaf.shape.slabs())
    walls = _of_shapes(leaves, lambda leaf: leaf.shape.wall())
    corners = np.array(_of_shapes(leaves, lambda leaf: leaf.shape.corners())).reshape(-1, 8, 3)
    starts = np.zeros(len(leaves) + 1, np.int64)
    np.cumsum(list(map(len, slabs)), out=starts[1:])
    has_wall = np.array([wall is not None for wall in walls], bool)
    corners = _map_points(matrices[:, None], corners)
    centers = corners.mean(axis=1)
    return Bodies(
        leaves,
        corners,
        centers,
        _ball_radii(leaves, matrices, corners, centers),
        starts,
        *_map_slabs([slab for own in slabs for slab in own], np.repeat(matrices, np.diff(starts), axis=0)),
        np.array([WALLS.index(wall.kind) if wall else 0 for wall in walls], np.int64),
        np.where(has_wall, np.cumsum(has_wall) - 1, -1),
        _map_walls([wall for wall in walls if wall], matrices[has_wall]),
        np.array([leaf.part for leaf in leaves], np.int64),
    )


def is_on_wall(kind: str, values: Array, error: float) -> bool:
    """Return whether a point is on a wall, by the values (4,) of its forms there and their largest error."""
    l0, l1, l2, l3 = values
    if kind == "torus":
        return bool(abs(np.hypot(np.hypot(l1, l2) - 1.0, l3) - l0) <= 4.0 * error)
    return bool(l0 >= -error and abs(np.sqrt(l1 * l1 + l2 * l2 + l3 * l3) - l0) <= 4.0 * error)


def wall_gradient(kind: str, forms: Array, values: Array) -> Array:
    """Return an outward normal (3,), of any length, of a wall where its forms (4, 4) have `values` (4,)."""
    factors = np.array([-values[0], *values[1:]])
    if kind == "torus":
        rho = np.hypot(values[1], values[2])
        factors = np.array([0.0, *(values[1:3] * (1.0 - 1.0 / rho)), values[3]])
    return factors @ forms[:, :3]


def _of_shapes(leaves: Sequence[Placed], describe: Callable[[Placed], T]) -> list[T]:
    """Return `describe` of each leaf, computed once for each shape: instances share their shapes."""
    known: dict[int, T] = {}
    result: list[T] = []
    for leaf in leaves:
        key = id(leaf.shape)
        if key not in known:
            known[key] = describe(leaf)
        result.append(known[key])
    return result


def _map_points(matrices: Array, points: Array) -> Array:
    """Return the images of points (..., 3) under maps (..., 3, 4)."""
    return (matrices[..., :3] * points[..., None, :]).sum(axis=-1) + matrices[..., 3]


def _ball_radii(leaves: Sequence[Placed], matrices: Array, corners: Array, centers: Array) -> Array:
    """Return radii (B,) of bounding balls: by the corners, or by the longest axis of the map if that is less.

    A ball around the corners' centre holds the shape before the map. Its radius grows at most by the map's longest
    axis. For an ellipsoid, it is less than the distance of the corners by a factor of up to sqrt(3).
    """
    by_corners = np.linalg.norm(corners - centers[:, None], axis=-1).max(axis=1, initial=0.0)
    own = np.array(_of_shapes(leaves, lambda leaf: leaf.shape.reach()))
    return np.minimum(by_corners, own * np.linalg.norm(matrices[:, :, :3], ord=2, axis=(1, 2)))


def cofactors(matrices: Array) -> Array:
    """Return the cofactor matrices (N, 3, 3) of maps (N, 3, 4), by the formula of affine.cofactors()."""
    a, b, c = (matrices[:, 0, j] for j in range(3))
    d, e, f = (matrices[:, 1, j] for j in range(3))
    g, h, i = (matrices[:, 2, j] for j in range(3))
    rows = (
        (e * i - f * h, f * g - d * i, d * h - e * g),
        (c * h - b * i, a * i - c * g, b * g - a * h),
        (b * f - c * e, c * d - a * f, a * e - b * d),
    )
    return np.moveaxis(np.array(rows).reshape(3, 3, -1), -1, 0)


def _determinants(matrices: Array, cofactor: Array) -> Array:
    return (
        matrices[:, 0, 0] * cofactor[:, 0, 0]
        + matrices[:, 0, 1] * cofactor[:, 0, 1]
        + matrices[:, 0, 2] * cofactor[:, 0, 2]
    )


def _map_slabs(slabs: Sequence[Slab], matrices: Array) -> tuple[Array, Array, Array]:
    """Return the unit normals (K, 3) and both offsets (K,) of slabs under maps (K, 3, 4).

    The formulas are those of affine.map_plane() and affine.unit_plane(), so that a face of a body and an equal Plane
    have equal bits.
    """
    normals = np.array([slab.normal for slab in slabs]).reshape(-1, 3)
    cofactor = cofactors(matrices)
    volume = _determinants(matrices, cofactor)
    mapped = (
        cofactor[:, :, 0] * normals[:, None, 0]
        + cofactor[:, :, 1] * normals[:, None, 1]
        + cofactor[:, :, 2] * normals[:, None, 2]
    )
    place = matrices[:, :, 3]
    shift = mapped[:, 0] * place[:, 0] + mapped[:, 1] * place[:, 1] + mapped[:, 2] * place[:, 2]
    low, high = (volume * np.array([getattr(slab, name) for slab in slabs]) + shift for name in ("low", "high"))
    # The largest component is 1 after the division. Its sign comes back with the length, as in unit_plane().
    rows = np.arange(len(mapped))
    scale = mapped[rows, np.argmax(np.abs(mapped), axis=1)]
    x, y, z = (mapped / scale[:, None]).T if len(mapped) else np.zeros((3, 0))
    length = np.copysign(np.sqrt(x * x + y * y + z * z), scale)
    unit = np.column_stack([x / length, y / length, z / length])
    low, high = low / scale / length, high / scale / length
    # A map with a negative determinant turns the normal, as map_plane() says: then low is high.
    turned = volume < 0.0
    unit = np.where(turned[:, None], -unit, unit)
    return unit, np.where(turned, -low, low), np.where(turned, -high, high)


def _map_walls(walls: Sequence[Wall], matrices: Array) -> Array:
    """Return the forms (W, 4, 4) of walls under maps (W, 3, 4)."""
    forms = np.array([wall.forms for wall in walls]).reshape(-1, 4, 4)
    cofactor = cofactors(matrices)
    inverse = np.swapaxes(cofactor, 1, 2) / _determinants(matrices, cofactor)[:, None, None]
    w = (forms[:, :, :3, None] * inverse[:, None]).sum(axis=2)
    c = forms[:, :, 3] - (w * matrices[:, None, :, 3]).sum(axis=2)
    forms = np.concatenate([w, c[..., None]], axis=2)
    for k, wall in enumerate(walls):
        if wall.kind != "torus":
            forms[k] = _normalize(forms[k])
    largest = np.abs(forms[:, :, :3]).max(axis=(1, 2), initial=0.0)[:, None, None]
    farthest = np.abs(forms[:, :, 3:]).max(axis=(1, 2), initial=0.0)[:, None, None]
    return np.concatenate([_snap(forms[:, :, :3], largest), _snap(forms[:, :, 3:], farthest)], axis=2)


def _normalize(forms: Array) -> Array:
    """Return forms (4, 4) of the same wall: orthogonal, the longest of l1 to l3 of length 1."""
    w = forms[1:, :3]
    products = w @ w.T
    scale = np.sqrt(np.diag(products).max())
    aside = products - np.diag(np.diag(products))
    if np.abs(aside).max() > _ORTHOGONAL * scale**2:
        u, _, _ = np.linalg.svd(w)
        forms = np.concatenate([forms[:1], u.T @ forms[1:]])
        scale = np.linalg.norm(forms[1:, :3], axis=1).max()
    return forms / scale


def _snap(values: Array, largest: Array) -> Array:
    unit = _GRID * np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(float).tiny))))
    return np.rint(values / unit) * unit + 0.0
