"""The objects of a scene with many primitives, sorted by how they are drawn.

Small objects of spheres that share a tree, instances above all, share code: a shape. Single half-spaces,
such as a ground, are met by rays everywhere, unless there are many. All others are evaluated as programs
(csg_pruning.py).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple, TypeAlias, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.csg_pruning import Pruner
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids import (
    Complement,
    Difference,
    Intersection,
    Plane,
    Primitive,
    Solid,
    Sphere,
    Union,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
T = TypeVar("T")
Operator: TypeAlias = Callable[[T, T], T]

# Up to so many primitives every ray is tested against all of them: lists cost more than they save. Above, they are
# also quicker to compile: a second or so for any tree, and no more for the next one.
FEW = 12
# Code of so many shapes is compiled. A rarer tree, or one of more leaves than a vertex shader can hand on
# (shapes.vert), becomes a program.
SHAPES, SHAPE_LEAVES = 4, 4
# The least radius of a ball around a lens, of the smaller sphere's: its growth is then 11 at most, which SLACK of
# lists.glsl is for. A thinner lens is seldom an object.
_THICK = 0.25

# Single half-spaces are written out in the code up to so many: of 100 llvmpipe compiles two seconds. More are programs.
NAMED_PLANES = 32

Shape = tuple[type[Solid], ...]  # a postfix tree, its leaves by type


class ShapeBatch(NamedTuple):
    """n objects of one shape, of k spheres each, for which code is compiled."""

    tree: list[Solid | int]  # postfix, with leaves as numbers
    first: Ints  # (n,): index of the first of the object's surfaces
    order: Ints  # (n,): number of the object in the scene


class ProgramBatch(NamedTuple):
    """n objects of one tree, of k leaves each, that are evaluated as programs."""

    pruner: Pruner
    surfaces: Ints  # (n, k): of each leaf
    order: Ints  # (n,): number of the object in the scene


class Batches(msgspec.Struct, frozen=True, eq=False):
    """All objects of a scene; `planes`: single half-spaces by their surface."""

    shapes: list[ShapeBatch]
    programs: list[ProgramBatch]
    planes: list[int]
    order: Ints  # (surfaces,): of each surface the number of its object

    @property
    def program_depth(self) -> int:
        """The stack that the deepest of all programs needs, chains aside; 0 if all programs are chains."""
        return max((batch.pruner.depth for batch in self.programs if not batch.pruner.is_chain), default=0)


def make_batches(objects: SceneObjects) -> Batches:
    """Sort a scene's objects."""
    counts = np.array(objects.counts())
    kinds = [*map(type, objects.nodes)]
    items: dict[Shape, list[int]] = {}  # the entries of `objects` by their shape
    for i, (start, end) in enumerate(pairwise(objects.starts)):
        items.setdefault(tuple(kinds[start:end]), []).append(i)
    totals = {shape: int(counts[own].sum()) for shape, own in items.items()}
    candidates = [
        shape for shape in totals if not {Plane, Complement} & set(shape) and shape.count(Sphere) <= SHAPE_LEAVES
    ]
    compiled = sorted(candidates, key=lambda shape: -totals[shape])[:SHAPES]
    spheres, planes = np.zeros((2, len(objects)), np.int64)  # of one object of each entry
    for shape, own in items.items():
        spheres[own], planes[own] = shape.count(Sphere), shape.count(Plane)
    first_sphere = _sums(counts * spheres)
    first_plane = first_sphere[-1] + _sums(counts * planes)
    number = _sums(counts)
    programs: list[ProgramBatch] = []
    named: list[int] = []
    for shape, own in items.items():
        if shape in compiled:
            continue
        if shape == (Plane,) and totals[shape] <= NAMED_PLANES:
            named = _spread(first_plane[own], 1, counts[own]).tolist()
            continue
        tree = objects.tree(own[0])
        columns = []
        sphere = plane = 0
        for node in tree:
            if isinstance(node, Plane):
                columns.append(_spread(first_plane[own], shape.count(Plane), counts[own]) + plane)
                plane += 1
            elif isinstance(node, Sphere):
                columns.append(_spread(first_sphere[own], shape.count(Sphere), counts[own]) + sphere)
                sphere += 1
        order = _spread(number[own], 1, counts[own])
        programs.append(ProgramBatch(Pruner(tree), np.column_stack(columns), order))
    shapes = [
        ShapeBatch(
            _numbered(objects.tree(own[0])),
            _spread(first_sphere[own], shape.count(Sphere), counts[own]),
            _spread(number[own], 1, counts[own]),
        )
        for shape in compiled
        for own in (items[shape],)
    ]
    numbers = np.arange(number[-1])
    orders = [np.repeat(numbers, np.repeat(leaves, counts)) for leaves in (spheres, planes)]
    return Batches(shapes, programs, named, np.concatenate(orders))


