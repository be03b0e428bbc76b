"""Solids: spheres and half-spaces (primitives), and CSG trees of them by `|` `&` `-` `~`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Vec3,
    direction,
    integer,
    number,
    point,
    set_fields,
    vector,
)
from raytracer.core.validation import items as list_of
from raytracer.scene import tree
from raytracer.scene.materials.material import Material

# The most leaves of one solid, more than any evaluator handles. With shared operands, a tree may be astronomically big.
MAX_LEAVES = 65536
# The most nodes of one solid: twice as many as binary operators need, which leaves room for complements.
MAX_NODES = 4 * MAX_LEAVES
# The most leaves of all solids of a scene, with each instance counted. 2^20 leaves of four float32 take 16 MiB, which
# any GPU has, and leaf numbers up to 2^24 are exact in float32.
MAX_SURFACES = 1048576
# Bound of the rounding error of a sum of a few rounded float64 numbers, relative to the largest number.
ROUNDING = 8.0 * 2.0**-53
_RADIUS = f"a number above 0, in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"
_OFFSET = f"a number within +-{MAX_LENGTH:g}"


@public
class Solid(Record, frozen=True):
    """A closed set of points, by a primitive (Sphere, Plane) or a CSG tree of primitives.

    The operators make trees: `a | b` (union), `a & b` (intersection), `a - b` (difference), `~a` (complement).
    """

    symbol: ClassVar[str] = ""  # the operator in Python, "" for a primitive

    @property
    def operands(self) -> tuple[Solid, ...]:
        """The solids that the operator combines; () for a primitive."""
        return ()

    @staticmethod
    def from_postfix(items: Iterable[Solid | str | int]) -> Solid:
        """Return the tree for a list in postfix order: `[a, b, "|", c, "-"]` is `(a | b) - c`.

        Each of the `items` is a solid, an operator ("|", "&", "-" or "~", after its operands), or the index, from 0, of
        an earlier item, whose solid is used again. Trees may have any depth. Raises InputError for other lists.
        """
        untyped = list_of(items, MAX_NODES)
        if untyped is None:
            raise InputError(f"expected a list, got {format_value(items)}", "items")
        if len(untyped) > MAX_NODES:
            raise InputError(f"expected at most {MAX_NODES} items", "items")
        made: list[Solid] = []
        pending: list[Solid] = []
        for i, item in enumerate(untyped):
            if isinstance(item, str) and item in _OPERATORS:
                operator = _OPERATORS[item]
                count = 1 if item == Complement.symbol else 2
                if len(pending) < count:
                    expected = f"{count} operands before {format_value(item)}"
                    raise InputError(f"expected {expected}, got {len(pending)}", ("items", i))
                operands = pending[-count:]
                del pending[-count:]
                solid = operator(*operands)
            elif isinstance(item, Solid):
                solid = item
            else:
                try:
                    solid = made[integer(item, ("items", i), 0, i - 1)]
                except InputError:
                    expected = f"a solid, one of {' '.join(_OPERATORS)}, or the index of an earlier item"
                    raise InputError(f"expected {expected}, got {format_value(item)}", ("items", i)) from None
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
    """Return x^2 as a float, and the exact rounding error of it (Dekker 1971, with Veltkamp's splitting)."""
    high = x * 134217729.0 - (x * 134217729.0 - x)  # 2^27 + 1: the upper half of x's bits
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low


@public
class Sphere(Solid, frozen=True, repr_omit_defaults=True):
    """A solid ball. Raises InputError for a wrong value.

    Args:
        center: the centre, three numbers within +-1e12.
        radius: the radius. Range: 1e-12 to 1e12.
        material: the material of its surface. Default: Material().
    """

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
        """Return the power of a point, |center - point|^2 - radius^2, to the last bit, even next to a huge sphere."""
        parts = [-part for part in _square(self.radius)]
        for c, p in zip(self.center, _check_point(point), strict=True):
            d = c - p
            # The rounding error of the subtraction (Knuth's two-sum). Its square is too small to count.
            error = (c - (d - (d - c))) - (p + (d - c))
            parts += (*_square(d), 2.0 * d * error)
        return math.fsum(parts)

    def touches(self, point: Vec3) -> bool:
        """Whether `point` lies on the sphere, up to rounding."""
        point = _check_point(point)
        largest = max(map(abs, (*self.center, *point, self.radius)))
        return abs(math.dist(self.center, point) - self.radius) <= ROUNDING * largest


@public
class Plane(Solid, frozen=True, repr_omit_defaults=True):
    """A solid half-space: all points x with dot(normal, x) <= offset. Raises InputError for a wrong value.

    Args:
        normal: the direction out of the solid, of any length but 0.
        offset: dot(normal, x) for points x of the boundary. Range: offset and offset / |normal| within +-1e12.
        material: the material of its surface. Default: Material().
    """

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
        """Return the unit normal and its offset. Coincident planes have bit-identical or exactly negated results."""
        scale = max(self.normal, key=abs)
        x, y, z, offset = (c / scale for c in (*self.normal, self.offset))
        length = math.copysign(math.hypot(x, y, z), scale)
        return (x / length, y / length, z / length), offset / length

    def depth(self, point: Vec3) -> float:
        """Return the distance of a point from the boundary, positive inside the half-space and negative outside."""
        normal, offset = self.unit()
        return math.fsum((offset, *(-n * p for n, p in zip(normal, _check_point(point), strict=True))))

    def touches(self, point: Vec3) -> bool:
        """Whether `point` lies on the plane, up to rounding."""
        point = _check_point(point)
        return abs(self.depth(point)) <= ROUNDING * max(map(abs, (*point, self.unit()[1])))


Primitive = Sphere | Plane


def _check_point(value: Any) -> Vec3:
    """Return three finite numbers of any size. Raises InputError."""
    return vector(value, "point", -math.inf, math.inf, "3 finite numbers")


def _check_material(material: Any) -> None:
    if not isinstance(material, Material):
        raise InputError(f"expected a Material, got {format_value(material)}", "material")


class _Operator(Solid, frozen=True, eq=False):
    """An inner node of a CSG tree. Trees may be deep (a - b - c - ...), so its methods do not recurse (see tree.py)."""

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if not isinstance(getattr(self, name), Solid):
                raise InputError(f"expected a solid, got {format_value(getattr(self, name))}", name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Operator) and tree.are_equal(self, other)

    def __hash__(self) -> int:
        return tree.tree_hash(self)

    def __repr__(self) -> str:
        return tree.tree_text(self)

    def __rich_repr__(self) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return None, so that rich shows the repr. The method of msgspec would recurse."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Solid.from_postfix, (tree.flatten(self),)


class _Binary(_Operator, frozen=True, eq=False):
    a: Solid
    b: Solid

    @property
    def operands(self) -> tuple[Solid, ...]:
        return self.a, self.b


@public
class Union(_Binary, frozen=True, eq=False):
    """The union `a | b`: all points in `a` or `b`."""

    symbol = "|"


@public
class Intersection(_Binary, frozen=True, eq=False):
    """The intersection `a & b`: all points in both `a` and `b`."""

    symbol = "&"


@public
class Difference(_Binary, frozen=True, eq=False):
    """The difference `a - b`: all points in `a` that are not in `b`."""

    symbol = "-"


@public
class Complement(_Operator, frozen=True, eq=False):
    """The complement `~a`: all points that are not in `a`."""

    symbol = "~"

    a: Solid

    @property
    def operands(self) -> tuple[Solid, ...]:
        return (self.a,)


_KINDS = Union, Intersection, Difference, Complement
_OPERATORS: dict[str, Callable[..., Solid]] = {kind.symbol: kind for kind in _KINDS}


def postfix(solid: Solid) -> list[Solid]:
    """Return the nodes of a tree, operands before operators. Raises InputError for too many nodes or another object."""
    # Visit root, right operand, left operand: postfix order reversed. The stack holds the left operands still to visit.
    # Comparing exact types is faster than isinstance(), and correct because node classes have no subclasses.
    order: list[Solid] = []
    pending = [solid]
    count = 0
    while pending:
        node: Any = pending.pop()
        kind = type(node)
        while kind is not Sphere and kind is not Plane:
            if kind not in _KINDS:
                raise InputError(f"expected solids here, got {format_value(node)}", "objects")
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


def simplify(solid: Solid) -> list[Solid]:
    """Return the nodes of a tree in postfix order without double complements, which do not change the solid."""
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
    """Return the primitives of a tree, from left to right."""
    return [node for node in postfix(solid) if isinstance(node, Primitive)]


def with_leaves(solid: Solid, change: Callable[[Primitive], Solid]) -> Solid:
    """Return a copy of the tree in which each primitive is replaced by `change(primitive)`."""
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
