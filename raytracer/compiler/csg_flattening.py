"""Flattening of CSG trees: nodes with many children, and the order in which programs (csg_pruning.py) evaluate them."""

from __future__ import annotations

from typing import NamedTuple

from raytracer.scene.solids.solid import Complement, Difference, Intersection, Primitive, Solid, Union


class Flat(NamedTuple):
    """A tree of n-ary AND and OR nodes over literals. Parents come before children, and the root, 0, is an AND.

    A literal is a leaf or its complement. Children are in the tree's order: inner nodes by number, leaf i as ~i.
    """

    conjunction: list[bool]  # for each inner node: whether it is an AND
    children: list[list[int]]  # for each inner node
    negated: list[bool]  # for each leaf: whether it stands for its complement


def flatten(nodes: list[Solid]) -> Flat:
    """Flatten a postfix tree: push complements down to the leaves (De Morgan), turn a - b into a & ~b, merge
    operators."""
    leaf = sum(isinstance(node, Primitive) for node in nodes)
    flat = Flat([True], [[]], [False] * leaf)
    # Read backwards, a postfix list is root, right, left. Pending: the parent of each node to come, and its negation.
    pending = [(0, False)]
    for node in reversed(nodes):
        parent, negated = pending.pop()
        match node:
            case Complement():
                pending.append((parent, not negated))
            case Union() | Intersection() | Difference():
                conjunction = isinstance(node, Union) == negated
                if conjunction != flat.conjunction[parent]:
                    inner = len(flat.children)
                    flat.children[parent].append(inner)
                    flat.conjunction.append(conjunction)
                    flat.children.append([])
                    parent = inner
                pending += ((parent, negated), (parent, negated != isinstance(node, Difference)))
            case _:
                leaf -= 1
                flat.negated[leaf] = negated
                flat.children[parent].append(~leaf)
    for children in flat.children:
        children.reverse()
    return flat


class Order(NamedTuple):
    """The order in which the nodes of a flat tree are evaluated."""

    depth: int  # the most values that are held at a time
    nodes: list[int]  # the nodes of Flat, children before their parent
    swapped: set[int]  # nodes that are evaluated after a sibling that comes later in the tree


def evaluation_order(flat: Flat) -> Order:
    """Return the order that holds the fewest values at a time (Sethi and Ullman 1970), keeping Flat's nodes."""
    need = [0] * len(flat.children)
    turns: list[list[int]] = [[] for _ in flat.children]
    swapped: set[int] = set()
    for v in reversed(range(len(flat.children))):
        children = flat.children[v]
        needs = [need[c] if c >= 0 else 1 for c in children]
        neediest = needs.index(max(needs))
        need[v] = max([needs.pop(neediest), *(n + 1 for n in needs)])
        turns[v] = children[neediest:] + children[:neediest][::-1]
        swapped.update(children[:neediest])
    # The stack yields root, last child, ..., first child, which is the reverse of children before parents.
    nodes: list[int] = []
    pending = [0]
    while pending:
        node = pending.pop()
        nodes.append(node)
        if node >= 0:
            pending += turns[node]
    return Order(need[0], nodes[::-1], swapped)


def empty_values(flat: Flat) -> list[bool]:
    """Return the value of each inner node for a ray that is outside all of its leaves' primitives."""
    empty = [False] * len(flat.children)
    for v in reversed(range(len(flat.children))):
        values = (empty[c] if c >= 0 else flat.negated[~c] for c in flat.children[v])
        empty[v] = all(values) if flat.conjunction[v] else any(values)
    return empty
