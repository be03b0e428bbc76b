"""Sizes of the bounded primitives of a scene: bounding balls, and half the smallest thickness. For warnings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.scene.scene_objects import Run, SceneObjects
from raytracer.scene.solids.body import Placed

Array = NDArray[np.float64]


class Sizes(NamedTuple):
    """The sizes of N primitives."""

    centers: Array  # (N, 3), of bounding balls
    radii: Array  # (N,), of bounding balls
    halves: Array  # (N,): half the smallest thickness: the radius of a sphere


def find_sizes(objects: SceneObjects) -> Sizes:
    """Return the sizes of all spheres, and of all bodies. A body of an instance has a ball around its position."""
    centers, radii = objects.spheres()
    parts = [Sizes(centers, radii, radii), *map(_body_sizes, objects.runs())]
    return Sizes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _body_sizes(run: Run) -> Sizes:
    """Return the sizes of the bodies of a run, by the boxes or frusta around them."""
    leaves = [node for node in run.nodes if isinstance(node, Placed)]
    shapes = {id(leaf.shape): leaf.shape for leaf in leaves}
    known = {key: np.array(shape.corners()) for key, shape in shapes.items()}
    matrices = np.array([leaf.matrix for leaf in leaves]).reshape(-1, 3, 4)
    own = np.array([known[id(leaf.shape)] for leaf in leaves]).reshape(-1, 8, 3)
    corners = own @ np.swapaxes(matrices[:, :, :3], 1, 2) + matrices[:, None, :, 3]
    centers = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1, initial=0.0)
    a, b, c = (np.diff(corners.reshape(-1, 2, 2, 2, 3), axis=axis).mean(axis=(1, 2, 3)) for axis in (1, 2, 3))
    volumes = np.abs(np.einsum("ni,ni->n", a, np.cross(b, c)))
    sides = [np.linalg.norm(np.cross(*pair), axis=1) for pair in ((a, b), (b, c), (c, a))]
    halves = volumes / (2.0 * np.max(sides, axis=0))
    if run.instances is None:
        return Sizes(centers, radii, halves)
    scales = np.asarray(run.instances.scales, float)[:, None]
    places = np.repeat(np.asarray(run.instances.positions, float), len(leaves), axis=0)
    reach = np.linalg.norm(centers, axis=1) + radii
    return Sizes(places, (scales * reach).ravel(), (scales * halves).ravel())
