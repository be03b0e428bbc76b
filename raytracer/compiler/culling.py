"""The plane-only cells of a picture, where only half-spaces and the background are to be seen, and no other object
casts a shadow.

A cell is CELL x CELL pixels. Most of many a picture is ground and sky, which a shader without
any CSG draws several times faster: the evaluator `cells` has one for them. A cell is plane-only for sure, or counts as
none; a cell at the edge of an object or of its shadow is none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import CELL, MARGIN, cube_faces, overlaps, tangents, widened
from raytracer.compiler.view_space import View, camera_grid
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, simplified

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Cells of a side of a cube's face around a light.
_GRID = 64
# The error of a ball's distance from a ray towards a light, in float32: so much of the distances from the camera and of
# the ray's length, however near the light the ball is (32 units in the last place, which the point, light, centre,
# direction and moment share).
PASSING = 2.0**-19
# PASSING widens balls for distances so many times as large as a typical one from the light, or from the camera
# to the light: nothing of those, and beyond them nothing is known to be plane-only.
_REACH, _AWAY = 128.0, 4.0
# In so many cells of the cube around a light a ball may be listed for no more than the light's radius, on average:
# in smaller ones the same lists would come over and over.
_LISTED_FOR_RADIUS = 16.0
# Slopes of a half-space, for each pixel that a picture is wide and high, below which cameraSlope() (camera.glsl) does
# not give its points to within MARGIN.
_FLATTEST = 2.0**-27


class OccupiedCells(NamedTuple):
    """The cells in which rays may meet other objects than half-spaces."""

    picture: Mask  # (cells,), numbered along rows, the lowest first
    # For the cube around each light, (6 * grid * grid,), numbered as cube_faces() does.
    lights: list[Mask]


def plane_only_cells(
    view: View, planes: Sequence[int], lights: Sequence[PointLight], occupied: OccupiedCells, size: tuple[int, int]
) -> tuple[Mask, Mask]:
    """(rows, columns) each: which cells of a picture of `size` (width, height) are plane-only, and which of them are
    empty, where nothing is to be seen. The lowest row comes first.

    `planes` are the single half-spaces, by their surface; `lights` are those that cast shadows.
    """
    rays = _corner_rays(view.camera, size)
    plane_only = ~occupied.picture.reshape(len(rays) - 1, -1)
    spheres = view.surfaces.spheres
    normals = [view.rotation @ view.surfaces.normals[plane - spheres] for plane in planes]
    depths = [view.depths[plane - spheres] for plane in planes]
    empty = plane_only.copy()
    for n, depth in zip(normals, depths, strict=True):
        # By a margin: a slope of all but 0 has no sign that rounding may not change.
        empty &= ~_any((rays @ n) * np.sign(depth) > -MARGIN * np.linalg.norm(rays, axis=-1))
    if not spheres:
        return plane_only, empty
    for light, cells in zip(lights, occupied.lights, strict=True):
        place = view.place(light.position)
        grid = math.isqrt(len(cells) // 6)
        far = reach(place, view.centers, view.surfaces.radii) - float(np.linalg.norm(place))
        # Sums over the cells from a face's corner on.
        sums = np.pad(cells.reshape(6, grid, grid).cumsum(1).cumsum(2), ((0, 0), (1, 0), (1, 0)))
        for n, depth in zip(normals, depths, strict=True):
            plane_only &= ~_shadowed(rays, n, depth, place, sums, far)
    return plane_only, empty & plane_only


def _corner_rays(camera: Camera, size: tuple[int, int]) -> Array:
    """(rows + 1, columns + 1, 3): directions through the corners of the cells of the picture, in view space, z = -1."""
    corner, step, (columns, rows) = camera_grid(camera, size)
    # The last cells end with the picture.
    x = np.minimum(corner[0] + step * np.arange(columns + 1), -corner[0])
    y = np.minimum(corner[1] + step * np.arange(rows + 1), -corner[1])
    return np.stack(np.broadcast_arrays(x, y[:, None], -1.0), axis=-1)


def occupied_cells(
    view: View, solids: Sequence[Solid], lights: Sequence[PointLight], size: tuple[int, int]
) -> OccupiedCells:
    """The occupied cells of few primitives. `solids` are the scene's, `lights` are those that cast shadows."""
    rays = _corner_rays(view.camera, size)
    centers, radii = view.centers, view.surfaces.radii
    corner, step, shape = camera_grid(view.camera, size)
    pairs = overlaps(*tangents(centers, radii), corner, (step, step), shape)
    corners = _corners(rays).reshape(4, -1, 3)[:, pairs[0]]
    picture = _occupied(solids, *_in_cone(pairs, corners, centers, radii), len(radii), shape[0] * shape[1])
    cubes = []
    for light in lights:
        place = view.place(light.position)
        grid = int(min(_GRID, finest_grid(place, light.radius, centers)))
        wide = radii + widening(place, light.radius, centers, radii)
        pairs = cube_faces(centers - place, wide, grid)
        kept = _in_cone(pairs, _cube_corners(pairs[0], grid), centers - place, wide)
        cubes.append(_occupied(solids, *kept, len(radii), 6 * grid * grid))
    return OccupiedCells(picture, cubes)


