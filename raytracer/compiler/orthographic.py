"""Orthographic views: where their rays begin, and the shadows of balls in the picture.

The rays of an orthographic camera begin on the plane through its position, across the view, and are parallel. So the
camera may come nearer without a change of the picture, up to the first surface. View space begins there: the numbers
that the shaders round then are as small as the scene and the picture, however far away the camera is.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import MARGIN
from raytracer.compiler.surfaces import Surfaces
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera

Array = NDArray[np.float64]

# The distance between the beginning of the rays and the first surface, as a share of the lengths near there: some ten
# times the rounding error of a root in float32 (sphere.glsl), so that no root is on the wrong side of the beginning.
_CLEAR = 2.0**-16
# The margin for the rounding of a ray's origin and a ball's centre, 16 of float32's 2^-24: see grown_radii().
_SHIFT = 2.0**-20


def advance(surfaces: Surfaces, camera: Camera, size: tuple[int, int]) -> float:
    """Return the distance by which an orthographic camera may come nearer without a change of its picture.

    The picture has the `size` (width, height). The distance is 0 if nothing is visible.
    """
    assert camera.height is not None
    right, up, forward = np.array(camera.axes())
    half = np.array((camera.height * size[0] / size[1], camera.height)) / 2.0
    reach = float(np.hypot(*half))
    x, y, z = np.array((right, up, forward)) @ (surfaces.centers - camera.position).T
    radii = surfaces.radii
    # The distance of each ball's axis from the picture, by which its first visible point is nearer to its middle.
    gap = np.hypot(np.maximum(np.abs(x) - half[0], 0.0), np.maximum(np.abs(y) - half[1], 0.0))
    deep = np.sqrt(np.maximum((radii - gap) * (radii + gap), 0.0))
    is_ahead = (gap <= radii * (1.0 + MARGIN)) & (z + deep > 0.0)
    first = float((z - deep - _CLEAR * (radii + reach))[is_ahead].min(initial=np.inf))
    slopes = surfaces.normals @ forward
    depths = surfaces.offsets - surfaces.normals @ np.array(camera.position)
    tilt = np.abs(surfaces.normals @ right) * half[0] + np.abs(surfaces.normals @ up) * half[1]
    # The depth of the beginning of the middle ray before each face, which differs by up to `tilt` for other rays.
    middle = depths * np.sign(slopes)
    is_crossed = (slopes != 0.0) & (middle + tilt > 0.0)
    clear = (middle - tilt - _CLEAR * reach)[is_crossed] / np.abs(slopes[is_crossed])
    first = min(first, float(clear.min(initial=np.inf)))
    return max(first, 0.0) if math.isfinite(first) else 0.0


def advanced(camera: Camera, distance: float) -> Vec3:
    """Return the position of a camera that has come nearer by `distance`."""
    x, y, z = (p + distance * f for p, f in zip(camera.position, camera.axes()[2], strict=True))
    return x, y, z


def grown_radii(centers: Array, radii: Array, times: Array | float = 1.0) -> Array:
    """Return radii (N,) with which balls hold the balls of `radii` as an orthographic camera sees them in float32.

    `times` multiplies the growth for the rounding of places, for balls that grow faster.

    The distance p of a ray at X from the centre c is that of two points of the picture. With u = 2^-24, rounding moves
    c by u |c| and X by 3 u |X|, and |X| <= |c| + p. So a ray that meets a ball in float32 has p <= r + 4 u |c| + 8 u r
    by the first form of the discriminant in sphere.glsl, and p <= r + 8 u |c| + 32 u r by the second.
    """
    return (radii + times * _SHIFT * np.hypot(centers[:, 0], centers[:, 1])) * (1.0 + MARGIN)


def shadows(centers: Array, radii: Array) -> tuple[Array, Array]:
    """Return the smallest bounds (lo, hi), each (N, 2), of (x, y) over all rays that meet each ball in front.

    The arguments are as for tangents() of direction_cells.py, and so are the bounds of a ball that no ray can meet.
    """
    radius = grown_radii(centers, radii)[:, None]
    lo, hi = centers[:, :2] - radius, centers[:, :2] + radius
    behind = centers[:, 2] - radius[:, 0] >= 0.0
    lo[behind], hi[behind] = np.inf, -np.inf
    return lo, hi


def meet_cells(corners: Array, centers: Array, radii: Array) -> NDArray[np.bool_]:
    """Return for pairs of a cell and a ball whether the ball's shadow meets the cell (M,).

    `corners` (4, M, >= 2) are the places of the cells' corners, `centers` (M, 3) and `radii` (M,) the balls.
    """
    places = corners[..., :2]
    low, high = places.min(axis=0), places.max(axis=0)
    apart = np.maximum(np.maximum(low - centers[:, :2], centers[:, :2] - high), 0.0)
    return np.hypot(apart[:, 0], apart[:, 1]) <= grown_radii(centers, radii) * (1.0 + MARGIN)
