"""The batches of a scene with many primitives: its objects, grouped by the way in which they are drawn.

Small objects of spheres that share one tree, instances above all, share code: a shape. Single half-spaces, such as a
ground, are tested for every ray, unless there are many. All other objects are evaluated as programs (csg_pruning.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.csg_pruning import LEAF_SHIFT, NEGATED, OR_LEAF, Pruner
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Complement, Difference, Intersection, Primitive, Solid, Union
from raytracer.scene.solids.sphere import Sphere

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
T = TypeVar("T")
Operator: TypeAlias = Callable[[T, T], T]

# The largest number of primitives for which every ray is tested against all of them: candidate lists would cost more
# than they save. Above it, lists are also quicker to compile: a second or so for any tree, and nothing for the next
# tree.
FEW = 12
# The largest number of shapes with compiled code, and of leaves of a shape. A rarer tree, or a tree of more leaves than
# a vertex shader can hand on (shapes.vert), becomes a program.
SHAPES, SHAPE_LEAVES = 4, 4
# The smallest radius of a bounding sphere of a lens, as a share of the smaller sphere's radius. The growth is then 11
# at most, for which SLACK of lists.glsl has room. A thinner lens is seldom an object.
_THICK = 0.25

# The smallest number of leaves of a long chain, which has a grid. For shorter chains, the lists of cells are short.
LONG = 48
# The largest number of leaves of a long chain that every ray is tested against, CORE of grid.glsl; and the largest
# number of objects of one tree that have grids, of which each may take 70 MB.
CORE, _MOST_GRIDS = 4, 16

# The largest number of single half-spaces that are written out in the code (llvmpipe takes two seconds to compile 100).
# If there are more, they become programs.
NAMED_PLANES = 32

# The types of leaves, in the order of the surfaces' indices.
_LEAVES: tuple[type[Solid], ...] = Sphere, Placed, Plane

Shape = tuple[type[Solid], ...]  # the node types of a postfix tree


class ShapeBatch(NamedTuple):
    """The n objects of one shape, with compiled code; each has k spheres."""

    tree: list[Solid | int]  # postfix, with leaves as numbers
    first: Ints  # (n,): index of the object's first surface
    order: Ints  # (n,): number of the object in the scene


class ProgramBatch(NamedTuple):
    """The n objects of one tree that are evaluated as programs; each has k leaves."""

    pruner: Pruner
    surfaces: Ints  # (n, k): the surface index of each leaf
    order: Ints  # (n,): number of the object in the scene
    is_long_chain: bool  # whether the objects have grids (chain_grids.py)


class Batches(msgspec.Struct, frozen=True, eq=False):
    """All objects of a scene, in batches. `planes` has the surface indices of the single half-spaces."""

    shapes: list[ShapeBatch]
    programs: list[ProgramBatch]
    planes: list[int]
    order: Ints  # (surfaces,): the number of each surface's object

    @property
    def program_depth(self) -> int:
        """The largest stack depth of the programs that are no chains; 0 if all programs are chains."""
        return max((batch.pruner.depth for batch in self.programs if not batch.pruner.is_chain), default=0)

    @property
    def has_grids(self) -> bool:
        """Whether any objects are long chains."""
        return any(batch.is_long_chain for batch in self.programs)


def make_batches(objects: SceneObjects) -> Batches:
    """Group a scene's objects."""
    counts = np.array(objects.counts())
    kinds = [*map(type, objects.nodes)]
    items: dict[Shape, list[int]] = {}  # the indices of the entries of `objects`, by shape
    for i, (start, end) in enumerate(pairwise(objects.starts)):
        items.setdefault(tuple(kinds[start:end]), []).append(i)
    totals = {shape: int(counts[own].sum()) for shape, own in items.items()}
    candidates = [
        shape
        for shape in totals
        if not {Placed, Plane, Complement} & set(shape) and shape.count(Sphere) <= SHAPE_LEAVES
    ]
    compiled = sorted(candidates, key=lambda shape: -totals[shape])[:SHAPES]
    leaves = np.zeros((len(_LEAVES), len(objects)), np.int64)  # in one object of each entry
    for shape, own in items.items():
        leaves[:, own] = np.array([shape.count(kind) for kind in _LEAVES])[:, None]
    # The index of the first leaf of each kind, in each entry.
    firsts: dict[type[Solid], Ints] = {}
    end = 0
    for kind, count in zip(_LEAVES, leaves, strict=True):
        firsts[kind] = end + _running_sums(counts * count)
        end = int(firsts[kind][-1])
    number = _running_sums(counts)
    programs: list[ProgramBatch] = []
    named: list[int] = []
    for shape, own in items.items():
        if shape in compiled:
            continue
        if shape == (Plane,) and totals[shape] <= NAMED_PLANES:
            named = _sequences(firsts[Plane][own], 1, counts[own]).tolist()
            continue
        tree = objects.tree(own[0])
        columns = []
        seen = dict.fromkeys(_LEAVES, 0)
        begins = {kind: _sequences(firsts[kind][own], shape.count(kind), counts[own]) for kind in _LEAVES}
        for kind in map(type, tree):
            if kind in seen:
                columns.append(begins[kind] + seen[kind])
                seen[kind] += 1
        order = _sequences(number[own], 1, counts[own])
        pruner = Pruner(tree)
        is_long = len(columns) >= LONG and len(order) <= _MOST_GRIDS and is_bounded(shape) and _is_chain(pruner, tree)
        programs.append(ProgramBatch(pruner, np.column_stack(columns), order, is_long))
    shapes = [
        ShapeBatch(
            _number_leaves(objects.tree(own[0])),
            _sequences(firsts[Sphere][own], shape.count(Sphere), counts[own]),
            _sequences(number[own], 1, counts[own]),
        )
        for shape in compiled
        for own in (items[shape],)
    ]
    numbers = np.arange(number[-1])
    orders = [np.repeat(numbers, np.repeat(count, counts)) for count in leaves]
    return Batches(shapes, programs, named, np.concatenate(orders))


