"""Solids: primitives such as spheres and boxes, affine maps of solids, and CSG trees of them by `|` `&` `-` `~`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, ClassVar

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, Vec3, integer, set_fields
from raytracer.core.validation import items as list_of
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import affine, moves, tree
from raytracer.scene.solids.affine import Map
from raytracer.scene.solids.bounds import EVERYWHERE, Bounds, extent
from raytracer.scene.solids.limits import MAX_LEAVES, MAX_NODES

_ORIGIN = (0.0, 0.0, 0.0)


@public
class Solid(Record, frozen=True):
    """A closed set of points: a primitive such as Sphere or Box, a moved solid, or a CSG tree of solids.

    The operators make trees: `a | b` (union), `a & b` (intersection), `a - b` (difference), `~a` (complement). The
    methods translate(), rotate(), scale(), mirror() and transform() return moved copies.
    """

    symbol: ClassVar[str] = ""  # the operator in Python, "" for a primitive

    @property
    def operands(self) -> tuple[Solid, ...]:
        """The solids that the operator combines; () for a primitive."""
        return ()

    @staticmethod
    def from_postfix(items: Iterable[Solid | str | int | Map]) -> Solid:
        """Return the tree for a list in postfix order: `[a, b, "|", c, "-"]` is `(a | b) - c`.

        Each of the `items` is a solid, an operator ("|", "&", "-" or "~", after its operands), a matrix of transform()
        after its operand, as a tuple, or the index, from 0, of an earlier item, whose solid is used again. Trees may
        have any depth. Raises InputError for other lists.
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
            elif isinstance(item, tuple):
                if not pending:
                    raise InputError("expected a solid before the matrix", ("items", i))
                solid = Transform(pending.pop(), affine.check_matrix(item, ("items", i)))
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

    def transform(self, matrix: Any) -> Solid:
        """Return the solid under an affine map: the copy holds the points A x + t for all points x of this solid.

        Args:
            matrix: the rows of [A | t], 3 x 4 numbers, or 4 x 4 with the last row 0, 0, 0, 1. Any array-like.

        Raises:
            InputError: another value, or a matrix that is singular to float64.
        """
        return Transform(self, affine.check_matrix(matrix, "matrix"))

    def translate(self, offset: Any) -> Solid:
        """Return the solid moved by `offset`, three numbers within +-1e12. Raises InputError."""
        return Transform(self, moves.translation(offset))

    def rotate(self, axis: Any, degrees: float, about: Any = _ORIGIN) -> Solid:
        """Return the solid rotated around an axis, counterclockwise as seen from the axis's tip.

        Args:
            axis: the direction of the axis, of any length but 0.
            degrees: the angle in degrees. Quarter turns are exact.
            about: a point of the axis. Default: the origin.

        Raises:
            InputError: a wrong value.
        """
        return Transform(self, moves.rotation(axis, degrees, about))

    def scale(self, factor: Any, about: Any = _ORIGIN) -> Solid:
        """Return the solid scaled by one factor, or by one factor along each axis.

        Args:
            factor: one number or three, in [1e-12, 1e12].
            about: the point that stays. Default: the origin.

        Raises:
            InputError: a wrong value.
        """
        return Transform(self, moves.scaling(factor, about))

    def mirror(self, normal: Any, about: Any = _ORIGIN) -> Solid:
        """Return the mirror image of the solid.

        Args:
            normal: the normal of the mirror plane, of any length but 0.
            about: a point of the mirror plane. Default: the origin.

        Raises:
            InputError: a wrong value.
        """
        return Transform(self, moves.reflection(normal, about))

    def paint(self, material: Material) -> Solid:
        """Return a copy with one material for all surfaces. Raises InputError for another value than a Material."""
        painted: dict[int, Solid] = {}
        for node in tree.list_distinct(self):
            if isinstance(node, Primitive):
                copy = node.with_material(material)
            else:
                operands = (painted[id(operand)] for operand in node.operands)
                copy = node.replace(**dict(zip("ab", operands, strict=False)))
            painted[id(node)] = copy
        return painted[id(self)]

    def bounds(self) -> Bounds:
        """Return a box (min, max) around the solid, with sides along the axes.

        The box of a primitive under any map is the smallest one. For a tree, it is the box of the operands' boxes: the
        smallest box around both for a union, the common part for an intersection, and the first one for a difference.
        """
        stack: list[Bounds] = []
        for node in postfix(self):
            match node:
                case Primitive():
                    stack.append(extent(node.support))
                case Complement():
                    stack[-1] = EVERYWHERE
                case Difference():
                    stack.pop()
                case _:
                    b, a = stack.pop(), stack.pop()
                    stack.append(a.union(b) if isinstance(node, Union) else a.common(b))
        return stack[0]

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


