"""The faces of a box."""

from __future__ import annotations

import numpy as np

from raytracer.core.validation import Vec3
from raytracer.ground_truth.solid_faces.definition import Faces, HalfSpace, vec3
from raytracer.scene.solids.box import Box


def faces(shape: Box) -> Faces:
    """Return the faces, from the definition."""
    return Faces(_box(shape.min, shape.max), None)


def _box(low: Vec3, high: Vec3) -> list[HalfSpace]:
    axes = np.eye(3)
    upper = [(vec3(axis), offset) for axis, offset in zip(axes, high, strict=True)]
    return upper + [(vec3(-axis), -offset) for axis, offset in zip(axes, low, strict=True)]
