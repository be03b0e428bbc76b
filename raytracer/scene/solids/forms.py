"""Parts of the descriptions of primitives: corners of boxes, frames of axes, and walls."""

from __future__ import annotations

import math

from raytracer.core.validation import Vec3
from raytracer.core.vectors import cross, divide_by, dot, scale_by
from raytracer.scene.solids.affine import Row
from raytracer.scene.solids.body import Wall

# Components of an axis below this part of the largest one count as 0 for its sign: rounding makes such components.
_IS_ZERO = 1e-6
# The largest component of a unit vector along the coordinate axis that its frame is made with. At least one is smaller:
# the smallest one is at most 0.577. No usual direction, such as (3, 4, 0) / 5, has a component of this value.
_ASIDE = 0.61


def box_corners(low: Vec3, high: Vec3) -> tuple[Vec3, ...]:
    """Return the corners of a box, in the order of Primitive.corners()."""
    sides = tuple(zip(low, high, strict=True))
    return tuple((sides[0][i & 1], sides[1][i >> 1 & 1], sides[2][i >> 2]) for i in range(8))


def frame(axis: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return right-handed unit vectors u, v, w: w is along `axis` or its opposite, so that both give equal bits.

    The vectors depend continuously on nearly every axis, and next to every axis along x, y or z.
    """
    largest = max(map(abs, axis))
    length = math.copysign(math.hypot(*axis), next(c for c in axis if abs(c) > _IS_ZERO * largest))
    w = _positive_zeros(divide_by(axis, length))
    aside = next(i for i in range(3) if abs(w[i]) < _ASIDE)
    u = cross((float(aside == 0), float(aside == 1), float(aside == 2)), w)
    u = _positive_zeros(divide_by(u, math.hypot(*u)))
    return u, _positive_zeros(cross(w, u)), w


def _positive_zeros(vector: Vec3) -> Vec3:
    return vector[0] + 0.0, vector[1] + 0.0, vector[2] + 0.0


def form(normal: Vec3, center: Vec3) -> Row:
    """Return the affine form dot(normal, x - center)."""
    return (*normal, 0.0 - dot(normal, center))


def ellipsoid_wall(center: Vec3, radii: Vec3) -> Wall:
    """Return the surface of an ellipsoid with axes along x, y and z."""
    axes = [scale_by((float(i == 0), float(i == 1), float(i == 2)), 1.0 / radii[i]) for i in range(3)]
    x, y, z = (form(axis, center) for axis in axes)
    return Wall("round", ((0.0, 0.0, 0.0, 1.0), x, y, z))