def _is_chain(pruner: Pruner, tree: Sequence[Solid]) -> bool:
    """Return whether a tree is a chain of which all leaves but a few are negated and bounded.

    A union is the complement of a conjunction, whose leaves are negated.
    """
    if not pruner.is_chain:
        return False
    codes = pruner.whole_program()
    is_plane = np.array([isinstance(leaf, Plane) for leaf in tree if isinstance(leaf, Primitive)])
    negated = ((codes & NEGATED) != 0) != ((codes[-1] & 7) == OR_LEAF)
    return int(np.count_nonzero(~negated | is_plane[codes >> LEAF_SHIFT])) <= CORE


def _running_sums(counts: Ints) -> Ints:
    """Return (N + 1,): the sum of the counts before each entry, and the total."""
    return np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])


def _sequences(starts: Ints, step: int, counts: Ints) -> Ints:
    """Return the sequences start, start + step, start + 2 step, ... of all entries, each with `counts` numbers."""
    within = np.arange(counts.sum()) - np.repeat(_running_sums(counts)[:-1], counts)
    return np.repeat(starts, counts) + step * within


def _number_leaves(tree: list[Solid]) -> list[Solid | int]:
    """Replace the leaves of a postfix tree by their numbers."""
    count = iter(range(len(tree)))
    return [next(count) if isinstance(node, Primitive) else node for node in tree]


def is_bounded(shape: Shape) -> bool:
    """Return whether a ray that misses all spheres and bodies of a tree misses its solid. A ray may always meet a
    half-space."""
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
            stack.append(kind is not Plane)
    return stack[0]


def combine_bounds(tree: list[Solid | int], leaf: Callable[[int], T], common: Operator[T], around: Operator[T]) -> T:
    """Compute a bound of a tree's solid from bounds of its leaves.

    `leaf` returns the bound of a leaf by its number, `common` the bound of an intersection, and
    `around` the bound of a union. The bound of a difference is the bound of its first operand.
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
    """Bounding spheres, close to the smallest ones."""

    centers: Array  # (n, 3)
    radii: Array  # (n,)
    # (n, 3): if the object's spheres move by up to d along x, y or z, a ball that is larger by growth * d still holds
    # it.
    growth: Array
    largest: Array  # (n,): the radius of the largest sphere


def bounding_balls(batch: ShapeBatch, centers: Array, radii: Array) -> Balls:
    """Return bounding spheres of a batch's objects. `centers` and `radii` have all spheres of the scene."""

    def ball(leaf: int) -> Balls:
        place = centers[batch.first + leaf]
        return Balls(place, radii[batch.first + leaf], np.zeros_like(place), radii[batch.first + leaf])

    return combine_bounds(batch.tree, ball, _balls_around_intersections, _balls_around_unions)


def _balls_around_intersections(a: Balls, b: Balls) -> Balls:
    """Return bounding spheres of the intersections of two balls: around the lens, or else the smaller ball.

    Let r be the smaller radius, and let both balls grow by d, or approach each other by 2 d. The plane of the lens's
    edge then moves by at most 2 d, and the square of the edge's radius grows by at most 4 r d + d^2. So an edge of the
    radius R, or less, grows beyond R by at most (2 r / R + 1) d. To bound this growth, R is at least a share _THICK of
    r. Only spheres make lenses here: the growth of lenses of lenses would be the product.
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


def _balls_around_unions(a: Balls, b: Balls) -> Balls:
    """Return the smallest balls around pairs of balls."""
    distance = np.linalg.norm(b.centers - a.centers, axis=1)
    radius = np.maximum(np.maximum(a.radii, b.radii), (distance + a.radii + b.radii) / 2.0)
    # The share of the way from a's centre to b's: 0 if a holds b, 1 if b holds a.
    share = np.clip((radius - a.radii) / np.where(distance > 0.0, distance, 1.0), 0.0, 1.0)
    center = a.centers + share[:, None] * (b.centers - a.centers)
    return Balls(center, radius, np.maximum(a.growth, b.growth), np.maximum(a.largest, b.largest))
