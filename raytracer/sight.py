"""Which cells of a picture are quiet: where only half-spaces and the background are to be seen, and no other
object casts a shadow.

A cell is CELL x CELL pixels. Most of many a picture is ground and sky, which a shader without
any CSG draws several times faster: the evaluator `cells` has one for them. What is said to be quiet
surely is; a cell at the edge of an object or of its shadow is not.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.bounds import ball
from raytracer.cells import MARGIN, cube_faces, overlaps, tangents
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.shader import CELL
from raytracer.solids import Plane
from raytracer.view_space import rotation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Cells of a side of a cube's face around a light.
_GRID = 64


def has_quiet(scene: Scene, settings: Settings) -> bool:
    """Whether pictures of scenes with this structure may have quiet cells."""
    return settings.evaluator == "cells" and all(isinstance(s, Plane) or ball(s) for s in scene.solids())


def quiet_cells(scene: Scene, size: tuple[int, int], settings: Settings) -> Mask:
    """(rows, columns): which cells of a picture of `size` (width, height) are quiet, the lowest row first."""
    width, height = size
    shape = -(-height // CELL), -(-width // CELL)
    R, eye = rotation(scene.camera), scene.camera.position
    balls = [found for solid in scene.solids() if not isinstance(solid, Plane) and (found := ball(solid))]
    if not balls:
        return np.ones(shape, bool)
    centers = (np.array([center for center, _ in balls]) - eye) @ R.T
    radii = np.array([radius for _, radius in balls])
    tangent = math.tan(math.radians(scene.camera.vertical_fov) / 2.0)
    corner, step = (-tangent * width / height, -tangent), 2.0 * tangent * CELL / height
    lo, hi = tangents(centers, radii)
    seen, _ = overlaps(lo, hi, corner, (step, step), shape[::-1])
    quiet = np.ones(shape, bool)
    quiet.flat[seen] = False
    if settings.shadows == "off":
        return quiet
    x, y = (corner[axis] + step * np.arange(shape[1 - axis] + 1) for axis in (0, 1))
    rays = np.stack(np.broadcast_arrays(x, y[:, None], -1.0), axis=-1)
    for light in scene.lights:
        place = R @ np.subtract(light.position, eye)
        occupied = _occupied(centers - place, radii)
        for plane in (solid for solid in scene.solids() if isinstance(solid, Plane)):
            quiet &= ~_shadowed(rays, R @ np.array(plane.unit()[0]), plane.depth(eye), place, occupied)
    return quiet


def _occupied(centers: Array, radii: Array) -> NDArray[np.int64]:
    """(6, GRID + 1, GRID + 1): sums over the cells of a light's cube that see balls, from a face's corner on."""
    occupied = np.zeros(6 * _GRID * _GRID, np.int64)
    occupied[cube_faces(centers, radii, _GRID)[0]] = 1
    return np.pad(occupied.reshape(6, _GRID, _GRID).cumsum(1).cumsum(2), ((0, 0), (1, 0), (1, 0)))


def _shadowed(rays: Array, n: Array, depth: float, light: Array, occupied: NDArray[np.int64]) -> Mask:
    """(rows, columns): in which cells shadows of balls may lie on the half-space dot(n, x) <= depth.

    `rays` (rows + 1, columns + 1, 3) go through the cells' corners.
    """
    slope = rays @ n
    ahead = slope * depth > 0.0  # linear, so that a cell sees the face where one of its corners does
    visible, whole = _any(ahead), _all(ahead)
    with np.errstate(divide="ignore", invalid="ignore"):
        P = np.where(ahead, depth / slope, 0.0)[..., None] * rays
    D = P - light
    shadowed = visible & ~whole & bool(occupied.any())  # the horizon's cells: the face goes on without end
    # What rounding to float32 may move a point by, seen from the light.
    error = MARGIN * (np.linalg.norm(P, axis=-1) + np.linalg.norm(light))
    for face in range(6):
        sums, axis = occupied[face], face // 2
        main = D[..., axis] * (1.0 - 2.0 * (face % 2))
        front = main > error
        mixed = _any(main > -error) & ~_all(front)
        shadowed |= whole & mixed & bool(sums[-1, -1])
        # In front of the face the cell's part of the half-space is a quadrilateral there, inside its bounds.
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.where(front[..., None], np.delete(D, axis, axis=-1) / main[..., None], 0.0)
            off = np.where(front, error / main, 0.0)[..., None] * (1.0 + np.abs(at))
        low = np.clip(np.floor((_corners(at - off).min(axis=0) + 1.0) / 2.0 * _GRID), 0, _GRID).astype(int)
        high = np.clip(np.floor((_corners(at + off).max(axis=0) + 1.0) / 2.0 * _GRID) + 1, 0, _GRID).astype(int)
        high = np.maximum(high, low)
        (c0, r0), (c1, r1) = np.moveaxis(low, -1, 0), np.moveaxis(high, -1, 0)
        count = sums[r1, c1] - sums[r0, c1] - sums[r1, c0] + sums[r0, c0]
        shadowed |= whole & _all(front) & (count > 0)
    return shadowed


def _corners(values: Array) -> Array:
    """(4, rows, columns, ...): the values at the corners of each cell."""
    return np.stack([values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]])


def _any(corners: Mask) -> Mask:
    return corners[:-1, :-1] | corners[:-1, 1:] | corners[1:, :-1] | corners[1:, 1:]


def _all(corners: Mask) -> Mask:
    return corners[:-1, :-1] & corners[:-1, 1:] & corners[1:, :-1] & corners[1:, 1:]


def runs(cells: Mask) -> NDArray[np.int32]:
    """(N, 3): column, row and length of each run of cells that are True along a row."""
    edges = np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    return np.column_stack([first, row, end - first]).astype(np.int32)
