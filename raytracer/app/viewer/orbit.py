"""Orbits of the lights and the camera around the point that the camera looks at, for drags and the wheel.

Everything turns around `camera.up` through `camera.look_at`. Angles are in radians.
"""

from __future__ import annotations

import math

import msgspec

from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3
from raytracer.core.vectors import add, cross, divided, dot, scaled, sub
from raytracer.scene.scene import Scene

# Short of the pole, where turning to the right would do nothing.
_STEEPEST = math.radians(89.0)
# Sine of the angle to the axis below which rounding decides on which side of it a point is.
_OFF_AXIS = 1e-9
# A light in the very middle has no direction to turn or to go: it sets out with this share of the camera's distance.
_FROM_THE_MIDDLE = 0.1


def turn_light(scene: Scene, index: int, right: float, up: float) -> Scene:
    """`scene` with a light moved on its sphere around the scene.

    A light before the scene goes to the right for positive `right`; `up` raises it, to 89 degrees.
    """
    if not scene.lights:
        return scene
    return _with_light(scene, index, _turned(scene, _arm(scene, scene.lights[index].position), right, up))


def scale_light(scene: Scene, index: int, factor: float) -> Scene:
    """`scene` with a light's distance from the scene's middle multiplied by `factor`."""
    if not scene.lights:
        return scene
    return _with_light(scene, index, _lengthened(_arm(scene, scene.lights[index].position), factor))


def turn_camera(scene: Scene, right: float, up: float) -> Scene:
    """`scene` with the camera on its sphere around `look_at`: what it sees turns `right` and `up`."""
    return _with_camera(scene, _turned(scene, _arm(scene, scene.camera.position), -right, -up))


def scale_camera(scene: Scene, factor: float) -> Scene:
    """`scene` with the camera's distance from `look_at` multiplied by `factor`."""
    return _with_camera(scene, _lengthened(_arm(scene, scene.camera.position), factor))


def _arm(scene: Scene, position: Vec3) -> Vec3:
    """From what the camera looks at to `position`, or a short way towards the camera if that is there."""
    arm = sub(position, scene.camera.look_at)
    return arm if any(arm) else scaled(sub(scene.camera.position, scene.camera.look_at), _FROM_THE_MIDDLE)


def _turned(scene: Scene, arm: Vec3, right: float, up: float) -> Vec3:
    radius = math.hypot(*arm)
    axis = divided(scene.camera.up, math.hypot(*scene.camera.up))
    height = dot(arm, axis)
    outward = sub(arm, scaled(axis, height))
    if math.hypot(*outward) < _OFF_AXIS * radius:  # straight above or below: it sets out towards the camera
        outward = cross(scene.camera.axes()[0], axis)
    outward = divided(outward, math.hypot(*outward))
    elevation = math.asin(max(-1.0, min(1.0, height / radius)))
    elevation = max(min(elevation, -_STEEPEST), min(max(elevation, _STEEPEST), elevation + up))
    level = add(scaled(outward, math.cos(right)), scaled(cross(axis, outward), math.sin(right)))
    return scaled(add(scaled(level, math.cos(elevation)), scaled(axis, math.sin(elevation))), radius)


def _lengthened(arm: Vec3, factor: float) -> Vec3:
    radius = math.hypot(*arm)
    return scaled(divided(arm, radius), max(MIN_RADIUS, min(MAX_LENGTH, radius * factor)))


def _with_light(scene: Scene, index: int, arm: Vec3) -> Scene:
    moved = msgspec.structs.replace(scene.lights[index], position=_place(scene, arm))
    return msgspec.structs.replace(scene, lights=(*scene.lights[:index], moved, *scene.lights[index + 1 :]))


def _with_camera(scene: Scene, arm: Vec3) -> Scene:
    try:
        camera = msgspec.structs.replace(scene.camera, position=_place(scene, arm))
    except InputError:  # so near to `look_at` that rounding has made them one point: here is the end
        return scene
    return msgspec.structs.replace(scene, camera=camera)


def _place(scene: Scene, arm: Vec3) -> Vec3:
    x, y, z = add(scene.camera.look_at, arm)
    return _clipped(x), _clipped(y), _clipped(z)


def _clipped(length: float) -> float:
    return max(-MAX_LENGTH, min(MAX_LENGTH, length))
