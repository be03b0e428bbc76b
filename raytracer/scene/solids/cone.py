"""The circular cone and its frustum."""

from __future__ import annotations

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3, number, set_fields
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.body import Body, Slab, Wall
from raytracer.scene.solids.checks import check_material
from raytracer.scene.solids.frustum import (
    check_ends,
    frustum_corners,
    frustum_slab,
    frustum_support,
    frustum_wall,
    touches_frustum,
)

_RADIUS = f"0, or a number in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"


@public
class Cone(Body, frozen=True, repr_omit_defaults=True):
    """A solid circular cone, or its frustum, with plane ends across its axis. Raises InputError for a wrong value.

    Args:
        base: the centre of one end, three numbers within +-1e12.
        top: the centre of the other end, 1e-12 or more from `base`.
        base_radius: the radius at `base`. Range: 0, or 1e-12 to 1e12.
        top_radius: the radius at `top`. Range: 0, or 1e-12 to 1e12, not both radii 0.
        material: the material of its surface. Default: Material().
    """

    base: Vec3
    top: Vec3
    base_radius: float
    top_radius: float
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        base, top = check_ends(self.base, self.top)
        base_radius, top_radius = _radius(self.base_radius, "base_radius"), _radius(self.top_radius, "top_radius")
        if base_radius == top_radius == 0.0:
            raise InputError("expected a radius above 0 at base or at top, got 0 at both", "top_radius")
        set_fields(self, base=base, top=top, base_radius=base_radius, top_radius=top_radius)

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        return frustum_support(self.base, self.top, self.base_radius, self.top_radius, direction)

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of a frustum of a pyramid around the cone."""
        return frustum_corners(self.base, self.top, self.base_radius, self.top_radius)

    def slabs(self) -> tuple[Slab, ...]:
        """Return the ends."""
        return (frustum_slab(self.base, self.top),)

    def wall(self) -> Wall:
        """Return the side."""
        return frustum_wall(self.base, self.top, self.base_radius, self.top_radius)

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        return touches_frustum(self.base, self.top, self.base_radius, self.top_radius, point, error)


def _radius(value: float, key: str) -> float:
    radius = number(value, key, 0.0, MAX_LENGTH, _RADIUS) + 0.0
    if 0.0 < radius < MIN_RADIUS:
        raise InputError(f"expected {_RADIUS}, got {format_value(value)}", key)
    return radius
