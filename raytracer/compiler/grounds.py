"""The plane-only cells of a picture, where only half-spaces and the background are to be seen, and no other object
casts a shadow.

A cell is CELL x CELL pixels. Most of many a picture is ground and sky, which a shader without
any CSG draws several times faster: the evaluator `cells` has one for them. A cell is plane-only for sure, or counts as
none; a cell at the edge of an object or of its shadow is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.culling import corner_rays, corners, reach
from raytracer.compiler.direction_cells import CELL, MARGIN
from raytracer.compiler.view_space import View
from raytracer.scene.lights import PointLight

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Slopes of a half-space, for each pixel that a picture is wide and high, below which cameraSlope() (camera.glsl) does
# not give its points to within MARGIN.
_FLATTEST = 2.0**-27
# A share of the distance below a hemisphere's equator, and a chord there, up to which projected arcs are short.
_BELOW, _SHORT = 0.25, 0.5
# The ends of the sides of a cell, as corners() counts its corners.
_ENDS = (0, 0, 1, 2), (1, 2, 3, 3)


class Ground(NamedTuple):
    """The cells of a picture in which a half-space is to be seen, and no other object than half-spaces."""

    plane: int  # its surface
    normal: Array
    depth: float  # of the camera in it
    cell: Ints  # (K,), numbered along rows, the lowest first
    corners: Array  # (3, 4, K): x, y, z of the half-space's points at the corners, where `ahead`
    distance: Array  # (4, K), from the camera
    ahead: Mask  # (K,): all corners see the half-space


class Sight(NamedTuple):
    """The cells of a picture without other objects than half-spaces, whatever the lights."""

    free: Mask  # (rows, columns), the lowest row first: those cells
    empty: Mask  # the free cells in which nothing is to be seen
    grounds: list[Ground]


def make_sight(view: View, planes: Sequence[int], occupied: Mask, size: tuple[int, int]) -> Sight:
    """Find the half-spaces in the cells of a picture of `size` (width, height) that are not `occupied` (rows, columns).

    `planes` are the single half-spaces, by their surface.
    """
    rays = corner_rays(view.camera, size)
    lengths = np.linalg.norm(rays, axis=-1)
    free = ~occupied
    empty = free.copy()
    grounds = []
    for plane in planes:
        normal = view.rotation @ view.surfaces.normals[plane - view.surfaces.spheres]
        depth = view.depths[plane - view.surfaces.spheres]
        slope = rays @ normal
        # By a margin: a slope of all but 0 has no sign that rounding may not change.
        empty &= ~_any(slope * np.sign(depth) > -MARGIN * lengths)
        steep = np.abs(slope) > _FLATTEST * CELL * sum(rays.shape[:2]) * lengths
        ahead = steep & (slope * depth > 0.0)
        # Linear, so that a cell sees the face where one of its corners does; of flat ones rounding may change the sign.
        visible = free & _any(ahead | ~steep) & (depth != 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            points = np.where(ahead, depth / slope, 0.0)[..., None] * rays
        cell = np.flatnonzero(visible)
        places = np.ascontiguousarray(np.moveaxis(corners(points).reshape(4, -1, 3)[:, cell], -1, 0))
        distance = np.sqrt(np.sum(places * places, axis=0))
        grounds.append(Ground(plane, normal, depth, cell, places, distance, _all(ahead).ravel()[cell]))
    return Sight(free, empty, grounds)


def shadowed_cells(
    sight: Sight, light: PointLight, view: View, grazed: Collection[int], occupied: Callable[[], Mask]
) -> Mask:
    """(rows, columns): in which cells of a picture shadows of balls may lie on half-spaces.

    `grazed` are the half-spaces, by their surface, in whose boundary the light is: it does not shine on these.
    `occupied` gives the cells (2 * grid * grid,) around the light, numbered as hemisphere_cells() does, in which rays
    may meet other objects than half-spaces.
    """
    shadowed = np.zeros(sight.free.size, bool)
    grounds = [ground for ground in sight.grounds if ground.plane not in grazed and len(ground.cell)]
    if not grounds:
        return shadowed.reshape(sight.free.shape)
    place = view.place(light.position)
    far = reach(place, view.centers, view.surfaces.radii) - float(np.linalg.norm(place))
    around: _Occupied | None = None
    for ground in grounds:
        # Rounding to float32 may move a point so far, seen from the light.
        error = MARGIN * (ground.distance + np.linalg.norm(place))
        whole = ground.ahead & (ground.distance.max(axis=0) <= far)
        # A face that looks away from all of the light is dark, whatever is between.
        height = float(ground.normal @ place) - ground.depth
        faces = -height * np.sign(ground.depth) > -error.max(axis=0) - light.radius * (1.0 + MARGIN)
        if not np.any(faces | ~whole):
            continue
        around = around or _sums(occupied())
        shadowed[ground.cell[~whole]] |= around.anywhere  # to the horizon: the face goes on without end
        within = np.flatnonzero(whole & faces)
        seen = ground.corners[:, :, within] - place[:, None, None]
        shadowed[ground.cell[within]] |= _shadowed(seen, error[:, within], around)
    return shadowed.reshape(sight.free.shape)


class _Occupied(NamedTuple):
    """The occupied cells around a light."""

    anywhere: bool
    sums: NDArray[np.int32]  # (2, grid + 1, grid + 1): over the cells from a hemisphere's corner on


def _sums(cells: Mask) -> _Occupied:
    grid = math.isqrt(len(cells) // 2)
    sums = np.zeros((2, grid + 1, grid + 1), np.int32)
    np.cumsum(cells.reshape(2, grid, grid), axis=1, out=sums[:, 1:, 1:])
    np.cumsum(sums[:, 1:, 1:], axis=2, out=sums[:, 1:, 1:])
    return _Occupied(bool(sums[:, -1, -1].any()), sums)


def _shadowed(places: Array, error: Array, around: _Occupied) -> Mask:
    """(K,): in which cells of a half-space shadows of balls may lie.

    `places` (3, 4, K) are the points at the cells' corners as seen from a light, each to within its `error` (4, K).

    A cell's part of the half-space is a quadrilateral. As seen from the light its sides are arcs of great circles,
    which hemisphere_cells() projects to arcs of circles of the radius 1 or more. These are at most half circles where
    all corners are in the hemisphere, or near each other and not far below. An arc leaves its chord l by
    1 - sqrt(1 - l^2 / 4) at most.
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
        # An error moves a projected place by less than twice its share of the distance.
        leaves = 1.0 - np.sqrt(np.maximum(1.0 - square / 4.0, 0.0))
        margin = leaves + (4.0 * off / np.where(near, length, 1.0)).max(axis=0)
        first = np.clip(np.floor((low - margin + 1.0) / 2.0 * grid), 0, grid).astype(int)
        last = np.clip(np.floor((high + margin + 1.0) / 2.0 * grid) + 1, 0, grid).astype(int)
        (c0, r0), (c1, r1) = first, np.maximum(last, first)
        count = sums[r1, c1] - sums[r0, c1] - sums[r1, c0] + sums[r0, c0]
        shadowed[cell] |= ~sure | (count > 0)
    return shadowed


def _over(combined: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """(rows, columns, ...): the values at the four corners of each cell, combined."""
    columns = combined(values[:-1], values[1:])
    return combined(columns[:, :-1], columns[:, 1:])


def _any(corners: Mask) -> Mask:
    return _over(np.logical_or, corners)


def _all(corners: Mask) -> Mask:
    return _over(np.logical_and, corners)
