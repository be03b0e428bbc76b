"""The registry of the kinds of primitives: `rt` and scene files have each class that this file imports.

To add a kind: its module in this folder, and a line here (docs/architecture.md).
"""

from raytracer.scene.solids.box import Box as Box
from raytracer.scene.solids.cone import Cone as Cone
from raytracer.scene.solids.cylinder import Cylinder as Cylinder
from raytracer.scene.solids.ellipsoid import Ellipsoid as Ellipsoid
from raytracer.scene.solids.paraboloid import Paraboloid as Paraboloid
from raytracer.scene.solids.plane import Plane as Plane
from raytracer.scene.solids.polyhedron import Polyhedron as Polyhedron
from raytracer.scene.solids.sphere import Sphere as Sphere
from raytracer.scene.solids.torus import Torus as Torus
