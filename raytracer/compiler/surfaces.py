"""A scene's surfaces as arrays, in the order of their index in the shaders: spheres, then bodies, then planes."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.bodies import Bodies, make_bodies, walls_at
from raytracer.compiler.placed_leaves import place_leaves
from raytracer.core.validation import Vec3
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.plane import is_on_plane

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
    """S spheres, B bodies and P planes, in world space. A surface here is a leaf of the trees; a body has faces."""

    centers: Array  # (S + B, 3), of the spheres, then of the bodies' bounding balls
    radii: Array  # (S + B,)
    extents: Array  # (S,): the largest absolute coordinate of each sphere's centre
    bodies: Bodies
    normals: Array  # (P, 3), unit
    offsets: Array  # (P,), for the unit normals
    material: NDArray[np.int32]  # (S + B + P,), index into Scene.materials
    used: list[int]  # the indices of the materials in use

    @property
    def spheres(self) -> int:
        """The number S of spheres."""
        return len(self.extents)

    @property
    def bounded(self) -> int:
        """The number S + B of surfaces with bounding balls, which is the index of the first plane."""
        return len(self.radii)

    @property
    def size(self) -> int:
        """The number of surfaces: S + B + P."""
        return len(self.material)


def make_surfaces(scene: Scene) -> Surfaces:
    """Collect the surfaces of all objects of `scene`."""
    assert isinstance(scene.objects, SceneObjects)
    order = {material: i for i, material in enumerate(scene.materials)}
    centers, radii = scene.objects.spheres()
    placed = place_leaves(scene.objects, order)
    bodies = make_bodies(placed.bodies)
    return Surfaces(
        np.concatenate([centers, bodies.centers]),
        np.concatenate([radii, bodies.radii]),
        np.abs(centers).max(axis=1, initial=0.0),
        bodies,
        placed.normals,
        placed.offsets,
        placed.material,
        np.flatnonzero(np.bincount(placed.material)).tolist(),  # np.unique would import numpy.ma
    )


def touched_surfaces(surfaces: Surfaces, lights: Sequence[PointLight]) -> list[int | None]:
    """Find the index of the first surface that each light lies on, or None.

    The faces of bodies count after all surfaces: first both faces of each slab, high and low, then the walls.

    A point light lies on a surface by Sphere.touches() and Plane.touches(). A light with a radius lies only on its own
    sphere, by PointLight.is_bulb().
    """
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, z, radius = np.vstack((surfaces.centers.T, surfaces.radii))[:, : surfaces.spheres].astype(np.float32)
        # Rounding to float32 changes the distance from a sphere by at most half of this.
        slack = _COARSE * np.maximum(surfaces.extents, surfaces.radii[: surfaces.spheres]).astype(np.float32)
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
    """Return the index of the first surface that a light lies on: a sphere `near` it, a plane, or a face."""
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
    if light.radius:
        return None
    # The exact test sums without rounding, which is slow, so only planes near the light are tested.
    off = np.abs(surfaces.normals @ light.position - surfaces.offsets)
    near = np.flatnonzero(off <= _NEAR * np.maximum(np.abs(surfaces.offsets), largest))
    for plane in near.tolist():
        x, y, z = surfaces.normals[plane].tolist()
        if is_on_plane((x, y, z), float(surfaces.offsets[plane]), light.position):
            return surfaces.bounded + plane
    return _face_at_light(surfaces, light)


def _face_at_light(surfaces: Surfaces, light: PointLight) -> int | None:
    """Return the index of the first face of a body that a light lies on, or None."""
    bodies = surfaces.bodies
    largest = max(map(abs, light.position))
    offsets = np.column_stack([bodies.high, bodies.low])
    off = np.abs((bodies.normals @ light.position)[:, None] - offsets)
    with np.errstate(invalid="ignore"):
        near = np.flatnonzero(np.isfinite(off) & (off <= _NEAR * np.maximum(np.abs(offsets), largest)))
    if len(near):
        return surfaces.size + int(near[0])
    walls = np.flatnonzero(walls_at(bodies, light.position))
    return surfaces.size + 2 * len(bodies.high) + int(walls[0]) if len(walls) else None


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
