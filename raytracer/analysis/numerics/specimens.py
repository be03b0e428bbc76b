"""Solids of all kinds for the ledger: one of each, random maps, and a scene around them."""

from __future__ import annotations

import numpy as np

from raytracer.analysis.numerics.pixel_errors import MATTE
from raytracer.core.validation import Vec3
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.scene import Scene
from raytracer.scene.solids.box import Box
from raytracer.scene.solids.cone import Cone
from raytracer.scene.solids.cylinder import Cylinder
from raytracer.scene.solids.ellipsoid import Ellipsoid
from raytracer.scene.solids.kinds import KINDS as ALL_KINDS
from raytracer.scene.solids.paraboloid import Paraboloid
from raytracer.scene.solids.polyhedron import Polyhedron
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere
from raytracer.scene.solids.torus import Torus

# All kinds but the sphere and the half-space, which have rows of their own.
KINDS = tuple(kind for kind in ALL_KINDS if kind not in ("sphere", "plane"))
_OCTAHEDRON = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


def specimen(kind: str, material: Material = MATTE[0]) -> Solid:
    """Return a solid of about the size 1 around the origin. All its numbers, and its faces' numbers, are exact."""
    match kind:
        case "box":
            return Box((-0.75, -0.5, -0.625), (0.75, 0.5, 0.625), material)
        case "cylinder":
            return Cylinder((0, -0.75, 0), (0, 0.75, 0), 0.5, material)
        case "cone":
            return Cone((0, -1, 0), (0, 1, 0), 0.75, 0.25, material)
        case "ellipsoid":
            return Ellipsoid((0, 0, 0), (1, 0.5, 0.75), material)
        case "torus":
            return Torus((0, 0, 0), (0, 1, 0), 0.75, 0.25, material)
        case "polyhedron":
            return Polyhedron(_OCTAHEDRON, material)
        case "paraboloid":
            return Paraboloid((0, -0.75, 0), (0, 0.75, 0), 0.75, material)
        case "sphere":
            return Sphere((0, 0, 0), 0.75, material)
        case _:
            raise ValueError(f"{kind}: has no specimen")


def random_map(rng: np.random.Generator, condition: float) -> np.ndarray:
    """Return a map (3, 4) with a condition number up to `condition`. The image of the unit ball has the size 1."""
    u, _, v = np.linalg.svd(rng.normal(size=(3, 3)))
    stretch = np.exp(rng.uniform(-np.log(condition), 0.0, 3)) if rng.random() < 0.3 else rng.uniform(0.4, 1.0, 3)
    linear = u @ np.diag(np.maximum(stretch / stretch.max(), 1.0 / condition)) @ v
    return np.column_stack([linear, rng.uniform(-1.2, 1.2, 3)])


def lit_scene(*objects: Solid, eye: Vec3 = (0.4, 0.7, 5.0), look_at: Vec3 = (0, 0, 0), fov: float = 50.0) -> Scene:
    """Return a scene with the ledger's light."""
    return Scene(objects, [PointLight((4, 7, 4))], Camera(eye, look_at, vertical_fov=fov))
