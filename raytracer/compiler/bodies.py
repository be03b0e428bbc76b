"""The bodies of a scene, in world space, as arrays: primitives other than spheres and half-spaces.

A body is the intersection of slabs (pairs of parallel plane faces) and at most one curved wall; see Slab and Wall in
raytracer/scene/solids/solid.py. A part of a torus is a body, too: one of the two intervals of a ray in the torus. Faces
that coincide have equal bits here, up to the sign of a plane's normal: then the shaders compute equal roots.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.scene.solids import affine_arrays
from raytracer.scene.solids.body import Body, Wall

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The kinds of walls, by their numbers in body.glsl; 0 is a body without a wall.
WALLS = "", "round", "cone", "torus"
# Forms that are orthogonal to within this share stay as they are. Maps of other forms are rotated among each other, so
# that the shaders' errors do not grow with the condition number of the map.
_ORTHOGONAL = 1e-9
# The unit to which the numbers of walls are rounded, as a share of the largest number. Walls that coincide, but are
# stated by other points of their axis, differ by a few 2^-53, which this rounding removes.
_GRID = 2.0**-44
# A point may lie on a wall if it is at most this share of the largest number of the two off it: the error of four forms
# with numbers rounded to _GRID.
_ON = 2.0 * _GRID


class Bodies(msgspec.Struct, frozen=True, eq=False):
    """B bodies with K slabs and W walls."""

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


class PlacedShapes(NamedTuple):
    """B bodies, as shapes under maps. Bodies may share shapes: copies of an object do."""

    shapes: list[Body]
    shape: Ints  # (B,): the number of each body's shape
    maps: Array  # (B, 3, 4)
    parts: Ints  # (B,): for a torus, the number of the ray's interval


def make_bodies(placed: PlacedShapes) -> Bodies:
    """Compute the faces and the bounds of bodies in world space."""
    shapes, shape, maps, parts = placed
    slabs, walls = [own.slabs() for own in shapes], [own.wall() for own in shapes]
    counts = np.array(list(map(len, slabs)), np.int64)
    starts = np.zeros(len(shape) + 1, np.int64)
    np.cumsum(counts[shape], out=starts[1:])
    body = np.repeat(np.arange(len(shape)), counts[shape])
    # The number of each body's slab among the slabs of all shapes.
    slab = (np.cumsum(counts) - counts)[shape][body] + np.arange(len(body)) - starts[body]
    rows = np.array([(*slab.normal, slab.low, slab.high) for own in slabs for slab in own]).reshape(-1, 5)[slab]
    has_wall = np.array([wall is not None for wall in walls], bool)
    is_walled = has_wall[shape]
    number = np.cumsum(has_wall)[shape[is_walled]] - 1
    kinds = np.array([WALLS.index(wall.kind) if wall else 0 for wall in walls], np.int64)[shape]
    corners = np.array([own.corners() for own in shapes]).reshape(-1, 8, 3)[shape]
    corners = affine_arrays.apply(maps[:, None], corners)
    centers = corners.mean(axis=1)
    return Bodies(
        corners,
        centers,
        _ball_radii(np.array([own.reach() for own in shapes])[shape], maps, corners, centers),
        starts,
        *affine_arrays.map_slabs(maps, body, rows[:, :3], rows[:, 3], rows[:, 4]),
        kinds,
        np.where(is_walled, np.cumsum(is_walled) - 1, -1),
        _map_walls([wall for wall in walls if wall], number, maps[is_walled], kinds[is_walled]),
        parts,
    )


def walls_at(bodies: Bodies, point: Vec3) -> NDArray[np.bool_]:
    """Return whether a point lies on each wall (W,), within the rounding of the wall's numbers."""
    w, c = bodies.forms[:, :, :3], bodies.forms[:, :, 3]
    l0, l1, l2, l3 = (w @ point + c).T
    error = _ON * (np.abs(w) @ np.abs(point) + np.abs(c)).max(axis=1, initial=0.0)
    is_torus = bodies.kinds[bodies.walls >= 0] == WALLS.index("torus")
    aside = np.hypot(l1, l2)
    return np.abs(np.hypot(np.where(is_torus, aside - 1.0, aside), l3) - l0) <= error


def wall_gradient(kind: str, forms: Array, values: Array) -> Array:
    """Return an outward normal (3,), of any length, of a wall where its forms (4, 4) have `values` (4,)."""
    factors = np.array([-values[0], *values[1:]])
    if kind == "torus":
        rho = np.hypot(values[1], values[2])
        factors = np.array([0.0, *(values[1:3] * (1.0 - 1.0 / rho)), values[3]])
    return factors @ forms[:, :3]


def _ball_radii(reach: Array, maps: Array, corners: Array, centers: Array) -> Array:
    """Return radii (B,) of bounding balls: by the corners, or by the longest axis of the map if that is less.

    A ball around the corners' centre, of the radius `reach` (B,), holds the shape before the map. Its radius grows at
    most by the map's longest axis. For an ellipsoid, it is less than the distance of the corners by a factor of up to
    sqrt(3).
    """
    by_corners = np.linalg.norm(corners - centers[:, None], axis=-1).max(axis=1, initial=0.0)
    return np.minimum(by_corners, reach * np.linalg.norm(maps[:, :, :3], ord=2, axis=(1, 2)))


def _map_walls(walls: Sequence[Wall], number: Ints, maps: Array, kinds: Ints) -> Array:
    """Return the forms (W, 4, 4) of the walls with the numbers (W,) and the kinds (W,), under maps (W, 3, 4)."""
    forms = np.array([wall.forms for wall in walls]).reshape(-1, 4, 4)[number]
    cofactor = affine_arrays.cofactors(maps)
    inverse = np.swapaxes(cofactor, 1, 2) / affine_arrays.determinants(maps, cofactor)[:, None, None]
    w = (forms[:, :, :3, None] * inverse[:, None]).sum(axis=2)
    c = forms[:, :, 3] - (w * maps[:, None, :, 3]).sum(axis=2)
    forms = np.concatenate([w, c[..., None]], axis=2)
    is_convex = kinds != WALLS.index("torus")
    forms[is_convex] = _normalize(forms[is_convex])
    largest = np.abs(forms[:, :, :3]).max(axis=(1, 2), initial=0.0)[:, None, None]
    farthest = np.abs(forms[:, :, 3:]).max(axis=(1, 2), initial=0.0)[:, None, None]
    return np.concatenate([_snap(forms[:, :, :3], largest), _snap(forms[:, :, 3:], farthest)], axis=2)


def _normalize(forms: Array) -> Array:
    """Return forms (W, 4, 4) of the same walls: orthogonal, the longest of l1 to l3 of length 1."""
    w = forms[:, 1:, :3]
    products = (w[:, :, None] * w[:, None]).sum(axis=3)
    squares = products[:, range(3), range(3)]
    largest = squares.max(axis=1, initial=0.0)
    aside = np.abs(products[:, [0, 0, 1], [1, 2, 2]]).max(axis=1, initial=0.0)
    oblique = np.flatnonzero(aside > _ORTHOGONAL * largest)
    if len(oblique):
        u, _, _ = np.linalg.svd(w[oblique])
        turned = (u[:, :, :, None] * forms[oblique, 1:, None]).sum(axis=1)
        forms[oblique, 1:] = turned
        largest[oblique] = (turned[:, :, :3] ** 2).sum(axis=2).max(axis=1)
    return forms / np.sqrt(largest)[:, None, None]


def _snap(values: Array, largest: Array) -> Array:
    unit = _GRID * np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(float).tiny))))
    return np.rint(values / unit) * unit + 0.0
