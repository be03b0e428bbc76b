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

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.csg_flattening import empty_values, evaluation_order, flatten
from raytracer.compiler.direction_cells import Ints, row_starts
from raytracer.compiler.tree_paths import paths
from raytracer.scene.solids import Solid

Mask = NDArray[np.bool_]

PUSH, AND_LEAF, OR_LEAF, AND, OR, TRUE = range(6)
LEAF_SHIFT, SWAPPED, NEGATED = 5, 1 << 4, 1 << 3
_DROPPED = -1
# Pairs of a cell and a leaf that are pruned at a time.
_AT_ONCE = 2**19


class _Events(NamedTuple):
    """In cells, the nodes of paths of one rank beside which something is left, and the listed leaves at paths' ends.

    They are sorted by cell, then place; those of one cell and path are a group.
    """

    pair: Ints  # cell << bits | place
    below: Mask  # whether the child on the path is left
    last: Ints  # index of the last event of the group
    tops: Ints  # those of these at which the uppermost node of the path is left
    sides: Ints  # pairs of the nodes beside the paths that are left: those of `tops` of the next rank, and then leaves
    parents: Ints  # which of them are whose children: sides[parents], by ...
    start: Ints  # ... where the children of each event that has some begin there, ...
    inner: Ints  # ... and the indices of these events


