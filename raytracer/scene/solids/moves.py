"""The maps of the methods of Solid, from the values of a user."""

from __future__ import annotations

from typing import Any

from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, direction, number, point, three_numbers
from raytracer.scene.solids import affine
from raytracer.scene.solids.affine import Map


def translation(offset: Any) -> Map:
    """Return the map of Solid.translate(). Raises InputError."""
    return affine.translation(point(offset, "offset"))


def rotation(axis: Any, degrees: Any, about: Any) -> Map:
    """Return the map of Solid.rotate(). Raises InputError."""
    return affine.around(affine.rotation(direction(axis, "axis"), number(degrees, "degrees")), point(about, "about"))


def scaling(factor: Any, about: Any) -> Map:
    """Return the map of Solid.scale(). Factors have the range of lengths. Raises InputError."""
    factors = three_numbers(factor, "factor", MIN_RADIUS, MAX_LENGTH)
    return affine.around(affine.scaling(factors), point(about, "about"))


def reflection(normal: Any, about: Any) -> Map:
    """Return the map of Solid.mirror(). Raises InputError."""
    return affine.around(affine.reflection(direction(normal, "normal")), point(about, "about"))
