"""Scenes that several tests render."""

import functools
import shutil
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

import raytracer as rt
from raytracer.formats.scene_file import parse_document

CHECKOUT = Path(__file__).parent.parent
ASSIGNMENT = CHECKOUT / "assets" / "scenes" / "assignment.toml"

COLORS = [rt.Material(kd=kd) for kd in ((0.8, 0.1, 0.1), (0.1, 0.2, 0.9), (0.1, 0.8, 0.2), (0.6, 0.6, 0.6))]
FLOOR = rt.Plane((0, 1, 0), 0, COLORS[3])
BALL = rt.Sphere((0, 1, 0), 1, COLORS[0]) - rt.Sphere((0.6, 1.6, 0.5), 0.7, COLORS[1])
SUN, LAMP = rt.PointLight((4, 7, 4)), rt.PointLight((-3, 2, 3), (0.5, 0.4, 0.3))

# A valid scene file, into which tests insert mistakes.
GOOD = """\
background = [0.5, 0.7, 0.9]
[camera]
position = [0, 3, 6]
look_at = [0, 2, 0]
[[lights]]
position = [4.0, 7.0, 4.0]
[materials.red]
kd = [0.64, 0.08, 0.08]
[shapes.a]
sphere = { center = [-1.0, 2.0, 0.0], radius = 1.5 }
material = "red"
[shapes.b]
plane = { normal = [0, 1, 0], offset = 0.0 }
material = "red"
[objects]
one = "a - b"
"""

# Polished metal under a point light: the light's glints, far smaller than a pixel, hold nearly all of the error.
GLINT = """\
background = [0, 0, 0]
[camera]
position = [0, 3.5, 9]
look_at = [0, 1, 0]
vertical_fov = 38
[[lights]]
position = [4, 7, 4]
color = [3, 3, 3]
[materials.grey]
model = "lambert"
[materials.metal]
model = "ggx"
alpha = 0.001
[shapes.floor]
plane = { normal = [0, 1, 0], offset = 0 }
material = "grey"
[shapes.a]
sphere = { center = [-2.2, 1, 0], radius = 1 }
material = "metal"
[shapes.b]
sphere = { center = [0, 1, 0], radius = 1 }
material = "metal"
[shapes.c]
sphere = { center = [2.2, 1, 0], radius = 1 }
material = "metal"
[objects]
floor = "floor"
a = "a"
b = "b"
c = "c"
"""


@functools.cache
def assignment() -> rt.Scene:
    return rt.load(ASSIGNMENT)


def copy_checkout(to: Path) -> None:
    """Copy the program to the folder `to`, where tests can edit its shaders.

    `python -m raytracer` in that folder runs the copy.
    """
    for folder in ("raytracer", "shaders", "assets/scenes"):
        shutil.copytree(CHECKOUT / folder, to / folder, ignore=shutil.ignore_patterns("__pycache__"))


@functools.cache
def glint() -> rt.Scene:
    return parse_document(Path("glint.toml"), GLINT).scene


def lit_scene(
    *objects: rt.Solid | rt.Instances, eye: Sequence[float] = (0, 0, 5), at: Sequence[float] = (0, 0, 0)
) -> rt.Scene:
    """Return a scene of `objects`, seen from `eye` in the direction of `at`, under two lights."""
    lights = [rt.PointLight((4, 7, 4)), rt.PointLight((-5, 3, 6), (0.5, 0.4, 0.3))]
    return rt.Scene(objects, lights, rt.Camera(tuple(eye), tuple(at), vertical_fov=60))  # pyright: ignore[reportArgumentType]


def with_light_radii(scene: rt.Scene, *radii: float) -> rt.Scene:
    """Return `scene` with these radii for its lights, repeated in order."""
    lights = [msgspec.structs.replace(l, radius=radii[i % len(radii)]) for i, l in enumerate(scene.lights)]
    return msgspec.structs.replace(scene, lights=lights)


def lens(x: float, y: float, z: float, scale: float = 1.0) -> rt.Solid:
    """Return the intersection of two spheres, with a bite taken out."""
    a, b, c = ((x + dx * scale, y, z + dz * scale) for dx, dz in ((-0.4, 0), (0.4, 0), (0.1, 0.6)))
    return (rt.Sphere(a, scale, COLORS[0]) & rt.Sphere(b, scale, COLORS[1])) - rt.Sphere(c, 0.7 * scale, COLORS[2])


def still_life(
    *more: rt.Solid,
    lights: Sequence[rt.PointLight] = (SUN,),
    eye: tuple[float, float, float] = (0, 3, 6),
    at: tuple[float, float, float] = (0, 1, 0),
    fov: float = 53.13,
) -> rt.Scene:
    """Return a scene with a cut sphere on the ground, and more solids."""
    return rt.Scene([BALL, FLOOR, *more], lights, rt.Camera(eye, at, vertical_fov=fov))


def with_lights(scene: rt.Scene, *lights: rt.PointLight) -> rt.Scene:
    return msgspec.structs.replace(scene, lights=lights)


def random_light(rng: np.random.Generator, low: float, high: float) -> rt.PointLight:
    """Return a light in a random direction, mostly from above, at a distance of 10^low to 10^high."""
    place = rng.normal(size=3)
    place *= 10.0 ** rng.uniform(low, high) / np.linalg.norm(place)
    if rng.random() < 0.8:
        place[1] = abs(place[1])
    return rt.PointLight(tuple(place.tolist()), tuple(rng.uniform(0, 1, 3).tolist()))


def random_tree(rng: np.random.Generator, spheres: int) -> rt.Solid:
    """Return a random tree over random spheres, with all operators."""
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
    """Return a random tree of 2 to 12 spheres above a ground. One camera in four is among the spheres."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, int(rng.integers(2, 13)))
    direction = rng.normal(size=3)
    direction[1] = abs(direction[1])
    distance = rng.uniform(0.2, 1.2) if rng.random() < 0.25 else rng.uniform(4.0, 8.0)
    eye = direction / np.linalg.norm(direction) * distance
    return lit_scene(tree, rt.Plane((0, 1, 0), -2.5, COLORS[3]), eye=tuple(eye), at=tuple(rng.uniform(-0.1, 0.1, 3)))
