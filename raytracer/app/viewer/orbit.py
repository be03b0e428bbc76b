"""Orbits of lights and camera around the point that the camera looks at, for drags and the wheel.

The axis of all orbits goes through `camera.look_at` in the direction of `camera.up`. Angles are in radians.
"""

from __future__ import annotations

import math

import msgspec

from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3
from raytracer.core.vectors import add, cross, divide_by, dot, scale_by, sub
from raytracer.scene.scene import Scene

# The largest elevation by drags. At the pole, at 90 degrees, turning to the right would have no effect.
_STEEPEST = math.radians(89.0)
# Sine of the angle to the axis below which rounding errors decide on which side of the axis a point lies.
_OFF_AXIS = 1e-9
# A light exactly at `look_at` has no direction. Its first movement starts from this share of the camera's distance.
_FROM_THE_MIDDLE = 0.1


def turn_light(scene: Scene, index: int, right: float, up: float) -> Scene:
    """Move a light on its sphere around `look_at`, and return the new scene.

    A positive `right` moves a light in front of the scene to the right; `up` raises a light, up to 89 degrees.
    """
    if not scene.lights:
        return scene
    return _with_light(scene, index, _turn_arm(scene, _arm(scene, scene.lights[index].position), right, up))


def scale_light(scene: Scene, index: int, factor: float) -> Scene:
    """Multiply a light's distance from `look_at` by `factor`, and return the new scene."""
    if not scene.lights:
        return scene
    return _with_light(scene, index, _scale_arm(_arm(scene, scene.lights[index].position), factor))


def turn_camera(scene: Scene, right: float, up: float) -> Scene:
    """Move the camera on its sphere around `look_at`, so that the picture turns `right` and `up`. Return the scene."""
    return _with_camera(scene, _turn_arm(scene, _arm(scene, scene.camera.position), -right, -up))


def scale_camera(scene: Scene, factor: float) -> Scene:
    """Multiply the camera's distance from `look_at` by `factor`, or an orthographic height. Return the new scene."""
    height = scene.camera.height
    if height is not None:
        height = max(MIN_RADIUS, min(MAX_LENGTH, height * factor))
        return msgspec.structs.replace(scene, camera=msgspec.structs.replace(scene.camera, height=height))
    return _with_camera(scene, _scale_arm(_arm(scene, scene.camera.position), factor))


def _arm(scene: Scene, position: Vec3) -> Vec3:
    """Return the vector from `look_at` to `position`, or a short one towards the camera if they are the same point."""
    arm = sub(position, scene.camera.look_at)
    return arm if any(arm) else scale_by(sub(scene.camera.position, scene.camera.look_at), _FROM_THE_MIDDLE)


def _turn_arm(scene: Scene, arm: Vec3, right: float, up: float) -> Vec3:
    radius = math.hypot(*arm)
    axis = divide_by(scene.camera.up, math.hypot(*scene.camera.up))
    height = dot(arm, axis)
    outward = sub(arm, scale_by(axis, height))
    if math.hypot(*outward) < _OFF_AXIS * radius:  # straight above or below: start towards the camera
        outward = cross(scene.camera.axes()[0], axis)
    outward = divide_by(outward, math.hypot(*outward))
    elevation = math.asin(max(-1.0, min(1.0, height / radius)))
    elevation = max(min(elevation, -_STEEPEST), min(max(elevation, _STEEPEST), elevation + up))
    level = add(scale_by(outward, math.cos(right)), scale_by(cross(axis, outward), math.sin(right)))
    return scale_by(add(scale_by(level, math.cos(elevation)), scale_by(axis, math.sin(elevation))), radius)


def _scale_arm(arm: Vec3, factor: float) -> Vec3:
    radius = math.hypot(*arm)
    return scale_by(divide_by(arm, radius), max(MIN_RADIUS, min(MAX_LENGTH, radius * factor)))


def _with_light(scene: Scene, index: int, arm: Vec3) -> Scene:
    moved = msgspec.structs.replace(scene.lights[index], position=_place(scene, arm))
    return msgspec.structs.replace(scene, lights=(*scene.lights[:index], moved, *scene.lights[index + 1 :]))


def _with_camera(scene: Scene, arm: Vec3) -> Scene:
    try:
        camera = msgspec.structs.replace(scene.camera, position=_place(scene, arm))
    except InputError:  # rounding has made camera and `look_at` one point: the camera cannot come nearer
        return scene
    return msgspec.structs.replace(scene, camera=camera)


def _place(scene: Scene, arm: Vec3) -> Vec3:
    x, y, z = add(scene.camera.look_at, arm)
    return _clip(x), _clip(y), _clip(z)


def _clip(length: float) -> float:
    return max(-MAX_LENGTH, min(MAX_LENGTH, length))
