"""The paraboloid of revolution with one end."""

from __future__ import annotations

import math

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3, number, set_fields
from raytracer.core.vectors import dot, scale_by, sub
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.body import Body, Slab, Wall
from raytracer.scene.solids.checks import RADIUS, check_material, check_place
from raytracer.scene.solids.forms import form, frame
from raytracer.scene.solids.frustum import check_ends, frustum_corners, frustum_slab
from raytracer.scene.solids.limits import ROUNDING


@public
class Paraboloid(Body, frozen=True, repr_omit_defaults=True):
    """A solid paraboloid of revolution with a plane end. Raises InputError for a wrong value.

    At the distance z from `top` along the axis, its radius is radius sqrt(z / height). Rounding errors are those of a
    ball with the radius radius^2 / (2 height), which the surface has at `top`.

    Args:
        base: the centre of the end, three numbers within +-1e12.
        top: the vertex, 1e-12 or more from `base`.
        radius: the radius at `base`. Range: 1e-12 to 1e12, and radius^2 / height from 1e-12 to 1e12.
        material: the material of its surface. Default: Material().
    """

    base: Vec3
    top: Vec3
    radius: float
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        base, top = check_ends(self.base, self.top)
        radius = number(self.radius, "radius", MIN_RADIUS, MAX_LENGTH, RADIUS)
        set_fields(self, base=base, top=top, radius=radius)
        if not MIN_RADIUS <= self._parameter() <= MAX_LENGTH:
            expected = f"a radius with radius^2 / height in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"
            raise InputError(f"expected {expected}, got {format_value(radius)}", "radius")

    def _parameter(self) -> float:
        """Return the squared radius for each unit of distance from the vertex."""
        return self.radius * (self.radius / math.dist(self.base, self.top))

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        u, v, _ = frame(sub(self.top, self.base))
        aside = math.hypot(dot(u, direction), dot(v, direction))
        axis = sub(self.base, self.top)
        inwards, height = -dot(axis, direction), math.hypot(*axis)
        # The curve's point with this normal has the radius parameter aside / (2 steep).
        steep = inwards / height
        if 2.0 * steep * self.radius <= self._parameter() * aside:
            return dot(direction, self.base) + self.radius * aside
        return dot(direction, self.top) + 0.25 * self._parameter() * aside * (aside / steep)

    def reach(self) -> float:
        """Return the radius of a ball that holds the primitive, around the mean of the corners."""
        return max(math.dist(self._middle(), self.top), math.hypot(math.dist(self._middle(), self.base), self.radius))

    def _middle(self) -> Vec3:
        x, y, z = ((a + b) / 2.0 for a, b in zip(self.base, self.top, strict=True))
        return x, y, z

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of a frustum of a pyramid around the paraboloid: its sides touch the edge of the end."""
        return frustum_corners(self.base, self.top, self.radius, self.radius / 2.0)

    def slabs(self) -> tuple[Slab, ...]:
        """Return the end."""
        normal, low, high = frustum_slab(self.base, self.top)
        rises = dot(normal, self.top) > dot(normal, self.base)
        return (Slab(normal, low, math.inf) if rises else Slab(normal, -math.inf, high),)

    def wall(self) -> Wall:
        """Return the curved surface, in lengths: |(l1, l2)|^2 <= l0^2 - l3^2, which is the squared radius there.

        Paraboloids of one curved surface have equal forms, up to rounding, wherever they end.
        """
        u, v, w = frame(sub(self.top, self.base))
        inwards = scale_by(w, 0.5 if dot(w, self.base) > dot(w, self.top) else -0.5)
        x, y, z, c = form(inwards, self.top)
        half = self._parameter() / 2.0
        return Wall("cone", ((x, y, z, c + half), form(u, self.top), form(v, self.top), (x, y, z, c - half)))

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        point = check_place(point)
        u, v, w = frame(sub(self.top, self.base))
        height, offset = math.dist(self.base, self.top), sub(point, self.top)
        along = dot(w, offset) * math.copysign(1.0, dot(w, sub(self.base, self.top)))
        aside, parameter = math.hypot(dot(u, offset), dot(v, offset)), self._parameter()
        # The distance from the curved surface to first order: its equation by the length of the gradient.
        side = (aside * aside - parameter * along) / math.hypot(2.0 * aside, parameter)
        largest = max(map(abs, (*self.base, *self.top, *point, self.radius)))
        return abs(max(side, along - height)) <= ROUNDING * largest + error
