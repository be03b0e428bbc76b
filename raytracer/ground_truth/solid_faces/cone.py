"""The faces of a cone or a frustum."""

from __future__ import annotations

import numpy as np

from raytracer.core.validation import Vec3
from raytracer.ground_truth.solid_faces.definition import Faces, WallDefinition, find_ends, make_frame
from raytracer.scene.solids.cone import Cone


def faces(shape: Cone) -> Faces:
    """Return the faces, from the definition."""
    radii = shape.base_radius, shape.top_radius
    return Faces(find_ends(shape.base, shape.top), _cone(shape.base, shape.top, radii))


def _cone(base: Vec3, top: Vec3, radii: tuple[float, float]) -> WallDefinition:
    axis = np.subtract(top, base)
    u, v, w = make_frame(axis)
    largest = max(radii)
    slope = (radii[1] - radii[0]) / np.linalg.norm(axis)
    rows = np.array((slope * w, u, v, np.zeros(3))) / largest
    return WallDefinition("quadric", base, rows, radii[0] / largest, ("cone", base, top, radii))
