"""Culling: finds the cells of a picture, and around lights, in which rays may meet objects other than half-spaces.

The cells are for scenes of few primitives. Scenes of any size use ball_growth(), the amount by which balls must grow
for rounding and for the radius of a light.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import MARGIN, Part, cells_in, grown_radii, hemisphere_cells, overlaps
from raytracer.compiler.orthographic import meet_cells
from raytracer.compiler.surfaces import Surfaces
from raytracer.compiler.view_space import View, camera_grid, project_balls
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.flattening import simplify
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Complement, Difference, Intersection, Solid
from raytracer.scene.solids.sphere import Sphere

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
# The number of cells along each side of a hemisphere around a light.
_GRID = 112
# From this number on, no cone around a cell's corners holds the opposite pole.
_FINE = 8
# The error of a ball's distance from a ray towards a light, in float32, as a share of the distances from the camera and
# of the ray's length. It holds however near the light the ball is. (It is 32 units in the last place, for the roundings
# of the point, light, centre, direction and moment.)
ROUNDING_GROWTH = 2.0**-19
# The largest distance for which ROUNDING_GROWTH holds, in typical distances of balls from the light, and in distances
# of the camera from the light. No cell beyond both counts as plane-only.
_REACH, _AWAY = 128.0, 4.0
# The typical distance is the median of a sample of at least this many balls: its last digits do not matter.
_SAMPLED = 256
# The average number of cells around a light in which a ball may be listed only because of the light's radius. With
# smaller cells, neighbouring cells would have equal lists.
_LISTED_FOR_RADIUS = 16.0


def corner_rays(camera: Camera, size: tuple[int, int], part: Part) -> Array:
    """Return the directions through the corners of cells (rows + 1, columns + 1, 3), in view space, z = -1.

    The cells are in a `part` of a picture of `size`, in pixels. For an orthographic camera, x and y are the
    places of the corners.
    """
    corner, step, _ = camera_grid(camera, size)
    left, low, columns, rows = cells_in(part)
    # The last row and column of cells end with the picture.
    x = np.minimum(corner[0] + step * np.arange(left, left + columns + 1), -corner[0])
    y = np.minimum(corner[1] + step * np.arange(low, low + rows + 1), -corner[1])
    return np.stack(np.broadcast_arrays(x, y[:, None], -1.0), axis=-1)


def occupied_cells(view: View, solids: Sequence[Solid], size: tuple[int, int], part: Part) -> Mask:
    """Find the cells (rows, columns) in a part of a picture in which objects other than half-spaces may be seen.

    For scenes of few primitives.
    """
    rays = corner_rays(view.camera, size, part)
    centers, radii = view.centers, view.surfaces.radii
    corner, step, shape = camera_grid(view.camera, size)
    cells = cells_in(part)
    pairs = overlaps(*project_balls(view.camera, centers, radii), corner, (step, step), shape, part=cells)
    around = corners(rays).reshape(4, -1, 3)[:, pairs[0]]
    if view.camera.projection == "orthographic":
        is_met = meet_cells(around, centers[pairs[1]], radii[pairs[1]])
        kept = pairs[0][is_met], pairs[1][is_met]
    else:
        kept = _keep_in_cone(pairs, around, centers, radii)
    columns, rows = cells[2:]
    return _find_occupied(solids, *kept, view.surfaces, columns * rows).reshape(rows, columns)


def occupied_cells_of_light(view: View, solids: Sequence[Solid], light: PointLight) -> Mask:
    """Find the occupied cells around a light, for shadowed_cells(). For scenes of few primitives."""
    centers, radii = view.centers, view.surfaces.radii
    place = view.place(light.position)
    grid = int(min(_GRID, finest_grid(place, light.radius, centers)))
    wide = radii + ball_growth(longest_bounded_ray(place, centers, radii), light.radius)
    pairs = hemisphere_cells(centers - place, wide, grid)
    if grid >= _FINE:
        pairs = _keep_in_cone(pairs, _cell_corners(pairs[0], grid), centers - place, wide)
    return _find_occupied(solids, *pairs, view.surfaces, 2 * grid * grid)


def longest_bounded_ray(light: Array, centers: Array, radii: Array) -> float:
    """Return the length of rays to a light up to which ROUNDING_GROWTH bounds their error."""
    if not len(radii):
        return 0.0
    some = slice(None, None, 1 + len(radii) // _SAMPLED)
    far = np.sort(_distances(centers[some], light) + radii[some])
    # The median. np.median() would import numpy.ma, which takes longer than this function.
    typical = float(far[(len(far) - 1) // 2] + far[len(far) // 2]) / 2.0
    return max(_REACH * typical, _AWAY * float(np.linalg.norm(light)))


def ball_growth(far: float, radius: float) -> float:
    """Return the amount by which balls must grow so that the ray to a light's centre stands for all rays to the light.

    If any ray from a point to the light meets a ball, the ray to the centre then meets the grown ball. `far` is the
    largest length of rays, by longest_bounded_ray(). At one share of their lengths, the two rays are no further apart
    than their ends: at most `radius`.
    """
    return radius * (1.0 + MARGIN) + rounding_growth(far, radius)


def rounding_growth(far: float, radius: float) -> float:
    """Return the amount by which balls must grow because of rounding, the second term of ball_growth().

    `far` is the largest length of rays. If the light has a `radius`, rays aim beside its centre, with twice the error.
    """
    return ROUNDING_GROWTH * far * (2.0 if radius else 1.0)


def finest_grid(light: Array, radius: float, centers: Array) -> float:
    """Return the largest useful number of cells along each side of a hemisphere around a light; at least 1.

    It follows from the share of all directions in which balls are listed only because of the light's radius.
    """
    if not radius or not len(centers):
        return math.inf
    distance = np.maximum(_distances(centers, light), radius)
    share = float(np.mean((radius / distance) ** 2)) / 4.0
    return max(1.0, math.sqrt(_LISTED_FOR_RADIUS / (0.5 * math.pi * share))) if share else math.inf


def _distances(points: Array, place: Array) -> Array:
    """Return the distances of points (N, 3) from a place (3,)."""
    x, y, z = (points - place).T
    return np.sqrt(x * x + y * y + z * z)


def _possible_cells(solid: Solid, spheres: Iterator[Mask], bodies: Iterator[Mask]) -> Mask:
    """Return the cells in which rays may meet a tree, from the cells of its spheres and its bodies, in their order."""
    stack: list[Mask] = []
    for node in simplify(solid):
        match node:
            case Sphere():
                stack.append(next(spheres))
            case Placed():
                stack.append(next(bodies))
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


def _find_occupied(
    solids: Sequence[Solid], cell: NDArray[np.int64], ball: NDArray[np.int64], surfaces: Surfaces, cells: int
) -> Mask:
    """Return the cells (cells,) in which a ray may meet an object other than a half-space.

    `cell` and `ball` are the pairs of a cell and a ball in it.
    """
    inside = np.zeros((surfaces.bounded, cells), bool)
    inside[ball, cell] = True
    spheres, bodies = iter(inside[: surfaces.spheres]), iter(inside[surfaces.spheres :])
    occupied = np.zeros(cells, bool)
    for solid in solids:
        if not isinstance(solid, Plane):
            occupied |= _possible_cells(solid, spheres, bodies)
    return occupied


def _keep_in_cone(
    pairs: tuple[NDArray[np.int64], NDArray[np.int64]], corners: Array, centers: Array, radii: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Keep the pairs of a cell and a sphere in which the sphere's cone meets the cone around the cell.

    `corners` (4, pairs, 3) are the directions of the cells' corners. A cone of at most a right angle to its axis,
    dot(d, axis) >= cos |d| with cos >= 0, that holds two directions also holds their sum. So a cone that holds the
    corners of a cell of the picture holds the cell. For cells around a light see _cell_corners(). This does not hold
    for a wider cone, so its pairs are kept.
    """
    cell, sphere = pairs
    centers, radii = centers[sphere], grown_radii(centers, radii)[sphere]
    axis = (corners / np.linalg.norm(corners, axis=-1, keepdims=True)).sum(axis=0)
    around = _angles(corners, axis).max(axis=0)
    distance = np.linalg.norm(centers, axis=1)
    half = np.arcsin(np.minimum(radii / np.where(distance > 0.0, distance, 1.0), 1.0))
    apart = _angles(axis, centers) > (around + half) * (1.0 + MARGIN)
    keep = ~apart | (around >= math.pi / 2.0 * (1.0 - MARGIN)) | (distance <= radii)
    return cell[keep], sphere[keep]


def _angles(a: Array, b: Array) -> Array:
    """Return the angles between directions. The cross product keeps the bits of their small parts in a narrow view."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))


def _cell_corners(cell: NDArray[np.int64], grid: int) -> Array:
    """Return the directions to the corners (4, N, 3) of N cells around a light; hemisphere_cells() numbers the cells.

    The projection maps a cone without the opposite pole to a disc, so a cone that holds a cell's corners holds the
    cell.
    """
    face, place = np.divmod(cell, grid * grid)
    row, column = np.divmod(place, grid)
    lines = np.linspace(-1.0, 1.0, grid + 1)
    x = lines[np.stack([column, column + 1, column, column + 1])]
    y = lines[np.stack([row, row, row + 1, row + 1])]
    return np.stack([2.0 * x, 2.0 * y, (1.0 - x * x - y * y) * (1.0 - 2.0 * face)], axis=-1)


def corners(values: Array) -> Array:
    """Return the values at the four corners of each cell (4, rows, columns, ...)."""
    return np.stack([values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]])
