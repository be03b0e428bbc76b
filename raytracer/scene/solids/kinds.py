"""The registry of the kinds of primitives, by their keys in scene files."""

from __future__ import annotations

from raytracer.scene.solids.box import Box
from raytracer.scene.solids.cone import Cone
from raytracer.scene.solids.cylinder import Cylinder
from raytracer.scene.solids.ellipsoid import Ellipsoid
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.polyhedron import Polyhedron
from raytracer.scene.solids.solid import Primitive
from raytracer.scene.solids.sphere import Sphere
from raytracer.scene.solids.torus import Torus

# To add a kind: its module in this folder, and a line here (docs/architecture.md).
KINDS: dict[str, type[Primitive]] = {
    "sphere": Sphere,
    "plane": Plane,
    "box": Box,
    "cylinder": Cylinder,
    "cone": Cone,
    "ellipsoid": Ellipsoid,
    "torus": Torus,
    "polyhedron": Polyhedron,
}
