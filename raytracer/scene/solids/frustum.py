"""The frustum of a circular cone, of which a cylinder is the case of equal radii: faces, corners and support.

A frustum has the ends `base` and `top`, the centres of two disks across the axis, and their radii.
"""

from __future__ import annotations

import math

from raytracer.core.shown import format_value
from raytracer.core.validation import MIN_RADIUS, InputError, Vec3, point
from raytracer.core.vectors import add, dot, scale_by, sub
from raytracer.scene.solids.body import Slab, Wall
from raytracer.scene.solids.checks import check_place
from raytracer.scene.solids.forms import form, frame
from raytracer.scene.solids.limits import ROUNDING


def check_ends(base: Vec3, top: Vec3) -> tuple[Vec3, Vec3]:
    """Return the ends of an axis as points. Raises InputError, also for ends less than 1e-12 apart."""
    base, top = point(base, "base"), point(top, "top")
    if math.dist(base, top) < MIN_RADIUS:
        raise InputError(f"expected a point {MIN_RADIUS:g} or more from base, got {format_value(list(top))}", "top")
    return base, top


def frustum_slab(base: Vec3, top: Vec3) -> Slab:
    """Return the two disks. Exchanged ends give equal bits."""
    w = frame(sub(top, base))[2]
    return Slab(w, *sorted((dot(w, base), dot(w, top))))


def frustum_wall(base: Vec3, top: Vec3, base_radius: float, top_radius: float) -> Wall:
    """Return the side, in lengths: |(l1, l2)| is the distance from the axis, and l0 the radius there.

    Frustums of one cone have equal forms, up to rounding. Exchanged ends give equal bits.
    """
    u, v, w = frame(sub(top, base))
    # The end next to the origin has the smallest rounding errors.
    center = min((base, top), key=lambda end: (math.hypot(*end), end))
    sides = form(u, center), form(v, center), (0.0, 0.0, 0.0, 0.0)
    if base_radius == top_radius:
        return Wall("round", ((0.0, 0.0, 0.0, base_radius), *sides))
    (low, low_radius), (high, high_radius) = sorted(((dot(w, base), base_radius), (dot(w, top), top_radius)))
    slope = (high_radius - low_radius) / (high - low)
    at_origin = (low_radius * high - high_radius * low) / (high - low)
    return Wall("cone", ((*_scaled(w, slope), at_origin), *sides))


def _scaled(w: Vec3, slope: float) -> Vec3:
    x, y, z = scale_by(w, slope)
    return x + 0.0, y + 0.0, z + 0.0


def frustum_support(base: Vec3, top: Vec3, base_radius: float, top_radius: float, direction: Vec3) -> float:
    """Return the largest dot(direction, x) of all points x."""
    u, v, _ = frame(sub(top, base))
    aside = math.hypot(dot(u, direction), dot(v, direction))
    return max(dot(direction, base) + base_radius * aside, dot(direction, top) + top_radius * aside)


def frustum_corners(base: Vec3, top: Vec3, base_radius: float, top_radius: float) -> tuple[Vec3, ...]:
    """Return the corners of the squares around both disks, in the order of Primitive.corners()."""
    u, v, _ = frame(sub(top, base))
    return tuple(
        add(center, add(scale_by(u, x * radius), scale_by(v, y * radius)))
        for center, radius in ((base, base_radius), (top, top_radius))
        for y in (-1.0, 1.0)
        for x in (-1.0, 1.0)
    )


def touches_frustum(base: Vec3, top: Vec3, base_radius: float, top_radius: float, place: Vec3, error: float) -> bool:
    """Whether `place` lies on the surface, up to rounding and an `error` of the point."""
    place = check_place(place)
    u, v, w = frame(sub(top, base))
    length = math.dist(base, top)
    center = scale_by(add(base, top), 0.5)
    offset = sub(place, center)
    height = math.copysign(1.0, dot(w, sub(top, base))) * dot(w, offset)
    radius = 0.5 * (base_radius + top_radius) + (top_radius - base_radius) * (height / length)
    # The distance across the side, not across the axis, so that rounding counts as much for flat cones.
    outside = math.hypot(dot(u, offset), dot(v, offset)) - radius
    side = outside * (length / math.hypot(length, top_radius - base_radius))
    largest = max(map(abs, (*base, *top, *place, base_radius, top_radius)))
    return abs(max(side, abs(height) - 0.5 * length)) <= ROUNDING * largest + error
