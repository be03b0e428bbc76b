"""Heavy paths of a tree, with which a deep tree takes no more work than a shallow one (Sleator and Tarjan 1983)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


class Paths(NamedTuple):
    """A tree cut into paths. A path goes from a node to its child with the most leaves, and so on down to a leaf.

    Above any node there are at most log2(leaves) other paths, however deep the tree is. A node's place is its position
    in an order in which each path is one run, from its leaf upwards.
    """

    place: Ints  # (nodes,): the place of each node
    node: Ints  # (nodes,): the node at each place
    bottom: Ints  # (nodes,): for each place, the place of the leaf at the end of its path
    top: Ints  # (nodes,): for each place, the place of the uppermost node of its path
    rank: Ints  # (nodes,): for each place, the number of other paths above its path


def cut_into_paths(parent: list[int]) -> Paths:
    """Cut a tree into paths.

    `parent` has each node's parent. Parents come after their children. The root comes last, and is its own parent.
    """
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
    size = [0] * count  # for the top of a path: the path's number of nodes
    for node in reversed(range(count)):
        above = parent[node]
        if above == node:
            top[node] = node
        elif heavy[above] == node:
            rank[node], top[node] = rank[above], top[above]
        else:
            rank[node], top[node] = rank[above] + 1, node
        size[top[node]] += 1
    # On a path, children have smaller numbers than their parents, so a path is in the order of the numbers.
    order = np.argsort(np.array(top), kind="stable")
    place = np.empty(count, np.int64)
    place[order] = np.arange(count)
    tops = np.array(top)[order]
    end = place[tops]
    return Paths(place, order, end - np.array(size)[tops] + 1, end, np.array(rank)[order])
