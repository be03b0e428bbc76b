"""Equality, hash, text and postfix form of CSG trees.

The functions do not recurse, so that trees may have any depth. They visit each distinct node once: subtrees may be
shared, so that a few nodes can stand for a tree of astronomical size.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from raytracer.scene.solids.affine import Map
    from raytracer.scene.solids.solid import Solid

# The largest depth of a tree that is written with operators. Python's parser accepts at most 200 open parentheses (3.9
# to 3.13), and a tree's text may stand inside other text.
MAX_NESTING = 50
# The most nodes of a tree that is written with operators. A larger tree is as readable in postfix form, in which shared
# subtrees occur once.
MAX_NODES = 1000


def list_distinct(root: Solid) -> list[Solid]:
    """Return each distinct node once, after its operands."""
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
    """Return the hash of a tree. Equal trees have equal hashes, whether their subtrees are shared or not."""
    hashes: dict[int, int] = {}
    for node in list_distinct(root):
        operands = [hashes[id(operand)] for operand in node.operands]
        hashes[id(node)] = hash((type(node), getattr(node, "matrix", None), *operands)) if operands else hash(node)
    return hashes[id(root)]


def are_equal(a: Solid, b: Solid) -> bool:
    """Whether two trees have the same operators over equal leaves.

    Nodes that must be equal are merged into sets with union-find until a pair differs (Hopcroft and Karp 1971, for
    automata). So the number of comparisons is at most the number of distinct nodes, even if subtrees are shared.
    """
    parents: dict[int, int] = {}  # the union-find forest: id of a node -> id of its parent

    def representative(node: int) -> int:
        while (parent := parents.get(node, node)) != node:
            parents[node] = node = parents.get(parent, parent)
        return node

    pending = [(a, b)]
    while pending:
        a, b = pending.pop()
        if a is b:
            continue
        if type(a) is not type(b) or (a.operands and getattr(a, "matrix", None) != getattr(b, "matrix", None)):
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


def flatten(root: Solid) -> list[Solid | str | int | Map]:
    """Return the list from which Solid.from_postfix() makes the tree. Shared subtrees occur once."""
    items: list[Solid | str | int | Map] = []
    indices: dict[int, int] = {}  # id of a finished operator -> its index in items
    pending = [(root, False)]
    while pending:
        node, is_entered = pending.pop()
        if id(node) in indices:
            items.append(indices[id(node)])
        elif not node.operands:
            items.append(node)
        elif is_entered:
            indices[id(node)] = len(items)
            items.append(getattr(node, "matrix", node.symbol))
        else:
            pending += ((node, True), *((operand, False) for operand in reversed(node.operands)))
    return items


def tree_text(root: Solid) -> str:
    """Return a tree's text as Python code: with operators if the tree is small, else in postfix form."""
    nodes = list_distinct(root)
    heights: dict[int, int] = {}
    counts: dict[int, int] = {}
    for node in nodes:
        heights[id(node)] = 1 + max((heights[id(operand)] for operand in node.operands), default=0)
        counts[id(node)] = 1 + sum(counts[id(operand)] for operand in node.operands)
    if heights[id(root)] > MAX_NESTING or counts[id(root)] > MAX_NODES:
        return f"Solid.from_postfix({flatten(root)!r})"
    texts: dict[int, str] = {}
    for node in nodes:
        matrix = getattr(node, "matrix", None)
        match [texts[id(operand)] for operand in node.operands]:
            case [a, b]:
                texts[id(node)] = f"({a} {node.symbol} {b})"
            case [a] if matrix is None:
                texts[id(node)] = f"{node.symbol}{a}"
            case [a]:
                operand = f"({a})" if a.startswith("~") else a
                texts[id(node)] = f"{operand}.transform({matrix!r})"
            case _:
                texts[id(node)] = repr(node)
    return texts[id(root)]
