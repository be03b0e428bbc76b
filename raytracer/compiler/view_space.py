"""View space: the camera is at the origin and looks along -z.

This module transforms scenes to view space in float64, before any number is rounded to the precision of the shaders.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.body_view import BodyView, make_body_view, plane_depths, turned
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.surfaces import Surfaces
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera

Array = NDArray[np.float64]


class View(msgspec.Struct, frozen=True, eq=False):
    """The surfaces of a scene in the view space of one camera."""

    camera: Camera
    surfaces: Surfaces
    rotation: Array  # (3, 3), by rotation()
    vectors: Array  # (N, 3): the centres of spheres and bounding balls and the unit normals of planes, in view space
    depths: Array  # (P,): the depth of the camera in each plane's half-space
    bodies: BodyView

    @property
    def centers(self) -> Array:
        """The centres of the spheres and of the bodies' bounding balls (S + B, 3), in view space."""
        return self.vectors[: self.surfaces.bounded]

    def place(self, point: Vec3) -> Array:
        """Transform a point to view space (3,)."""
        return self.rotation @ np.subtract(point, self.camera.position)


def make_view(surfaces: Surfaces, camera: Camera) -> View:
    """Transform surfaces to the view space of a camera."""
    turn = rotation(camera)
    vectors = turned(np.concatenate([surfaces.centers - camera.position, surfaces.normals]), turn)
    depths = plane_depths(surfaces.normals, surfaces.offsets, camera.position)
    return View(camera, surfaces, turn, vectors, depths, make_body_view(surfaces.bodies, camera, turn))


def rotation(camera: Camera) -> Array:
    """Return the rotation R (3, 3) of world directions to view space, `R @ v`."""
    right, up, forward = camera.axes()
    return np.array([right, up, np.negative(forward)])


def pixel_scale(camera: Camera, height: int) -> float:
    """Return tan(fov / 2) / H: half the side of a pixel on the plane at distance 1."""
    return math.tan(math.radians(camera.vertical_fov) / 2.0) / height


def camera_grid(camera: Camera, size: tuple[int, int]) -> tuple[tuple[float, float], float, tuple[int, int]]:
    """Return the grid of a picture's cells on the plane at distance 1: lower left corner, step, (columns, rows)."""
    width, height = size
    scale = pixel_scale(camera, height)
    return (-scale * width, -scale * height), 2.0 * scale * CELL, (-(-width // CELL), -(-height // CELL))


def project_point(camera: Camera, point: Vec3, size: tuple[int, int], margin: float) -> tuple[float, float, bool]:
    """Project a point into a picture of `size`: x, y in pixels from the lower left, and whether it is in view.

    A point is in view if it is inside the picture and at least `margin` pixels from the border. Any other point gets
    the place on the inner edge of the margin that is in the direction of the point.
    """
    x, y, z = rotation(camera) @ (np.array(point) - camera.position)
    middle = np.array(size) / 2.0
    room = np.maximum(middle - margin, 1.0)
    # In homogeneous coordinates, a point beside or behind the camera has a direction too.
    offset, depth = np.array([x, y]), -z * 2.0 * pixel_scale(camera, size[1])
    beyond = np.abs(offset / room).max()
    in_view = depth > 0.0 and beyond <= depth
    # For a point straight behind the camera, any direction serves: use up.
    offset = offset / depth if in_view else offset / beyond if beyond > 0.0 else np.array([0.0, room[1]])
    px, py = middle + offset
    return float(px), float(py), bool(in_view)
