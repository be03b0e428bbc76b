"""The camera: its position, direction of view and angle of view."""

from __future__ import annotations

import math

from raytracer.core.record import Record, public
from raytracer.core.validation import InputError, Vec3, direction, number, point, set_fields
from raytracer.core.vectors import cross, divide_by, dot, scale_by, sub

# The smallest accepted sine of the angle between `up` and the direction of view. At smaller angles the rounding of the
# input decides in which direction the picture's "right" points.
MIN_UP_ANGLE = 1e-8


@public
class Camera(Record, frozen=True):
    """A pinhole camera.

    Args:
        position: the position of the pinhole.
        look_at: the point in the centre of the picture. It must differ from `position`.
        up: the direction that points upwards in the picture, of any length. It must not be parallel to the direction
            of view. Default: (0, 1, 0).
        vertical_fov: the vertical angle of view, in degrees. Range: above 0, below 180. Default: 53.13.

    Raises:
        InputError: a wrong value.
    """

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
        """Return the picture's axes (right, up, forward) as unit vectors in world space.

        The vectors right, up and -forward form a right-handed system.
        """
        forward = sub(self.look_at, self.position)
        distance = math.hypot(*forward)
        if distance == 0.0:
            raise InputError(f"expected a point other than position, got {self.look_at}", "look_at")
        forward = divide_by(forward, distance)
        right = cross(forward, divide_by(self.up, math.hypot(*self.up)))
        sine = math.hypot(*right)
        if sine < MIN_UP_ANGLE:
            raise InputError(f"expected a direction not parallel to the view, got {self.up}", "up")
        # A short cross product has a large relative rounding error: remove its component along `forward`.
        right = divide_by(right, sine)
        right = sub(right, scale_by(forward, dot(right, forward)))
        right = divide_by(right, math.hypot(*right))
        return right, cross(right, forward), forward
