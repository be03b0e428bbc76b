"""Rays from points to a light, in float64: ray_tracer.py looks along them, by a rule of its own."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import MAX_COLOR, MIN_RADIUS
from raytracer.scene.lights import PointLight
from raytracer.scene.solids import Primitive, Sphere

Array = NDArray[np.float64]


def ends_on(leaf: Primitive, light: PointLight) -> bool:
    """Whether rays to a light end on a leaf's surface: the point lies on it, or the sphere is the light's own."""
    if light.radius:
        return isinstance(leaf, Sphere) and light.is_bulb(leaf)
    return leaf.touches(light.position)


def light_rays(
    light: PointLight,
    to_center: Array,
    own: NDArray[np.bool_],
    n: Array,
    rays: int,
    shift: Array | None = None,
) -> Iterator[tuple[Array, Array, Array]]:
    """(L, distance, irradiance) of the rays from points to a light: one, or `rays` x `rays` to a sphere.

    `to_center` (R, 3) goes from the points to the light's centre; of a point on the light's `own` sphere `n` is the
    outward normal. `irradiance` (R, 3) is that on a surface across the ray: the light's radiance times the ray's solid
    angle. Rays go through the middles of parts, of equal solid angle, of the directions in which the sphere is seen, or
    of each point's parts through the places that its `shift` (R, 2) in [0, 1) says: where that is random and all places
    are as likely, each point's mean over its rays is right in the mean, however few they are.
    """
    d = np.linalg.norm(to_center, axis=1)
    W = to_center / np.where(d == 0.0, 1.0, d)[:, None]
    I = np.broadcast_to(light.color, W.shape)
    if light.falloff == "inverse_square":
        nearest = np.maximum(d, max(light.radius, MIN_RADIUS))
        I = np.minimum(I / nearest[:, None] ** 2, MAX_COLOR)
    if not light.radius:
        yield W, d, I
        return
    r = light.radius
    d, W = np.where(own, r, d), np.where(own[:, None], -n, W)  # half of all directions go into it
    around = ~own & (d <= r)
    W[d == 0.0] = 0.0, 0.0, 1.0
    sine = r / np.maximum(d, r)
    opening = np.where(around, 2.0, sine**2 / (1.0 + np.sqrt(1.0 - sine**2)))  # 1 - cosine of the cone's half angle
    radiance = I / (math.pi * sine**2)[:, None]
    U = np.cross(W, np.eye(3)[np.argmin(np.abs(W), axis=1)])
    U /= np.linalg.norm(U, axis=1, keepdims=True)
    across, around_it = (0.5, np.full(len(d), 0.5)) if shift is None else shift.T
    for i, j in itertools.product(range(rays), repeat=2):
        off, angle = (i + across) / rays * opening, (2.0 * math.pi * (j + around_it) / rays)[:, None]
        side = np.sqrt(off * (2.0 - off))
        L = (1.0 - off)[:, None] * W + side[:, None] * (np.cos(angle) * U + np.sin(angle) * np.cross(W, U))
        half_chord = np.sqrt(np.maximum(r**2 - (d * side) ** 2, 0.0))
        distance = d * (1.0 - off) + np.where(own | around, half_chord, -half_chord)
        yield L, distance, radiance * (2.0 * math.pi * opening / rays**2)[:, None]
