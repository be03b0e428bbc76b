"""A scene's numbers as the shaders take them: in view space, packed for uniform blocks.

The move to view space (camera at the origin, looking along -z) is done here in float64, before
anything is rounded to float32.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.checks import Vec3
from raytracer.scene import MODELS, Camera, Plane, Primitive, Scene, Sphere
from raytracer.settings import Settings
from raytracer.shader import surfaces

# std140 layout of struct Material (material.glsl) and struct Light (light.glsl).
_MATERIAL = np.dtype(
    [("ka", "f4", 3), ("h", "f4"), ("kd", "f4", 3), ("model", "i4"), ("ks", "f4", 3), ("number", "i4")]
)
_LIGHT = np.dtype([("position", "f4", 3), ("pad0", "f4"), ("color", "f4", 3), ("pad1", "f4")])


def rotation(camera: Camera) -> NDArray[np.float64]:
    """(3, 3): world directions to view space, by `R @ v`."""
    right, up, forward = camera.axes()
    return np.array([right, up, np.negative(forward)])


def surfaces_block(scene: Scene) -> bytes:
    """The uniform block of surfaces.glsl."""
    R, eye = rotation(scene.camera), np.array(scene.camera.position)
    packed = [_packed(surface, R, eye) for surface in surfaces(scene)]
    return np.array(packed, np.float32).tobytes()


def _packed(surface: Primitive, R: NDArray[np.float64], eye: NDArray[np.float64]) -> list[float]:
    if isinstance(surface, Sphere):
        return [*(R @ (np.array(surface.center) - eye)).tolist(), surface.radius]
    normal, offset = surface.unit()
    return [*(R @ normal).tolist(), offset - float(np.array(normal) @ eye)]


def camera_terms_block(scene: Scene, size: tuple[int, int]) -> bytes:
    """The uniform block of terms.glsl: the spheres' powers and the planes' slopes.

    A slope, dot(normal, direction), is a x + b y + c in half pixels from the picture's centre; each
    coefficient is split into a multiple of `quantum` and the rest. See cameraSlope() in camera.glsl.
    """
    R, eye = rotation(scene.camera), np.array(scene.camera.position)
    found = surfaces(scene)
    powers = [_power(eye, surface) for surface in found if isinstance(surface, Sphere)]

    scale = pixel_scale(scene.camera, size[1])
    normals = np.array([R @ s.unit()[0] for s in found if isinstance(s, Plane)]).reshape(-1, 3)
    slopes = normals * (scale, scale, -1.0)
    largest = np.abs(slopes) @ (size[0], size[1], 1.0)
    # Partial sums stay below 2^23 quanta, so float32's 24 bits hold each.
    quantum = np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(np.float32).tiny))) - 23.0)[:, None]
    coarse = np.rint(slopes / quantum) * quantum

    rows = np.zeros((len(powers) + 2 * len(slopes), 4), np.float32)
    rows[: len(powers), 0] = powers
    rows[len(powers) :, :3] = np.concatenate([coarse, slopes - coarse])
    return rows.tobytes()


def _power(eye: NDArray[np.float64], sphere: Sphere) -> float:
    distance = math.dist(sphere.center, eye)
    return (distance - sphere.radius) * (distance + sphere.radius)


def materials_block(scene: Scene, settings: Settings) -> bytes:
    """The uniform block of material.glsl: the material of each surface."""
    found = [settings.shaded(surface.material) for surface in surfaces(scene)]
    numbers = material_index(scene)
    rows = [(m.ka, m.h, m.kd, MODELS.index(m.model), m.ks, n) for m, n in zip(found, numbers, strict=False)]
    return np.array(rows, _MATERIAL).tobytes()


def lights_block(scene: Scene) -> bytes:
    """The uniform block of light.glsl."""
    R, eye = rotation(scene.camera), np.array(scene.camera.position)
    rows = [(R @ (np.array(light.position) - eye), 0.0, light.color, 0.0) for light in scene.lights]
    return np.array(rows, _LIGHT).tobytes()


def material_index(scene: Scene) -> NDArray[np.int32]:
    """Index into `Scene.materials` of each surface, and -1 at the end: so also at index -1."""
    order = {material: i for i, material in enumerate(scene.materials)}
    return np.array([*(order[surface.material] for surface in surfaces(scene)), -1], np.int32)


def pixel_scale(camera: Camera, height: int) -> float:
    """tan(fov / 2) / H: half a pixel on the plane at distance 1."""
    return math.tan(math.radians(camera.vertical_fov) / 2.0) / height


def in_picture(camera: Camera, point: Vec3, size: tuple[int, int], margin: float) -> tuple[float, float, bool]:
    """Where a point appears in a picture of `size`: x, y in pixels from the lower left, and whether it is in view.

    A point out of view, or within `margin` pixels of the border, gets the place on the border of
    that margin towards which one has to look for it.
    """
    x, y, z = rotation(camera) @ (np.array(point) - camera.position)
    middle = np.array(size) / 2.0
    room = np.maximum(middle - margin, 1.0)
    # Homogeneous, so that a point beside or behind the camera has a direction too.
    offset, depth = np.array([x, y]), -z * 2.0 * pixel_scale(camera, size[1])
    beyond = np.abs(offset / room).max()
    in_view = depth > 0.0 and beyond <= depth
    # Straight behind, every direction is as good: up.
    offset = offset / depth if in_view else offset / beyond if beyond > 0.0 else np.array([0.0, room[1]])
    px, py = middle + offset
    return float(px), float(py), bool(in_view)
