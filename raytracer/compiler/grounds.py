"""Finds plane-only cells: only half-spaces and the background are visible there, and no other object casts a shadow.

A cell is CELL x CELL pixels. Many pictures are mostly ground and sky, which a shader without CSG draws several times
faster; the evaluator `cells` has such a shader. A cell counts as plane-only only if that is certain. So a cell at the
edge of an object or of its shadow is not plane-only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.culling import corner_rays, corners, longest_bounded_ray
from raytracer.compiler.direction_cells import CELL, MARGIN, Part
from raytracer.compiler.view_space import View
from raytracer.scene.lights import PointLight

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# The smallest slope of a half-space, for each pixel of a picture's width and height, with which cameraSlope()
# (camera.glsl) gives its points to within MARGIN.
_FLATTEST = 2.0**-27
# The smallest slope of a half-space for which plane.glsl gives its points on orthographic rays to within MARGIN: the
# depth of a ray's origin X has an error of 5 2^-24 |X|, and the slope divides it.
_FLATTEST_PARALLEL = 2.0**-3
# The largest depth below a hemisphere's equator, as a share of the distance, and the longest chord, with which a
# projected arc counts as short.
_BELOW, _SHORT = 0.25, 0.5
# The ends of the sides of a cell, as numbers of its corners in corners().
_ENDS = (0, 0, 1, 2), (1, 2, 3, 3)


class Ground(NamedTuple):
    """The cells of a picture in which a half-space is visible, and no other objects than half-spaces."""

    plane: int  # the surface index of the half-space
    normal: Array  # (3,), in view space
    depth: float  # the depth of the origin of view space in the half-space
    side: float  # 1 if the camera sees the face from within the half-space, -1 from outside
    cell: Ints  # (K,): numbers of the cells, row by row from the bottom
    corners: Array  # (3, 4, K): x, y, z of the half-space's points at the cells' corners, valid where `ahead`
    distance: Array  # (4, K): distances of these points from the origin of view space
    ahead: Mask  # (K,): whether the half-space is visible at all corners


class Sight(NamedTuple):
    """The cells of a picture without other objects than half-spaces, for any lights."""

    free: Mask  # (rows, columns), the lowest row first: these cells
    empty: Mask  # the free cells in which no surface is visible
    grounds: list[Ground]


def make_sight(view: View, planes: Sequence[int], occupied: Mask, size: tuple[int, int], part: Part) -> Sight:
    """Find the half-spaces in the cells of a part of a picture of `size` that are not `occupied` (rows, columns).

    `planes` are the surface indices of the single half-spaces.
    """
    rays = corner_rays(view.camera, size, part)
    flattest = _FLATTEST * CELL * sum(-(-side // CELL) + 1 for side in size)
    see = _see_parallel if view.camera.projection == "orthographic" else partial(_see_face, flattest)
    free = ~occupied
    empty = free.copy()
    grounds = []
    for plane in planes:
        normal = view.rotation @ view.surfaces.normals[plane - view.surfaces.bounded]
        depth = view.depths[plane - view.surfaces.bounded]
        face = see(rays, normal, depth)
        empty &= ~_cells_with_any_corner(face.may_be_seen)
        cell = np.flatnonzero(free & _cells_with_any_corner(face.is_shown))
        places = np.ascontiguousarray(np.moveaxis(corners(face.points).reshape(4, -1, 3)[:, cell], -1, 0))
        distance = np.sqrt(np.sum(places * places, axis=0))
        grounds.append(
            Ground(
                plane,
                normal,
                depth,
                face.side,
                cell,
                places,
                distance,
                _cells_with_all_corners(face.ahead).ravel()[cell],
            )
        )
    return Sight(free, empty, grounds)


class _Face(NamedTuple):
    """The boundary of a half-space at the corners of a picture's cells. Arrays are (rows + 1, columns + 1, ...)."""

    points: Array  # (..., 3), in view space, valid where `ahead`
    ahead: Mask  # whether the face is visible at the corner, and its point is known to within MARGIN
    is_shown: Mask  # True at one corner of a cell at least if the face is in the cell
    may_be_seen: Mask  # False at all corners of a cell only if it is certain that the face is not in the cell
    side: float  # as in Ground


