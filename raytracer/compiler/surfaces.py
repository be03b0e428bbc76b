"""A scene's surfaces as arrays, in the order of their index in the shaders: spheres, then planes."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids import ROUNDING, Plane, leaves

Array = NDArray[np.float64]

# A light may lie on a plane if its distance is at most this share of the largest number of the two. The share is the
# tolerance ROUNDING, and four times as much for the rounding of the distance, a sum of four terms in float64.
_NEAR = 5.0 * ROUNDING
# A light may lie on a sphere if its distance, computed in float32, is at most this share of the largest number of the
# two. The share is twice the bound of the rounding error of that distance.
_COARSE = np.float32(2.0**-18)
# The smallest distance whose square is in float32's range.
_NEAREST = np.float32(2.0**-50)


class Surfaces(msgspec.Struct, frozen=True, eq=False):
    """S spheres and P planes, in world space."""

    centers: Array  # (S, 3)
    radii: Array  # (S,)
    extents: Array  # (S,): the largest absolute coordinate of each centre
    planes: list[Plane]
    normals: Array  # (P, 3), unit
    offsets: Array  # (P,), for the unit normals
    material: NDArray[np.int32]  # (S + P,), index into Scene.materials
    used: list[int]  # the indices of the materials in use

    @property
    def spheres(self) -> int:
        """The number S of spheres."""
        return len(self.radii)

    @property
    def size(self) -> int:
        """The number of surfaces, spheres and planes: S + P."""
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


def touched_surfaces(surfaces: Surfaces, lights: Sequence[PointLight]) -> list[int | None]:
    """Find the index of the first surface that each light lies on, or None.

    A point light lies on a surface by Sphere.touches() and Plane.touches(). A light with a radius lies only on its own
    sphere, by PointLight.is_bulb().
    """
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, z, radius = np.vstack((surfaces.centers.T, surfaces.radii)).astype(np.float32)
        # Rounding to float32 changes the distance from a sphere by at most half of this.
        slack = _COARSE * np.maximum(surfaces.extents, surfaces.radii).astype(np.float32)
        touched: list[int | None] = []
        for light in lights:
            a, b, c, own = np.array((*light.position, light.radius), np.float32)
            dx, dy, dz = x - a, y - b, z - c
            distance = np.sqrt(dx * dx + dy * dy + dz * dz)
            off = distance if light.radius else np.abs(distance - radius)
            off -= slack
            # Spheres count as near if squares leave float32's range: comparisons with such numbers are False.
            near = ~(off > _COARSE * max(map(abs, (a, b, c, own)))) | (distance < _NEAREST)
            touched.append(_surface_at_light(surfaces, light, np.flatnonzero(near)))
    return touched


def _surface_at_light(surfaces: Surfaces, light: PointLight, near: NDArray[np.int64]) -> int | None:
    """Return the index of the first surface that a light lies on, among the planes and the spheres `near` it."""
    distance = np.linalg.norm(surfaces.centers[near] - light.position, axis=1)
    largest = max(map(abs, (*light.position, light.radius)))
    radii, extents = surfaces.radii[near], np.maximum(surfaces.extents[near], largest)
    if light.radius:
        off = np.maximum(distance, np.abs(radii - light.radius))
        bound = ROUNDING * extents
    else:
        off = np.abs(distance - radii)
        bound = ROUNDING * np.maximum(extents, radii)
    touching = near[off <= bound]
    if len(touching):
        return int(touching[0])
    if light.radius or not surfaces.planes:
        return None
    # Plane.touches() sums without rounding, which is slow, so only planes near the light are tested.
    off = np.abs(surfaces.normals @ light.position - surfaces.offsets)
    near = np.flatnonzero(off <= _NEAR * np.maximum(np.abs(surfaces.offsets), largest))
    return next((surfaces.spheres + int(p) for p in near if surfaces.planes[p].touches(light.position)), None)


def powers(centers: Array, radii: Array, point: Vec3) -> Array:
    """Return |center - point|^2 - radius^2 of each sphere (S,), as Sphere.power(), to all but its last bits."""
    difference = centers - point
    # `rest` is the rounding error of the subtraction (Knuth's two-sum).
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
    """Return x^2 and its rounding error (Dekker 1971, with Veltkamp's splitting)."""
    scaled = x * 134217729.0  # 2^27 + 1
    high = scaled - (scaled - x)
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low