def reach(light: Array, centers: Array, radii: Array) -> float:
    """The length of rays to a light up to which PASSING bounds their error."""
    if not len(radii):
        return 0.0
    middle = (len(radii) - 1) // 2, len(radii) // 2
    far = np.partition(np.linalg.norm(centers - light, axis=1) + radii, middle)
    # Their median. np.median() would import numpy.ma, which takes longer than all of this.
    typical = float(far[middle[0]] + far[middle[1]]) / 2.0
    return max(_REACH * typical, _AWAY * float(np.linalg.norm(light)))


def widening(light: Array, radius: float, centers: Array, radii: Array) -> float:
    """By how much balls are to be wider so that the ray to a light's centre meets one where any to the light does.

    Points of the two are, after the same share of their ways from P, no further apart than their ends, which is at
    most `radius`. To aim beside the centre takes as many roundings again as PASSING is for.
    """
    passing = PASSING * reach(light, centers, radii)
    return radius * (1.0 + MARGIN) + 2.0 * passing if radius else passing


def finest_grid(light: Array, radius: float, centers: Array) -> float:
    """The most cells that a side of a cube's face around a light should have; at least 1.

    By the share of all directions in which balls are listed for no more than the light's radius.
    """
    if not radius or not len(centers):
        return math.inf
    distance = np.maximum(np.linalg.norm(centers - light, axis=1), radius)
    share = float(np.mean((radius / distance) ** 2)) / 4.0
    return max(1.0, math.sqrt(_LISTED_FOR_RADIUS / (6.0 * share))) if share else math.inf


def _possible(solid: Solid, spheres: Iterator[Mask]) -> Mask:
    """The cells where rays may meet a tree, from the cells of its spheres, in their order."""
    stack: list[Mask] = []
    for node in simplified(solid):
        match node:
            case Sphere():
                stack.append(next(spheres))
            case Plane():
                stack.append(np.ones(1, bool))
            case Complement():
                stack[-1] = np.ones(1, bool)
            case Difference():
                stack.pop()
            case _:
                b, a = stack.pop(), stack.pop()
                stack.append(a & b if isinstance(node, Intersection) else a | b)
    return stack[0]


def _occupied(
    solids: Sequence[Solid], cell: NDArray[np.int64], sphere: NDArray[np.int64], spheres: int, cells: int
) -> Mask:
    """(cells,): where a ray may meet an object other than a half-space, by the pairs of a cell and a sphere in it."""
    inside = np.zeros((spheres, cells), bool)
    inside[sphere, cell] = True
    remaining = iter(inside)
    occupied = np.zeros(cells, bool)
    for solid in solids:
        if not isinstance(solid, Plane):
            occupied |= _possible(solid, remaining)
    return occupied


def _in_cone(
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]], corners: Array, centers: Array, radii: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The pairs of a cell and a sphere in which the sphere's cone meets the cone around the cell.

    `corners` (4, pairs, 3) are directions. A cone of at most a right angle to its axis, dot(d, axis) >= cos |d| with
    cos >= 0, holds with two directions their sum: so it holds a cell of which it holds the corners. A wider one may
    not, and its pairs are kept.
    """
    cell, sphere = pairs
    centers, radii = centers[sphere], widened(centers, radii)[sphere]
    axis = (corners / np.linalg.norm(corners, axis=-1, keepdims=True)).sum(axis=0)
    around = _angles(corners, axis).max(axis=0)
    distance = np.linalg.norm(centers, axis=1)
    half = np.arcsin(np.minimum(radii / np.where(distance > 0.0, distance, 1.0), 1.0))
    apart = _angles(axis, centers) > (around + half) * (1.0 + MARGIN)
    keep = ~apart | (around >= math.pi / 2.0 * (1.0 - MARGIN)) | (distance <= radii)
    return cell[keep], sphere[keep]


def _angles(a: Array, b: Array) -> Array:
    """Between directions. By the cross product: where the view is narrow it keeps the bits of their small parts."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))


