"""What there is: solids, materials, lights, a camera, and the scene that holds them.

Pure data, no OpenGL. Every object is frozen, checked when made, and has a `repr` that can be
pasted back. Lengths are in one unit of the user's choice, angles in degrees, colours linear RGB.
Whatever is wrong with a value raises `InputError`, whose message begins with the value's name.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import UnionType
from typing import Any, TypeVar

from raytracer.core.record import Record, public
from raytracer.core.validation import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Vec3,
    check_choice,
    check_text,
    color,
    direction,
    items,
    number,
    point,
    set_fields,
    shown,
)
from raytracer.core.vectors import cross, divided, dot, scaled, sub
from raytracer.scene.instances import Instances
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import MAX_SURFACES, ROUNDING, Solid, Sphere, leaves

T = TypeVar("T")

# Sine of the angle between `up` and the view below which rounding of the given numbers decides
# where "right" points.
MIN_UP_ANGLE = 1e-8


FALLOFFS = ("none", "inverse_square")


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
    falloff: str = "none"

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
        given = max(map(abs, (*sphere.center, *self.position, self.radius)))
        off = max(math.dist(sphere.center, self.position), abs(sphere.radius - self.radius))
        return off <= ROUNDING * given


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
        # The shorter the product, the larger its rounding: take out what is left along `forward`.
        right = divided(right, sine)
        right = sub(right, scaled(forward, dot(right, forward)))
        right = divided(right, math.hypot(*right))
        return right, cross(right, forward), forward


@public
class Scene(Record, frozen=True):
    """Solids, lights and a camera.

    `objects` are separate solids, and Instances of solids; the first hit of any is seen. `ambient`
    is Ia of the lecture's formula, `background` the radiance of a ray that meets nothing.
    `materials` lists the scene's materials in the order that the `material` output counts them:
    those given, then any others in the order in which the objects name them.
    """

    objects: Sequence[Solid | Instances]
    lights: Sequence[PointLight]
    camera: Camera
    ambient: Vec3 = (1.0, 1.0, 1.0)
    background: Vec3 = (0.5, 0.7, 0.9)
    materials: Sequence[Material] = ()
    name: str = "scene"

    def __post_init__(self) -> None:
        objects = _tuple_of(self.objects, Solid | Instances, "objects", "solids and Instances")
        if not objects:
            raise InputError("expected at least one", "objects")
        if not isinstance(self.camera, Camera):
            raise InputError(f"expected a Camera, got {shown(self.camera)}", "camera")
        given = _tuple_of(self.materials, Material, "materials", "Materials")
        set_fields(
            self,
            objects=objects,
            lights=_tuple_of(self.lights, PointLight, "lights", "PointLights"),
            ambient=color(self.ambient, "ambient"),
            background=color(self.background, "background"),
            materials=tuple(dict.fromkeys((*given, *_materials(objects)))),
            name=check_text(self.name, "name"),
        )

    def solids(self) -> tuple[Solid, ...]:
        """All plain solids in order, those of Instances one by one. Surfaces are counted in this order everywhere."""
        return tuple(s for o in self.objects for s in (o.solids() if isinstance(o, Instances) else (o,)))


def checked_scene(value: Any) -> Scene:
    """`value`, if it is a Scene. Raises InputError."""
    if not isinstance(value, Scene):
        raise InputError(f"expected a Scene (raytracer.load() makes one of a file), got {shown(value)}", "scene")
    return value


_last: tuple[object, tuple[Material, ...]] = (None, ())


def _materials(objects: tuple[Solid | Instances, ...]) -> tuple[Material, ...]:
    """The materials of all primitives, once each, in order. Raises InputError for more than MAX_SURFACES of these.

    Kept for the next scene of the same objects: in a window lights and cameras make many of them.
    """
    global _last
    last = _last  # another thread may set it meanwhile
    if last[0] is not objects:
        count = 0
        materials: dict[Material, None] = {}
        for i, item in enumerate(objects, start=1):
            primitives = leaves(item.solid if isinstance(item, Instances) else item)
            count += len(primitives) * (len(item) if isinstance(item, Instances) else 1)
            if count > MAX_SURFACES:  # at once: of solids that objects share there may be more than fit the memory
                least = "at least " if i < len(objects) else ""
                raise InputError(f"expected at most {MAX_SURFACES} primitives, got {least}{count}", "objects")
            materials |= dict.fromkeys(leaf.material for leaf in primitives)
        _last = last = objects, tuple(materials)
    return last[1]


def _tuple_of(values: Any, kind: type[T] | UnionType, key: str, expected: str) -> tuple[T, ...]:
    if isinstance(values, kind):
        values = (values,)
    # A tuple stays the same one, by which the materials of a scene's objects are known.
    result = values if type(values) is tuple else items(values, MAX_SURFACES)
    if result is None:
        raise InputError(f"expected {expected}, got {shown(values)}", key)
    result = tuple(result)
    if len(result) > MAX_SURFACES:
        raise InputError(f"expected at most {MAX_SURFACES} {expected}", key)
    for value in result:
        if not isinstance(value, kind):
            raise InputError(f"expected {expected}, got {shown(value)}", key)
    return result
