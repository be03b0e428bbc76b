"""The surfaces on which a scene may have bright features: balls, balls as large as bodies, planes and faces."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.bodies import Bodies
from raytracer.compiler.surfaces import Surfaces

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Ints = NDArray[np.intp]

# The most pairs of a surface and a light for one camera or its mirror image: they take a tenth of a second. If there
# are more, only every second, third ... surface is examined.
_MOST_PAIRS = 2**18
# The shadow of a body, as a share of the shadow of the box around it: the middle between a box and an ellipsoid.
_FILLED = 0.75
# The largest distance of a point from a face that it lies on, as a share of the body's bounding ball.
_NEAR = 1e-6


class FlatFaces(NamedTuple):
    """F plane faces of bodies, then P half-spaces."""

    normals: Array  # (F + P, 3), unit
    offsets: Array  # (F + P,)
    owners: Ints  # (F + P,): the body of each face, -1 for a half-space


class FeatureSurfaces(NamedTuple):
    """Some of a scene's surfaces: B balls, then P planes, which are faces of bodies and half-spaces."""

    centers: Array  # (B, 3)
    radii: Array  # (B,)
    planes: FlatFaces  # P planes
    bodies: Bodies  # all bodies of the scene
    materials: Ints  # (B + P,): the place of each surface's material in Surfaces.used

    def choose(self, mask: Mask, lights: int) -> FeatureSurfaces:
        """Choose the surfaces that are True in `mask` (B + P,), or a regular sample of them.

        The sample is for surfaces that have more than _MOST_PAIRS pairs with so many `lights`.
        """
        chosen = np.flatnonzero(mask)
        chosen = chosen[:: max(1, -(-len(chosen) * lights // _MOST_PAIRS))]
        count = len(self.radii)
        balls, planes = chosen[chosen < count], chosen[chosen >= count] - count
        normals, offsets, owners = self.planes
        faces = FlatFaces(normals[planes], offsets[planes], owners[planes])
        return FeatureSurfaces(self.centers[balls], self.radii[balls], faces, self.bodies, self.materials[chosen])

    def are_held(self, points: Array) -> Mask:
        """Return which points (K, B + P, 3) are within the extent of their surfaces. All points of balls are."""
        balls = len(self.radii)
        held = np.ones(points.shape[:2], bool)
        held[:, balls:] = _on_faces(self.bodies, self.planes.owners, points[:, balls:])
        return held


def all_surfaces(surfaces: Surfaces) -> FeatureSurfaces:
    """Return all spheres, a ball as large as each body, all plane faces of bodies, and all half-spaces."""
    planes, bounded = _flat_faces(surfaces), surfaces.bounded
    owners = surfaces.spheres + planes.owners[planes.owners >= 0]
    material = surfaces.material
    return FeatureSurfaces(
        surfaces.centers,
        np.append(surfaces.radii[: surfaces.spheres], _ball_radii(surfaces.bodies)),
        planes,
        surfaces.bodies,
        np.searchsorted(surfaces.used, np.concatenate([material[:bounded], material[owners], material[bounded:]])),
    )


def _flat_faces(surfaces: Surfaces) -> FlatFaces:
    """Collect all plane faces of a scene."""
    bodies = surfaces.bodies
    owners = np.repeat(np.arange(len(bodies.radii)), np.diff(bodies.starts))
    is_high, is_low = np.isfinite(bodies.high), np.isfinite(bodies.low)
    return FlatFaces(
        np.concatenate([bodies.normals[is_high], bodies.normals[is_low], surfaces.normals]),
        np.concatenate([bodies.high[is_high], bodies.low[is_low], surfaces.offsets]),
        np.concatenate([owners[is_high], owners[is_low], np.full(len(surfaces.offsets), -1)]),
    )


def _on_faces(bodies: Bodies, owners: Ints, points: Array) -> Mask:
    """Return which points (K, N, 3) of the planes of N faces are within the bodies `owners` (N,) of the faces.

    All points of half-spaces, with the owner -1, are.
    """
    offsets = points - bodies.centers[owners] if len(bodies.centers) else points
    within = (owners < 0) | (np.einsum("...i,...i->...", offsets, offsets) <= _squared_radii(bodies, owners))
    # Few points are left here. Each is compared with all faces of its body.
    light, face = np.nonzero(within & (owners >= 0))
    near, body = points[light, face], owners[face]
    counts = np.diff(bodies.starts)[body]
    first = np.cumsum(counts) - counts
    slabs = np.repeat(bodies.starts[body] - first, counts) + np.arange(counts.sum())
    heights = np.einsum("ni,ni->n", bodies.normals[slabs], np.repeat(near, counts, axis=0))
    slack = np.repeat(_NEAR * bodies.radii[body], counts)
    outside = (heights > bodies.high[slabs] + slack) | (heights < bodies.low[slabs] - slack)
    within[light, face] = np.bincount(np.repeat(np.arange(len(body)), counts), outside, len(body)) == 0
    walled = bodies.walls[body] >= 0
    forms = bodies.forms[bodies.walls[body[walled]]]
    l0, l1, l2, l3 = (np.einsum("nij,nj->ni", forms[..., :3], near[walled]) + forms[..., 3]).T
    # A torus has no plane faces, so that the wall is a second-order cone.
    within[light[walled], face[walled]] &= np.hypot(np.hypot(l1, l2), l3) <= l0
    return within


def _squared_radii(bodies: Bodies, owners: Ints) -> Array:
    return np.square(bodies.radii[owners]) if len(bodies.radii) else np.zeros(len(owners))


def _ball_radii(bodies: Bodies) -> Array:
    """Return the radii (B,) of balls whose discs are as large as the bodies' outlines, in the mean of all directions.

    The second part of a torus has the radius 0: the first one stands for both.
    """
    corners = bodies.corners.reshape(-1, 2, 2, 2, 3)
    a, b, c = (np.diff(corners, axis=axis).mean(axis=(1, 2, 3)) for axis in (1, 2, 3))
    # The mean outline of a convex body is a quarter of its surface (Cauchy 1832).
    faces = sum(np.linalg.norm(np.cross(*sides), axis=-1) for sides in ((a, b), (b, c), (c, a)))
    return np.where(bodies.parts > 0, 0.0, np.sqrt(_FILLED / (2.0 * math.pi) * faces))
