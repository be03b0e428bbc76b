"""A scene's surfaces as arrays, in the order of the shaders' surface index: spheres, then planes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.scene.instances import Instances
from raytracer.scene.scene import Scene
from raytracer.scene.solids import Plane, Sphere, leaves

Array = NDArray[np.float64]


class Table(NamedTuple):
    """S spheres and P planes, in world space."""

    centers: Array  # (S, 3)
    radii: Array  # (S,)
    planes: list[Plane]
    normals: Array  # (P, 3), unit
    material: NDArray[np.int32]  # (S + P,), index into Scene.materials
    used: list[int]  # those of them that occur

    @property
    def size(self) -> int:
        """S + P"""
        return len(self.material)


_last: tuple[object, object, Table] | None = None


def table(scene: Scene) -> Table:
    """The surfaces of `scene`, kept as long as scenes of the same objects are asked for."""
    global _last
    last = _last  # another thread may set it meanwhile
    # A scene makes a new tuple of its materials, but of the same ones: they are quickly compared.
    if last is None or last[0] is not scene.objects or last[1] != scene.materials:
        _last = last = scene.objects, scene.materials, _table(scene)
    return last[2]


def _table(scene: Scene) -> Table:
    order = {material: i for i, material in enumerate(scene.materials)}
    centers: list[Array] = []
    radii: list[Array] = []
    planes: list[Plane] = []
    materials: list[NDArray[np.int32]] = []
    of_planes: list[int] = []
    for item in scene.objects:
        found = leaves(item.solid if isinstance(item, Instances) else item)
        spheres = [leaf for leaf in found if isinstance(leaf, Sphere)]
        count = len(item) if isinstance(item, Instances) else 1
        if isinstance(item, Instances):
            places = item.spheres()
            centers.append(places[0].reshape(-1, 3))
            radii.append(places[1].ravel())
        else:
            centers.append(np.array([s.center for s in spheres]).reshape(-1, 3))
            radii.append(np.array([s.radius for s in spheres]))
        materials.append(np.tile(np.array([order[s.material] for s in spheres], np.int32), count))
        if len(spheres) < len(found):
            placed = item.solids() if isinstance(item, Instances) else (item,)
            own = [leaf for solid in placed for leaf in leaves(solid) if isinstance(leaf, Plane)]
            planes += own
            of_planes += [order[plane.material] for plane in own]
    material = np.concatenate([*materials, np.array(of_planes, np.int32)])
    return Table(
        np.concatenate(centers),
        np.concatenate(radii),
        planes,
        np.array([plane.unit()[0] for plane in planes]).reshape(-1, 3),
        material,
        np.flatnonzero(np.bincount(material)).tolist(),  # np.unique would import numpy.ma
    )


def powers(centers: Array, radii: Array, point: Vec3) -> Array:
    """(S,): Sphere.power() of each, |center - point|^2 - radius^2 to all but its last bits."""
    difference = centers - point
    # What the subtraction rounded off (Knuth's two-sum).
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
    """x^2, and what it rounded off (Dekker 1971, after Veltkamp's splitting)."""
    scaled = x * 134217729.0  # 2^27 + 1
    high = scaled - (scaled - x)
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low
