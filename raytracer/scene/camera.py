"""The camera: its position, direction of view and projection."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, get_args

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Vec3,
    check_choice,
    items,
    number,
    point,
    set_fields,
)
from raytracer.core.validation import direction as check_direction
from raytracer.core.vectors import cross, divide_by, dot, scale_by, sub
from raytracer.scene.framing import bounding_ball
from raytracer.scene.instances import Instances
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.solid import Solid

if TYPE_CHECKING:
    from raytracer.scene.scene import Scene

# The rays of a picture start at one point, or they are parallel.
Projection = Literal["perspective", "orthographic"]

# The smallest accepted sine of the angle between `up` and the direction of view. At smaller angles the rounding of the
# input decides in which direction the picture's "right" points.
MIN_UP_ANGLE = 1e-8
# The direction of view of a framing camera: from above, from the right and from the front. It shows three faces of a
# box, with different angles, so that edges do not coincide in the picture.
VIEW_DIRECTION = (-1.0, -1.0, -2.0)
# The angle of view of a framing camera, in degrees. It is narrower than the default of a camera, because a whole solid
# looks distorted from nearby.
FRAMING_FOV = 30.0


@public
class Camera(Record, frozen=True, repr_omit_defaults=True):
    """A camera. In perspective, all rays start at its position. An orthographic camera has parallel rays.

    Args:
        position: the position of the camera. An orthographic camera sees only what is in front of the plane through
            its position, across the view.
        look_at: the point in the centre of the picture. It must differ from `position`.
        up: the direction that points upwards in the picture, of any length. It must not be parallel to the direction
            of view. Default: (0, 1, 0).
        vertical_fov: the vertical angle of view, in degrees. An orthographic camera ignores it. Range: above 0, below
            180. Default: 53.13.
        projection: "perspective" or "orthographic". Default: "perspective".
        height: the height of the picture of an orthographic camera, in the scene's unit; None for perspective. Range:
            1e-12 to 1e12. Default: None.

    Raises:
        InputError: a wrong value.
    """

    position: Vec3
    look_at: Vec3
    up: Vec3 = (0.0, 1.0, 0.0)
    vertical_fov: float = 53.13
    projection: Projection = "perspective"
    height: float | None = None

    def __post_init__(self) -> None:
        fov = number(self.vertical_fov, "vertical_fov", expected="degrees in (0, 180)")
        if not 0.0 < fov < 180.0:
            raise InputError(f"expected degrees in (0, 180), got {fov:g}", "vertical_fov")
        projection = check_choice(self.projection, "projection", get_args(Projection))
        height = self.height
        if projection == "orthographic":
            expected = f"the picture's height, in [{MIN_RADIUS:g}, {MAX_LENGTH:g}], for an orthographic camera"
            if height is None:
                raise InputError(f"missing; expected {expected}", "height")
            height = number(height, "height", MIN_RADIUS, MAX_LENGTH, expected)
        elif height is not None:
            expected = 'no height without projection = "orthographic"'
            raise InputError(f"expected {expected}, got {format_value(height)}", "height")
        set_fields(
            self,
            position=point(self.position, "position"),
            look_at=point(self.look_at, "look_at"),
            up=check_direction(self.up, "up"),
            vertical_fov=fov,
            projection=projection,
            height=height,
        )
        self.axes()

    @staticmethod
    def framing(
        scene: Scene | Solid | Instances | Sequence[Solid | Instances],
        direction: Vec3 = VIEW_DIRECTION,
        *,
        up: Vec3 = (0.0, 1.0, 0.0),
        vertical_fov: float = FRAMING_FOV,
        projection: Projection = "perspective",
        aspect: float = 1.0,
    ) -> Camera:
        """Return a camera that looks at the objects of a scene, so that their bounding ball just fits into the picture.

        The ball is around all objects with bounds. An object without bounds, such as a half-space, does not count.

        Args:
            scene: a scene, a solid, or any number of solids and Instances.
            direction: the direction of view, of any length. Default: (-1, -1, -2), from above, from the right and
                from the front.
            up: as for Camera. Default: (0, 1, 0).
            vertical_fov: as for Camera, for perspective. Default: 30.
            projection: as for Camera. Default: "perspective".
            aspect: the picture's width over its height. The ball fits into any picture that is at least so wide. Above
                0. Default: 1.

        Raises:
            InputError: a wrong value, or no object has bounds.
        """
        ball = bounding_ball(_objects(scene))
        if ball is None:
            raise InputError(
                "expected an object with bounds, around which to place the camera: state a position and look_at",
                "scene",
            )
        across = number(aspect, "aspect", expected="a number above 0")
        if across <= 0.0:
            raise InputError(f"expected a number above 0, got {across:g}", "aspect")
        across = min(across, 1.0)
        view = check_direction(direction, "direction")
        # A camera around the origin, where no digits are lost, checks the other arguments.
        is_parallel = projection == "orthographic"
        unit = scale_by(view, 1.0 / math.hypot(*view))
        camera = Camera(
            scale_by(unit, -1.0), (0.0, 0.0, 0.0), up, vertical_fov, projection, 1.0 if is_parallel else None
        )
        half = math.atan(across * math.tan(math.radians(camera.vertical_fov) / 2.0))
        distance = 2.0 * ball.radius if is_parallel else ball.radius / math.sin(half)
        place = sub(ball.center, scale_by(unit, distance))
        height = 2.0 * ball.radius / across if is_parallel else None
        is_far = max(*map(abs, (*place, *ball.center)), height or 0.0) > MAX_LENGTH
        if is_far or place == ball.center or (height is not None and height < MIN_RADIUS):
            around = f"a ball of radius {ball.radius:g} around ({', '.join(f'{x:g}' for x in ball.center)})"
            raise InputError(
                f"expected objects that a camera within +-{MAX_LENGTH:g} can frame, got objects in {around}: state a "
                "position and look_at",
                "scene",
            )
        return camera.replace(position=place, look_at=ball.center, height=height)

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


def _objects(value: Any) -> Sequence[Solid | Instances]:
    """Return the objects of a scene, or the solids and Instances of a collection. Raises InputError."""
    if isinstance(value, Solid | Instances):
        return (value,)
    objects = getattr(value, "objects", None) if isinstance(value, Record) else items(value, MAX_SURFACES)
    if objects is None or not all(isinstance(item, Solid | Instances) for item in objects):
        raise InputError(f"expected a Scene, or solids and Instances, got {format_value(value)}", "scene")
    return objects
