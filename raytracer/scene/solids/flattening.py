"""Flattened trees: lists of nodes in postfix order, with all maps moved to the leaves."""

from __future__ import annotations

from collections.abc import Callable

from raytracer.scene.solids.solid import Complement, Primitive, Solid, postfix


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
