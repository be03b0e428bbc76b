"""Faces of each kind of solid, from its definition: half-spaces, and at most one wall."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.scene.solids.box import Box
from raytracer.scene.solids.cone import Cone
from raytracer.scene.solids.cylinder import Cylinder
from raytracer.scene.solids.ellipsoid import Ellipsoid
from raytracer.scene.solids.polyhedron import Polyhedron
from raytracer.scene.solids.solid import Primitive
from raytracer.scene.solids.sphere import Sphere
from raytracer.scene.solids.torus import Torus

Array = NDArray[np.float64]
HalfSpace = tuple[Vec3, float]  # the points x with dot(normal, x) <= offset

# Directions whose components differ by less than this are one direction: some hundreds of roundings of float64.
_ROUNDED = 1e-13


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


def faces(shape: Primitive) -> Faces:
    """Return the faces of a primitive other than a half-space."""
    match shape:
        case Sphere():
            return Faces([], _ellipsoid(shape.center, (shape.radius, shape.radius, shape.radius)))
        case Box():
            return Faces(_box(shape.min, shape.max), None)
        case Ellipsoid():
            return Faces([], _ellipsoid(shape.center, shape.radii))
        case Cylinder():
            ends = _ends(shape.base, shape.top)
            return Faces(ends, _cylinder(shape.base, shape.top, shape.radius))
        case Cone():
            radii = shape.base_radius, shape.top_radius
            return Faces(_ends(shape.base, shape.top), _cone(shape.base, shape.top, radii))
        case Torus():
            return Faces([], _torus(shape.center, shape.axis, shape.major_radius, shape.minor_radius))
        case Polyhedron():
            planes: list[HalfSpace] = []
            for (x, y, z), low, high in shape.slabs():
                planes += [((x, y, z), high)] if math.isfinite(high) else []
                planes += [((-x, -y, -z), -low)] if math.isfinite(low) else []
            return Faces(planes, None)
        case _:
            raise TypeError(f"no faces of {type(shape).__name__}")


def _box(low: Vec3, high: Vec3) -> list[HalfSpace]:
    axes = np.eye(3)
    upper = [(_vec3(axis), offset) for axis, offset in zip(axes, high, strict=True)]
    return upper + [(_vec3(-axis), -offset) for axis, offset in zip(axes, low, strict=True)]


def _ends(base: Vec3, top: Vec3) -> list[HalfSpace]:
    """Return the half-spaces between the planes through two points, across the line through them."""
    axis = np.subtract(top, base)
    x, y, z = axis / np.abs(axis).max()
    offsets = [math.fsum(a * b for a, b in zip((x, y, z), end, strict=True)) for end in (base, top)]
    return [((-x, -y, -z), -offsets[0]), ((x, y, z), offsets[1])]


def _ellipsoid(center: Vec3, radii: Vec3) -> WallDefinition:
    rows = np.vstack((np.zeros(3), np.diag(1.0 / np.array(radii))))
    return WallDefinition("quadric", center, rows, 1.0, ("ellipsoid", center, radii))


def _cylinder(base: Vec3, top: Vec3, radius: float) -> WallDefinition:
    u, v, w = _frame(np.subtract(top, base))
    rows = np.array((np.zeros(3), u, v, np.zeros(3))) / radius
    # Cylinders along the same line, of any two ends, have the same wall: the line's direction, up to its sign, and its
    # point nearest to the origin. They are rounded, since other ends of the line give other last bits.
    forward = w * np.sign(w[np.argmax(np.abs(w) > _ROUNDED)])
    foot = np.array(base) - (np.array(base) @ w) * w
    unit = radius + np.abs(foot).max()
    key = "cylinder", radius, *_rounded(forward), *(_rounded(foot / unit) if foot.any() else foot)
    return WallDefinition("quadric", base, rows, 1.0, key)


def _cone(base: Vec3, top: Vec3, radii: tuple[float, float]) -> WallDefinition:
    axis = np.subtract(top, base)
    u, v, w = _frame(axis)
    largest = max(radii)
    slope = (radii[1] - radii[0]) / np.linalg.norm(axis)
    rows = np.array((slope * w, u, v, np.zeros(3))) / largest
    return WallDefinition("quadric", base, rows, radii[0] / largest, ("cone", base, top, radii))


def _torus(center: Vec3, axis: Vec3, major: float, minor: float) -> WallDefinition:
    u, v, w = _frame(np.array(axis))
    rows = np.array((np.zeros(3), u, v, w)) / major
    forward = w * np.sign(w[np.argmax(np.abs(w) > _ROUNDED)])
    return WallDefinition("torus", center, rows, minor / major, ("torus", center, *_rounded(forward), major, minor))


def _rounded(vector: Array) -> tuple[float, ...]:
    """Return a vector of length 1 or less, rounded so that roundings of its last bits do not matter."""
    return tuple(float(round(x / _ROUNDED)) for x in vector)


def _frame(axis: Array) -> tuple[Array, Array, Array]:
    """Return three orthogonal unit vectors, with the third along `axis`."""
    axis = axis / np.abs(axis).max()
    w: Array = axis / np.linalg.norm(axis)
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w))]).astype(np.float64)
    u /= np.linalg.norm(u)
    v = np.cross(w, u).astype(np.float64)
    return u, v, w


def _vec3(vector: Array) -> Vec3:
    x, y, z = map(float, vector)
    return x, y, z
