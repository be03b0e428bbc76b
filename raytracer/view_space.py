"""A scene's numbers as the shaders take them: in view space, packed for uniform blocks.

The move to view space (camera at the origin, looking along -z) is done here in float64, before
anything is rounded to the precision of the shaders.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.checks import Vec3
from raytracer.scene import Camera, Scene
from raytracer.settings import Precision, Settings
from raytracer.shader import surfaces
from raytracer.solids import MODELS, Sphere

# std140 layout of struct Material (material.glsl), and of struct Light (light.glsl) at either precision.
_MATERIAL = np.dtype(
    [("ka", "f4", 3), ("h", "f4"), ("kd", "f4", 3), ("model", "i4"), ("ks", "f4", 3), ("number", "i4")]
)
_LIGHT = {
    32: np.dtype([("position", "f4", 3), ("pad0", "f4"), ("color", "f4", 3), ("on", "i4")]),
    64: np.dtype([("position", "f8", 3), ("pad0", "f8"), ("color", "f4", 3), ("on", "i4"), ("pad1", "f4", 4)]),
}
_REAL = {32: np.float32, 64: np.float64}  # of real.glsl


def rotation(camera: Camera) -> NDArray[np.float64]:
    """(3, 3): world directions to view space, by `R @ v`."""
    right, up, forward = camera.axes()
    return np.array([right, up, np.negative(forward)])


def surfaces_block(scene: Scene, precision: Precision) -> bytes:
    """The uniform block of surfaces.glsl."""
    eye = scene.camera.position
    rows = [
        (*vector, surface.radius if isinstance(surface, Sphere) else surface.depth(eye))
        for surface, vector in zip(surfaces(scene), _vectors(scene), strict=True)
    ]
    return np.array(rows, _REAL[precision]).tobytes()


def _vectors(scene: Scene) -> NDArray[np.float64]:
    """(N, 3): the centres of the spheres and the unit normals of the planes, in view space."""
    R, eye = rotation(scene.camera), scene.camera.position
    return np.array(
        [R @ (np.subtract(s.center, eye) if isinstance(s, Sphere) else s.unit()[0]) for s in surfaces(scene)]
    )


def camera_terms_block(scene: Scene, size: tuple[int, int], precision: Precision) -> bytes:
    """The uniform block of terms.glsl: the slopes, and the spheres' powers.

    A slope, dot(vector, direction), is a x + b y + c in half pixels from the picture's centre; each
    coefficient is split into a multiple of `quantum` and the rest. See cameraSlope() in camera.glsl.
    """
    scale = pixel_scale(scene.camera, size[1])
    slopes = _vectors(scene) * (scale, scale, -1.0)
    largest = np.abs(slopes) @ (size[0], size[1], 1.0)
    # Partial sums stay below 2^23 quanta, so float32's 24 bits hold each.
    quantum = np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(np.float32).tiny))) - 23.0)[:, None]
    coarse = np.rint(slopes / quantum) * quantum

    count = len(slopes)
    rows = np.zeros((2 * count, 4), _REAL[precision])
    rows[:count, :3], rows[count:, :3] = coarse, slopes - coarse
    powers = [s.power(scene.camera.position) for s in surfaces(scene) if isinstance(s, Sphere)]
    rows[: len(powers), 3] = powers
    return rows.tobytes()


def materials_block(scene: Scene, settings: Settings) -> bytes:
    """The uniform block of material.glsl: the material of each surface."""
    found = [settings.shaded(surface.material) for surface in surfaces(scene)]
    numbers = material_index(scene)
    rows = [(m.ka, m.h, m.kd, MODELS.index(m.model), m.ks, n) for m, n in zip(found, numbers, strict=False)]
    return np.array(rows, _MATERIAL).tobytes()


def lights_block(scene: Scene, precision: Precision) -> bytes:
    """The uniform block of light.glsl."""
    R, eye = rotation(scene.camera), scene.camera.position
    found = surfaces(scene)
    block = np.zeros(len(scene.lights), _LIGHT[precision])
    for row, light in zip(block, scene.lights, strict=True):
        row["position"], row["color"] = R @ np.subtract(light.position, eye), light.color
        row["on"] = next((i for i, s in enumerate(found, start=1) if s.touches(light.position)), 0)
    return block.tobytes()


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
