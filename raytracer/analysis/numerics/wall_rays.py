"""Random curved walls under random maps, and rays at them, in float64 and as the shaders take them."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.rounding_bounds import UNIT, Array, Rays, RoundedView
from raytracer.analysis.wall_bounds import Forms

Kind = Literal["cylinder", "ellipsoid", "cone", "torus"]
Aim = Literal["at", "inside", "tangent", "axis", "generator"]
Floats = NDArray[np.float32]

# No rotation, and a picture of 1920 x 1080 pixels.
VIEW = RoundedView(np.eye(3), (0.0, 0.0, 0.0), 3000, UNIT[32])


class Walls(NamedTuple):
    """Walls in their own space, |y| <= 1 or so, and their places x = c + M y in view space, (N, ..) each."""

    own: Array  # the forms (N, 4, 4), their slopes and then their constants
    M: Array  # the map's axes are perpendicular, and their lengths are the half sizes
    size: Array  # the largest half size


class WallRays(NamedTuple):
    """Rays at walls: the numbers that a shader takes, and those that they are rounded from."""

    rays: Rays
    forms: Forms
    size: Array  # the walls' sizes (N,)
    scale: Array  # the largest length that counts: the size, or a distance (N,)
    p: Floats  # the forms at the rays' origins (N, 4)
    d: Floats  # their slopes
    power: Floats  # wallPower(p)


def random_walls(kind: Kind, count: int, aspect: float, rng: np.random.Generator) -> Walls:
    """Return walls of sizes 1e-3 to 1e3 whose half sizes differ by up to the factor `aspect`."""
    own = np.zeros((count, 4, 4))
    own[:, 0, 3] = 1.0
    for i in range(3 if kind in ("ellipsoid", "torus") else 2):
        own[:, i + 1, i] = 1.0
    if kind == "cone":
        # l0 = 1 + k z; one in four is a cone whose apex is a point of the solid.
        own[:, 0, 2] = rng.uniform(-1.0, 1.0, count)
        own[: count // 4, 0, 2] = np.sign(own[: count // 4, 0, 2])
    elif kind == "torus":
        own[:, 0, 3] = np.float32(10.0 ** rng.uniform(-2.0, -0.02, count))
    size = 10.0 ** rng.uniform(-3.0, 3.0, count)
    half = 10.0 ** rng.uniform(-np.log10(aspect), 0.0, (count, 3))
    half[:, 0] = 1.0
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    return Walls(own, axes * (rng.permuted(half, axis=1) * size[:, None])[:, None, :], size)


def points_on(kind: Kind, walls: Walls, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return random points of the walls in their own space, and the outward gradients there (N, 3)."""
    count = len(walls.size)
    level, height = walls.own[:, 0, 3], walls.own[:, 0, 2]
    turn, tilt = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1)
    z = rng.uniform(-1.0, 1.0, count)[:, None] * [0.0, 0.0, 1.0]
    if kind == "torus":
        gradient = ring * np.cos(tilt)[:, None] + np.sin(tilt)[:, None] * [0.0, 0.0, 1.0]
        return ring + level[:, None] * gradient, gradient
    if kind == "ellipsoid":
        gradient = ring * np.sqrt(1.0 - z[:, 2:] ** 2) + z
        return gradient, gradient
    return ring * (level + height * z[:, 2])[:, None] + z, ring - height[:, None] * [0.0, 0.0, 1.0]


def place(walls: Walls, c: Array) -> Forms:
    """Return the walls' forms in view space. Their values are lengths, but for tori."""
    w = walls.own[:, :, :3] @ np.linalg.inv(walls.M)
    longest = np.linalg.norm(w, axis=2).max(axis=1)[:, None]
    scale = np.where(walls.own[:, :1, 3] == 1.0, np.maximum(longest, 1e-300), 1.0)
    constant = walls.own[:, :, 3] - (w @ c[:, :, None])[..., 0]
    return Forms(w / scale[..., None], constant / scale)


def rays_at(kind: Kind, aim: Aim, camera: bool, count: int, aspect: float, rng: np.random.Generator) -> WallRays:
    """Return random walls, and a ray at each, from 1e-3 to 1e4 sizes away. Camera rays start at the origin.

    `aim`: at the solid; from inside it; tangent, off by up to a tenth of the size; along the axis; along a generator.
    """
    walls = random_walls(kind, count, aspect, rng)
    on, gradient = points_on(kind, walls, rng)
    away = 10.0 ** rng.uniform(-3.0, 4.0, (count, 1))
    off = 10.0 ** rng.uniform(-9.0, -1.0, (count, 1)) * rng.choice((-1.0, 1.0), (count, 1))
    depth = walls.own[:, :1, 3] if kind == "torus" else np.ones((count, 1))
    target = rng.uniform(-1.1, 1.1, (count, 3))
    direction = rng.normal(size=(count, 3))
    if aim == "inside":
        target, away = on - depth * rng.uniform(0.1, 0.9, (count, 1)) * gradient, 0.0 * away
    elif aim == "tangent":
        target, direction = on + depth * off * gradient, np.cross(gradient, direction)
    elif aim == "axis":
        direction = direction[:, 2:] * [0.0, 0.0, 1.0]
    elif aim == "generator":
        direction = on * [1.0, 1.0, 0.0] / np.linalg.norm(on[:, :2], axis=1)[:, None] * walls.own[:, :1, 2]
        direction = direction + [0.0, 0.0, 1.0] + 0.01 * off * rng.normal(size=(count, 3))
        target = on * (1.0 + off)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    # The rays in view space. If the camera is elsewhere, it is 0.1 to 1e3 sizes away.
    start, rd = ((walls.M @ v[:, :, None])[..., 0] for v in (target - away * direction, direction))
    rd /= np.linalg.norm(rd, axis=1)[:, None]
    distance = np.linalg.norm(start, axis=1)
    c, ro = -start, np.zeros((count, 3))
    if not camera:
        c = rng.normal(size=(count, 3))
        c *= (walls.size * 10.0 ** rng.uniform(-1.0, 3.0, count) / np.linalg.norm(c, axis=1))[:, None]
        ro, rd = (v.astype(np.float32).astype(float) for v in (c + start, rd))
    scale = np.maximum(np.maximum(distance, walls.size), 0.0 if camera else np.linalg.norm(c, axis=1))
    none = np.zeros(count)
    rays, forms = Rays(ro, rd, none, none, camera), place(walls, c)
    return WallRays(rays, forms, walls.size, scale, *_rounded(rays, forms, rng))


def _rounded(rays: Rays, forms: Forms, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Return p, d and the power, rounded by the host for camera rays, and by a shader for others."""
    if rays.camera:
        p, d = forms.c, (forms.w @ rays.rd[:, :, None])[..., 0]
        d = d * (1.0 + rng.uniform(-5.0, 5.0, d.shape) * UNIT[32])  # the error of cameraSlope()
        return p.astype(np.float32), d.astype(np.float32), _power(p).astype(np.float32)
    numbers = forms.w, forms.c, rays.ro[:, None], rays.rd[:, None]
    w, c, ro, rd = (np.asarray(x, np.float32) for x in numbers)
    p, d = (
        np.asarray(w[..., 0] * x[..., 0] + w[..., 1] * x[..., 1] + w[..., 2] * x[..., 2], np.float32) for x in (ro, rd)
    )
    return p + c, d, _power(p + c)


def _power(p: Any) -> Any:
    """Return wallPower(p) in the precision of p."""
    return p[:, 0] * p[:, 0] - (p[:, 1] * p[:, 1] + p[:, 2] * p[:, 2] + p[:, 3] * p[:, 3])
