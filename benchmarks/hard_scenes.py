"""Random scenes that are hard to sample, for benchmarks of the error estimate.

They have thin shells, needles, glints, lamps, lights close to surfaces, emitters, or facing mirrors, or are nearly
black or very bright.
"""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

import raytracer as rt
from benchmarks.unseen import SIZE, random_color, random_direction
from raytracer.scene.options import Shadows

KINDS = (
    "shells",
    "needles",
    "shiny",
    "polished",
    "small lamps",
    "large lamps",
    "near lights",
    "emitters",
    "facing mirrors",
    "dark",
    "bright",
)
_CAMERA = rt.Camera((0.0, 2.5, 8.0), (0.0, 0.6, 0.0), vertical_fov=38.0)
# The width of a pixel at the distance of the objects, for pictures of SIZE.
_PIXEL = 2 * 8.0 * math.tan(math.radians(19.0)) / SIZE[1]


def hard_scene(seed: int) -> tuple[rt.Scene, Shadows, str]:
    """Return the scene of a seed, its shadows, and its kind, one of KINDS."""
    rng = np.random.default_rng([11, seed])
    kind = KINDS[seed % len(KINDS)]
    kinds = get_args(Shadows)
    soft = "lamps" in kind or rng.random() < 0.5
    shadows = "soft" if soft else kinds[rng.integers(3)]
    objects = [_object(rng, kind) for _ in range(rng.integers(1, 6))]
    floor = _glossy(rng, kind) if rng.random() < 0.2 else rt.Material("lambert", rho=random_color(rng))
    objects.append(rt.Plane((0.0, 1.0, 0.0), 0.0, floor))
    if kind == "facing mirrors":
        mirror = rt.Material("mirror")
        objects.append(rt.Plane((0.0, 0.0, 1.0), -3.0, mirror) if rng.random() < 0.5 else _wall(rng, mirror))
        objects.append(rt.Sphere((float(rng.uniform(-1, 1)), 1.2, 0.0), 1.1, mirror))
    if kind == "emitters":
        for _ in range(rng.integers(1, 12)):
            place = tuple(float(v) for v in rng.uniform((-3.0, 0.3, -2.0), (3.0, 3.0, 2.0)))
            glow = rt.Material(kd=0.0, ks=0.0, ka=0.0, le=float(10 ** rng.uniform(0, 4)))
            objects.append(rt.Sphere(place, _PIXEL * float(10 ** rng.uniform(-1, 1)), glow))  # pyright: ignore[reportArgumentType]
    is_empty = kind in ("emitters", "dark") or rng.random() < 0.3
    background = (0.0, 0.0, 0.0) if is_empty else random_color(rng)
    scene = rt.Scene(objects, _lights(rng, kind), _CAMERA, background=background, ambient=background)
    if kind in ("dark", "bright"):
        scene = _scaled(scene, float(10 ** (rng.uniform(-20, -3) if kind == "dark" else rng.uniform(3, 9))))
    return scene, shadows, kind


def _wall(rng: np.random.Generator, material: rt.Material) -> rt.Solid:
    """Return a wall that faces the camera's side of the scene."""
    angle = float(rng.uniform(0.5, 1.2))
    return rt.Plane((math.sin(angle), 0.0, math.cos(angle)), -3.0, material)


