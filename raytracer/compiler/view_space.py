"""A scene's numbers as the shaders take them: in view space, packed for textures and blocks.

The move to view space (camera at the origin, looking along -z) is done here in float64, before
anything is rounded to the precision of the shaders.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import groups
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.glsl import reflectance
from raytracer.compiler.glsl.shaders import material_layout, shaded_materials
from raytracer.compiler.surfaces import powers, table
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera
from raytracer.scene.lights import FALLOFFS, PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Precision, Settings
from raytracer.scene.solids import ROUNDING

# std140 layout of struct Light (light.glsl) at either precision.
_LIGHT = {
    precision: np.dtype(
        {
            "names": ["position", "on", "n", "radius", "color", "falloff"],
            "formats": [(real, 3), "i4", (real, 3), real, ("f4", 3), "i4"],
            "offsets": offsets,
            "itemsize": size,
        }
    )
    for precision, real, offsets, size in (
        (32, "f4", (0, 12, 16, 28, 32, 44), 48),
        (64, "f8", (0, 24, 32, 56, 64, 76), 96),
    )
}
_REAL = {32: np.float32, 64: np.float64}  # of real.glsl


def rotation(camera: Camera) -> NDArray[np.float64]:
    """(3, 3): world directions to view space, by `R @ v`."""
    right, up, forward = camera.axes()
    return np.array([right, up, np.negative(forward)])


def surfaces_block(scene: Scene) -> bytes:
    """The uniform block Surfaces of surfaces.glsl, of doubles."""
    return _rows(scene).tobytes()


def _rows(scene: Scene) -> NDArray[np.float64]:
    """(N, 4): the vectors, and the radii of the spheres and offsets of the planes."""
    found = table(scene)
    depths = [plane.depth(scene.camera.position) for plane in found.planes]
    return np.column_stack([vectors(scene), np.concatenate([found.radii, depths])])


def vectors(scene: Scene) -> NDArray[np.float64]:
    """(N, 3): the centres of the spheres and the unit normals of the planes, in view space."""
    found = table(scene)
    return np.concatenate([found.centers - scene.camera.position, found.normals]) @ rotation(scene.camera).T


def camera_terms_block(scene: Scene, size: tuple[int, int]) -> bytes:
    """The uniform block CameraTerms of surfaces.glsl, of doubles."""
    return np.concatenate(_camera_terms(scene, size, 64)).tobytes()


def numbers_texture(scene: Scene, size: tuple[int, int]) -> NDArray[np.float32]:
    """(4 N, 4): the texels `numbers` of surfaces.glsl."""
    found = table(scene)
    texels = np.zeros((found.size, 4, 4), np.float32)
    texels[:, 0] = _rows(scene)
    texels[:, 1], texels[:, 2] = _camera_terms(scene, size, 32)
    texels[len(found.radii) :, 1, 3] = groups(scene).order[len(found.radii) :]
    texels[:, 3, 0] = groups(scene).order
    return texels.reshape(-1, 4)


def materials_texture(scene: Scene, settings: Settings) -> NDArray[np.float32]:
    """(texels, 4): the texels `materials` of the generated materials.glsl."""
    found = material_layout(scene, settings)
    rows = reflectance.packed(found, shaded_materials(scene, settings), rotation(scene.camera))
    row = np.searchsorted(table(scene).used, table(scene).material)
    if found.is_small:
        return rows[row].reshape(-1, 4)
    begins = np.zeros((len(row), 4), np.float32)
    begins[:, 0] = len(row) + found.texels * row
    return np.concatenate([begins, rows.reshape(-1, 4)])


def _camera_terms(
    scene: Scene, size: tuple[int, int], precision: Precision
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N, 4) each: coarse and fine slopes, with the spheres' powers, and which surfaces coincide.

    A slope, dot(vector, direction), is a x + b y + c in half pixels from the picture's centre; each
    coefficient is split into a multiple of `quantum` and the rest. See cameraSlope() in camera.glsl.
    """
    scale = pixel_scale(scene.camera, size[1])
    slopes = vectors(scene) * (scale, scale, -1.0)
    largest = np.abs(slopes) @ (size[0], size[1], 1.0)
    # Partial sums stay below 2^23 quanta, so float32's 24 bits hold each.
    quantum = np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(np.float32).tiny))) - 23.0)[:, None]
    coarse = np.rint(slopes / quantum) * quantum

    found = table(scene)
    power = np.pad(powers(found.centers, found.radii, scene.camera.position), (0, len(found.planes)))
    same = same_as(scene, precision).astype(float)
    return np.column_stack([coarse, power]), np.column_stack([slopes - coarse, same])