class Primitive(Solid, frozen=True):
    """A solid that is no tree and no moved solid."""

    if TYPE_CHECKING:

        @property
        def material(self) -> Material:
            """The material of the surface."""
            ...

    def place(self, matrix: Map | None) -> list[Primitive | Union]:
        """Return the postfix nodes of the primitive under a map; None is the identity.

        The leaves are of the types Sphere, Plane and Placed.
        """
        raise NotImplementedError

    def with_material(self, material: Material) -> Primitive:
        """Return a copy with another material."""
        return self.replace(material=material)

    def support(self, direction: Vec3) -> float:
        """Return the largest dot(direction, x) of all points x of the primitive; inf if it is unbounded."""
        raise NotImplementedError

    def touches(self, point: Vec3, error: float = 0.0) -> bool:
        """Whether `point` lies on the surface, up to rounding and an `error` of the point, a length."""
        raise NotImplementedError


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


class Transform(_Operator, frozen=True, eq=False):
    """A solid under an affine map, made by the methods of Solid. Maps of maps are composed at once."""

    a: Solid
    matrix: Map

    def __post_init__(self) -> None:
        solid, matrix = self.a, self.matrix
        if isinstance(solid, Transform):
            solid, matrix = solid.a, affine.compose(matrix, solid.matrix)
        set_fields(self, a=solid, matrix=affine.check_map(matrix, "transform"))

    @property
    def operands(self) -> tuple[Solid, ...]:
        return (self.a,)


_KINDS = Union, Intersection, Difference, Complement
_OPERATORS: dict[str, Callable[..., Solid]] = {kind.symbol: kind for kind in _KINDS}


def postfix(solid: Solid) -> list[Solid]:
    """Return the nodes of a tree, operands before operators, with all maps moved to the leaves.

    The leaves are of the types Sphere, Plane and Placed. Raises InputError for too many nodes or another object.
    """
    # Visit root, right operand, left operand: postfix order reversed. The stack holds the left operands still to visit.
    # Comparing exact types is faster than isinstance(), and correct because node classes have no subclasses.
    order: list[Solid] = []
    pending: list[tuple[Any, Map | None]] = [(solid, None)]
    count = 0
    while pending:
        node, matrix = pending.pop()
        kind = type(node)
        while kind in _KINDS or kind is Transform:
            if kind is Transform:
                matrix = affine.compose(matrix, node.matrix) if matrix else node.matrix
                node = node.a
            elif kind is Complement:
                order.append(node)
                node = node.a
            else:
                order.append(node)
                pending.append((node.a, matrix))
                node = node.b
            kind = type(node)
        if not isinstance(node, Primitive):
            raise InputError(f"expected solids here, got {format_value(node)}", "objects")
        placed = node.place(matrix)
        order += placed[::-1]
        count += len(placed) // 2 + 1
        if count > MAX_LEAVES:
            raise InputError(f"expected at most {MAX_LEAVES} primitives in one object", "objects")
        if len(order) > MAX_NODES:
            raise InputError(f"expected at most {MAX_NODES} primitives and operators in one object", "objects")
    order.reverse()
    return order
