"""The face of a ball."""

from __future__ import annotations

from raytracer.ground_truth.solid_faces.definition import Faces, ellipsoid_wall
from raytracer.scene.solids.sphere import Sphere


def faces(shape: Sphere) -> Faces:
    """Return the faces, from the definition."""
    return Faces([], ellipsoid_wall(shape.center, (shape.radius, shape.radius, shape.radius)))
