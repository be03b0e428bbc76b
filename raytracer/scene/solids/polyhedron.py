"""The convex polyhedron."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from raytracer.core.record import public
from raytracer.core.shown import format_value
from raytracer.core.validation import MIN_RADIUS, InputError, Vec3, items, set_fields
from raytracer.core.validation import point as check_point
from raytracer.core.vectors import dot
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.body import Body, Slab
from raytracer.scene.solids.checks import check_material, check_place
from raytracer.scene.solids.forms import box_corners
from raytracer.scene.solids.limits import ROUNDING

# The most points: a hull of as many has up to 8,188 faces, each of which a ray may have to meet.
MAX_POINTS = 4096


@public
class Polyhedron(Body, frozen=True, repr_omit_defaults=True):
    """A solid convex polyhedron: the convex hull of points. Raises InputError for a wrong value.

    Points inside the hull, in its faces and on its edges are welcome, as are equal points.

    Args:
        points: the points [N, 3], numbers within +-1e12, not all in one plane. Range of N: 4 to 4,096. Any array-like.
        material: the material of its surface. Default: Material().
    """

    points: tuple[Vec3, ...]
    material: Material = Material()  # pyright: ignore[reportIncompatibleMethodOverride]

    def __post_init__(self) -> None:
        check_material(self.material)
        rows: list[Any] | None = items(self.points, MAX_POINTS)
        if rows is None or not 4 <= len(rows) <= MAX_POINTS:
            count = "" if rows is None or len(rows) > MAX_POINTS else f"{len(rows)} in "
            raise InputError(f"expected 4 to {MAX_POINTS} points, got {count}{format_value(self.points)}", "points")
        set_fields(self, points=tuple(check_point(row, ("points", i)) for i, row in enumerate(rows)))
        if not _faces(self.points):
            least = f"points {MIN_RADIUS:g} or more off one plane"
            raise InputError(f"expected {least}, and off it by more than rounding in float64", "points")

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        return max(dot(direction, point) for point in self.points)

    def corners(self) -> tuple[Vec3, ...]:
        """Return the corners of the box around the points, with sides along the axes."""
        (a, b, c), (x, y, z) = ([choose(column) for column in zip(*self.points, strict=True)] for choose in (min, max))
        return box_corners((a, b, c), (x, y, z))

    def outermost(self) -> tuple[Vec3, ...]:
        """Return the points: the box of a thin hull across the axes is thick."""
        return self.points

    def slabs(self) -> tuple[Slab, ...]:
        """Return the faces, two parallel ones as one slab."""
        return _faces(self.points)

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        point = check_place(point)
        largest = max(abs(x) for p in (*self.points, point) for x in p)
        heights = [(dot(normal, point), low, high) for normal, low, high in _faces(self.points)]
        return abs(max(max(low - h, h - high) for h, low, high in heights)) <= ROUNDING * largest + error


# Keeps the faces of the last polyhedra, since a hull takes up to a second, and both the check and the compiler need it.
@lru_cache(maxsize=64)
def _faces(points: tuple[Vec3, ...]) -> tuple[Slab, ...]:
    """Return the faces of the convex hull; () for points in one plane to float64, or less than 1e-12 off one."""
    import numpy as np

    from raytracer.scene.solids.hull import hull_sides

    return tuple(Slab(*side) for side in hull_sides(np.array(points), MIN_RADIUS))