def _object(rng: np.random.Generator, kind: str) -> rt.Solid | rt.Instances:
    """Return a random object near the origin, on or above the floor."""
    radius = float(rng.uniform(0.3, 1.0))
    x, y, z = float(rng.uniform(-2.5, 2.5)), radius * float(rng.uniform(0.7, 1.6)), float(rng.uniform(-1.5, 1.5))
    material = _glossy(rng, kind)
    ball = rt.Sphere((x, y, z), radius, material)
    if kind == "shells":  # a hollow ball, cut open, whose wall is 1e-3 to 1 pixels thick
        inner = rt.Sphere((x, y, z), radius - _PIXEL * float(10 ** rng.uniform(-3, 0)), _glossy(rng, kind))
        n = random_direction(rng)
        return (ball - inner) & rt.Plane(n, float(np.dot(n, (x, y, z))) + 0.3 * radius, material)
    if kind == "needles":  # a ball cut down to a thickness of 0.02 to 1 pixels along one or two axes
        solid: rt.Solid = ball
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        for axis in axes[: rng.integers(1, 3)]:
            n, d = tuple(float(v) for v in axis), float(np.dot(axis, (x, y, z)))
            thin = _PIXEL * float(10 ** rng.uniform(-1.7, 0))
            solid &= rt.Plane(n, d + thin, material)  # pyright: ignore[reportArgumentType]
            solid &= rt.Plane(tuple(-v for v in n), -d, material)  # pyright: ignore[reportArgumentType]
        return solid
    if rng.random() < 0.2:
        other = rt.Sphere((x + 0.5 * radius, y + 0.3 * radius, z), 0.8 * radius, _glossy(rng, kind))
        return ball & other if rng.random() < 0.5 else ball - other
    if rng.random() < 0.15:  # dozens of balls
        places = rng.uniform((-2.5, 0.1, -1.5), (2.5, 2.0, 1.5), (int(rng.integers(10, 60)), 3))
        return rt.Instances(rt.Sphere((0.0, 0.0, 0.0), 0.12, material), places.tolist(), 1.0)
    return ball


def _glossy(rng: np.random.Generator, kind: str) -> rt.Material:
    """Return a random material. The kinds "shiny" and "polished" get materials with narrow highlights."""
    if kind == "shiny":
        model = ("phong", "blinn", "phong_normalized", "blinn_normalized")[rng.integers(4)]
        return rt.Material(model, kd=random_color(rng, 0.0, 0.6), ks=0.4, h=float(10 ** rng.uniform(3, 6)))
    if kind == "polished":
        alpha = float(10 ** rng.uniform(-3, -1))
        if rng.random() < 0.7:
            return rt.Material("ggx", alpha=alpha, fresnel=("conductor", "schlick")[rng.integers(2)])
        return rt.Material("beckmann", alpha=alpha)
    match rng.integers(5):
        case 0:
            return rt.Material(kd=random_color(rng), ks=0.3, h=float(10 ** rng.uniform(0, 3)))
        case 1:
            return rt.Material("ggx", alpha=float(10 ** rng.uniform(-1, 0)))
        case 2:
            return rt.Material("oren_nayar", rho=random_color(rng), sigma=20.0)
    return rt.Material("lambert", rho=random_color(rng))


def _lights(rng: np.random.Generator, kind: str) -> list[rt.PointLight]:
    lights = []
    for _ in range(rng.integers(1, 4)):
        x, z = rng.uniform(-4, 4, 2)
        place, color, radius, falloff = (
            (float(x), float(rng.uniform(2, 7)), float(z)),
            float(rng.uniform(0.3, 3)),
            0.0,
            "none",
        )
        if kind == "small lamps":
            radius = float(10 ** rng.uniform(-3, -1))
        elif kind == "large lamps":
            radius = float(rng.uniform(0.5, 1.8))
        elif kind == "near lights":
            place = float(x), float(10 ** rng.uniform(-3, -0.3)), float(z)
            color, falloff = float(10 ** rng.uniform(-1, 0.5)), "inverse_square"
            radius = 0.5 * place[1] if rng.random() < 0.3 else 0.0
        elif rng.random() < 0.5:
            radius = float(rng.uniform(0.05, 0.6))
        lights.append(rt.PointLight(place, (color,) * 3, radius, falloff))  # pyright: ignore[reportArgumentType]
    return lights


def _scaled(scene: rt.Scene, factor: float) -> rt.Scene:
    """Return the scene with lights, background and ambient light multiplied by the factor."""
    lights = [
        rt.PointLight(light.position, tuple(factor * c for c in light.color), light.radius, light.falloff)  # pyright: ignore[reportArgumentType]
        for light in scene.lights
    ]
    background, ambient = (tuple(factor * c for c in color) for color in (scene.background, scene.ambient))
    return rt.Scene(scene.objects, lights, scene.camera, background=background, ambient=ambient)  # pyright: ignore[reportArgumentType]
