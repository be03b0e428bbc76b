"""The half-space."""

from __future__ import annotations

import math

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3, direction, number, set_fields
from raytracer.core.vectors import dot, scale_by
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import affine
from raytracer.scene.solids.affine import Map
from raytracer.scene.solids.checks import check_material, check_place
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.solid import Primitive, Union

# The largest component of a normal, or its inverse, under a map with all factors in the range of lengths: a normal and
# two factors of 1e12 each, with more than enough for sheared maps.
_MAX_NORMAL = 1e60
_OFFSET = f"a number within +-{MAX_LENGTH:g}"


@public
class Plane(Primitive, frozen=True, repr_omit_defaults=True):
    """A solid half-space: all points x with dot(normal, x) <= offset. Raises InputError for a wrong value.

    Args:
        normal: the direction out of the solid, of any length but 0.
        offset: dot(normal, x) for points x of the boundary. Range: offset and offset / |normal| within +-1e12.
        material: the material of its surface. Default: Material().
    """

    normal: Vec3
    offset: float
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        offset = number(self.offset, "offset", -MAX_LENGTH, MAX_LENGTH, _OFFSET)
        normal = direction(self.normal, "normal")
        set_fields(self, normal=normal, offset=offset)
        distance = abs(self.unit()[1])
        if distance > MAX_LENGTH:
            raise InputError(f"expected offset / |normal| within +-{MAX_LENGTH:g}, got {distance:g}", "offset")

    def unit(self) -> tuple[Vec3, float]:
        """Return the unit normal and its offset. Coincident planes have bit-identical or exactly negated results."""
        return affine.unit_plane(self.normal, self.offset)

    def depth(self, point: Vec3) -> float:
        """Return the distance of a point from the boundary, positive inside the half-space and negative outside."""
        return _depth(*self.unit(), check_place(point))

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the plane, up to rounding and an `error` of the point."""
        return is_on_plane(*self.unit(), check_place(point), error)

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return the half-space under a map, as a Plane."""
        if matrix is None:
            return [self]
        affine.check_invertible(matrix, "transform")
        normal, offset = affine.map_plane(matrix, self.normal, self.offset)
        if not 1.0 / _MAX_NORMAL <= max(map(abs, normal)) <= _MAX_NORMAL:
            expected = f"maps of half-spaces with factors in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"
            raise InputError(f"expected {expected}, got {format_value(matrix)}", "transform")
        # A power of two leaves all bits of the unit normal as they are.
        factor = 2.0 ** -math.frexp(max(map(abs, normal)))[1]
        try:
            return [Plane(scale_by(normal, factor), offset * factor, self.material)]
        except InputError:
            got = format_value(offset / math.hypot(*normal))
            expected = f"moved half-spaces within +-{MAX_LENGTH:g} of the origin"
            raise InputError(f"expected {expected}, got one at {got}", "transform") from None

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x: inf unless `direction` is a multiple of the normal."""
        normal, offset = self.unit()
        length = dot(normal, direction)
        aside = max(abs(d - length * n) for d, n in zip(direction, normal, strict=True))
        return length * offset if length >= 0.0 and aside == 0.0 else math.inf


def is_on_plane(normal: Vec3, offset: float, point: Vec3, error: float = 0.0) -> bool:
    """Return whether a point lies on the plane of a unit normal, up to rounding and an `error` of the point."""
    return abs(_depth(normal, offset, point)) <= ROUNDING * max(map(abs, (*point, offset))) + error


def _depth(normal: Vec3, offset: float, point: Vec3) -> float:
    """Return the depth of a point in the half-space of a unit normal. The sum is rounded once."""
    return math.fsum((offset, *(-n * p for n, p in zip(normal, point, strict=True))))
