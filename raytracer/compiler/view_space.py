"""View space: the camera is at the origin and looks along -z.

The move to view space is done here in float64, before anything is rounded to the precision of the shaders.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.surfaces import Surfaces
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera

Array = NDArray[np.float64]


class View(msgspec.Struct, frozen=True, eq=False):
    """Surfaces as one camera sees them."""

    camera: Camera
    surfaces: Surfaces
    rotation: Array  # (3, 3), of rotation()
    vectors: Array  # (N, 3): the centres of the spheres and the unit normals of the planes, in view space
    depths: list[float]  # of the camera in each plane's half-space

    @property
    def centers(self) -> Array:
        """(S, 3): the centres of the spheres, in view space."""
        return self.vectors[: self.surfaces.spheres]

    def place(self, point: Vec3) -> Array:
        """(3,): where a point is in view space."""
        return self.rotation @ np.subtract(point, self.camera.position)


def make_view(surfaces: Surfaces, camera: Camera) -> View:
    """Move surfaces to the view space of a camera."""
    turn = rotation(camera)
    vectors = np.concatenate([surfaces.centers - camera.position, surfaces.normals]) @ turn.T
    return View(camera, surfaces, turn, vectors, [plane.depth(camera.position) for plane in surfaces.planes])


def rotation(camera: Camera) -> Array:
    """(3, 3): world directions to view space, by `R @ v`."""
    right, up, forward = camera.axes()
    return np.array([right, up, np.negative(forward)])


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
