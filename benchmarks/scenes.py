"""Scenes of the benchmarks, the same in each run."""

import functools
import math
import operator

import numpy as np

import raytracer as rt

_HOLES = 999


def paint(r: float, g: float, b: float) -> rt.Material:
    """Return a material of a color, with the ambient and diffuse shares of the assignment."""
    return rt.Material(ka=(0.15 * r, 0.15 * g, 0.15 * b), kd=(0.8 * r, 0.8 * g, 0.8 * b))


RED, BLUE, GREEN, GREY = paint(0.8, 0.1, 0.1), paint(0.1, 0.2, 0.9), paint(0.1, 0.8, 0.2), paint(0.6, 0.6, 0.6)


def many(n: int) -> rt.Scene:
    """Return a scene of `n` lenses with a bite, in random directions, above the ground.

    Larger `n` makes them smaller.
    """
    rng = np.random.default_rng(1)
    centers = rng.uniform((-10.0, 0.2, -20.0), (10.0, 6.0, 2.0), (n, 3))
    radii = rng.uniform(0.15, 0.45, n) * 0.6 * (1000.0 / n) ** (1.0 / 3.0)
    along, aside = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, n, 3)))

    def spheres(offsets: np.ndarray, share: float, material: rt.Material) -> list[rt.Solid]:
        places = (centers + radii[:, None] * offsets).tolist()
        return [rt.Sphere(place, share * r, material) for place, r in zip(places, radii.tolist(), strict=True)]

    parts = spheres(0.4 * along, 1.0, RED), spheres(-0.4 * along, 1.0, BLUE), spheres(0.8 * aside, 0.7, GREEN)
    solids = [(a & b) - c for a, b, c in zip(*parts, strict=True)]
    return rt.Scene(
        [*solids, rt.Plane((0, 1, 0), 0, GREY)],
        [rt.PointLight((4, 12, 8))],
        rt.Camera((0, 3, 6), (0, 2, 0)),
        name=f"{n} objects",
    )


def holes(chain: bool) -> rt.Scene:
    """Return a scene of a sphere minus 999 small spheres near its surface.

    With `chain` the spheres are subtracted one by one, which makes a tree 999 deep on its left. Otherwise a balanced
    union of the spheres is subtracted. Both trees describe the same solid.
    """
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(_HOLES, 3))
    centers = directions / np.linalg.norm(directions, axis=1, keepdims=True) * rng.uniform(0.9, 1.02, (_HOLES, 1))
    radii = rng.uniform(0.04, 0.12, _HOLES)
    ball = rt.Sphere((0, 0, 0), 1, RED)
    bites: list[rt.Solid] = [rt.Sphere(c, r, GREEN) for c, r in zip(centers.tolist(), radii.tolist(), strict=True)]
    solid = functools.reduce(operator.sub, bites, ball) if chain else ball - _balanced(bites)
    fov = math.degrees(
        2.0 * math.atan(math.tan(math.radians(30.0)) * 9.0 / 16.0)
    )  # a horizontal field of view of 60 degrees
    camera = rt.Camera((0, 0, 4), (0, 0, 0), vertical_fov=fov)
    return rt.Scene([solid], [rt.PointLight((4, 7, 4))], camera, name=f"sphere minus {_HOLES}")


def _balanced(solids: list[rt.Solid]) -> rt.Solid:
    while len(solids) > 1:
        pairs = [a | b for a, b in zip(solids[::2], solids[1::2], strict=False)]
        solids = pairs + solids[2 * len(pairs) :]
    return solids[0]
