"""The ellipsoid with axes along x, y and z."""

from __future__ import annotations

import math

from raytracer.core.record import public
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, Vec3, point, set_fields, vector
from raytracer.core.vectors import add, dot, sub
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import affine
from raytracer.scene.solids.affine import IDENTITY, Map
from raytracer.scene.solids.body import Body, Placed, Wall
from raytracer.scene.solids.checks import check_material, check_place
from raytracer.scene.solids.forms import box_corners, ellipsoid_wall
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.solid import Primitive, Union
from raytracer.scene.solids.sphere import moved_sphere

_RADII = f"3 numbers above 0, in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"


@public
class Ellipsoid(Body, frozen=True, repr_omit_defaults=True):
    """A solid ellipsoid with axes along x, y and z. Raises InputError for a wrong value.

    Args:
        center: the centre, three numbers within +-1e12.
        radii: half the lengths of the axes, three numbers. Range: 1e-12 to 1e12.
        material: the material of its surface. Default: Material().
    """

    center: Vec3
    radii: Vec3
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        set_fields(
            self,
            center=point(self.center, "center"),
            radii=vector(self.radii, "radii", MIN_RADIUS, MAX_LENGTH, _RADII),
        )

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return the ellipsoid under a map: a Sphere if it is a ball there, up to rounding."""
        matrix = matrix or IDENTITY
        radius = affine.similarity(affine.compose(matrix, affine.scaling(self.radii)))
        if radius is None:
            return [Placed(self, matrix)]
        return [moved_sphere(affine.apply(matrix, self.center), radius, self.material)]

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        return dot(direction, self.center) + math.hypot(*(d * r for d, r in zip(direction, self.radii, strict=True)))

    def reach(self) -> float:
        """Return the radius of a ball that holds the primitive, around its centre."""
        return max(self.radii)

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of the box around the ellipsoid."""
        return box_corners(sub(self.center, self.radii), add(self.center, self.radii))

    def wall(self) -> Wall:
        """Return the surface."""
        return ellipsoid_wall(self.center, self.radii)

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        point = check_place(point)
        parts = list(zip(self.center, self.radii, point, strict=True))
        slack = max((ROUNDING * max(abs(c), r, abs(p)) + error) / r for c, r, p in parts)
        return abs(math.hypot(*((p - c) / r for c, r, p in parts)) - 1.0) <= slack
