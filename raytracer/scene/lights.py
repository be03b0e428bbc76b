"""Lights: points, and under soft shadows spheres, and how their light falls off with distance.

Part of `scene.py`, whose docstring says what holds for all values of a scene.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

from raytracer.core.record import Record, public
from raytracer.core.shown import shown
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
from raytracer.scene.solids import ROUNDING, Sphere

Falloff = Literal["none", "inverse_square"]
# The place of a falloff here is its number in irradiance.glsl, which has its formula; light_rays.py has it in float64.
FALLOFFS: tuple[Falloff, ...] = get_args(Falloff)


@public
class PointLight(Record, frozen=True, repr_omit_defaults=True):
    """A light at `position`: a point, or under soft shadows a sphere of `radius`, which nobody sees itself.

    `color` is I, the irradiance on a surface that faces it: at any distance where `falloff` is "none", as in the
    lecture; I / distance^2, of the centre, where that is "inverse_square", though never more than 1e12, as colours
    are, and inside the sphere as on it. `radius` is 0 or in [1e-12, 1e12].
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
        """Whether `sphere` is this light's own, to the rounding of the numbers that are given."""
        if not isinstance(sphere, Sphere):
            raise InputError(f"expected a Sphere, got {shown(sphere)}", "sphere")
        largest = max(map(abs, (*sphere.center, *self.position, self.radius)))
        off = max(math.dist(sphere.center, self.position), abs(sphere.radius - self.radius))
        return off <= ROUNDING * largest
