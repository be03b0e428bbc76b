"""A primitive of each kind, and the definition of its points."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from raytracer.scene.solids.solid import Primitive

Array = NDArray[np.float64]

# Bounded primitives of about the size 1 around the origin, by their names in scene files.
EXAMPLES: dict[str, Primitive] = {
    "box": rt.Box((-0.7, -0.5, -0.6), (0.7, 0.5, 0.6)),
    "cylinder": rt.Cylinder((0, -0.8, 0.1), (0.2, 0.8, 0), 0.6),
    "cone": rt.Cone((0, -0.8, 0), (0.1, 0.8, 0), 0.8, 0.1),
    "ellipsoid": rt.Ellipsoid((0, 0, 0), (1, 0.6, 0.8)),
    "torus": rt.Torus((0, 0, 0), (0, 1, 0.2), 0.7, 0.3),
    "polyhedron": rt.Polyhedron(((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))),
    "sphere": rt.Sphere((0, 0, 0), 0.8),
    "paraboloid": rt.Paraboloid((0.1, -0.7, 0), (0, 0.8, 0.1), 0.7),
}


def inside(shape: Any, x: Array) -> Array:
    """Return a number for each point [..., 3] by the definition of the shape: negative inside, positive outside."""
    match shape:
        case rt.Box():
            return np.max((np.subtract(shape.min, x), x - shape.max), axis=0).max(axis=-1)
        case rt.Cylinder() | rt.Cone():
            base, axis = np.array(shape.base), np.subtract(shape.top, shape.base)
            height = np.linalg.norm(axis)
            z = (x - base) @ axis / height
            distance = np.linalg.norm(np.cross(x - base, axis / height), axis=-1)
            ends = (shape.radius,) * 2 if isinstance(shape, rt.Cylinder) else (shape.base_radius, shape.top_radius)
            radius = ends[0] + (ends[1] - ends[0]) * z / height
            return np.max((distance - radius, -z, z - height), axis=0)
        case rt.Paraboloid():
            axis = np.subtract(shape.base, shape.top)
            z = (x - shape.top) @ axis / (axis @ axis)
            rho = np.linalg.norm(np.cross(x - shape.top, axis), axis=-1) / np.linalg.norm(axis)
            return np.maximum((rho / shape.radius) ** 2 - z, z - 1.0)
        case rt.Ellipsoid():
            return np.linalg.norm((x - shape.center) / shape.radii, axis=-1) - 1.0
        case rt.Sphere():
            return np.linalg.norm(x - shape.center, axis=-1) - shape.radius
        case rt.Torus():
            axis = np.array(shape.axis) / np.linalg.norm(shape.axis)
            z = (x - shape.center) @ axis
            rho = np.linalg.norm(np.cross(x - shape.center, axis), axis=-1)
            return np.hypot(rho - shape.major_radius, z) - shape.minor_radius
        case rt.Polyhedron():
            planes = hull_planes(shape.points)
            return (x @ planes[:, :3].T - planes[:, 3]).max(axis=-1)
        case _:
            raise TypeError(f"no definition of {type(shape).__name__}")


@functools.cache
def hull_planes(corners: tuple[tuple[float, float, float], ...]) -> Array:
    """Return the planes (n, offset) [P, 4] through three of the points that have all of them on one side."""
    points = np.array(corners)
    planes: list[Array] = []
    for a, b, c in itertools.combinations(points, 3):
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n)
        planes += [np.array((*side, side @ a)) for side in (n, -n) if ((points - a) @ side < 1e-12).all()]
    return np.array(planes)
