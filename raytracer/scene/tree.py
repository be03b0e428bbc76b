"""Equality, hash, text and the flat form of trees of solids, all without recursion, so that depth is no limit.

Sub-trees may be shared, so a short program describes a tree of astronomical size: each distinct node is visited once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from raytracer.scene.solids import Solid

# Python reads at most 200 open parentheses (3.9 to 3.13), and the text of a tree stands inside other text.
MAX_NESTING = 50
# A tree of more nodes is as readable in its flat form, which shows shared sub-trees once.
MAX_NODES = 1000


def distinct(root: Solid) -> list[Solid]:
    """Each node once, after its operands."""
    order: dict[int, Solid] = {}
    pending = [root]
    while pending:
        node = pending[-1]
        missing = [operand for operand in node.operands if id(operand) not in order]
        if missing:
            pending += reversed(missing)
        else:
            order[id(node)] = node
            pending.pop()
    return list(order.values())


def tree_hash(root: Solid) -> int:
    """The hash of a tree: the same for trees that are equal, whatever their sub-trees share."""
    hashes: dict[int, int] = {}
    for node in distinct(root):
        operands = [hashes[id(operand)] for operand in node.operands]
        hashes[id(node)] = hash((type(node), *operands)) if operands else hash(node)
    return hashes[id(root)]


def are_equal(a: Solid, b: Solid) -> bool:
    """Whether two trees have the same operators over equal leaves.

    Pairs of nodes are taken for equal until one is not, by sets of these (Hopcroft and Karp 1971, for automata): there
    are no more such pairs than distinct nodes, whatever the trees share.
    """
    parents: dict[int, int] = {}  # of nodes in their sets, by id

    def representative(node: int) -> int:
        while (parent := parents.get(node, node)) != node:
            parents[node] = node = parents.get(parent, parent)
        return node

    pending = [(a, b)]
    while pending:
        a, b = pending.pop()
        if a is b:
            continue
        if type(a) is not type(b):
            return False
        if not a.operands:
            if a != b:
                return False
            continue
        set_a, set_b = representative(id(a)), representative(id(b))
        if set_a != set_b:
            parents[set_a] = set_b
            pending += zip(a.operands, b.operands, strict=True)
    return True


def flat(root: Solid) -> list[Solid | str | int]:
    """The items of which Solid.from_postfix() makes the tree, shared sub-trees included."""
    items: list[Solid | str | int] = []
    places: dict[int, int] = {}  # of finished operators
    pending = [(root, False)]
    while pending:
        node, is_entered = pending.pop()
        if id(node) in places:
            items.append(places[id(node)])
        elif not node.operands:
            items.append(node)
        elif is_entered:
            places[id(node)] = len(items)
            items.append(node.symbol)
        else:
            pending += ((node, True), *((operand, False) for operand in reversed(node.operands)))
    return items


def text(root: Solid) -> str:
    """Python's text for a tree: with operators if it is small, else of its flat form."""
    nodes = distinct(root)
    heights: dict[int, int] = {}
    counts: dict[int, int] = {}
    for node in nodes:
        heights[id(node)] = 1 + max((heights[id(operand)] for operand in node.operands), default=0)
        counts[id(node)] = 1 + sum(counts[id(operand)] for operand in node.operands)
    if heights[id(root)] > MAX_NESTING or counts[id(root)] > MAX_NODES:
        return f"Solid.from_postfix({flat(root)!r})"
    texts: dict[int, str] = {}
    for node in nodes:
        match [texts[id(operand)] for operand in node.operands]:
            case [a, b]:
                texts[id(node)] = f"({a} {node.symbol} {b})"
            case [a]:
                texts[id(node)] = f"{node.symbol}{a}"
            case _:
                texts[id(node)] = repr(node)
    return texts[id(root)]
