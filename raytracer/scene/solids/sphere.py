"""The ball."""

from __future__ import annotations

import math

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3, number, point, set_fields
from raytracer.core.vectors import dot
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import affine
from raytracer.scene.solids.affine import Map
from raytracer.scene.solids.body import Body, Placed, Wall
from raytracer.scene.solids.checks import RADIUS, check_material, check_place
from raytracer.scene.solids.forms import box_corners, ellipsoid_wall
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.solid import Primitive, Union


def _square(x: float) -> tuple[float, float]:
    """Return x^2 as a float, and the exact rounding error of it (Dekker 1971, with Veltkamp's splitting)."""
    high = x * 134217729.0 - (x * 134217729.0 - x)  # 2^27 + 1: the upper half of x's bits
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low


@public
class Sphere(Body, frozen=True, repr_omit_defaults=True):
    """A solid ball. Raises InputError for a wrong value.

    Args:
        center: the centre, three numbers within +-1e12.
        radius: the radius. Range: 1e-12 to 1e12.
        material: the material of its surface. Default: Material().
    """

    center: Vec3
    radius: float
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        set_fields(
            self,
            center=point(self.center, "center"),
            radius=number(self.radius, "radius", MIN_RADIUS, MAX_LENGTH, RADIUS),
        )

    def power(self, point: Vec3) -> float:
        """Return the power of a point, |center - point|^2 - radius^2, to the last bit, even next to a huge sphere."""
        parts = [-part for part in _square(self.radius)]
        for c, p in zip(self.center, check_place(point), strict=True):
            d = c - p
            # The rounding error of the subtraction (Knuth's two-sum). Its square is too small to count.
            error = (c - (d - (d - c))) - (p + (d - c))
            parts += (*_square(d), 2.0 * d * error)
        return math.fsum(parts)

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the sphere, up to rounding and an `error` of the point."""
        point = check_place(point)
        largest = max(map(abs, (*self.center, *point, self.radius)))
        return abs(math.dist(self.center, point) - self.radius) <= ROUNDING * largest + error

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return the sphere under a map: a Sphere if the map scales all lengths equally, otherwise an ellipsoid."""
        if matrix is None:
            return [self]
        factor = affine.similarity(matrix)
        if factor is None:
            return [Placed(self, matrix)]
        return [moved_sphere(affine.apply(matrix, self.center), self.radius * factor, self.material)]

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        return dot(direction, self.center) + self.radius * math.hypot(*direction)

    def reach(self) -> float:
        """Return the radius of a ball that holds the primitive, around its centre."""
        return self.radius

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of the cube around the sphere."""
        return box_corners(*self.bounds())

    def wall(self) -> Wall:
        """Return the surface."""
        return ellipsoid_wall(self.center, (self.radius, self.radius, self.radius))


def moved_sphere(center: Vec3, radius: float, material: Material) -> Sphere:
    """Return the ball that a map makes. Raises InputError about the map, not about values that no user wrote."""
    try:
        return Sphere(center, radius, material)
    except InputError:
        expected = f"moved balls with a radius in [{MIN_RADIUS:g}, {MAX_LENGTH:g}] and a centre within +-{MAX_LENGTH:g}"
        got = f"the radius {format_value(radius)} around {format_value(list(center))}"
        raise InputError(f"expected {expected}, got {got}", "transform") from None
