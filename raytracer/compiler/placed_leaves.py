"""The bodies and the half-spaces of a scene as arrays, with all copies of instances placed at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.bodies import PlacedShapes
from raytracer.scene.materials.material import Material
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids import affine_arrays
from raytracer.scene.solids.body import Body, Placed
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Primitive

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class PlacedLeaves(NamedTuple):
    """The leaves of a scene other than spheres: B bodies and P half-spaces, each in the order of the objects."""

    bodies: PlacedShapes
    normals: Array  # (P, 3), unit
    offsets: Array  # (P,), for the unit normals
    material: NDArray[np.int32]  # the numbers of the materials of all spheres, then of the bodies and the half-spaces


def place_leaves(objects: SceneObjects, order: Mapping[Material, int]) -> PlacedLeaves:
    """Place the leaves of all objects. `order` has the number of each material."""
    known: dict[int, int] = {}  # the numbers of the shapes, by their identity: moved solids may share them, too
    shapes: list[Body] = []
    numbers, parts, maps = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros((0, 3, 4))]
    normals, offsets = [np.zeros((0, 3))], [np.zeros(0)]
    materials: list[list[NDArray[np.int32]]] = [[np.zeros(0, np.int32)] for _ in range(3)]
    for run in objects.runs():
        count = len(run.instances) if run.instances else 1
        bodies, planes = [node for node in run.nodes if type(node) is Placed], run.planes
        kinds: tuple[Sequence[Primitive], ...] = run.spheres, bodies, planes
        for leaves, own in zip(kinds, materials, strict=True):
            own.append(np.tile(np.array([order[leaf.material] for leaf in leaves], np.int32), count))
        for leaf in bodies:
            if id(leaf.shape) not in known:
                known[id(leaf.shape)] = len(shapes)
                shapes.append(leaf.shape)
        numbers.append(np.tile(np.array([known[id(leaf.shape)] for leaf in bodies], np.int64), count))
        parts.append(np.tile(np.array([leaf.part for leaf in bodies], np.int64), count))
        own_maps = np.array([leaf.matrix for leaf in bodies]).reshape(-1, 3, 4)
        copies = run.instances.maps() if run.instances and (bodies or planes) else None
        if copies is not None:
            own_maps = affine_arrays.compose(copies[:, None], own_maps).reshape(-1, 3, 4)
        maps.append(own_maps)
        unit, offset = _half_spaces(planes, copies)
        normals.append(unit)
        offsets.append(offset)
    placed = PlacedShapes(shapes, np.concatenate(numbers), np.concatenate(maps), np.concatenate(parts))
    return PlacedLeaves(
        placed,
        np.concatenate(normals),
        np.concatenate(offsets),
        np.concatenate([part for own in materials for part in own]),
    )


def _half_spaces(planes: Sequence[Plane], copies: Array | None) -> tuple[Array, Array]:
    """Return the unit normals (P, 3) and the offsets (P,) of half-spaces, under the maps of copies (N, 3, 4) if any."""
    normals = np.array([plane.normal for plane in planes]).reshape(-1, 3)
    offsets = np.array([plane.offset for plane in planes])
    if copies is None:
        unit, _, high = affine_arrays.unit_slabs(normals, offsets, offsets)
        return unit, high
    unit, high = affine_arrays.map_planes(copies, normals, offsets)
    return unit.reshape(-1, 3), high.ravel()