def _sums(counts: Ints) -> Ints:
    """(N + 1,): the sum of all counts before each, and of all."""
    return np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])


def _spread(starts: Ints, step: int, counts: Ints) -> Ints:
    """Each start as often as its count says, and so many steps further each time."""
    within = np.arange(counts.sum()) - np.repeat(_sums(counts)[:-1], counts)
    return np.repeat(starts, counts) + step * within


def _numbered(tree: list[Solid]) -> list[Solid | int]:
    count = iter(range(len(tree)))
    return [next(count) if isinstance(node, Primitive) else node for node in tree]


def is_bounded(shape: Shape) -> bool:
    """Whether a ray that meets none of a tree's spheres meets nothing of it; half-spaces it always may meet."""
    stack: list[bool] = []
    for kind in shape:
        if kind is Complement:
            stack[-1] = False
        elif kind is Difference:
            stack.pop()
        elif kind in (Union, Intersection):
            b, a = stack.pop(), stack.pop()
            stack.append(a and b if kind is Union else a or b)
        else:
            stack.append(kind is Sphere)
    return stack[0]


def combined(tree: list[Solid | int], leaf: Callable[[int], T], common: Operator[T], around: Operator[T]) -> T:
    """A bound of a tree's solid, from `leaf` for each leaf, `common` for an intersection and `around` for a union.

    The bound of a difference is the bound of its first operand.
    """
    stack: list[T] = []
    for node in tree:
        if isinstance(node, int):
            stack.append(leaf(node))
        elif isinstance(node, Difference):
            stack.pop()
        else:
            b, a = stack.pop(), stack.pop()
            stack.append(common(a, b) if isinstance(node, Intersection) else around(a, b))
    return stack[0]


class Balls(NamedTuple):
    """Balls that hold something, close to the smallest."""

    centers: Array  # (n, 3)
    radii: Array  # (n,)
    # (n, 3): where two spheres are moved by d from where they are, along x, y or z, balls wider by so many d hold it.
    growth: Array
    largest: Array  # (n,): the radius of the largest sphere


def balls(batch: ShapeBatch, centers: Array, radii: Array) -> Balls:
    """Balls that hold the objects of a batch, from all spheres' places."""

    def ball(leaf: int) -> Balls:
        place = centers[batch.first + leaf]
        return Balls(place, radii[batch.first + leaf], np.zeros_like(place), radii[batch.first + leaf])

    return combined(batch.tree, ball, _common, _around)


def _common(a: Balls, b: Balls) -> Balls:
    """Around what two balls have in common: a lens, or else all of the smaller one.

    Let r be the radius of the smaller one, and the two be wider by d, or nearer to each other by 2 d. The plane of
    the lens's edge then moves by 2 d at most, and the square of the edge's radius grows by 4 r d + d^2 at most: where
    it is R or less, it gets no larger than R by more than (2 r / R + 1) d. So that is bounded, R is at least a share
    of r. Only of spheres: lenses of lenses would grow by the product.
    """
    apart = b.centers - a.centers
    distance = np.linalg.norm(apart, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (distance + (a.radii - b.radii) * (a.radii + b.radii) / distance) / 2.0  # from a to the lens's edge
        square = (a.radii - along) * (a.radii + along)
        lens = (along > 0.0) & (along < distance) & (square > 0.0) & ~np.any(a.growth + b.growth, axis=1)
        axis = apart / distance[:, None]
    first = a.radii <= b.radii
    smaller = np.where(first, a.radii, b.radii)
    edge = np.maximum(np.sqrt(np.where(lens, square, 0.0)), _THICK * smaller)

    def choose(lens_value: Array, a_value: Array, b_value: Array) -> Array:
        return np.where(lens[:, None], lens_value, np.where(first[:, None], a_value, b_value))

    return Balls(
        choose(a.centers + axis * along[:, None], a.centers, b.centers),
        np.where(lens, edge, smaller),
        choose(np.abs(axis) * (3.0 + 2.0 * smaller / edge)[:, None], a.growth, b.growth),
        np.maximum(a.largest, b.largest),
    )


def _around(a: Balls, b: Balls) -> Balls:
    """The smallest ball around two."""
    distance = np.linalg.norm(b.centers - a.centers, axis=1)
    radius = np.maximum(np.maximum(a.radii, b.radii), (distance + a.radii + b.radii) / 2.0)
    # From a's centre towards b's: not at all if a holds b, all the way if b holds a.
    share = np.clip((radius - a.radii) / np.where(distance > 0.0, distance, 1.0), 0.0, 1.0)
    center = a.centers + share[:, None] * (b.centers - a.centers)
    return Balls(center, radius, np.maximum(a.growth, b.growth), np.maximum(a.largest, b.largest))
