"""The definition of the faces of any primitive."""

from __future__ import annotations

from importlib import import_module

from raytracer.ground_truth.solid_faces.definition import Faces
from raytracer.scene.solids.solid import Primitive


def find_faces(shape: Primitive) -> Faces:
    """Return the faces of a primitive other than a half-space: the module of its name here has their definition."""
    kind = type(shape).__name__.lower()
    return import_module(f"{__package__}.{kind}").faces(shape)
