"""A CSG tree as nodes of many children, and the order in which programs (csg_pruning.py) evaluate these."""

from __future__ import annotations

from typing import NamedTuple

from raytracer.scene.solids import Complement, Difference, Intersection, Primitive, Solid, Union


class Flat(NamedTuple):
    """A tree of n-ary AND and OR nodes over literals; parents come before children, and root 0 is an AND.

    Children are in the tree's order: inner nodes by number, leaf i as ~i.
    """

    conjunction: list[bool]
    children: list[list[int]]
    negated: list[bool]  # of leaves


def flatten(nodes: list[Solid]) -> Flat:
    """Complements pushed down to the leaves by De Morgan's laws, a - b as a & ~b, equal operators merged."""
    leaf = sum(isinstance(node, Primitive) for node in nodes)
    flat = Flat([True], [[]], [False] * leaf)
    # Backwards, a postfix list is root, right, left. For each node that is to come: its parent, whether negated.
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
    """In what order a flat tree's nodes are evaluated."""

    depth: int
    nodes: list[int]  # children before their parent, numbered as in Flat
    swapped: set[int]  # nodes that are evaluated later than a sibling that the tree has after them


def evaluation_order(flat: Flat) -> Order:
    """The order that holds the fewest values at a time (Sethi and Ullman 1970), of those that Flat's nodes allow."""
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
    # Root, last, ..., first on a stack is children before parents backwards.
    nodes: list[int] = []
    pending = [0]
    while pending:
        node = pending.pop()
        nodes.append(node)
        if node >= 0:
            pending += turns[node]
    return Order(need[0], nodes[::-1], swapped)


def empty_values(flat: Flat) -> list[bool]:
    """The value of each inner node when none of its leaves is listed."""
    empty = [False] * len(flat.children)
    for v in reversed(range(len(flat.children))):
        values = (empty[c] if c >= 0 else flat.negated[~c] for c in flat.children[v])
        empty[v] = all(values) if flat.conjunction[v] else any(values)
    return empty
