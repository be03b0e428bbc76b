"""The definition of a solid by its faces: half-spaces, and at most one wall. Parts that several kinds share."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3

Array = NDArray[np.float64]
HalfSpace = tuple[Vec3, float]  # the points x with dot(normal, x) <= offset

# Directions whose components differ by less than this are one direction: some hundreds of roundings of float64.
ROUNDED = 1e-13


class WallDefinition(NamedTuple):
    """A curved surface, by four affine forms l(x) = rows (x - anchor) + (constant, 0, 0, 0).

    "quadric": the boundary of |(l1, l2, l3)| <= l0 (quadrics.py). "torus": the boundary of
    (hypot(l1, l2) - 1)^2 + l3^2 <= l0^2, where l0 is a constant (tori.py).
    """

    kind: Literal["quadric", "torus"]
    anchor: Vec3
    rows: Array  # (4, 3)
    constant: float
    key: tuple[object, ...]  # equal for equal surfaces


class Faces(NamedTuple):
    """A solid in its own space: the intersection of half-spaces and the inside of a wall."""

    half_spaces: list[HalfSpace]
    wall: WallDefinition | None


def find_ends(base: Vec3, top: Vec3) -> list[HalfSpace]:
    """Return the half-spaces between the planes through two points, across the line through them."""
    axis = np.subtract(top, base)
    x, y, z = axis / np.abs(axis).max()
    offsets = [math.fsum(a * b for a, b in zip((x, y, z), end, strict=True)) for end in (base, top)]
    return [((-x, -y, -z), -offsets[0]), ((x, y, z), offsets[1])]


def ellipsoid_wall(center: Vec3, radii: Vec3) -> WallDefinition:
    """Return the surface of an ellipsoid with axes along x, y and z."""
    rows = np.vstack((np.zeros(3), np.diag(1.0 / np.array(radii))))
    return WallDefinition("quadric", center, rows, 1.0, ("ellipsoid", center, radii))


def round_direction(vector: Array) -> tuple[float, ...]:
    """Return a vector of length 1 or less, rounded so that roundings of its last bits do not matter."""
    return tuple(float(round(x / ROUNDED)) for x in vector)


def make_frame(axis: Array) -> tuple[Array, Array, Array]:
    """Return three orthogonal unit vectors, with the third along `axis`."""
    axis = axis / np.abs(axis).max()
    w: Array = axis / np.linalg.norm(axis)
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w))]).astype(np.float64)
    u /= np.linalg.norm(u)
    v = np.cross(w, u).astype(np.float64)
    return u, v, w


def vec3(vector: Array) -> Vec3:
    """Return an array of three numbers as a tuple."""
    x, y, z = map(float, vector)
    return x, y, z
