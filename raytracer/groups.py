"""The objects of a scene with many primitives, sorted by how they are drawn.

Small objects of spheres that share a tree, instances above all, share code: a kind. Single half-spaces,
such as a ground, are met by rays everywhere, unless there are many. All others are evaluated as programs (prune.py).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from raytracer.instances import Instances
from raytracer.prune import Pruner
from raytracer.scene import Scene
from raytracer.solids import (
    Complement,
    Difference,
    Intersection,
    Plane,
    Primitive,
    Solid,
    Sphere,
    Union,
    simplified,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
T = TypeVar("T")
Operator: TypeAlias = Callable[[T, T], T]

# Up to so many primitives every ray is tested against all of them: lists cost more than they save. Above, they are
# also quicker to compile: a second or so for any tree, and no more for the next one.
FEW = 12
# Code of so many kinds is compiled; a rarer tree, or one of more leaves than a vertex shader can hand on (kinds.vert),
# becomes a program.
KINDS, KIND_LEAVES = 4, 4

# Single half-spaces are written out in the code up to so many: of 100 llvmpipe compiles two seconds. More are programs.
NAMED_PLANES = 32

Shape = tuple[type[Solid], ...]  # a postfix tree, its leaves by type


class Group(NamedTuple):
    """n objects of one kind, of k spheres each."""

    tree: list[Solid | int]  # postfix, with leaves as numbers
    first: Ints  # (n,): index of the first of the object's surfaces
    order: Ints  # (n,): number of the object in the scene


class Big(NamedTuple):
    """n objects of one tree, of k leaves each, that are evaluated as programs."""

    pruner: Pruner
    surfaces: Ints  # (n, k): of each leaf
    order: Ints  # (n,): number of the object in the scene


class Groups(NamedTuple):
    """All objects of a scene; `planes`: single half-spaces by their surface."""

    kinds: list[Group]
    bigs: list[Big]
    planes: list[int]
    order: Ints  # (surfaces,): of each surface the number of its object


_last: tuple[object, Groups] | None = None


def groups(scene: Scene) -> Groups:
    """The objects of `scene`, kept as long as scenes of the same objects are asked for."""
    global _last
    last = _last  # another thread may set it meanwhile
    if last is None or last[0] is not scene.objects:
        _last = last = scene.objects, _groups(scene)
    return last[1]


def _groups(scene: Scene) -> Groups:
    trees = [simplified(o.solid if isinstance(o, Instances) else o) for o in scene.objects]
    counts = [len(o) if isinstance(o, Instances) else 1 for o in scene.objects]
    shapes = [tuple(type(node) for node in tree) for tree in trees]
    of_kind: Counter[Shape] = Counter()
    for shape, count in zip(shapes, counts, strict=True):
        if not {Plane, Complement} & set(shape) and shape.count(Sphere) <= KIND_LEAVES:
            of_kind[shape] += count
    kinds = [shape for shape, _ in of_kind.most_common(KINDS)]
    spheres = sum(shape.count(Sphere) * count for shape, count in zip(shapes, counts, strict=True))
    few_planes = sum(count for shape, count in zip(shapes, counts, strict=True) if shape == (Plane,)) <= NAMED_PLANES
    first: list[list[Ints]] = [[] for _ in kinds]
    order: list[list[Ints]] = [[] for _ in kinds]
    bigs: dict[Shape, list[tuple[Ints, Ints]]] = {}
    planes: list[int] = []
    orders_of_spheres: list[Ints] = []
    orders_of_planes: list[Ints] = []
    sphere, plane, number = 0, spheres, 0
    for tree, shape, count in zip(trees, shapes, counts, strict=True):
        own = shape.count(Sphere), shape.count(Plane)
        numbers = np.arange(number, number + count)
        if shape in kinds:
            first[kinds.index(shape)].append(sphere + own[0] * np.arange(count))
            order[kinds.index(shape)].append(numbers)
        elif shape == (Plane,) and few_planes:
            planes += range(plane, plane + count)
        else:
            is_plane = np.array([isinstance(node, Plane) for node in tree if isinstance(node, Primitive)])
            among = np.where(is_plane, np.cumsum(is_plane) - 1 + plane, np.cumsum(~is_plane) - 1 + sphere)
            step = np.where(is_plane, own[1], own[0])
            bigs.setdefault(shape, []).append((among + step * np.arange(count)[:, None], numbers))
        orders_of_spheres.append(np.repeat(numbers, own[0]))
        orders_of_planes.append(np.repeat(numbers, own[1]))
        sphere, plane, number = sphere + own[0] * count, plane + own[1] * count, number + count
    found = [
        Group(_numbered(trees[shapes.index(shape)]), np.concatenate(f), np.concatenate(o))
        for shape, f, o in zip(kinds, first, order, strict=True)
    ]
    programs = [
        Big(Pruner(trees[shapes.index(shape)]), np.concatenate(surfaces), np.concatenate(order))
        for shape, (surfaces, order) in ((shape, zip(*parts, strict=True)) for shape, parts in bigs.items())
    ]
    return Groups(found, programs, planes, np.concatenate([*orders_of_spheres, *orders_of_planes]))


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
    """Something that holds a tree's solid, given that for each leaf, for what two have in common, and for two together.

    What is left of a difference is held by what holds its first operand.
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


def balls(group: Group, centers: Array, radii: Array) -> tuple[Array, Array]:
    """(n, 3) and (n,): balls that hold the objects of a group, close to the smallest, given all spheres' places."""

    def ball(leaf: int) -> tuple[Array, Array]:
        return centers[group.first + leaf], radii[group.first + leaf]

    return combined(group.tree, ball, _common, _around)


def _common(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """Around what two balls have in common: a lens, or else all of the smaller one."""
    distance = np.linalg.norm(b[0] - a[0], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (distance + (a[1] - b[1]) * (a[1] + b[1]) / distance) / 2.0  # from a to the lens's edge
        square = (a[1] - along) * (a[1] + along)
        lens = (along > 0.0) & (along < distance) & (square > 0.0)
        middle = a[0] + (b[0] - a[0]) * (along / distance)[:, None]
    smaller = a[1] < b[1]
    center = np.where(lens[:, None], middle, np.where(smaller[:, None], a[0], b[0]))
    return center, np.where(lens, np.sqrt(np.where(lens, square, 0.0)), np.minimum(a[1], b[1]))


def _around(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """The smallest ball around two."""
    distance = np.linalg.norm(b[0] - a[0], axis=1)
    radius = np.maximum(np.maximum(a[1], b[1]), (distance + a[1] + b[1]) / 2.0)
    # From a's centre towards b's: not at all if a holds b, all the way if b holds a.
    share = np.clip((radius - a[1]) / np.where(distance > 0.0, distance, 1.0), 0.0, 1.0)
    return a[0] + share[:, None] * (b[0] - a[0]), radius
