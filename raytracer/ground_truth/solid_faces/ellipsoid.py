"""The face of an ellipsoid."""

from __future__ import annotations

from raytracer.ground_truth.solid_faces.definition import Faces, ellipsoid_wall
from raytracer.scene.solids.ellipsoid import Ellipsoid


def faces(shape: Ellipsoid) -> Faces:
    """Return the faces, from the definition."""
    return Faces([], ellipsoid_wall(shape.center, shape.radii))
