"""Scenes that are enlarged or moved as a whole."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from raytracer.core.validation import Vec3
from raytracer.core.vectors import add, dot, scaled
from raytracer.scene.instances import Instances
from raytracer.scene.scene import Scene
from raytracer.scene.solids import Plane, Primitive, Solid, Sphere, with_leaves


def _transform(scene: Scene, point: Callable[[Vec3], Vec3], scale: float, offset: Callable[[Plane], float]) -> Scene:
    """`scene` with all its points and lengths changed; `point` turns nothing, and multiplies lengths by `scale`."""

    def changed(leaf: Primitive) -> Solid:
        if isinstance(leaf, Sphere):
            return msgspec.structs.replace(leaf, center=point(leaf.center), radius=leaf.radius * scale)
        return msgspec.structs.replace(leaf, offset=offset(leaf))

    camera = msgspec.structs.replace(
        scene.camera, position=point(scene.camera.position), look_at=point(scene.camera.look_at)
    )
    lights = [
        msgspec.structs.replace(light, position=point(light.position), radius=light.radius * scale)
        for light in scene.lights
    ]
    objects = [
        Instances(o.solid, [point(p) for p in o.positions.tolist()], o.scales * scale)
        if isinstance(o, Instances)
        else with_leaves(o, changed)
        for o in scene.objects
    ]
    return msgspec.structs.replace(scene, objects=objects, camera=camera, lights=lights)


def enlarge_scene(scene: Scene, by: float) -> Scene:
    """`scene` with all lengths `by` times as large."""
    return _transform(scene, lambda p: scaled(p, by), by, lambda plane: plane.offset * by)


def move_scene(scene: Scene, by: Vec3) -> Scene:
    """`scene`, moved by a vector as a whole."""
    return _transform(
        scene,
        lambda p: add(p, by),
        1.0,
        lambda plane: plane.offset + dot(plane.normal, by),
    )
