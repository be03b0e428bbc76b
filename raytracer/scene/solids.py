"""Solids: spheres and half-spaces, and trees of these by `|` `&` `-` `~`.

Part of `scene.py`, which says what holds for all of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

from raytracer.core.record import Record, public
from raytracer.core.shown import shown
from raytracer.core.validation import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Vec3,
    direction,
    number,
    point,
    set_fields,
    vector,
    whole,
)
from raytracer.core.validation import items as list_of
from raytracer.scene import tree
from raytracer.scene.materials.material import Material

# Leaves of one solid. Sub-solids may be shared in Python, so a short program can describe a tree
# of astronomical size; no evaluator comes near this many.
MAX_LEAVES = 65536
# Nodes of one solid: twice as many as binary operators take, for complements.
MAX_NODES = 4 * MAX_LEAVES
# Leaves of all solids of a scene, instances counted each. 2^20 of four float32 are 16 MiB, which any
# GPU holds, and their numbers are exact in float32 (up to 2^24).
MAX_SURFACES = 1048576
# The roundings of a handful of numbers to float64 take their sum so far from 0, as a share of its largest number.
ROUNDING = 8.0 * 2.0**-53
# Expected values in the words of errors.
_RADIUS = f"a number above 0, in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"
_OFFSET = f"a number within +-{MAX_LENGTH:g}"


@public
class Solid(Record, frozen=True):
    """A closed set of points: a primitive, or a tree of them. `|` `&` `-` `~` make trees."""

    # As Python spells the operator; "" of a primitive.
    symbol: ClassVar[str] = ""

    @property
    def operands(self) -> tuple[Solid, ...]:
        """The solids that the operator joins, none of a primitive."""
        return ()

    @staticmethod
    def from_postfix(items: Iterable[Solid | str | int]) -> Solid:
        """The tree that a list in postfix order describes: `[a, b, "|", c, "-"]` is `(a | b) - c`.

        Each item is a solid, one of "|", "&", "-", "~" with its operands before it, or a whole number: the place, from
        0, of an earlier item, whose solid it stands for. Trees may be of any depth. Raises InputError for other lists.
        """
        untyped = list_of(items, MAX_NODES)
        if untyped is None:
            raise InputError(f"expected a list, got {shown(items)}", "items")
        if len(untyped) > MAX_NODES:
            raise InputError(f"expected at most {MAX_NODES} items", "items")
        made: list[Solid] = []
        pending: list[Solid] = []
        for i, item in enumerate(untyped):
            if isinstance(item, str) and item in _OPERATORS:
                operator = _OPERATORS[item]
                count = 1 if item == Complement.symbol else 2
                if len(pending) < count:
                    expected = f"{count} operands before {shown(item)}"
                    raise InputError(f"expected {expected}, got {len(pending)}", ("items", i))
                operands = pending[-count:]
                del pending[-count:]
                solid = operator(*operands)
            elif isinstance(item, Solid):
                solid = item
            else:
                try:
                    solid = made[whole(item, ("items", i), 0, i - 1)]
                except InputError:
                    expected = f"a solid, one of {' '.join(_OPERATORS)}, or the place of an item before"
                    raise InputError(f"expected {expected}, got {shown(item)}", ("items", i)) from None
            made.append(solid)
            pending.append(solid)
        if len(pending) != 1:
            raise InputError(f"expected the operands and operators of one solid, got {len(pending)} solids", "items")
        return pending[0]

    def __or__(self, other: Solid) -> Union:
        return Union(self, other)

    def __and__(self, other: Solid) -> Intersection:
        return Intersection(self, other)

    def __sub__(self, other: Solid) -> Difference:
        return Difference(self, other)

    def __bool__(self) -> bool:
        raise TypeError("a solid is neither true nor false: join solids by | & - ~, not by or, and, not")

    def __invert__(self) -> Complement:
        return Complement(self)


def _square(x: float) -> tuple[float, float]:
    """x^2 as a float, and the exact remainder of its rounding (Dekker 1971, after Veltkamp's splitting)."""
    high = x * 134217729.0 - (x * 134217729.0 - x)  # 2^27 + 1: the upper half of x's bits
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low


@public
class Sphere(Solid, frozen=True, repr_omit_defaults=True):
    """The ball around `center` with `radius` in [1e-12, 1e12]."""

    center: Vec3
    radius: float
    material: Material = Material()

    def __post_init__(self) -> None:
        _check_material(self.material)
        set_fields(
            self,
            center=point(self.center, "center"),
            radius=number(self.radius, "radius", MIN_RADIUS, MAX_LENGTH, _RADIUS),
        )

    def power(self, point: Vec3) -> float:
        """|center - point|^2 - radius^2 to its last bits: also where the point is all but on a huge sphere."""
        parts = [-part for part in _square(self.radius)]
        for c, p in zip(self.center, _place(point), strict=True):
            d = c - p
            # The remainder of the subtraction's rounding (Knuth's two-sum): its square is below any bit that matters.
            rest = (c - (d - (d - c))) - (p + (d - c))
            parts += (*_square(d), 2.0 * d * rest)
        return math.fsum(parts)

    def touches(self, point: Vec3) -> bool:
        """Whether `point` lies on the sphere, to the rounding of the numbers that are given."""
        point = _place(point)
        largest = max(map(abs, (*self.center, *point, self.radius)))
        return abs(math.dist(self.center, point) - self.radius) <= ROUNDING * largest


@public
class Plane(Solid, frozen=True, repr_omit_defaults=True):
    """The solid half-space dot(normal, x) <= offset; `normal` need not be a unit vector."""

    normal: Vec3
    offset: float
    material: Material = Material()

    def __post_init__(self) -> None:
        _check_material(self.material)
        offset = number(self.offset, "offset", -MAX_LENGTH, MAX_LENGTH, _OFFSET)
        normal = direction(self.normal, "normal")
        set_fields(self, normal=normal, offset=offset)
        distance = abs(self.unit()[1])
        if distance > MAX_LENGTH:
            raise InputError(f"expected offset / |normal| within +-{MAX_LENGTH:g}, got {distance:g}", "offset")

    def unit(self) -> tuple[Vec3, float]:
        """The unit normal and its offset: to the last bit the same, or both negated, for planes that coincide."""
        scale = max(self.normal, key=abs)
        x, y, z, offset = (c / scale for c in (*self.normal, self.offset))
        length = math.copysign(math.hypot(x, y, z), scale)
        return (x / length, y / length, z / length), offset / length

    def depth(self, point: Vec3) -> float:
        """The depth of a point inside: offset - dot(n, point) for the unit normal n; negative outside."""
        normal, offset = self.unit()
        return math.fsum((offset, *(-n * p for n, p in zip(normal, _place(point), strict=True))))

    def touches(self, point: Vec3) -> bool:
        """Whether `point` lies on the plane, to the rounding of the numbers that are given."""
        point = _place(point)
        return abs(self.depth(point)) <= ROUNDING * max(map(abs, (*point, self.unit()[1])))


Primitive = Sphere | Plane


def _place(value: Any) -> Vec3:
    """A point to be looked at, as far away as it may be."""
    return vector(value, "point", -math.inf, math.inf, "3 finite numbers")


def _check_material(material: Any) -> None:
    if not isinstance(material, Material):
        raise InputError(f"expected a Material, got {shown(material)}", "material")


class _Operator(Solid, frozen=True, eq=False):
    """An inner node of a CSG tree.

    Trees get deep (a - b - c - ...), so nothing here recurses, by tree.py.
    """

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if not isinstance(getattr(self, name), Solid):
                raise InputError(f"expected a solid, got {shown(getattr(self, name))}", name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Operator) and tree.are_equal(self, other)

    def __hash__(self) -> int:
        return tree.tree_hash(self)

    def __repr__(self) -> str:
        return tree.text(self)

    def __rich_repr__(self) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """None, so that rich shows the repr: msgspec's own would recurse."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Solid.from_postfix, (tree.flat(self),)


class _Binary(_Operator, frozen=True, eq=False):
    a: Solid
    b: Solid

    @property
    def operands(self) -> tuple[Solid, ...]:
        return self.a, self.b


@public
class Union(_Binary, frozen=True, eq=False):
    """The points in `a` or `b`: `a | b`."""

    symbol = "|"


@public
class Intersection(_Binary, frozen=True, eq=False):
    """The points in both `a` and `b`: `a & b`."""

    symbol = "&"


@public
class Difference(_Binary, frozen=True, eq=False):
    """The points in `a` that are not in `b`: `a - b`."""

    symbol = "-"


@public
class Complement(_Operator, frozen=True, eq=False):
    """The points that are not in `a`: `~a`."""

    symbol = "~"

    a: Solid

    @property
    def operands(self) -> tuple[Solid, ...]:
        return (self.a,)


_KINDS = Union, Intersection, Difference, Complement
_OPERATORS: dict[str, Callable[..., Solid]] = {kind.symbol: kind for kind in _KINDS}


def postfix(solid: Solid) -> list[Solid]:
    """The nodes of a tree, operands before their operator.

    Raises InputError for a tree of more than `MAX_LEAVES` leaves or `MAX_NODES` nodes, and for no solid.
    """
    # Root, right, left is postfix backwards: down along the last operands, with the first ones on a stack. Exact types
    # are compared, which takes less time than isinstance(): no class is derived from a node's.
    order: list[Solid] = []
    pending = [solid]
    count = 0
    while pending:
        node: Any = pending.pop()
        kind = type(node)
        while kind is not Sphere and kind is not Plane:
            if kind not in _KINDS:
                raise InputError(f"expected solids here, got {shown(node)}", "objects")
            order.append(node)
            if kind is Complement:
                node = node.a
            else:
                pending.append(node.a)
                node = node.b
            kind = type(node)
        order.append(node)
        count += 1
        if count > MAX_LEAVES:
            raise InputError(f"expected at most {MAX_LEAVES} primitives in one object", "objects")
        if len(order) > MAX_NODES:
            raise InputError(f"expected at most {MAX_NODES} primitives and operators in one object", "objects")
    order.reverse()
    return order


def simplified(solid: Solid) -> list[Solid]:
    """List the tree as postfix() does, but without complements of complements: it is compiled alike."""
    nodes = postfix(solid)
    if Complement not in map(type, nodes):
        return nodes
    order: list[Solid] = []
    for node in nodes:
        if isinstance(node, Complement) and isinstance(order[-1], Complement):
            order.pop()
        else:
            order.append(node)
    return order


def leaves(solid: Solid) -> list[Primitive]:
    """The primitives of a tree, from left to right."""
    return [node for node in postfix(solid) if isinstance(node, Primitive)]


def with_leaves(solid: Solid, change: Callable[[Primitive], Solid]) -> Solid:
    """The same tree over other leaves: each is what `change` makes of it."""
    stack: list[Solid] = []
    for node in postfix(solid):
        if isinstance(node, Primitive):
            stack.append(change(node))
        elif isinstance(node, Complement):
            stack.append(~stack.pop())
        else:
            b, a = stack.pop(), stack.pop()
            stack.append(type(node)(a, b))  # pyright: ignore[reportCallIssue]
    return stack[0]
