"""Shadow rays: directions, distances and irradiance of the rays from surface points to a light, in float64."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import MAX_COLOR, MIN_RADIUS
from raytracer.scene.lights import PointLight

Array = NDArray[np.float64]


def light_rays(
    light: PointLight,
    to_center: Array,
    own: NDArray[np.bool_],
    n: Array,
    rays: int,
    shift: Array | None = None,
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield (L, distance, irradiance) of the rays from points to a light: one ray, or `rays` x `rays` to a sphere.

    The directions to a spherical light are divided into `rays` x `rays` parts of equal solid angle, with a ray in each.
    With uniformly random shifts, the mean over a point's rays is unbiased, however few they are.

    Args:
        light: the light.
        to_center: vectors from the points to the light's centre [R, 3].
        own: whether the point lies on the light's own sphere [R].
        n: outward normals of these spheres, used where `own` is true [R, 3].
        rays: the square root of the number of rays to a sphere.
        shift: the position of the ray in its part, in [0, 1), for each point [R, 2]. None: the middle of the part.

    Yields:
        L: unit vectors towards the light [R, 3].
        distance: the distance to the light along the ray [R].
        irradiance: the irradiance on a surface perpendicular to the ray: the light's radiance times the solid angle of
            the part [R, 3].
    """
    d = np.linalg.norm(to_center, axis=1)
    W = to_center / np.where(d == 0.0, 1.0, d)[:, None]
    I = np.broadcast_to(light.color, W.shape)
    match light.falloff:
        case "none":
            pass
        case "inverse_square":
            nearest = np.maximum(d, max(light.radius, MIN_RADIUS))
            I = np.minimum(I / nearest[:, None] ** 2, MAX_COLOR)
        case _:
            assert_never(light.falloff)
    if not light.radius:
        yield W, d, I
        return
    r = light.radius
    d, W = np.where(own, r, d), np.where(own[:, None], -n, W)  # from its surface, the sphere fills a half-space
    inside = ~own & (d <= r)
    W[d == 0.0] = 0.0, 0.0, 1.0
    sine = r / np.maximum(d, r)
    opening = np.where(inside, 2.0, sine**2 / (1.0 + np.sqrt(1.0 - sine**2)))  # 1 - cosine of the cone's half angle
    radiance = I / (math.pi * sine**2)[:, None]
    U = np.cross(W, np.eye(3)[np.argmin(np.abs(W), axis=1)])
    U /= np.linalg.norm(U, axis=1, keepdims=True)
    polar_shift, azimuth_shift = (0.5, np.full(len(d), 0.5)) if shift is None else shift.T
    for i, j in itertools.product(range(rays), repeat=2):
        # 1 - cosine of the angle to the cone's axis, and the azimuth around the axis.
        versine, angle = (i + polar_shift) / rays * opening, (2.0 * math.pi * (j + azimuth_shift) / rays)[:, None]
        ray_sine = np.sqrt(versine * (2.0 - versine))
        L = (1.0 - versine)[:, None] * W + ray_sine[:, None] * (np.cos(angle) * U + np.sin(angle) * np.cross(W, U))
        half_chord = np.sqrt(np.maximum(r**2 - (d * ray_sine) ** 2, 0.0))
        distance = d * (1.0 - versine) + np.where(own | inside, half_chord, -half_chord)
        yield L, distance, radiance * (2.0 * math.pi * opening / rays**2)[:, None]
