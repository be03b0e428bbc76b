"""Transforms of whole scenes: enlargement and translation."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from raytracer.core.validation import Vec3
from raytracer.core.vectors import add, scale_by
from raytracer.scene.instances import Instances
from raytracer.scene.scene import Scene
from raytracer.scene.solids.solid import Solid


def _transform(scene: Scene, point: Callable[[Vec3], Vec3], scale: float, move: Callable[[Solid], Solid]) -> Scene:
    """Transform all points and lengths of `scene`.

    Args:
        scene: the scene
        point: the transform of points, without rotation
        scale: its factor for lengths
        move: the transform of solids
    """
    camera = msgspec.structs.replace(
        scene.camera, position=point(scene.camera.position), look_at=point(scene.camera.look_at)
    )
    if camera.height is not None:
        camera = camera.replace(height=camera.height * scale)
    lights = [
        msgspec.structs.replace(light, position=point(light.position), radius=light.radius * scale)
        for light in scene.lights
    ]
    objects = [
        o.replace(positions=[point(p) for p in o.positions.tolist()], scales=o.scales * scale)
        if isinstance(o, Instances)
        else move(o)
        for o in scene.objects
    ]
    return msgspec.structs.replace(scene, objects=objects, camera=camera, lights=lights)


def enlarge_scene(scene: Scene, by: float) -> Scene:
    """Multiply all lengths of `scene` by a factor, and return the new scene."""
    return _transform(scene, lambda p: scale_by(p, by), by, lambda solid: solid.scale(by))


def move_scene(scene: Scene, by: Vec3) -> Scene:
    """Move `scene` as a whole by a vector, and return the new scene."""
    return _transform(scene, lambda p: add(p, by), 1.0, lambda solid: solid.translate(by))
