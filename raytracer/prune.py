"""A CSG tree shrunk to the few primitives that rays through a cell can meet, for many cells at once.

A ray is outside a primitive that is not listed in its cell from end to end: the primitive is False
there, and the tree shrinks. For every cell what remains of it becomes a program for a stack machine.

A program is a row of int32 codes: leaf << 5 | swapped << 4 | negated << 3 | operation.

    0 PUSH       the leaf
    1 AND_LEAF   combine the top of the stack with the leaf
    2 OR_LEAF    the same
    3 AND        combine the two topmost values, the leaf field is 0
    4 OR         the same
    5 TRUE       the constant True; the only code of its program

`negated`: the leaf stands for its complement. `swapped`: the later operand (the leaf, or the top of
the stack) comes before the other one in the tree. The tree's first operand that changes at a surface
owns it, and programs do not keep the tree's order: a node's neediest child is evaluated first, then
those that follow it, and then those that precede it, from the nearest to the first (swapped). What
is on the stack thus stands for neighbours in the tree, so that "before" and "after" make sense.
An empty program is the constant False. In a chain, all of whose leaves are combined alike, the first code may say
AND_LEAF or OR_LEAF too, instead of PUSH: chains() makes it so.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.cells import Ints, row_starts
from raytracer.solids import Complement, Difference, Intersection, Primitive, Solid, Union

Mask = NDArray[np.bool_]

PUSH, AND_LEAF, OR_LEAF, AND, OR, TRUE = range(6)
LEAF_SHIFT, SWAPPED, NEGATED = 5, 1 << 4, 1 << 3
_DROPPED = -1


class _Flat(NamedTuple):
    """A tree of n-ary AND and OR nodes over literals; parents come before children, and root 0 is an AND.

    Children are in the tree's order: inner nodes by number, leaf i as ~i.
    """

    conjunction: list[bool]
    children: list[list[int]]
    negated: list[bool]  # of leaves


def _flatten(nodes: list[Solid]) -> _Flat:
    """Complements pushed down to the leaves by De Morgan's laws, a - b as a & ~b, equal operators merged."""
    leaf = sum(isinstance(node, Primitive) for node in nodes)
    flat = _Flat([True], [[]], [False] * leaf)
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


class _Order(NamedTuple):
    """In what order a flat tree's nodes are evaluated."""

    depth: int
    nodes: list[int]  # children before their parent, numbered as in _Flat
    swapped: set[int]  # nodes that are evaluated later than a sibling that the tree has after them


def _order(flat: _Flat) -> _Order:
    """The order that holds the fewest values at a time (Sethi and Ullman 1970), of those that _Flat's nodes allow."""
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
    return _Order(need[0], nodes[::-1], swapped)


def _empty(flat: _Flat) -> list[bool]:
    """What each inner node is when none of its leaves is listed."""
    empty = [False] * len(flat.children)
    for v in reversed(range(len(flat.children))):
        values = (empty[c] if c >= 0 else flat.negated[~c] for c in flat.children[v])
        empty[v] = all(values) if flat.conjunction[v] else any(values)
    return empty


class _Level(NamedTuple):
    """The pairs cell << bits | node at one depth of the tree whose node is left, given what is below it; sorted."""

    pairs: Ints
    node: Ints
    parents: Ints  # likewise pairs
    size: Ints  # how many of the pairs are each parent's
    left: Mask  # whether each parent is left


