"""Scenes that several tests render."""

import functools
import shutil
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

import raytracer as rt

CHECKOUT = Path(__file__).parent.parent
ASSIGNMENT = CHECKOUT / "assets" / "scenes" / "assignment.toml"

COLORS = [rt.Material(kd=kd) for kd in ((0.8, 0.1, 0.1), (0.1, 0.2, 0.9), (0.1, 0.8, 0.2), (0.6, 0.6, 0.6))]


@functools.cache
def assignment() -> rt.Scene:
    return rt.load(ASSIGNMENT)


def copy_checkout(to: Path) -> None:
    """What runs: so that its shaders can be edited. `python -m raytracer` in folder `to` takes them."""
    for folder in ("raytracer", "shaders", "assets/scenes"):
        shutil.copytree(CHECKOUT / folder, to / folder, ignore=shutil.ignore_patterns("__pycache__"))


def of(
    *objects: rt.Solid | rt.Instances, eye: Sequence[float] = (0, 0, 5), at: Sequence[float] = (0, 0, 0)
) -> rt.Scene:
    """`objects` seen from `eye`, under two lights."""
    lights = [rt.PointLight((4, 7, 4)), rt.PointLight((-5, 3, 6), (0.5, 0.4, 0.3))]
    return rt.Scene(objects, lights, rt.Camera(tuple(eye), tuple(at), vertical_fov=60))  # pyright: ignore[reportArgumentType]


def under_spheres(scene: rt.Scene, *radii: float) -> rt.Scene:
    """`scene` with lights of these radii, in turn."""
    lights = [msgspec.structs.replace(l, radius=radii[i % len(radii)]) for i, l in enumerate(scene.lights)]
    return msgspec.structs.replace(scene, lights=lights)


def random_tree(rng: np.random.Generator, spheres: int) -> rt.Solid:
    """One tree of all operators over random spheres."""
    solids: list[rt.Solid] = [
        rt.Sphere(tuple(rng.uniform(-1.5, 1.5, 3)), rng.uniform(0.3, 1.5), COLORS[rng.integers(4)])
        for _ in range(spheres)
    ]
    while len(solids) > 1:
        i = rng.integers(len(solids) - 1)
        a, b = solids[i], solids.pop(i + 1)
        joined = (a | b, a & b, a - b, b - a, ~(~a & ~b), a - ~b)[rng.choice(6, p=(0.35, 0.15, 0.2, 0.1, 0.1, 0.1))]
        solids[i] = joined
    return solids[0] if rng.random() < 0.9 else ~solids[0]


def random_scene(seed: int) -> rt.Scene:
    """2 to 12 spheres in one random tree above a ground half-space; one in four has the camera in their midst."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, int(rng.integers(2, 13)))
    direction = rng.normal(size=3)
    direction[1] = abs(direction[1])
    distance = rng.uniform(0.2, 1.2) if rng.random() < 0.25 else rng.uniform(4.0, 8.0)
    eye = direction / np.linalg.norm(direction) * distance
    return of(tree, rt.Plane((0, 1, 0), -2.5, COLORS[3]), eye=tuple(eye), at=tuple(rng.uniform(-0.1, 0.1, 3)))
