"""Light sources: points or, with soft shadows, spheres, and their falloff with distance."""

from __future__ import annotations

import math
from typing import Literal, get_args

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Vec3,
    check_choice,
    color,
    number,
    point,
    set_fields,
)
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.sphere import Sphere

Falloff = Literal["none", "inverse_square"]
# The index of a falloff is its number in irradiance.glsl, which has the formulas. light_rays.py has them in float64.
FALLOFFS: tuple[Falloff, ...] = get_args(Falloff)


@public
class PointLight(Record, frozen=True, repr_omit_defaults=True):
    """A point light or, with soft shadows, a spherical light. The light itself is invisible.

    Args:
        position: the centre of the light.
        color: the intensity I, linear RGB, each in [0, 1e12]: the irradiance on a surface that faces the light, at
            distance 1 or, without falloff, at any distance. Default: (1, 1, 1).
        radius: the radius of the sphere, 0 for a point. Range: 0, or 1e-12 to 1e12. It counts only in pictures with
            soft shadows. Default: 0.
        falloff: "none", as in the lecture, or "inverse_square": the irradiance is I / distance^2, by the distance from
            the light's centre, at most 1e12 and inside the sphere the same as on it. Default: "none".

    Raises:
        InputError: a wrong value.
    """

    position: Vec3
    color: Vec3 = (1.0, 1.0, 1.0)
    radius: float = 0.0
    falloff: Falloff = "none"

    def __post_init__(self) -> None:
        expected = f"0, for a point, or a number in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"
        radius = number(self.radius, "radius", 0.0, MAX_LENGTH, expected)
        if 0.0 < radius < MIN_RADIUS:
            raise InputError(f"expected {expected}, got {radius:g}", "radius")
        set_fields(
            self,
            position=point(self.position, "position"),
            color=color(self.color, "color"),
            radius=radius,
            falloff=check_choice(self.falloff, "falloff", FALLOFFS, expected=" or ".join(map(repr, FALLOFFS))),
        )

    def is_bulb(self, sphere: Sphere) -> bool:
        """Whether `sphere` has the light's centre and radius, up to rounding. It does not block the light."""
        if not isinstance(sphere, Sphere):
            raise InputError(f"expected a Sphere, got {format_value(sphere)}", "sphere")
        largest = max(map(abs, (*sphere.center, *self.position, self.radius)))
        difference = max(math.dist(sphere.center, self.position), abs(sphere.radius - self.radius))
        return difference <= ROUNDING * largest
