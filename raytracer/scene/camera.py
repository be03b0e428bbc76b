"""The camera: where it stands, and which way the picture's axes point.

Part of `scene.py`, whose docstring says what holds for all values of a scene.
"""

from __future__ import annotations

import math

from raytracer.core.record import Record, public
from raytracer.core.validation import InputError, Vec3, direction, number, point, set_fields
from raytracer.core.vectors import cross, divided, dot, scaled, sub

# Sine of the angle between `up` and the view below which rounding of the given numbers decides
# where "right" points.
MIN_UP_ANGLE = 1e-8


@public
class Camera(Record, frozen=True):
    """A pinhole camera. `vertical_fov` is in degrees, in (0, 180); `up` need not be a unit vector."""

    position: Vec3
    look_at: Vec3
    up: Vec3 = (0.0, 1.0, 0.0)
    vertical_fov: float = 53.13

    def __post_init__(self) -> None:
        fov = number(self.vertical_fov, "vertical_fov", expected="degrees in (0, 180)")
        if not 0.0 < fov < 180.0:
            raise InputError(f"expected degrees in (0, 180), got {fov:g}", "vertical_fov")
        set_fields(
            self,
            position=point(self.position, "position"),
            look_at=point(self.look_at, "look_at"),
            up=direction(self.up, "up"),
            vertical_fov=fov,
        )
        self.axes()

    def axes(self) -> tuple[Vec3, Vec3, Vec3]:
        """Unit vectors right, up, forward of the picture, in world space (right-handed: back = -forward)."""
        forward = sub(self.look_at, self.position)
        distance = math.hypot(*forward)
        if distance == 0.0:
            raise InputError(f"expected a point other than position, got {self.look_at}", "look_at")
        forward = divided(forward, distance)
        right = cross(forward, divided(self.up, math.hypot(*self.up)))
        sine = math.hypot(*right)
        if sine < MIN_UP_ANGLE:
            raise InputError(f"expected a direction not parallel to the view, got {self.up}", "up")
        # The shorter the product, the larger its rounding: take out the rest along `forward`.
        right = divided(right, sine)
        right = sub(right, scaled(forward, dot(right, forward)))
        right = divided(right, math.hypot(*right))
        return right, cross(right, forward), forward
