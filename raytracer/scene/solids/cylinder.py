"""The circular cylinder with two ends."""

from __future__ import annotations

import math

from raytracer.core.record import public
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, Vec3, number, set_fields
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.body import Body, Slab, Wall
from raytracer.scene.solids.checks import RADIUS, check_material
from raytracer.scene.solids.frustum import (
    check_ends,
    frustum_corners,
    frustum_slab,
    frustum_support,
    frustum_wall,
    touches_frustum,
)


@public
class Cylinder(Body, frozen=True, repr_omit_defaults=True):
    """A solid circular cylinder with plane ends across its axis. Raises InputError for a wrong value.

    Args:
        base: the centre of one end, three numbers within +-1e12.
        top: the centre of the other end, 1e-12 or more from `base`.
        radius: the radius. Range: 1e-12 to 1e12.
        material: the material of its surface. Default: Material().
    """

    base: Vec3
    top: Vec3
    radius: float
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        base, top = check_ends(self.base, self.top)
        set_fields(self, base=base, top=top, radius=number(self.radius, "radius", MIN_RADIUS, MAX_LENGTH, RADIUS))

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        return frustum_support(self.base, self.top, self.radius, self.radius, direction)

    def reach(self) -> float:
        """Return the radius of a ball that holds the primitive, around its centre."""
        return math.hypot(math.dist(self.base, self.top) / 2.0, self.radius)

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of a box around the cylinder."""
        return frustum_corners(self.base, self.top, self.radius, self.radius)

    def slabs(self) -> tuple[Slab, ...]:
        """Return the ends."""
        return (frustum_slab(self.base, self.top),)

    def wall(self) -> Wall:
        """Return the side."""
        return frustum_wall(self.base, self.top, self.radius, self.radius)

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        return touches_frustum(self.base, self.top, self.radius, self.radius, point, error)
