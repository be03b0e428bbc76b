"""The box with faces across the axes."""

from __future__ import annotations

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MIN_RADIUS, InputError, Vec3, point, set_fields
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.body import Body, Slab
from raytracer.scene.solids.checks import check_material, check_place
from raytracer.scene.solids.forms import box_corners
from raytracer.scene.solids.limits import ROUNDING


@public
class Box(Body, frozen=True, repr_omit_defaults=True):
    """A solid box with faces across the axes. Raises InputError for a wrong value.

    Args:
        min: the corner with the smallest coordinates, three numbers within +-1e12.
        max: the corner with the largest coordinates, each larger than that of `min` by 1e-12 or more.
        material: the material of its surface. Default: Material().
    """

    min: Vec3
    max: Vec3
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        low, high = point(self.min, "min"), point(self.max, "max")
        if any(b - a < MIN_RADIUS for a, b in zip(low, high, strict=True)):
            expected = f"3 numbers above those of min, {format_value(list(low))}, by {MIN_RADIUS:g} or more"
            raise InputError(f"expected {expected}, got {format_value(list(high))}", "max")
        set_fields(self, min=low, max=high)

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        return sum(max(d * a, d * b) for d, a, b in zip(direction, self.min, self.max, strict=True))

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners."""
        return box_corners(self.min, self.max)

    def slabs(self) -> tuple[Slab, ...]:
        """Return the six faces."""
        axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
        return tuple(map(Slab, axes, self.min, self.max))

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        point = check_place(point)
        slack = ROUNDING * max(map(abs, (*self.min, *self.max, *point))) + error
        sides = [(a - p, p - b) for p, a, b in zip(point, self.min, self.max, strict=True)]
        return abs(max(map(max, sides))) <= slack