def same_as(scene: Scene, precision: Precision) -> NDArray[np.int64]:
    """(N,): for each surface a number, from 1, that it has in common with all that coincide as the shaders see them."""
    rows = _rows(scene).astype(_REAL[precision])
    planes = rows[len(table(scene).radii) :]
    # A half-space and its complement have one face: of n and -n take that whose first part but 0 is positive.
    first = np.argmax(planes[:, :3] != 0.0, axis=1)
    planes *= np.sign(planes[np.arange(len(planes)), first])[:, None]
    is_plane = np.arange(len(rows)) >= len(rows) - len(planes)
    return np.unique(np.column_stack([is_plane, rows + 0.0]), axis=0, return_inverse=True)[1].reshape(-1) + 1


def lights_block(scene: Scene, settings: Settings) -> bytes:
    """The uniform block of light.glsl."""
    R, eye = rotation(scene.camera), scene.camera.position
    block = np.zeros(len(scene.lights), _LIGHT[settings.precision])
    for row, light in zip(block, map(settings.cast, scene.lights), strict=True):
        place = R @ np.subtract(light.position, eye)
        row["position"], row["color"] = place, light.color
        row["radius"], row["falloff"] = light.radius, FALLOFFS.index(light.falloff)
        on = _bulb(scene, light) if light.radius else _touched(scene, light.position)
        if on is not None:
            row["on"] = same_as(scene, settings.precision)[on]
        if on is not None and not light.radius:
            outward = place - vectors(scene)[on] if on < len(table(scene).radii) else vectors(scene)[on]
            row["n"] = outward / np.linalg.norm(outward)
    return block.tobytes()


def _touched(scene: Scene, point: Vec3) -> int | None:
    """The first surface that `point` lies on, as touches() of Sphere and Plane says; its index."""
    found = table(scene)
    given = np.maximum(np.abs(found.centers).max(axis=1, initial=max(map(abs, point))), found.radii)
    off = np.abs(np.linalg.norm(found.centers - point, axis=1) - found.radii)
    on = np.concatenate([off <= ROUNDING * given, [plane.touches(point) for plane in found.planes]])
    return int(np.argmax(on)) if on.any() else None


def _bulb(scene: Scene, light: PointLight) -> int | None:
    """The first sphere that is the light's own, as is_bulb() of PointLight says; its index."""
    found = table(scene)
    given = np.abs(found.centers).max(axis=1, initial=max(map(abs, (*light.position, light.radius))))
    off = np.maximum(np.linalg.norm(found.centers - light.position, axis=1), np.abs(found.radii - light.radius))
    bulbs = np.flatnonzero(off <= ROUNDING * given)
    return int(bulbs[0]) if len(bulbs) else None


def pixel_scale(camera: Camera, height: int) -> float:
    """tan(fov / 2) / H: half a pixel on the plane at distance 1."""
    return math.tan(math.radians(camera.vertical_fov) / 2.0) / height


def camera_grid(camera: Camera, size: tuple[int, int]) -> tuple[tuple[float, float], float, tuple[int, int]]:
    """The grid of a picture's cells on the plane at distance 1: its lower left corner, its step, (columns, rows)."""
    width, height = size
    scale = pixel_scale(camera, height)
    return (-scale * width, -scale * height), 2.0 * scale * CELL, (-(-width // CELL), -(-height // CELL))


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
