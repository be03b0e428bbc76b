"""The bodies of a scene in the view space of one camera, with the terms of camera rays that would cancel in float32."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.bodies import WALLS, Bodies, walls_at
from raytracer.core.validation import Vec3

Array = NDArray[np.float64]


class BodyView(msgspec.Struct, frozen=True, eq=False):
    """The K slabs and W walls of bodies in view space, and the bodies' corners."""

    corners: Array  # (B, 8, 3)
    normals: Array  # (K, 3)
    high: Array  # (K,): the depth of the camera in the half-space of each slab's high face; inf without a face
    low: Array  # (K,): the same for the low face
    forms: Array  # (W, 4, 4): (w, l): the gradients of the walls' forms, and their values at the camera
    # (W,): l0^2 - l1^2 - l2^2 - l3^2 at the camera; 0 for a camera on the wall, not for another camera of a torus
    powers: Array


def make_body_view(bodies: Bodies, eye: Vec3, turn: Array) -> BodyView:
    """Transform bodies to the view space with the origin `eye` and the rotation `turn` (3, 3)."""
    forms = bodies.forms
    values = _sum_products(forms[:, :, :3], eye) + forms[:, :, 3]
    return BodyView(
        turned(bodies.corners - eye, turn),
        turned(bodies.normals, turn),
        plane_depths(bodies.normals, bodies.high, eye),
        plane_depths(-bodies.normals, -bodies.low, eye),
        np.concatenate([turned(forms[:, :, :3], turn), values[..., None]], axis=2),
        _powers(bodies, values, eye),
    )


def turned(vectors: Array, turn: Array) -> Array:
    """Return vectors (..., 3) rotated by `turn` (3, 3). Equal or opposite vectors give equal or opposite bits.

    A matrix product of a library may round equal rows differently.
    """
    return np.stack([_sum_products(vectors, tuple(row)) for row in turn.tolist()], axis=-1)


def _sum_products(vectors: Array, other: tuple[float, ...]) -> Array:
    x, y, z = other
    return vectors[..., 0] * x + vectors[..., 1] * y + vectors[..., 2] * z


def plane_depths(normals: Array, offsets: Array, point: Vec3) -> Array:
    """Return the depths (N,) of a point in half-spaces dot(normal, x) <= offset, as Plane.depth(), to its last bits.

    The sum of the rounded products is compensated (Knuth's two-sum).
    """
    total, rest = offsets, np.zeros(len(offsets))
    with np.errstate(invalid="ignore"):  # infinite offsets stay infinite
        for j in range(3):
            part = -normals[:, j] * point[j]
            new = total + part
            kept = new - total
            rest = rest + ((total - (new - kept)) + (part - kept))
            total = new
        return np.where(np.isinf(offsets), offsets, total + rest)


def _powers(bodies: Bodies, values: Array, eye: Vec3) -> Array:
    """Return the powers of BodyView (W,), by the values of the forms (W, 4) at the camera."""
    l0, l1, l2, l3 = values.T
    # The difference of squares that are near each other.
    aside = np.sqrt(l1 * l1 + l2 * l2 + l3 * l3)
    powers = (l0 - aside) * (l0 + aside)
    powers[bodies.kinds[bodies.walls >= 0] == WALLS.index("torus")] = 1.0
    powers[walls_at(bodies, eye)] = 0.0
    return powers
