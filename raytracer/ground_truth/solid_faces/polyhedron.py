"""The faces of a polyhedron."""

from __future__ import annotations

import math

from raytracer.ground_truth.solid_faces.definition import Faces, HalfSpace
from raytracer.scene.solids.polyhedron import Polyhedron


def faces(shape: Polyhedron) -> Faces:
    """Return the faces, from the definition."""
    planes: list[HalfSpace] = []
    for (x, y, z), low, high in shape.slabs():
        planes += [((x, y, z), high)] if math.isfinite(high) else []
        planes += [((-x, -y, -z), -low)] if math.isfinite(low) else []
    return Faces(planes, None)
