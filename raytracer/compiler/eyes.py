"""The eyes of a picture: the camera, and the camera's images in flat mirrors.

A flat mirror shows the reversed view of the camera's image behind the mirror.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.features import Features
from raytracer.compiler.view_space import pixel_scale, rotation
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera

Array = NDArray[np.float64]

# The area of the largest feature, in square pixels: two samples of each pixel meet it four times.
_LARGEST = 2.0
# The most eyes of a picture. A room with six flat mirrors has seven eyes with one bounce; two facing mirrors have seven
# with three bounces.
MOST_EYES = 8
# The distance from which a pinhole camera stands for an orthographic one, in heights of the picture: its rays are
# parallel to within half of 2^-20, so far less than the factor to which features are known.
_FAR = 2.0**20


class Mirror(NamedTuple):
    """A mirroring plane dot(normal, x) = offset, with the factor of the mirrored light."""

    normal: Array  # (3,), unit
    offset: float
    factor: Array  # (3,)


class Eye(NamedTuple):
    """A camera and its picture, or the image of a camera in the flat mirror `behind`."""

    position: Array
    rotation: Array
    focal: float  # in pixels
    size: tuple[int, int]
    factor: Array  # (3,): the factor of all light that the eye sees
    behind: Mirror | None = None
    nearest: float = 0.0  # the least depth that the eye sees

    def image(self, mirror: Mirror) -> Eye:
        """Return the eye's image in `mirror`."""
        normal = mirror.normal
        return self._replace(
            position=self.position - 2.0 * (normal @ self.position - mirror.offset) * normal,
            rotation=self.rotation - 2.0 * np.outer(self.rotation @ normal, normal),
            factor=self.factor * mirror.factor,
            behind=mirror,
        )

    def _is_before(self, points: Array, margins: Array | float) -> NDArray[np.bool_]:
        """Return which points (N, 3) are in front of the mirror `behind`, or within the margins of it.

        In front means on the other side than the eye's image.
        """
        if self.behind is None:
            return np.ones(len(points), bool)
        normal, offset, _ = self.behind
        return np.sign(offset - normal @ self.position) * (points @ normal - offset) > -margins

    def sees(self, centers: Array, radii: Array) -> NDArray[np.bool_]:
        """Return which spheres (N,) may be in the picture. Spheres around the camera do not count."""
        x, y, z = self.rotation @ (centers - self.position).T
        seen = -z > self.nearest - radii
        for side, pixels in ((x, self.size[0]), (y, self.size[1])):
            slope = pixels / (2.0 * self.focal)
            seen &= np.abs(side) <= slope * -z + radii * math.hypot(1.0, slope)
        return seen & (x * x + y * y + z * z > radii * radii) & self._is_before(centers, radii)

    def features(self, points: Array, solid_angles: Array, images: Array, radiance: Array) -> Features:
        """Return the features at `points` (..., 3), with `radiance` (..., 3), that are in the picture and small.

        `solid_angles` and `images` (...), in sr, become the areas and pixels of the features.
        """
        lit = (solid_angles > 0.0) & radiance.any(axis=-1)
        points, solid_angles, images, radiance = points[lit], solid_angles[lit], images[lit], radiance[lit]
        x, y, z = self.rotation @ (points - self.position).T
        depth = -z
        columns = self.size[0] / 2.0 + self.focal * x / depth
        rows = self.size[1] / 2.0 - self.focal * y / depth
        # A pixel off the picture's middle covers less solid angle.
        scale = self.focal**2 * np.power(1.0 + (x * x + y * y) / (depth * depth), 1.5)
        areas = scale * solid_angles
        chosen = (
            (depth > self.nearest) & (columns >= 0) & (rows >= 0) & (columns < self.size[0]) & (rows < self.size[1])
        )
        chosen &= (areas < _LARGEST) & self._is_before(points, 0.0)
        return Features(
            columns[chosen],
            rows[chosen],
            areas[chosen],
            np.maximum((scale * images)[chosen], 1.0),
            self.factor * radiance[chosen],
        )


def eyes(camera: Camera, place: Vec3, size: tuple[int, int], mirrors: Sequence[Mirror], bounces: int) -> list[Eye]:
    """Return the camera of a picture of `size` (width, height) and its images in `mirrors` after up to `bounces`
    bounces.

    `place` is the position of the camera, or for an orthographic camera any position from which it sees the same.
    There are at most MOST_EYES: the eyes with the fewest bounces.
    """
    position, focal, nearest = np.array(place), 0.5 / pixel_scale(camera, size[1]), 0.0
    if camera.height is not None:
        nearest = _FAR * camera.height
        position, focal = position - nearest * np.array(camera.axes()[2]), nearest * focal
    made = latest = [Eye(position, rotation(camera), focal, size, np.ones(3), nearest=nearest)]
    for _ in range(bounces if mirrors else 0):
        latest = [eye.image(mirror) for eye in latest for mirror in mirrors if mirror is not eye.behind]
        made = [*made, *latest][:MOST_EYES]
        if not latest or len(made) == MOST_EYES:
            break
    return made
