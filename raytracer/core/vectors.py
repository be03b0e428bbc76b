"""Arithmetic of three-dimensional vectors as tuples of floats, so that scenes can be built without importing NumPy."""

from __future__ import annotations

from raytracer.core.validation import Vec3


def add(a: Vec3, b: Vec3) -> Vec3:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec3, b: Vec3) -> Vec3:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Vec3, b: Vec3) -> float:
    """Return the dot product of a and b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def scale_by(a: Vec3, s: float) -> Vec3:
    """Return a * s."""
    return (a[0] * s, a[1] * s, a[2] * s)


def divide_by(a: Vec3, s: float) -> Vec3:
    """Return a / s."""
    return (a[0] / s, a[1] / s, a[2] / s)


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return the cross product of a and b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
