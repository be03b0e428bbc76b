"""Bodies: primitives with plane faces and a curved one, and their places under affine maps."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import affine
from raytracer.scene.solids.affine import IDENTITY, Map
from raytracer.scene.solids.bounds import extent
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.solid import Primitive, Union


class Wall(NamedTuple):
    """The curved face of a primitive, by four affine forms l(x) = w.x + c, each with its numbers (w, c).

    "round": the points with |(l1, l2, l3)| <= l0, where l0 is a constant: an ellipsoid, or a cylinder with l3 = 0.
    "cone": the same for any l0 >= 0: a second-order cone, convex as well.
    "torus": the points with (hypot(l1, l2) - 1)^2 + l3^2 <= l0^2, where l0 is a constant below 1.
    """

    kind: Literal["round", "cone", "torus"]
    forms: tuple[affine.Row, affine.Row, affine.Row, affine.Row]  # of l0, l1, l2, l3


class Slab(NamedTuple):
    """The points with low <= dot(normal, x) <= high: two parallel faces, or one if the other bound is infinite."""

    normal: Vec3  # of any length
    low: float
    high: float


class Body(Primitive, frozen=True):
    """A bounded primitive: the intersection of `slabs` and at most one `wall`, in its own space.

    The compiler uses only these methods. The float64 reference is written from the definition of each kind.
    """

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return the leaf of the body under a map; None is the identity."""
        return [Placed(self, matrix or IDENTITY)]

    def with_material(self, material: Material) -> Body:
        """Return a copy with another material."""
        return self.replace(material=material)

    def corners(self) -> tuple[Vec3, ...]:
        """Return eight points whose convex hull holds the primitive, in the order of the corners of a box.

        The bits 1, 2 and 4 of a corner's number choose between the two sides along three axes.
        """
        raise NotImplementedError

    def outermost(self) -> tuple[Vec3, ...]:
        """Return points that are about as far apart, along any direction, as the primitive's points."""
        return self.corners()

    def reach(self) -> float:
        """Return the radius of a ball that holds the primitive, around the mean of the corners."""
        corners = self.corners()
        middle = [sum(coordinates) / len(corners) for coordinates in zip(*corners, strict=True)]
        return max(math.dist(middle, corner) for corner in corners)

    def slabs(self) -> tuple[Slab, ...]:
        """Return the plane faces."""
        return ()

    def wall(self) -> Wall | None:
        """Return the curved face, if any."""
        return None


class Placed(Body, frozen=True):
    """A leaf of a flattened tree: a primitive under an affine map. Raises InputError beyond the limits of lengths.

    The two intervals of a ray in a torus are two leaves, the parts 0 and 1. Other primitives have only the part 0.
    """

    shape: Body
    matrix: Map
    part: int = 0

    def __post_init__(self) -> None:
        if self.matrix is IDENTITY:
            return
        affine.check_invertible(self.matrix, "transform")
        low, high = extent(self.support)
        if not all(a >= -MAX_LENGTH and b <= MAX_LENGTH for a, b in zip(low, high, strict=True)):
            got = f"{format_value(list(low))} to {format_value(list(high))}"
            raise InputError(f"expected moved solids within +-{MAX_LENGTH:g}, got one from {got}", "transform")
        if not all(b - a >= MIN_RADIUS for a, b in zip(low, high, strict=True)):
            sides = format_value([b - a for a, b in zip(low, high, strict=True)])
            raise InputError(f"expected moved solids {MIN_RADIUS:g} or more wide, got {sides}", "transform")

    @property
    def material(self) -> Material:
        """The material of the primitive."""
        return self.shape.material

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return this leaf under a further map."""
        return [self if matrix is None else Placed(self.shape, affine.compose(matrix, self.matrix), self.part)]

    def with_material(self, material: Material) -> Placed:
        """Return a copy with another material."""
        return self.replace(shape=self.shape.with_material(material))

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x."""
        shift = sum(d * row[3] for d, row in zip(direction, self.matrix, strict=True))
        return self.shape.support(affine.pull_direction(self.matrix, direction)) + shift

    def corners(self) -> tuple[Vec3, ...]:
        """Return eight points whose convex hull holds the leaf, as Primitive.corners()."""
        return tuple(affine.apply(self.matrix, corner) for corner in self.shape.corners())

    def outermost(self) -> tuple[Vec3, ...]:
        """Return points that are about as far apart, along any direction, as the leaf's points."""
        return tuple(affine.apply(self.matrix, point) for point in self.shape.outermost())

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point."""
        back = affine.inverse(self.matrix)
        sizes = [max(abs(p), abs(row[3])) for p, row in zip(point, self.matrix, strict=True)]
        # The rounding of the coordinates, of the matrix and of its inverse counts as much as the inverse stretches it.
        largest = max(sum(abs(x) * (ROUNDING * s + error) for x, s in zip(row, sizes, strict=False)) for row in back)
        return self.shape.touches(affine.apply(back, point), largest)
