"""The ring torus."""

from __future__ import annotations

import math

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3, direction, number, point, set_fields
from raytracer.core.vectors import add, divide_by, dot, scale_by, sub
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.affine import IDENTITY, Map
from raytracer.scene.solids.body import Body, Placed, Wall
from raytracer.scene.solids.checks import RADIUS, check_material, check_place
from raytracer.scene.solids.forms import box_corners, form, frame
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.solid import Primitive, Union


@public
class Torus(Body, frozen=True, repr_omit_defaults=True):
    """A solid ring: all points within `minor_radius` of a circle. Raises InputError for a wrong value.

    Args:
        center: the centre of the circle, three numbers within +-1e12.
        axis: the direction across the plane of the circle, of any length but 0.
        major_radius: the radius of the circle. Range: 1e-12 to 1e12.
        minor_radius: the radius of the tube. Range: 1e-12 to 1e12, and below `major_radius`.
        material: the material of its surface. Default: Material().
    """

    center: Vec3
    axis: Vec3
    major_radius: float
    minor_radius: float
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        center, axis = point(self.center, "center"), direction(self.axis, "axis")
        major = number(self.major_radius, "major_radius", MIN_RADIUS, MAX_LENGTH, RADIUS)
        minor = number(self.minor_radius, "minor_radius", MIN_RADIUS, MAX_LENGTH, RADIUS)
        if minor >= major:
            expected = f"a number below major_radius, {format_value(major)}"
            raise InputError(f"expected {expected}, got {format_value(minor)}", "minor_radius")
        set_fields(self, center=center, axis=axis, major_radius=major, minor_radius=minor)

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return the union of the first and the second interval of a ray in the torus, under a map."""
        first, second = (Placed(self, matrix or IDENTITY, part) for part in (0, 1))
        return [first, second, Union(first, second)]

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        u, v, _ = frame(self.axis)
        aside = math.hypot(dot(u, direction), dot(v, direction))
        return dot(direction, self.center) + self.major_radius * aside + self.minor_radius * math.hypot(*direction)

    def reach(self) -> float:
        """Return the radius of a ball that holds the primitive, around its centre."""
        return self.major_radius + self.minor_radius

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of the box around the torus with two sides across the axis."""
        outer = self.major_radius + self.minor_radius
        axes = frame(self.axis)
        half = (outer, outer, self.minor_radius)
        return tuple(
            add(self.center, _combine(axes, corner)) for corner in box_corners((-half[0], -half[1], -half[2]), half)
        )

    def wall(self) -> Wall:
        """Return the surface."""
        x, y, z = (form(divide_by(side, self.major_radius), self.center) for side in frame(self.axis))
        return Wall("torus", ((0.0, 0.0, 0.0, self.minor_radius / self.major_radius), x, y, z))

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        point = check_place(point)
        x, y, z = (dot(side, sub(point, self.center)) for side in frame(self.axis))
        distance = math.hypot(math.hypot(x, y) - self.major_radius, z) - self.minor_radius
        return abs(distance) <= ROUNDING * max(map(abs, (*self.center, *point, self.major_radius))) + error


def _combine(axes: tuple[Vec3, Vec3, Vec3], factors: Vec3) -> Vec3:
    u, v, w = (scale_by(axis, factor) for axis, factor in zip(axes, factors, strict=True))
    return add(add(u, v), w)
