"""A tree cut into paths, so that a deep one is no more work than a shallow one (Sleator and Tarjan 1983)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


class Paths(NamedTuple):
    """A tree cut into paths: from a node to the child with the most leaves, to that one's, and so on down to a leaf.

    Above any node there are at most log2(leaves) other paths, however deep the tree is. A node's place is its own in
    an order in which each path is one run from its leaf up.
    """

    place: Ints  # of each node
    node: Ints  # at each place
    bottom: Ints  # (nodes,): the place of the leaf at the end of the path of each place
    top: Ints  # likewise of its uppermost node
    rank: Ints  # (nodes,): of each place, how many other paths its path hangs from


def paths(parent: list[int]) -> Paths:
    """The paths of a tree by each node's parent; the root, which is its own, comes last, and parents after children."""
    count = len(parent)
    leaves = [0] * count
    heavy = [-1] * count
    for node in range(count):
        leaves[node] = leaves[node] or 1
        above = parent[node]
        if above != node:
            leaves[above] += leaves[node]
            if heavy[above] < 0 or leaves[node] > leaves[heavy[above]]:
                heavy[above] = node
    rank, top = [0] * count, [0] * count
    size = [0] * count  # of the path that a node is the top of
    for node in reversed(range(count)):
        above = parent[node]
        if above == node:
            top[node] = node
        elif heavy[above] == node:
            rank[node], top[node] = rank[above], top[above]
        else:
            rank[node], top[node] = rank[above] + 1, node
        size[top[node]] += 1
    # On a path children have smaller numbers than their parents, so it keeps the order of the numbers.
    order = np.argsort(np.array(top), kind="stable")
    place = np.empty(count, np.int64)
    place[order] = np.arange(count)
    tops = np.array(top)[order]
    end = place[tops]
    return Paths(place, order, end - np.array(size)[tops] + 1, end, np.array(rank)[order])
