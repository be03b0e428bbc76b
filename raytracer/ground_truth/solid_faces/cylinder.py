"""The faces of a cylinder."""

from __future__ import annotations

import numpy as np

from raytracer.core.validation import Vec3
from raytracer.ground_truth.solid_faces.definition import (
    ROUNDED,
    Faces,
    WallDefinition,
    find_ends,
    make_frame,
    round_direction,
)
from raytracer.scene.solids.cylinder import Cylinder


def faces(shape: Cylinder) -> Faces:
    """Return the faces, from the definition."""
    return Faces(find_ends(shape.base, shape.top), _cylinder(shape.base, shape.top, shape.radius))


def _cylinder(base: Vec3, top: Vec3, radius: float) -> WallDefinition:
    u, v, w = make_frame(np.subtract(top, base))
    rows = np.array((np.zeros(3), u, v, np.zeros(3))) / radius
    # Cylinders along the same line, of any two ends, have the same wall: the line's direction, up to its sign, and its
    # point nearest to the origin. They are rounded, since other ends of the line give other last bits.
    forward = w * np.sign(w[np.argmax(np.abs(w) > ROUNDED)])
    foot = np.array(base) - (np.array(base) @ w) * w
    unit = radius + np.abs(foot).max()
    key = "cylinder", radius, *round_direction(forward), *(round_direction(foot / unit) if foot.any() else foot)
    return WallDefinition("quadric", base, rows, 1.0, key)