def _cube_corners(cell: NDArray[np.int64], grid: int) -> Array:
    """(4, N, 3): the corners of N cells of a cube, numbered as cube_faces() does."""
    face, place = np.divmod(cell, grid * grid)
    row, column = np.divmod(place, grid)
    lines = np.linspace(-1.0, 1.0, grid + 1)
    b = lines[np.stack([column, column + 1, column, column + 1])]
    c = lines[np.stack([row, row, row + 1, row + 1])]
    axis, a = face // 2, np.broadcast_to(1.0 - 2.0 * (face % 2), b.shape)
    return np.stack(
        [np.where(axis == 0, a, b), np.where(axis == 1, a, np.where(axis == 0, b, c)), np.where(axis == 2, a, c)],
        axis=-1,
    )


def _shadowed(rays: Array, n: Array, depth: float, light: Array, sums: NDArray[np.int64], reach: float) -> Mask:
    """(rows, columns): in which cells shadows of balls may lie on the half-space dot(n, x) <= depth.

    `rays` (rows + 1, columns + 1, 3) go through the cells' corners. Balls shade points within `reach`.
    """
    slope = rays @ n
    steep = np.abs(slope) > _FLATTEST * CELL * sum(rays.shape[:2]) * np.linalg.norm(rays, axis=-1)
    ahead = steep & (slope * depth > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        P = np.where(ahead, depth / slope, 0.0)[..., None] * rays
    # Linear, so that a cell sees the face where one of its corners does; of flat ones rounding may change the sign.
    visible = _any(ahead | ~steep) & (depth != 0.0)
    whole = _all(ahead & (np.linalg.norm(P, axis=-1) <= reach))
    D = P - light
    grid = sums.shape[1] - 1
    shadowed = visible & ~whole & bool(sums[:, -1, -1].any())  # to the horizon: the face goes on without end
    # Rounding to float32 may move a point so far, seen from the light.
    error = MARGIN * (np.linalg.norm(P, axis=-1) + np.linalg.norm(light))
    for face in np.flatnonzero(sums[:, -1, -1]):
        axis = face // 2
        main = D[..., axis] * (1.0 - 2.0 * (face % 2))
        front = main > error
        # Partly in front: only where it is not wholly beside the face, beyond one of its sides.
        most = _over(np.maximum, main + error)
        side = np.delete(D, axis, axis=-1)
        off = error[..., None]
        beside = _over(np.minimum, side - off) > most[..., None]
        beside |= _over(np.maximum, side + off) < -most[..., None]
        shadowed |= whole & (most > 0.0) & ~_all(front) & ~beside.any(axis=-1)
        # In front of the face the cell's part of the half-space is a quadrilateral there, inside its bounds.
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.where(front[..., None], side / main[..., None], 0.0)
            off = np.where(front, error / main, 0.0)[..., None] * (1.0 + np.abs(at))
        low = np.clip(np.floor((_over(np.minimum, at - off) + 1.0) / 2.0 * grid), 0, grid).astype(int)
        high = np.clip(np.floor((_over(np.maximum, at + off) + 1.0) / 2.0 * grid) + 1, 0, grid).astype(int)
        high = np.maximum(high, low)
        (c0, r0), (c1, r1) = np.moveaxis(low, -1, 0), np.moveaxis(high, -1, 0)
        count = sums[face, r1, c1] - sums[face, r0, c1] - sums[face, r1, c0] + sums[face, r0, c0]
        shadowed |= whole & _all(front) & (count > 0)
    return shadowed


def _corners(values: Array) -> Array:
    """(4, rows, columns, ...): the values at the corners of each cell."""
    return np.stack([values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]])


def _over(combined: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """(rows, columns, ...): the values at the four corners of each cell, combined."""
    columns = combined(values[:-1], values[1:])
    return combined(columns[:, :-1], columns[:, 1:])


def _any(corners: Mask) -> Mask:
    return _over(np.logical_or, corners)


def _all(corners: Mask) -> Mask:
    return _over(np.logical_and, corners)
