"""View space: the camera is at the origin and looks along -z. An orthographic camera is near the first surface.

This module transforms scenes to view space in float64, before any number is rounded to the precision of the shaders.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler import direction_cells, orthographic
from raytracer.compiler.body_view import BodyView, make_body_view, plane_depths, turned
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.surfaces import Surfaces
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera

Array = NDArray[np.float64]


class View(msgspec.Struct, frozen=True, eq=False):
    """The surfaces of a scene in the view space of one camera."""

    camera: Camera
    eye: Vec3  # the origin of view space: the camera's position, or the nearer one of orthographic.py
    advance: float  # the distance from the camera's position to the eye
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
        return self.rotation @ np.subtract(point, self.eye)


def make_view(surfaces: Surfaces, camera: Camera, size: tuple[int, int]) -> View:
    """Transform surfaces to the view space of a camera, for a picture of `size` (width, height)."""
    eye, advance = view_origin(surfaces, camera, size)
    turn = rotation(camera)
    vectors = turned(np.concatenate([surfaces.centers - eye, surfaces.normals]), turn)
    depths = plane_depths(surfaces.normals, surfaces.offsets, eye)
    return View(camera, eye, advance, surfaces, turn, vectors, depths, make_body_view(surfaces.bodies, eye, turn))


def view_origin(surfaces: Surfaces, camera: Camera, size: tuple[int, int]) -> tuple[Vec3, float]:
    """Return the origin of view space, and its distance from the camera's position."""
    if camera.projection == "perspective":
        return camera.position, 0.0
    distance = orthographic.advance(surfaces, camera, size)
    return orthographic.advanced(camera, distance), distance


def rotation(camera: Camera) -> Array:
    """Return the rotation R (3, 3) of world directions to view space, `R @ v`."""
    right, up, forward = camera.axes()
    return np.array([right, up, np.negative(forward)])


def pixel_scale(camera: Camera, height: int) -> float:
    """Return half the side of a pixel: tan(fov / 2) / H on the plane at distance 1, or of an orthographic picture."""
    if camera.height is not None:
        return camera.height / 2.0 / height
    return math.tan(math.radians(camera.vertical_fov) / 2.0) / height


def camera_grid(camera: Camera, size: tuple[int, int]) -> tuple[tuple[float, float], float, tuple[int, int]]:
    """Return the grid of a picture's cells: lower left corner, step, (columns, rows).

    It is on the plane at distance 1, or for an orthographic camera on any plane across the view.
    """
    width, height = size
    scale = pixel_scale(camera, height)
    return (-scale * width, -scale * height), 2.0 * scale * CELL, (-(-width // CELL), -(-height // CELL))


def grown_radii(camera: Camera, centers: Array, radii: Array, times: Array) -> Array:
    """Return radii (N,) with which balls hold the balls of `radii` as a camera sees them in float32.

    `times` (N,) multiplies the growth for the rounding of rays. `centers` (N, 3) are in view space.
    """
    grow = orthographic.grown_radii if camera.projection == "orthographic" else direction_cells.grown_radii
    return grow(centers, radii, times)


def project_balls(camera: Camera, centers: Array, radii: Array) -> tuple[Array, Array]:
    """Return the bounds (lo, hi), each (N, 2), of balls in camera_grid(), as direction_cells.tangents()."""
    project = orthographic.shadows if camera.projection == "orthographic" else direction_cells.tangents
    return project(centers, radii)


def project_point(camera: Camera, point: Vec3, size: tuple[int, int], margin: float) -> tuple[float, float, bool]:
    """Project a point into a picture of `size`: x, y in pixels from the lower left, and whether it is in view.

    A point is in view if it is inside the picture and at least `margin` pixels from the border. Any other point gets
    the place on the inner edge of the margin that is in the direction of the point.
    """
    x, y, z = rotation(camera) @ (np.array(point) - camera.position)
    middle = np.array(size) / 2.0
    room = np.maximum(middle - margin, 1.0)
    # In homogeneous coordinates, a point beside or behind the camera has a direction too.
    offset, depth = np.array([x, y]), 2.0 * pixel_scale(camera, size[1])
    if camera.projection == "perspective":
        depth *= -z
    elif z >= 0.0:
        depth = 0.0
    beyond = np.abs(offset / room).max()
    in_view = depth > 0.0 and beyond <= depth
    # For a point straight behind the camera, any direction serves: use up.
    offset = offset / depth if in_view else offset / beyond if beyond > 0.0 else np.array([0.0, room[1]])
    px, py = middle + offset
    return float(px), float(py), bool(in_view)
