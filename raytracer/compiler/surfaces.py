"""A scene's surfaces as arrays, in the order of the shaders' surface index: spheres, then planes."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids import ROUNDING, Plane, leaves

Array = NDArray[np.float64]

# A share of the largest number: ROUNDING, and four times as much for the roundings of a sum of four terms.
_NEAR = 5.0 * ROUNDING


class Surfaces(msgspec.Struct, frozen=True, eq=False):
    """S spheres and P planes, in world space."""

    centers: Array  # (S, 3)
    radii: Array  # (S,)
    extents: Array  # (S,): the largest coordinate of each centre, without its sign
    planes: list[Plane]
    normals: Array  # (P, 3), unit
    offsets: Array  # (P,), of the unit normals
    material: NDArray[np.int32]  # (S + P,), index into Scene.materials
    used: list[int]  # the materials that occur

    @property
    def spheres(self) -> int:
        """S"""
        return len(self.radii)

    @property
    def size(self) -> int:
        """S + P"""
        return len(self.material)


def make_surfaces(scene: Scene) -> Surfaces:
    """Collect the surfaces of all objects of `scene`."""
    assert isinstance(scene.objects, SceneObjects)
    order = {material: i for i, material in enumerate(scene.materials)}
    sphere_materials: list[NDArray[np.int32]] = []
    plane_materials: list[NDArray[np.int32]] = []
    planes: list[Plane] = []
    for run in scene.objects.runs():
        own = np.array([order[sphere.material] for sphere in run.spheres], np.int32)
        sphere_materials.append(np.tile(own, len(run.instances)) if run.instances else own)
        if placed := run.planes:
            if run.instances:
                placed = [leaf for solid in run.instances.solids() for leaf in leaves(solid) if isinstance(leaf, Plane)]
            planes += placed
            plane_materials.append(np.array([order[plane.material] for plane in placed], np.int32))
    centers, radii = scene.objects.spheres()
    material = np.concatenate([*sphere_materials, *plane_materials])
    units = [plane.unit() for plane in planes]
    return Surfaces(
        centers,
        radii,
        np.abs(centers).max(axis=1, initial=0.0),
        planes,
        np.array([normal for normal, _ in units]).reshape(-1, 3),
        np.array([offset for _, offset in units]),
        material,
        np.flatnonzero(np.bincount(material)).tolist(),  # np.unique would import numpy.ma
    )


def touched_surface(surfaces: Surfaces, light: PointLight) -> int | None:
    """The index of the first surface that `light` is on, if there is one.

    A point is on what Sphere.touches() and Plane.touches() say. A light with a radius is on its own sphere alone, which
    PointLight.is_bulb() tells.
    """
    distance = np.linalg.norm(surfaces.centers - light.position, axis=1)
    largest = max(map(abs, (*light.position, light.radius)))
    if light.radius:
        off = np.maximum(distance, np.abs(surfaces.radii - light.radius))
        bound = ROUNDING * np.maximum(surfaces.extents, largest)
    else:
        off = np.abs(distance - surfaces.radii)
        bound = ROUNDING * np.maximum(np.maximum(surfaces.extents, largest), surfaces.radii)
    touching = np.flatnonzero(off <= bound)
    if len(touching):
        return int(touching[0])
    if light.radius or not surfaces.planes:
        return None
    # Plane.touches() sums without rounding, which takes long: only planes that are near are asked.
    off = np.abs(surfaces.normals @ light.position - surfaces.offsets)
    near = np.flatnonzero(off <= _NEAR * np.maximum(np.abs(surfaces.offsets), largest))
    return next((surfaces.spheres + int(p) for p in near if surfaces.planes[p].touches(light.position)), None)


def powers(centers: Array, radii: Array, point: Vec3) -> Array:
    """(S,): Sphere.power() of each, |center - point|^2 - radius^2 to all but its last bits."""
    difference = centers - point
    # The part that the subtraction rounded off (Knuth's two-sum).
    back = difference - centers
    rest = (centers - (difference - back)) - (point + back)
    total, low = _square(radii)
    total, low = -total, -low
    low = low + np.sum(2.0 * difference * rest, axis=1)
    for part in difference.T:
        square, below = _square(part)
        new = total + square
        kept = new - total
        low = low + below + ((total - (new - kept)) + (square - kept))
        total = new
    return total + low


def _square(x: Array) -> tuple[Array, Array]:
    """x^2, and the part that it rounded off (Dekker 1971, after Veltkamp's splitting)."""
    scaled = x * 134217729.0  # 2^27 + 1
    high = scaled - (scaled - x)
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low
