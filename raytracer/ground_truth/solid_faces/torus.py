"""The face of a torus."""

from __future__ import annotations

import numpy as np

from raytracer.core.validation import Vec3
from raytracer.ground_truth.solid_faces.definition import ROUNDED, Faces, WallDefinition, make_frame, round_direction
from raytracer.scene.solids.torus import Torus


def faces(shape: Torus) -> Faces:
    """Return the faces, from the definition."""
    return Faces([], _torus(shape.center, shape.axis, shape.major_radius, shape.minor_radius))


def _torus(center: Vec3, axis: Vec3, major: float, minor: float) -> WallDefinition:
    u, v, w = make_frame(np.array(axis))
    rows = np.array((np.zeros(3), u, v, w)) / major
    forward = w * np.sign(w[np.argmax(np.abs(w) > ROUNDED)])
    return WallDefinition(
        "torus", center, rows, minor / major, ("torus", center, *round_direction(forward), major, minor)
    )