def _see_face(flattest: float, rays: Array, normal: Array, depth: float) -> _Face:
    """Find a face along rays from the origin with the directions `rays` (..., 3).

    `flattest` is the smallest slope with which the face's points are known.
    """
    lengths = np.linalg.norm(rays, axis=-1)
    slope = rays @ normal
    steep = np.abs(slope) > flattest * lengths
    ahead = steep & (slope * depth > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        points = np.where(ahead, depth / slope, 0.0)[..., None] * rays
    # With a margin, because rounding may change the sign of a slope near 0.
    may_be_seen = slope * np.sign(depth) > -MARGIN * lengths
    # The slope is linear in the pixel, so a cell sees the face if one of its corners does. Flat corners count as well,
    # because rounding may change their sign.
    return _Face(points, ahead, (ahead | ~steep) & (depth != 0.0), may_be_seen, float(np.sign(depth)))


def _see_parallel(places: Array, normal: Array, depth: float) -> _Face:
    """Find a face along orthographic rays, from `places` (..., >= 2) along -z."""
    origins = np.concatenate([places[..., :2], np.zeros((*places.shape[:2], 1))], axis=-1)
    slope = -float(normal[2])
    depths = (depth - origins @ normal) * np.sign(slope)
    # The depth is linear in the pixel, so a cell sees the face if one of its corners does. The margin covers rounding.
    margin = MARGIN * (abs(depth) + np.linalg.norm(origins, axis=-1))
    if abs(slope) <= _FLATTEST_PARALLEL:
        flat = depths > -margin
        return _Face(origins, np.zeros_like(flat), flat, flat, float(np.sign(slope)))
    points = origins + (depths / abs(slope))[..., None] * (0.0, 0.0, -1.0)
    shown = depths > -margin
    return _Face(points, depths > margin, shown, shown, float(np.sign(slope)))


def shadowed_cells(
    sight: Sight, light: PointLight, view: View, grazed: Collection[int], occupied: Callable[[], Mask]
) -> Mask:
    """Find the cells (rows, columns) of a picture in which shadows of balls may lie on half-spaces.

    Args:
        sight: The half-spaces in the cells of the picture.
        light: The light.
        view: The surfaces in view space.
        grazed: The surface indices of the half-spaces whose boundary the light lies in. The light does not shine on
        them.
        occupied: Returns the cells around the light in which rays may meet other objects than half-spaces
            (2 * grid * grid,). hemisphere_cells() numbers them.
    """
    shadowed = np.zeros(sight.free.size, bool)
    grounds = [ground for ground in sight.grounds if ground.plane not in grazed and len(ground.cell)]
    if not grounds:
        return shadowed.reshape(sight.free.shape)
    place = view.place(light.position)
    far = longest_bounded_ray(place, view.centers, view.surfaces.radii) - float(np.linalg.norm(place))
    around: _Occupied | None = None
    for ground in grounds:
        # The distance by which rounding to float32 may move a point, relative to the light.
        error = MARGIN * (ground.distance + np.linalg.norm(place))
        whole = ground.ahead & (ground.distance.max(axis=0) <= far)
        # A face that looks away from all of the light is dark anyway.
        height = float(ground.normal @ place) - ground.depth
        faces = -height * ground.side > -error.max(axis=0) - light.radius * (1.0 + MARGIN)
        if not np.any(faces | ~whole):
            continue
        around = around or _sum_occupied(occupied())
        shadowed[ground.cell[~whole]] |= around.anywhere  # the face extends to the horizon
        within = np.flatnonzero(whole & faces)
        seen = ground.corners[:, :, within] - place[:, None, None]
        shadowed[ground.cell[within]] |= _find_shadowed(seen, error[:, within], around)
    return shadowed.reshape(sight.free.shape)


class _Occupied(NamedTuple):
    """The occupied cells around a light."""

    anywhere: bool
    sums: NDArray[np.int32]  # (2, grid + 1, grid + 1): prefix sums over the cells of each hemisphere


def _sum_occupied(cells: Mask) -> _Occupied:
    """Sum the occupied cells, so that four sums give their number in any rectangle."""
    grid = math.isqrt(len(cells) // 2)
    sums = np.zeros((2, grid + 1, grid + 1), np.int32)
    np.cumsum(cells.reshape(2, grid, grid), axis=1, out=sums[:, 1:, 1:])
    np.cumsum(sums[:, 1:, 1:], axis=2, out=sums[:, 1:, 1:])
    return _Occupied(bool(sums[:, -1, -1].any()), sums)


def _find_shadowed(places: Array, error: Array, around: _Occupied) -> Mask:
    """Find the cells (K,) of a half-space in which shadows of balls may lie.

    `places` (3, 4, K) are the points at the cells' corners, relative to a light, each to within its `error` (4, K).

    A cell's part of the half-space is a quadrilateral. Seen from the light, its sides are arcs of great circles, which
    the projection of hemisphere_cells() maps to arcs of circles of radius 1 or more. They are at most half circles if
    all corners are in the hemisphere, or if they are near each other and not far below the equator. The distance of an
    arc from its chord, of length l, is at most 1 - sqrt(1 - l^2 / 4).
    """
    grid = around.sums.shape[1] - 1
    shadowed = np.zeros(places.shape[-1], bool)
    distance = np.sqrt(np.sum(places * places, axis=0))
    for sums, sign in zip(around.sums, (1.0, -1.0), strict=True):
        height = places[2] * sign
        cell = np.flatnonzero(((height + error).max(axis=0) > 0.0) & ~shadowed)
        if not len(cell) or not sums[-1, -1]:
            continue
        height, off, length = height[:, cell], error[:, cell], distance[:, cell]
        front = (height > off).all(axis=0)
        near = ((height >= -_BELOW * length) & (length > 8.0 * off)).all(axis=0)
        scale = np.where(near, height + length, 1.0)
        at = places[:2, :, cell] / scale
        low, high = at.min(axis=1), at.max(axis=1)
        sides = at[:, _ENDS[0]] - at[:, _ENDS[1]]
        square = np.sum(sides * sides, axis=0).max(axis=0)
        sure = near & (front | (square <= _SHORT**2))
        # An error moves a projected point by less than twice its share of the distance.
        leaves = 1.0 - np.sqrt(np.maximum(1.0 - square / 4.0, 0.0))
        margin = leaves + (4.0 * off / np.where(near, length, 1.0)).max(axis=0)
        first = np.clip(np.floor((low - margin + 1.0) / 2.0 * grid), 0, grid).astype(int)
        last = np.clip(np.floor((high + margin + 1.0) / 2.0 * grid) + 1, 0, grid).astype(int)
        (c0, r0), (c1, r1) = first, np.maximum(last, first)
        count = sums[r1, c1] - sums[r0, c1] - sums[r1, c0] + sums[r0, c0]
        shadowed[cell] |= ~sure | (count > 0)
    return shadowed


def _combine_corners(combined: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """Combine the values at the four corners of each cell (rows, columns, ...)."""
    columns = combined(values[:-1], values[1:])
    return combined(columns[:, :-1], columns[:, 1:])


def _cells_with_any_corner(corners: Mask) -> Mask:
    """Return the cells (rows, columns) with any corner that is True."""
    return _combine_corners(np.logical_or, corners)


def _cells_with_all_corners(corners: Mask) -> Mask:
    """Return the cells (rows, columns) whose corners are all True."""
    return _combine_corners(np.logical_and, corners)