class Pruner:
    """A tree, as solids.postfix() gives it, ready to be pruned; its leaves are counted from left to right.

    `depth`: how many values a program holds at most: those on the stack, and the leaf that is being
    combined with its top. A stack of max(depth - 1, 1) will do. `is_chain`: whether all programs are chains.
    """

    def __init__(self, nodes: list[Solid]) -> None:
        flat = _flatten(nodes)
        order, empty = _order(flat), _empty(flat)
        self.depth = order.depth
        self.is_chain = len(flat.children) == 1 or (len(flat.children) == 2 and len(flat.children[0]) == 1)
        self._constant = empty[0]
        # From here on a node's number is its place in the order of evaluation: all below it come
        # just before it, so that pairs sorted by cell and node stay sorted when parents take their places.
        count = len(order.nodes)
        number = {node: i for i, node in enumerate(order.nodes)}
        self._number = np.zeros(len(flat.negated), np.int64)  # of leaves
        self._inner = np.array([node >= 0 for node in order.nodes])
        self._root = count - 1
        self._parent = np.full(count, self._root)
        self._level = np.zeros(count, np.int64)  # steps from the root
        self._joins = np.zeros(count, np.int64)  # how a leaf in its place is combined with what is left before it
        # Whether a node decides its parent when it is dropped: False in an AND, True in an OR.
        self._killer = np.zeros(count, np.int64)
        self._code = np.zeros(count, np.int64)
        for v, children in enumerate(flat.children):
            for c in children:
                i = number[c]
                self._parent[i] = number[v]
                self._level[i] = self._level[number[v]] + 1
                self._joins[i] = (AND_LEAF if flat.conjunction[v] else OR_LEAF) | (SWAPPED if c in order.swapped else 0)
                self._killer[i] = (empty[c] if c >= 0 else flat.negated[~c]) != flat.conjunction[v]
                if c < 0:
                    self._number[~c] = i
                    self._code[i] = ~c << LEAF_SHIFT | (NEGATED if flat.negated[~c] else 0)
        # Whoever is dropped equals its empty value; a node is left only if none of its killers is dropped.
        self._killers = np.bincount(self._parent, self._killer, count).astype(np.int64)
        self._bits = count.bit_length()
        self._sorted = self._level.max() == 1 and bool(np.all(np.diff(self._number) > 0))

    def programs(self, cell: Ints, leaf: Ints, cells: int) -> tuple[Ints, NDArray[np.int32]]:
        """(start (cells + 1,), code (K,)): cell i's program is code[start[i] : start[i + 1]].

        `cell` and `leaf`, each (M,), are the listed pairs, sorted by cell, then leaf, each once. What has no
        bounds, such as a half-space, belongs in every cell.
        """
        levels = self._up(self._split((cell << self._bits) | self._number[leaf]))
        parts = self._down(levels)
        roots = levels[0].parents[levels[0].left]
        if self._constant:
            left = np.zeros(cells, bool)
            left[roots >> self._bits] = True
            parts.append((np.flatnonzero(~left) << self._bits | self._root) << LEAF_SHIFT | TRUE)
        # Each part is sorted, and the stable sort merges what is.
        entries = parts[0] if len(parts) == 1 else np.sort(np.concatenate((roots[:0], *parts)), kind="stable")
        pair, how = entries >> LEAF_SHIFT, entries & ((1 << LEAF_SHIFT) - 1)
        code = self._code[pair & self._node] | how
        return row_starts(pair >> self._bits, cells), code.astype(np.int32)

    @property
    def _node(self) -> int:
        """What of a pair, cell << bits | node, is the node."""
        return (1 << self._bits) - 1

    def _split(self, pairs: Ints) -> list[Ints]:
        """The pairs of every level from 1, sorted."""
        if self._sorted:
            return [pairs]
        level = self._level[pairs & self._node]
        # One sort, whatever the number of levels.
        bits = int(pairs.max(initial=0)).bit_length()
        pairs = np.sort(level << bits | pairs)
        ends = np.searchsorted(pairs, np.arange(1, level.max(initial=1) + 2) << bits)
        return [pairs[a:b] & ((1 << bits) - 1) for a, b in itertools.pairwise(ends)]

    def _up(self, own: list[Ints]) -> list[_Level]:
        """From the listed leaves of each level up to the roots that are left."""
        levels = []
        inner = own[-1][:0]
        for leaves in reversed(own):
            pairs = np.sort(np.concatenate((leaves, inner)), kind="stable") if len(inner) else leaves
            node = pairs & self._node
            parents = (pairs - node) | self._parent[node]
            first = np.ones(len(pairs), bool)
            np.not_equal(parents[1:], parents[:-1], out=first[1:])
            start = np.flatnonzero(first)
            parents, size = parents[start], np.diff(start, append=len(pairs))
            left = np.add.reduceat(self._killer[node], start) == self._killers[parents & self._node]
            levels.append(_Level(pairs, node, parents, size, left))
            inner = parents[left]
        return levels[::-1]

    def _down(self, levels: list[_Level]) -> list[Ints]:
        """From the roots down to the leaves: what is left, as pair << LEAF_SHIFT | how it is combined; each sorted."""
        parts = []
        # How each parent that is left joins what was evaluated before it: the code for a leaf in its place.
        joins = np.full(np.count_nonzero(levels[0].left), PUSH)
        for pairs, node, parents, size, left in levels:
            above = np.full(len(parents), _DROPPED)
            above[left] = joins
            # A parent with one child left is that child.
            joined = (above > PUSH) & (size > 1)
            parts.append(parents[joined] << LEAF_SHIFT | above[joined] + (AND - AND_LEAF))
            below = self._joins[node]
            below[np.cumsum(size) - size] = np.where(size > 1, PUSH, above)
            below[np.repeat(above == _DROPPED, size)] = _DROPPED
            inner = self._inner[node]
            leaves = (below != _DROPPED) & ~inner
            parts.append(pairs[leaves] << LEAF_SHIFT | below[leaves])
            joins = below[inner]
        return [part for part in parts if len(part)]


def chains(start: Ints, code: NDArray[np.int32]) -> NDArray[np.int32]:
    """The programs code[start[i] : start[i + 1]], those that are chains beginning with what combines their leaves."""
    first = start[:-1][np.diff(start) > 0]
    if not len(first):
        return code
    operation = code & 7
    operation[first] = operation[np.minimum(first + 1, len(code) - 1)]  # of the next one
    size = np.diff(first, append=len(code))
    operation[first[size == 1]] = AND_LEAF
    least, most = np.minimum.reduceat(operation, first), np.maximum.reduceat(operation, first)
    chain = (least == most) & (least >= AND_LEAF) & (most <= OR_LEAF)
    code = code.copy()
    code[first[chain]] |= least[chain]  # PUSH is 0
    return code
