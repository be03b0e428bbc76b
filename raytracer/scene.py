"""What there is: solids, materials, lights, a camera, and the scene that holds them.

Pure data, no OpenGL. Every object is frozen, checked when made, and has a `repr` that can be
pasted back. Lengths are in one unit of the user's choice, angles in degrees, colours linear RGB.
Whatever is wrong with a value raises `InputError`, whose message begins with the value's name.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from types import UnionType
from typing import TypeVar

import msgspec

from raytracer.checks import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Vec3,
    color,
    direction,
    number,
    point,
    set_fields,
    shown,
)
from raytracer.instances import Instances
from raytracer.material import Material
from raytracer.solids import MAX_SURFACES, ROUNDING, Solid, Sphere, leaves
from raytracer.vectors import cross, divided, dot, scaled, sub

T = TypeVar("T")

# Sine of the angle between `up` and the view below which rounding of the given numbers decides
# where "right" points.
MIN_UP_ANGLE = 1e-8


FALLOFFS = ("none", "inverse_square")


class PointLight(msgspec.Struct, frozen=True, repr_omit_defaults=True):
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
            raise InputError(f"radius: expected {expected}, got {radius:g}")
        if self.falloff not in FALLOFFS:
            raise InputError(f"falloff: expected {' or '.join(map(repr, FALLOFFS))}, got {shown(self.falloff)}")
        set_fields(self, position=point(self.position, "position"), color=color(self.color, "color"), radius=radius)

    def is_bulb(self, sphere: Sphere) -> bool:
        """Whether `sphere` is this light's own, to the rounding of the numbers that are given."""
        given = max(map(abs, (*sphere.center, *self.position, self.radius)))
        off = max(math.dist(sphere.center, self.position), abs(sphere.radius - self.radius))
        return off <= ROUNDING * given


class Camera(msgspec.Struct, frozen=True):
    """A pinhole camera. `vertical_fov` is in degrees, in (0, 180); `up` need not be a unit vector."""

    position: Vec3
    look_at: Vec3
    up: Vec3 = (0.0, 1.0, 0.0)
    vertical_fov: float = 53.13

    def __post_init__(self) -> None:
        fov = number(self.vertical_fov, "vertical_fov", expected="degrees in (0, 180)")
        if not 0.0 < fov < 180.0:
            raise InputError(f"vertical_fov: expected degrees in (0, 180), got {fov:g}")
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
            raise InputError(f"look_at: expected a point other than position, got {self.look_at}")
        forward = divided(forward, distance)
        right = cross(forward, divided(self.up, math.hypot(*self.up)))
        sine = math.hypot(*right)
        if sine < MIN_UP_ANGLE:
            raise InputError(f"up: expected a direction not parallel to the view, got {self.up}")
        # The shorter the product, the larger its rounding: take out what is left along `forward`.
        right = divided(right, sine)
        right = sub(right, scaled(forward, dot(right, forward)))
        right = divided(right, math.hypot(*right))
        return right, cross(right, forward), forward


class Scene(msgspec.Struct, frozen=True):
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
            raise InputError("objects: expected at least one")
        if not isinstance(self.camera, Camera):
            raise InputError(f"camera: expected a Camera, got {shown(self.camera)}")
        given = _tuple_of(self.materials, Material, "materials", "Materials")
        set_fields(
            self,
            objects=objects,
            lights=_tuple_of(self.lights, PointLight, "lights", "PointLights"),
            ambient=color(self.ambient, "ambient"),
            background=color(self.background, "background"),
            materials=tuple(dict.fromkeys((*given, *_materials(objects)))),
        )

    def solids(self) -> tuple[Solid, ...]:
        """All plain solids in order, those of Instances one by one. Surfaces are counted in this order everywhere."""
        return tuple(s for o in self.objects for s in (o.solids() if isinstance(o, Instances) else (o,)))


_last: tuple[object, tuple[Material, ...]] = (None, ())


def _materials(objects: tuple[Solid | Instances, ...]) -> tuple[Material, ...]:
    """The materials of all primitives, once each, in order. Raises InputError for more than MAX_SURFACES of these.

    Kept for the next scene of the same objects: in a window lights and cameras make many of them.
    """
    global _last
    if _last[0] is not objects:
        count = 0
        materials: dict[Material, None] = {}
        for i, item in enumerate(objects, start=1):
            found = leaves(item.solid if isinstance(item, Instances) else item)
            count += len(found) * (len(item) if isinstance(item, Instances) else 1)
            if count > MAX_SURFACES:  # at once: of solids that objects share there may be more than fit the memory
                least = "at least " if i < len(objects) else ""
                raise InputError(f"objects: expected at most {MAX_SURFACES} primitives, got {least}{count}")
            materials |= dict.fromkeys(leaf.material for leaf in found)
        _last = objects, tuple(materials)
    return _last[1]


def _tuple_of(values: Iterable[T], kind: type[T] | UnionType, key: str, expected: str) -> tuple[T, ...]:
    result = tuple(values) if isinstance(values, Iterable) else (values,)
    for value in result:
        if not isinstance(value, kind):
            raise InputError(f"{key}: expected {expected}, got {shown(value)}")
    return result