class Pruner:
    """A tree, as solids.postfix() gives it, ready to be pruned; its leaves are counted from left to right.

    `depth`: how many values a program holds at most: those on the stack, and the leaf that is being
    combined with its top. A stack of max(depth - 1, 1) will do. `is_chain`: whether all programs are chains.

    The work is in proportion to the listed leaves, times log2(leaves) at most, however deep the tree is: what is left
    of a path is known from its few nodes beside which something is left, as all others are left if and only if their
    child on the path is, or never.
    """

    def __init__(self, nodes: list[Solid]) -> None:
        flat = flatten(nodes)
        order, empty = evaluation_order(flat), empty_values(flat)
        self.depth = order.depth
        self.is_chain = len(flat.children) == 1 or (len(flat.children) == 2 and len(flat.children[0]) == 1)
        self._constant = empty[0]
        # From here on a node's number is its place in the order of evaluation: all below it come just before it.
        count = len(order.nodes)
        number = {node: i for i, node in enumerate(order.nodes)}
        leaves = np.zeros(len(flat.negated), np.int64)
        parent = [count - 1] * count
        joins = np.zeros(count, np.int64)  # how a leaf in its place is combined with what is left before it
        # Whether a node decides its parent when it is dropped: False in an AND, True in an OR.
        killer = np.zeros(count, np.int64)
        code = np.zeros(count, np.int64)
        for v, children in enumerate(flat.children):
            for c in children:
                i = number[c]
                parent[i] = number[v]
                joins[i] = (AND_LEAF if flat.conjunction[v] else OR_LEAF) | (SWAPPED if c in order.swapped else 0)
                killer[i] = (empty[c] if c >= 0 else flat.negated[~c]) != flat.conjunction[v]
                if c < 0:
                    leaves[~c] = i
                    code[i] = ~c << LEAF_SHIFT | (NEGATED if flat.negated[~c] else 0)
        cut = paths(parent)
        self._bits = count.bit_length()
        self._code = code  # of each node by its number; all that follows is of each place
        self._leaf = cut.place[leaves]  # of each leaf
        self._places = np.arange(count)
        self._ranks = int(cut.rank.max()) + 1
        self._number, self._bottom, self._top, self._rank = cut.node, cut.bottom, cut.top, cut.rank
        self._parent = cut.place[np.array(parent)[cut.node]]
        self._joins, self._killer = joins[cut.node], killer[cut.node]
        # Whoever is dropped equals its empty value; a node is left only if none of its killers is dropped. How many of
        # these are beside the path:
        side = np.flatnonzero(self._top == self._places)
        side = side[side != count - 1]  # the root's is beside none
        self._killers = np.bincount(self._parent[side], self._killer[side], count).astype(np.int64)
        # How many places before each, with one more at the end, are inner nodes that are dropped unless they are
        # events: at which something beside the path would have to be left.
        self._blocked = np.concatenate([[0], np.cumsum(self._killers > 0)])

    def programs(self, cell: Ints, leaf: Ints, cells: int) -> tuple[Ints, NDArray[np.int32]]:
        """(start (cells + 1,), code (K,)): cell i's program is code[start[i] : start[i + 1]].

        `cell` and `leaf`, each (M,), are the listed pairs, sorted by cell, then leaf, each once. What has no
        bounds, such as a half-space, belongs in every cell.
        """
        parts = [np.zeros(0, np.int64)]
        begin = 0
        while begin < len(cell):
            # Whole cells; what is computed on the way takes a few hundred bytes a pair.
            end = begin + _AT_ONCE
            end = int(np.searchsorted(cell, cell[end])) if end < len(cell) else len(cell)
            if end <= begin:
                end = int(np.searchsorted(cell, cell[begin], side="right"))
            pruned = self._chain if self.is_chain else self._paths
            parts.append(pruned(cell[begin:end], self._leaf[leaf[begin:end]]))
            begin = end
        entries = np.concatenate(parts)
        if self._constant:
            left = np.zeros(cells, bool)
            left[entries >> (LEAF_SHIFT + self._bits)] = True
            constant = (np.flatnonzero(~left) << self._bits | (len(self._code) - 1)) << LEAF_SHIFT | TRUE
            entries = np.sort(np.concatenate((entries, constant)), kind="stable")
        pair, how = entries >> LEAF_SHIFT, entries & ((1 << LEAF_SHIFT) - 1)
        code = self._code[pair & self._mask] | how
        return row_starts(pair >> self._bits, cells), code.astype(np.int32)

    @property
    def _mask(self) -> int:
        """The bits of a pair, cell << bits | place, that are the place."""
        return (1 << self._bits) - 1

    def _chain(self, cell: Ints, place: Ints) -> Ints:
        """The codes that are left, if all leaves have one parent: (cell << bits | number) << LEAF_SHIFT | operation."""
        start = np.flatnonzero(_differs(cell))
        left = np.add.reduceat(self._killer[place], start) == self._killer[self._leaf].sum()
        how = self._joins[place]
        how[start] = PUSH
        kept = np.repeat(left, np.diff(start, append=len(cell)))
        return ((cell << self._bits | self._number[place]) << LEAF_SHIFT | how)[kept]

    def _paths(self, cell: Ints, place: Ints) -> Ints:
        """The same of any tree."""
        return np.sort(np.concatenate(self._down(self._up(cell << self._bits | place))))

    def _up(self, pairs: Ints) -> list[_Events]:
        """The events of each rank, by the pairs of listed leaves."""
        place = pairs & self._mask
        rank = self._rank[place]
        alone = self._top[place] == place  # leaves that are a path of their own
        levels: list[_Events] = []
        tops = pairs[:0]
        for r in reversed(range(self._ranks)):
            levels.append(
                self._events(np.concatenate((tops, pairs[alone & (rank == r + 1)])), pairs[~alone & (rank == r)])
            )
            tops = levels[-1].pair[levels[-1].tops]
            tops = tops + (self._top - self._places)[tops & self._mask]
        return levels[::-1]

    def _events(self, sides: Ints, ends: Ints) -> _Events:
        """The events of the paths that have `sides` and, as the leaves that they end in, `ends`."""
        place = sides & self._mask
        parent = sides - place + self._parent[place]
        parents = np.argsort(parent, kind="stable")
        parent = parent[parents]
        start = np.flatnonzero(_differs(parent))
        parent = parent[start]
        at = parent & self._mask
        fulfilled = np.add.reduceat(self._killer[place[parents]], start) == self._killers[at]
        pair = np.concatenate((parent, ends))
        order = np.argsort(pair, kind="stable")
        pair = pair[order]
        inner = np.empty(len(pair), np.int64)
        inner[order] = np.arange(len(pair))
        # A node is left if what is beside the path leaves it, and its child on the path is no killer or is left, too.
        alone = np.concatenate((~fulfilled | (self._killer[at - 1] == 0), np.ones(len(ends), bool)))[order]
        value = np.concatenate((fulfilled, np.ones(len(ends), bool)))[order] & alone
        at = pair & self._mask
        group = pair + (self._top - self._places)[at]
        begins = _differs(group)
        # Between two events are nodes beside which nothing is left: they are as the child on the path, or blocked.
        joined = ~begins
        joined[1:] &= self._blocked[at[1:]] == self._blocked[at[:-1] + 1]
        known = alone | ~joined
        left = value[np.maximum.accumulate(np.where(known, np.arange(len(pair)), 0))]
        below = joined
        below[1:] &= left[:-1]
        ends_ = np.flatnonzero(np.append(begins[1:], True)[: len(pair)])
        tops = ends_[left[ends_] & (self._blocked[self._top[at[ends_]] + 1] == self._blocked[at[ends_] + 1])]
        last = ends_[np.cumsum(begins) - 1]
        return _Events(pair, below, last, tops, sides, parents, start, inner[: len(parent)])

    def _down(self, levels: list[_Events]) -> list[Ints]:
        """The codes that are left, from the roots down to the leaves, as _chain() has them."""
        parts: list[Ints] = []
        # How each path that is left joins what was evaluated before it: the code for a leaf in its place.
        joins = np.full(len(levels[0].tops), PUSH)
        for level, nexts in zip(levels, [*(len(level.tops) for level in levels[1:]), 0], strict=True):
            pair, at = level.pair, level.pair & self._mask
            entering = np.full(len(pair), _DROPPED)
            entering[level.tops] = joins
            # Below the first event whose child on the path is dropped, all of the path is.
            gone = np.cumsum(~level.below)
            live = (entering[level.last] != _DROPPED) & (gone[level.last] == gone)
            sides = level.sides[level.parents]
            size = np.diff(level.start, append=len(sides))
            number = self._number[sides & self._mask]
            first = np.full(len(pair), len(self._number))
            first[level.inner] = np.minimum.reduceat(number, level.start)
            # A node with one child left is that child. Of more, the one that is evaluated first is pushed.
            on_path = level.below & (self._number[at - 1] < first)
            handed = np.where(on_path, PUSH, self._joins[at - 1])
            above = np.where(level.last == np.arange(len(pair)), entering, np.append(handed[1:], 0)[: len(pair)])
            above[~live] = _DROPPED
            many = np.zeros(len(pair), bool)
            many[level.inner] = size + level.below[level.inner] > 1
            combined = many & (above > PUSH)
            is_leaf = (above != _DROPPED) & (self._bottom[at] == at)
            numbered = pair - at + self._number[at]
            parts.append(numbered[combined] << LEAF_SHIFT | above[combined] + (AND - AND_LEAF))
            parts.append(numbered[is_leaf] << LEAF_SHIFT | above[is_leaf])
            owner = np.repeat(level.inner, size)
            below = np.where(
                (number == first[owner]) & ~on_path[owner],
                np.where(many[owner], PUSH, above[owner]),
                self._joins[sides & self._mask],
            )
            below[above[owner] == _DROPPED] = _DROPPED
            by_side = np.empty(len(sides), np.int64)
            by_side[level.parents] = below
            # The tops of the next rank's paths come first.
            joins = by_side[:nexts]
            leaves, how = level.sides[nexts:], by_side[nexts:]
            place = leaves & self._mask
            kept = how != _DROPPED
            parts.append((leaves - place + self._number[place])[kept] << LEAF_SHIFT | how[kept])
        return parts


def _differs(values: Ints) -> Mask:
    """Whether each is another than the one before it."""
    first = np.ones(len(values), bool)
    np.not_equal(values[1:], values[:-1], out=first[1:])
    return first


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
