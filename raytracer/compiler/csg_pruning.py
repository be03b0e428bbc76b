"""CSG pruning: reduces a tree to the few primitives that rays through a cell can meet, for many cells at once.

A primitive that is not listed in a cell is False along every ray through the cell, so the tree shrinks. The rest of the
tree becomes a program for a stack machine, one for every cell.

A program is a row of int32 codes: leaf << 5 | swapped << 4 | negated << 3 | operation.

    0 PUSH       push the leaf
    1 AND_LEAF   combine the top of the stack with the leaf by AND
    2 OR_LEAF    combine the top of the stack with the leaf by OR
    3 AND        combine the two topmost values by AND; the leaf field is 0
    4 OR         combine the two topmost values by OR; the leaf field is 0
    5 TRUE       the constant True; the only code of its program
    6 GRID       the object of a grid (chain_grids.py); the leaf field is the grid's number; the only code

`negated`: the leaf stands for its complement. `swapped`: the later operand (the leaf, or the top of the stack) comes
before the other one in the tree. The order in the tree matters, because the first operand that changes at a surface
owns the surface. Programs evaluate a node's children in another order: first the child that needs the deepest stack,
then the children after it, and then the children before it, from the nearest to the first (swapped). So a value on the
stack always stands for neighbours in the tree, and "before" and "after" have a meaning.
An empty program is the constant False. A chain combines all of its leaves by one operation; mark_chains() writes
AND_LEAF or OR_LEAF into its first code, in place of PUSH.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.csg_flattening import empty_values, evaluation_order, flatten
from raytracer.compiler.direction_cells import Ints, row_starts
from raytracer.compiler.tree_paths import cut_into_paths
from raytracer.scene.solids.solid import Solid

Mask = NDArray[np.bool_]

PUSH, AND_LEAF, OR_LEAF, AND, OR, TRUE, GRID = range(7)
LEAF_SHIFT, SWAPPED, NEGATED = 5, 1 << 4, 1 << 3
_DROPPED = -1
# The number of pairs of a cell and a leaf that are pruned at a time.
_PAIRS_AT_ONCE = 2**19


class _Events(NamedTuple):
    """The events on the paths of one rank (tree_paths.py), in all cells.

    An event is a node with a remaining side child, or a listed leaf at the end of a path. A side child is a child that
    is not on its parent's path. Events are sorted by cell, then place; the events of one cell and path are a group.
    """

    pair: Ints  # cell << bits | place
    below: Mask  # whether the child on the path remains
    last: Ints  # index of the last (uppermost) event of the group
    tops: Ints  # indices of the last events of groups whose path remains up to its top
    sides: Ints  # the remaining side children, as pairs: first the tops of the next rank's paths, then leaves
    parents: Ints  # the order that sorts `sides` by their parents
    start: Ints  # where the children of each event with side children begin, in sides[parents]
    inner: Ints  # the indices of these events


class Pruner:
    """Prunes one tree, in the order of solids.postfix(); its leaves are counted from left to right.

    `depth` is the most values that a program holds: the values on the stack, and the leaf that is combined with the
    top. A stack of max(depth - 1, 1) is enough. `is_chain`: whether all programs are chains.

    The work is in proportion to the number of listed leaves, times at most log2(leaves), however deep the tree is. The
    state of a path follows from its few events: any other node on it remains if and only if its child on the path
    remains, or it never remains.
    """

    def __init__(self, nodes: list[Solid]) -> None:
        flat = flatten(nodes)
        order, empty = evaluation_order(flat), empty_values(flat)
        self.depth = order.depth
        self.is_chain = len(flat.children) == 1 or (len(flat.children) == 2 and len(flat.children[0]) == 1)
        self._constant = empty[0]
        # From here on a node's number is its position in the order of evaluation. All nodes below it come just before
        # it.
        count = len(order.nodes)
        number = {node: i for i, node in enumerate(order.nodes)}
        leaves = np.zeros(len(flat.negated), np.int64)
        parent = [count - 1] * count
        joins = np.zeros(count, np.int64)  # the operation of a leaf in the node's place, unless it comes first
        # Killers: nodes that decide their parent's value when dropped, being False in an AND or True in an OR.
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
        cut = cut_into_paths(parent)
        self._bits = count.bit_length()
        self._code = code  # of each node, by its number; the other arrays are by place
        self._leaf = cut.place[leaves]  # the place of each leaf
        self._places = np.arange(count)
        self._ranks = int(cut.rank.max()) + 1
        self._number, self._bottom, self._top, self._rank = cut.node, cut.bottom, cut.top, cut.rank
        self._parent = cut.place[np.array(parent)[cut.node]]
        self._joins, self._killer = joins[cut.node], killer[cut.node]
        # A dropped node has its empty value, so a node remains only if none of its killers is dropped. The number of
        # killers among the side children of each place:
        side = np.flatnonzero(self._top == self._places)
        side = side[side != count - 1]  # the root is no side child
        self._killers = np.bincount(self._parent[side], self._killer[side], count).astype(np.int64)
        # Before each place, and at the end: the number of places that are dropped unless they are events, because a
        # side child of theirs would have to remain.
        self._blocked = np.concatenate([[0], np.cumsum(self._killers > 0)])

    def programs(self, cell: Ints, leaf: Ints, cells: int) -> tuple[Ints, NDArray[np.int32]]:
        """Return (start (cells + 1,), code (K,)): the program of cell i is code[start[i] : start[i + 1]].

        `cell` and `leaf`, each (M,), are the listed pairs, sorted by cell, then leaf, each once. A leaf without bounds,
        such as a half-space, must be listed in every cell.
        """
        parts = [np.zeros(0, np.int64)]
        begin = 0
        while begin < len(cell):
            # Whole cells at a time. Intermediate results take a few hundred bytes for each pair.
            end = begin + _PAIRS_AT_ONCE
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

    def whole_program(self) -> Ints:
        """Return the codes (K,) of the program of a cell in which all leaves are listed."""
        leaves = np.arange(len(self._leaf))
        start, code = self.programs(np.zeros_like(leaves), leaves, 1)
        return mark_chains(start, code).astype(np.int64)

    @property
    def _mask(self) -> int:
        """The mask of the lowest bits of a pair, which hold the place: cell << bits | place."""
        return (1 << self._bits) - 1

    def _chain(self, cell: Ints, place: Ints) -> Ints:
        """Return the codes of the programs of all cells, for a tree whose leaves have one parent.

        `cell` and `place`, each (M,), are the listed leaves. A code here is (cell << bits | number of the node)
        << LEAF_SHIFT | operation.
        """
        start = np.flatnonzero(_are_changes(cell))
        left = np.add.reduceat(self._killer[place], start) == self._killer[self._leaf].sum()
        how = self._joins[place]
        how[start] = PUSH
        kept = np.repeat(left, np.diff(start, append=len(cell)))
        return ((cell << self._bits | self._number[place]) << LEAF_SHIFT | how)[kept]

    def _paths(self, cell: Ints, place: Ints) -> Ints:
        """Return the codes of the programs of all cells, for any tree, in the form of _chain()."""
        return np.sort(np.concatenate(self._descend(self._ascend(cell << self._bits | place))))

    def _ascend(self, pairs: Ints) -> list[_Events]:
        """Find the events of each rank, from the pairs of listed leaves up to the roots."""
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
        """Find the events of one rank from the remaining side children `sides` and the listed leaves `ends` of its
        paths."""
        place = sides & self._mask
        parent = sides - place + self._parent[place]
        parents = np.argsort(parent, kind="stable")
        parent = parent[parents]
        start = np.flatnonzero(_are_changes(parent))
        parent = parent[start]
        at = parent & self._mask
        fulfilled = np.add.reduceat(self._killer[place[parents]], start) == self._killers[at]
        pair = np.concatenate((parent, ends))
        order = np.argsort(pair, kind="stable")
        pair = pair[order]
        inner = np.empty(len(pair), np.int64)
        inner[order] = np.arange(len(pair))
        # A node remains if all killers among its side children remain, and its child on the path is no killer or
        # remains.
        alone = np.concatenate((~fulfilled | (self._killer[at - 1] == 0), np.ones(len(ends), bool)))[order]
        value = np.concatenate((fulfilled, np.ones(len(ends), bool)))[order] & alone
        at = pair & self._mask
        group = pair + (self._top - self._places)[at]
        begins = _are_changes(group)
        # The nodes between two events have no remaining side children: each is as its child on the path, or blocked.
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

    def _descend(self, levels: list[_Events]) -> list[Ints]:
        """Return the remaining codes, from the roots down to the leaves, in the form of _chain()."""
        parts: list[Ints] = []
        # For each remaining path, the operation that joins it with the values evaluated before, as for a leaf in its
        # place.
        joins = np.full(len(levels[0].tops), PUSH)
        for level, nexts in zip(levels, [*(len(level.tops) for level in levels[1:]), 0], strict=True):
            pair, at = level.pair, level.pair & self._mask
            entering = np.full(len(pair), _DROPPED)
            entering[level.tops] = joins
            # If the child of an event on the path is dropped, the rest of the path below is dropped too.
            gone = np.cumsum(~level.below)
            live = (entering[level.last] != _DROPPED) & (gone[level.last] == gone)
            sides = level.sides[level.parents]
            size = np.diff(level.start, append=len(sides))
            number = self._number[sides & self._mask]
            first = np.full(len(pair), len(self._number))
            first[level.inner] = np.minimum.reduceat(number, level.start)
            # A node with one remaining child stands for this child. Of several children, the one evaluated first is
            # pushed.
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


def _are_changes(values: Ints) -> Mask:
    """Return whether each value differs from the one before it. The first one counts as different."""
    first = np.ones(len(values), bool)
    np.not_equal(values[1:], values[:-1], out=first[1:])
    return first


def mark_chains(start: Ints, code: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the programs code[start[i] : start[i + 1]], with the operation of each chain in its first code."""
    first = start[:-1][np.diff(start) > 0]
    if not len(first):
        return code
    operation = code & 7
    operation[first] = operation[np.minimum(first + 1, len(code) - 1)]  # the operation of the second code
    size = np.diff(first, append=len(code))
    operation[first[size == 1]] = AND_LEAF
    least, most = np.minimum.reduceat(operation, first), np.maximum.reduceat(operation, first)
    chain = (least == most) & (least >= AND_LEAF) & (most <= OR_LEAF)
    code = code.copy()
    code[first[chain]] |= least[chain]  # PUSH is 0
    return code
