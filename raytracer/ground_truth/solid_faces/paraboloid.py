"""The faces of a paraboloid."""

from __future__ import annotations

import math

import numpy as np

from raytracer.core.validation import Vec3
from raytracer.ground_truth.solid_faces.definition import Faces, WallDefinition, find_ends, make_frame, round_direction
from raytracer.scene.solids.paraboloid import Paraboloid


def faces(shape: Paraboloid) -> Faces:
    """Return the faces, from the definition."""
    return Faces(find_ends(shape.base, shape.top)[:1], _wall(shape.base, shape.top, shape.radius))


def _wall(base: Vec3, top: Vec3, radius: float) -> WallDefinition:
    """Return the surface x^2 + y^2 = z, with x and y in radii and z in heights: 4 z is (z + 1)^2 - (z - 1)^2."""
    axis = np.subtract(base, top)
    height = float(np.linalg.norm(axis))
    u, v, w = make_frame(axis)
    rows = np.array((w / (2.0 * height), u / radius, v / radius, w / (2.0 * height)))
    # Paraboloids of one curved surface have the same wall, wherever they end. Their parameters differ by roundings.
    mantissa, exponent = math.frexp(radius * (radius / height))
    key = "paraboloid", top, *round_direction(w), *round_direction(np.array([mantissa])), exponent
    return WallDefinition("quadric", base, rows, 1.0, key)
