"""Random ordinary scenes for benchmarks of the error estimate.

They have all kinds of materials, soft shadows, mirrors and thin features.
"""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

import raytracer as rt
from raytracer.scene.options import Shadows

# The picture size for which thin features are designed: their widths are multiples of a pixel at the look-at point.
SIZE = (480, 270)


def random_color(rng: np.random.Generator, low: float = 0.05, high: float = 0.95) -> tuple[float, float, float]:
    r, g, b = rng.uniform(low, high, 3)
    return float(r), float(g), float(b)


def random_direction(rng: np.random.Generator) -> tuple[float, float, float]:
    x, y, z = rng.normal(size=3)
    length = math.sqrt(x * x + y * y + z * z)
    return float(x / length), float(y / length), float(z / length)


def _material(rng: np.random.Generator) -> rt.Material:
    color = random_color(rng)
    match rng.integers(12):
        case 0 | 1 | 2:
            return rt.Material(ka=color, kd=color, ks=random_color(rng, 0, 0.6), h=float(10 ** rng.uniform(0, 3)))
        case 3:
            return rt.Material(
                "blinn", ka=color, kd=color, ks=random_color(rng, 0, 0.6), h=float(10 ** rng.uniform(0, 3))
            )
        case 4 | 5:
            return rt.Material("ggx", alpha=float(10 ** rng.uniform(-1, 0)))
        case 6 | 7:
            return rt.Material("oren_nayar", rho=color, sigma=float(rng.uniform(0, 40)))
        case 8 | 9:
            return rt.Material("lambert", rho=color)
        case 10:
            return rt.Material("cook_torrance", m=float(10 ** rng.uniform(-1, 0)))
    return rt.Material("mirror")


def _solid(rng: np.random.Generator, pixel: float) -> rt.Solid | rt.Instances:
    """Return a random object near the origin, about 1 in size. `pixel`: the width of a pixel there."""
    center = tuple(float(v) for v in rng.uniform(-1.5, 1.5, 3))
    assert len(center) == 3
    a, b = _material(rng), _material(rng)
    ball = rt.Sphere(center, float(rng.uniform(0.3, 0.9)), a)
    match rng.integers(6):
        case 0:
            return ball
        case 1:  # a lens, or a ball with a bite
            x, y, z = center
            other = rt.Sphere((x + 0.4, y + 0.2, z - 0.3), float(rng.uniform(0.3, 0.7)), b)
            return ball & other if rng.random() < 0.5 else ball - other
        case 2:  # a bowl with a wall of 0.5 to 4 pixels
            n = random_direction(rng)
            inner = rt.Sphere(center, ball.radius - pixel * float(rng.uniform(0.5, 4)), b)
            return (ball - inner) & rt.Plane(n, float(np.dot(n, center)) + 0.2, a)
        case 3:  # a plate with a thickness of 0.3 to 3 pixels
            n = random_direction(rng)
            d = float(np.dot(n, center))
            thin = pixel * float(rng.uniform(0.3, 3))
            return ball & rt.Plane(n, d + thin, b) & rt.Plane((-n[0], -n[1], -n[2]), -d, b)
        case 4:  # a cube of half-spaces
            sides = [rt.Plane((0, 0, 1), center[2] + 0.4, a), rt.Plane((0, 0, -1), -center[2] + 0.4, a)]
            angle = float(rng.uniform(0, math.pi / 2))
            for k in range(4):
                n = math.cos(angle + k * math.pi / 2), math.sin(angle + k * math.pi / 2), 0.0
                sides.append(rt.Plane(n, float(np.dot(n, center)) + 0.4, b))
            solid: rt.Solid = sides[0]
            for side in sides[1:]:
                solid = solid & side
            return solid
    return rt.Instances(  # dust: balls with radii of 0.1 to 1.6 pixels
        rt.Sphere((0, 0, 0), pixel, a),
        rng.uniform(-1.5, 1.5, (int(rng.integers(20, 150)), 3)).tolist(),
        float(10 ** rng.uniform(-1.0, 0.2)),
    )


def unseen(seed: int) -> tuple[rt.Scene, Shadows]:
    """Return the scene of a seed, and its shadows."""
    rng = np.random.default_rng([7, seed])
    fov = float(rng.uniform(25, 70))
    distance = 3.0 / math.tan(math.radians(fov) / 2)
    eye = np.multiply(random_direction(rng), distance)
    eye[1] = abs(eye[1]) + 0.2
    pixel = 2 * distance * math.tan(math.radians(fov) / 2) / SIZE[1]
    objects: list[rt.Solid | rt.Instances] = [_solid(rng, pixel) for _ in range(rng.integers(1, 7))]
    if rng.random() < 0.7:
        objects.append(rt.Plane((0, 1, 0), -1.6, _material(rng)))
    lights = []
    for _ in range(rng.integers(1, 3)):
        place = np.multiply(random_direction(rng), rng.uniform(3, 9))
        place[1] = abs(place[1]) + 1
        radius = float(rng.uniform(0.05, 1.0)) if rng.random() < 0.7 else 0.0
        lights.append(rt.PointLight(tuple(float(v) for v in place), random_color(rng, 0.2, 1.5), radius))  # pyright: ignore[reportArgumentType]
    up = random_direction(rng) if rng.random() < 0.5 else (0.0, 1.0, 0.0)
    camera = rt.Camera(tuple(float(v) for v in eye), (0, 0, 0), up, fov)  # pyright: ignore[reportArgumentType]
    kinds = get_args(Shadows)
    shadows = "soft" if rng.random() < 0.5 else kinds[rng.integers(3)]
    return rt.Scene(objects, lights, camera, background=random_color(rng)), shadows
