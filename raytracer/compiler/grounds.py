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
    empty: Mask  # those of them in which nothing is to be seen
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
    `occupied` gives the cells (6 * grid * grid,) of the cube around the light, numbered as cube_faces() does, in which
    rays may meet other objects than half-spaces.
    """
    shadowed = np.zeros(sight.free.size, bool)
    grounds = [ground for ground in sight.grounds if ground.plane not in grazed and len(ground.cell)]
    if not grounds:
        return shadowed.reshape(sight.free.shape)
    place = view.place(light.position)
    far = reach(place, view.centers, view.surfaces.radii) - float(np.linalg.norm(place))
    cube: _Cube | None = None
    for ground in grounds:
        # Rounding to float32 may move a point so far, seen from the light.
        error = MARGIN * (ground.distance + np.linalg.norm(place))
        whole = ground.ahead & (ground.distance.max(axis=0) <= far)
        # A face that looks away from all of the light is dark, whatever is between.
        height = float(ground.normal @ place) - ground.depth
        faces = -height * np.sign(ground.depth) > -error.max(axis=0) - light.radius * (1.0 + MARGIN)
        if not np.any(faces | ~whole):
            continue
        cube = cube or _cube(occupied())
        shadowed[ground.cell[~whole]] |= cube.is_occupied  # to the horizon: the face goes on without end
        within = np.flatnonzero(whole & faces)
        seen = ground.corners[:, :, within] - place[:, None, None]
        shadowed[ground.cell[within]] |= _shadowed(seen, error[:, within], cube)
    return shadowed.reshape(sight.free.shape)


class _Cube(NamedTuple):
    """The occupied cells of the cube around a light."""

    is_occupied: bool
    faces: list[int]  # with any
    sums: NDArray[np.int32]  # (6, grid + 1, grid + 1): over the cells from a face's corner on


def _cube(cells: Mask) -> _Cube:
    grid = math.isqrt(len(cells) // 6)
    sums = np.zeros((6, grid + 1, grid + 1), np.int32)
    np.cumsum(cells.reshape(6, grid, grid), axis=1, out=sums[:, 1:, 1:])
    np.cumsum(sums[:, 1:, 1:], axis=2, out=sums[:, 1:, 1:])
    faces = np.flatnonzero(sums[:, -1, -1]).tolist()
    return _Cube(bool(faces), faces, sums)


def _shadowed(places: Array, error: Array, cube: _Cube) -> Mask:
    """(K,): in which cells of a half-space shadows of balls may lie.

    `places` (3, 4, K) are the points at the cells' corners as seen from a light, each to within its `error` (4, K).
    """
    grid = cube.sums.shape[1] - 1
    shadowed = np.zeros(places.shape[-1], bool)
    for face in cube.faces:
        axis = face // 2
        others = [places[k] for k in range(3) if k != axis]
        main = places[axis] * (1.0 - 2.0 * (face % 2))
        # Only cells that are partly in front of the face, and not wholly beside it, beyond one of its sides.
        most = (main + error).max(axis=0)
        seen = most > 0.0
        for side in others:
            seen &= ((side - error).min(axis=0) <= most) & ((side + error).max(axis=0) >= -most)
        cell = np.flatnonzero(seen & ~shadowed)
        main, off = main[:, cell], error[:, cell]
        front = main > off
        # In front of the face the cell's part of the half-space is a quadrilateral there, inside its bounds.
        bounds = []
        with np.errstate(divide="ignore", invalid="ignore"):
            for side in others:
                at = np.where(front, side[:, cell] / main, 0.0)
                margin = np.where(front, off / main, 0.0) * (1.0 + np.abs(at))
                low = np.clip(np.floor(((at - margin).min(axis=0) + 1.0) / 2.0 * grid), 0, grid).astype(int)
                high = np.clip(np.floor(((at + margin).max(axis=0) + 1.0) / 2.0 * grid) + 1, 0, grid).astype(int)
                bounds.append((low, np.maximum(high, low)))
        (c0, c1), (r0, r1) = bounds
        sums = cube.sums[face]
        count = sums[r1, c1] - sums[r0, c1] - sums[r1, c0] + sums[r0, c0]
        shadowed[cell] |= ~front.all(axis=0) | (count > 0)
    return shadowed


def _over(combined: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """(rows, columns, ...): the values at the four corners of each cell, combined."""
    columns = combined(values[:-1], values[1:])
    return combined(columns[:, :-1], columns[:, 1:])


def _any(corners: Mask) -> Mask:
    return _over(np.logical_or, corners)


def _all(corners: Mask) -> Mask:
    return _over(np.logical_and, corners)
