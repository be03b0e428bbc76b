"""Programs of pruned trees have the values and owners of the whole tree, with a shallow stack."""

import functools
import operator
import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import raytracer as rt
from raytracer.compiler import csg_pruning
from raytracer.compiler.csg_pruning import Pruner
from raytracer.ground_truth.intersection import _inside, _owner
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.solid import Solid, postfix
from tests.scenes import random_tree

Mask = NDArray[np.bool_]

SAMPLES = 32  # random truth values of the listed leaves, before and after a surface, per cell


def execute(codes: list[int], before: Mask, after: Mask) -> tuple[Mask, Mask, NDArray[np.int64], int]:
    """Run a program on the values of the leaves [leaves, SAMPLES]; return (before, after, owner, depth)."""
    no = np.zeros(before.shape[1], bool)
    stack: list[tuple[Mask, Mask, NDArray[np.int64]]] = []
    deepest = 0
    for code in codes:
        leaf, op = code >> csg_pruning.LEAF_SHIFT, code & 7
        if op == csg_pruning.TRUE:
            assert len(codes) == 1
            return ~no, ~no, np.full(len(no), -1), 0
        if op in (csg_pruning.PUSH, csg_pruning.AND_LEAF, csg_pruning.OR_LEAF):
            negated = bool(code & csg_pruning.NEGATED)
            stack.append((before[leaf] ^ negated, after[leaf] ^ negated, np.full(len(no), leaf)))
        else:
            assert leaf == 0
        deepest = max(deepest, len(stack))
        if op != csg_pruning.PUSH:
            second, first = stack.pop(), stack.pop()
            if code & csg_pruning.SWAPPED:
                first, second = second, first
            join = np.logical_and if op in (csg_pruning.AND_LEAF, csg_pruning.AND) else np.logical_or
            owner = np.where(first[0] != first[1], first[2], second[2])
            stack.append((join(first[0], second[0]), join(first[1], second[1]), owner))
    assert len(stack) == (1 if codes else 0)
    return (*stack[0], deepest) if codes else (no, no, np.full(len(no), -1), 0)


def assert_programs_equal_tree(solid: Solid, rng: np.random.Generator, cells: int, listed: float) -> Pruner:
    """Compare the programs of random cells, which list each leaf with probability `listed`, with the whole tree."""
    nodes = postfix(solid)
    pruner = Pruner(nodes)
    count = len(leaves(solid))
    chosen = rng.random((cells, count)) < listed
    cell, leaf = np.nonzero(chosen)
    start, code = pruner.programs(cell, leaf, cells)
    assert start.shape == (cells + 1,) and start[-1] == len(code) and code.dtype == np.int32
    for i in range(cells):
        before = rng.random((count, SAMPLES)) < rng.random()
        # A few leaves change, or many at once, as at coincident surfaces.
        after = before ^ (rng.random((count, SAMPLES)) < rng.choice([0.05, 0.5]))
        before, after = before & chosen[i, :, None], after & chosen[i, :, None]
        codes = code[start[i] : start[i + 1]].tolist()
        was, is_, owner, depth = execute(codes, before, after)
        whole = _inside(nodes, list(before)), _inside(nodes, list(after))
        np.testing.assert_array_equal(was, whole[0][-1])
        np.testing.assert_array_equal(is_, whole[1][-1])
        changes = was != is_
        np.testing.assert_array_equal(owner[changes], _owner(nodes, *whole)[changes])
        assert depth == pruner.depth if listed == 1.0 else depth <= pruner.depth
        used = [c >> csg_pruning.LEAF_SHIFT for c in codes if c & 7 <= csg_pruning.OR_LEAF]
        assert len(set(used)) == len(used) and set(used) <= set(leaf[cell == i])
    return pruner


def test_programs_have_the_values_and_owners_of_whole_random_trees() -> None:
    rng = np.random.default_rng(1)
    for _ in range(150):
        assert_programs_equal_tree(random_tree(rng, int(rng.integers(1, 41))), rng, 8, rng.choice([0.1, 0.5, 1.0]))


def test_programs_do_not_depend_on_the_number_of_pairs_pruned_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csg_pruning, "_PAIRS_AT_ONCE", 5)
    rng = np.random.default_rng(4)
    for _ in range(20):
        assert_programs_equal_tree(random_tree(rng, int(rng.integers(1, 41))), rng, 8, 0.5)


def test_the_memory_for_a_deep_tree_is_proportional_to_the_listed_leaves() -> None:
    # Each listed leaf is thousands of levels below the root. Visiting these levels one by one took 3 GB.
    tree = spheres(8000)[0]
    for i, sphere in enumerate(spheres(8000)):
        tree = tree - sphere if i % 2 else tree | sphere
    pruner = Pruner(postfix(tree))
    rng = np.random.default_rng(5)
    pairs = np.unique(np.repeat(np.arange(20000), 2) * 8001 + rng.integers(0, 8001, 40000))
    tracemalloc.start()
    start, code = pruner.programs(*np.divmod(pairs, 8001), 20000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6 and len(code) == start[-1] > 10000
    assert_programs_equal_tree(tree, rng, 4, 0.001)


def spheres(count: int) -> list[Solid]:
    return [rt.Sphere((float(i), 0.0, 0.0), 1.0) for i in range(count)]


def balanced(solids: list[Solid], *operators: Callable[[Solid, Solid], Solid]) -> Solid:
    """Return a balanced tree. Each level, from the leaves up, uses the next of `operators`, cyclically."""
    while len(solids) > 1:
        joined = [operators[0](a, b) for a, b in zip(solids[::2], solids[1::2], strict=False)]
        solids = joined + solids[2 * len(joined) :]
        operators = (*operators[1:], operators[0])
    return solids[0]


def subtract_from(a: Solid, b: Solid) -> Solid:
    return b - a


@pytest.mark.parametrize(
    ("tree", "depth"),
    [
        (functools.reduce(operator.sub, spheres(1000)), 2),
        (spheres(1000)[0] - balanced(spheres(999), operator.or_), 2),
        (balanced(spheres(1000), operator.or_), 2),
        (functools.reduce(subtract_from, spheres(1000)), 2),  # right-deep, with alternating operators once flattened
        (functools.reduce(lambda a, b: ~(a | b) & b, spheres(500)), 2),
        (balanced(spheres(1024), operator.or_, operator.and_), 11),
        (balanced(spheres(1000), operator.sub, operator.or_, subtract_from), None),
    ],
    ids=["left-deep", "minus-union", "union", "right-deep", "complements", "alternating", "mixed"],
)
def test_programs_of_a_thousand_leaves_stay_within_the_stack_depth(tree: Solid, depth: int | None) -> None:
    pruner = assert_programs_equal_tree(tree, np.random.default_rng(2), 4, 0.02)
    full = assert_programs_equal_tree(tree, np.random.default_rng(3), 1, 1.0)
    assert full.depth == pruner.depth and depth in (None, pruner.depth)


def test_programs_consist_of_the_documented_codes() -> None:
    a, b, c, d = spheres(4)

    def program(solid: Solid, *listed: int) -> list[int]:
        leaf = np.array(listed, np.int64)
        return Pruner(postfix(solid)).programs(np.zeros_like(leaf), leaf, 1)[1].tolist()

    PUSH, AND_LEAF, OR_LEAF, AND, OR = range(5)
    negated, swapped = 8, 16
    assert program(a - b - c, 0, 1, 2) == [PUSH, 1 << 5 | negated | AND_LEAF, 2 << 5 | negated | AND_LEAF]
    assert program(a - b - c, 0, 2) == [PUSH, 2 << 5 | negated | AND_LEAF]
    assert program(a - b - c, 1, 2) == []  # False without a
    assert program(a | ~b, 0) == [csg_pruning.TRUE] == program(~a)
    assert program(a | ~b, 0, 1) == [PUSH, 1 << 5 | negated | OR_LEAF]
    # The operand that needs the deepest stack comes first, then the operand before it, with SWAPPED.
    assert program(a | (b & c), 0, 1, 2) == [1 << 5 | PUSH, 2 << 5 | AND_LEAF, swapped | OR_LEAF]
    assert program(a | (b & c), 0, 2) == [PUSH]
    assert program((a | b) & (c | d), 0, 1, 2, 3) == [PUSH, 1 << 5 | OR_LEAF, 2 << 5 | PUSH, 3 << 5 | OR_LEAF, AND]
    # One operand is reduced to one leaf, which needs no place of its own on the stack.
    assert program((a | b) & (c | d), 0, 1, 3) == [PUSH, 1 << 5 | OR_LEAF, 3 << 5 | AND_LEAF]
    assert program((a & b) | (c & d), 0, 1, 2, 3)[-1] == OR


def test_the_first_code_of_a_chain_says_how_its_leaves_are_combined() -> None:
    a, b, c, d = spheres(4)

    def chain(solid: Solid, *listed: int) -> list[int]:
        leaf = np.array(listed, np.int64)
        # The chain is in the second of three cells; the third lists only the last leaf.
        cell = np.append(np.ones_like(leaf), 2)
        start, code = Pruner(postfix(solid)).programs(cell, np.append(leaf, 3), 3)
        begun = csg_pruning.mark_chains(start, code)
        assert start[1] == 0 and (begun != code).sum() <= 2
        if start[3] > start[2]:
            assert begun[start[2] :].tolist() in (
                [3 << 5 | csg_pruning.AND_LEAF],
                [3 << 5 | csg_pruning.NEGATED | csg_pruning.AND_LEAF],
            )
        return (begun[: start[2]] & 7).tolist()

    PUSH, AND_LEAF, OR_LEAF = range(3)
    assert chain(a | b | c | d, 0, 1, 2, 3) == [OR_LEAF] * 4
    assert chain((a & b & c) | d, 0, 1, 2) == [AND_LEAF] * 3
    assert chain((a & b & c) | d, 0, 1, 2, 3) == [PUSH, AND_LEAF, AND_LEAF, OR_LEAF]
    assert chain((a & b) | (c & d), 0) == []
    assert chain(a - b - c - d, 1, 2) == []
    assert all(Pruner(postfix(solid)).is_chain for solid in (a - b - c, a | b | c, ~(a | b), ~a, a & ~(b | c)))
    assert not any(Pruner(postfix(solid)).is_chain for solid in ((a & b) | c, a - (b & c)))


def test_programs_of_cells_without_leaves_are_constant() -> None:
    a, b = spheres(2)
    none = np.zeros(0, np.int64)
    for solid, expected in (
        (a | b, []),
        (a - ~b, []),
        (~a, [csg_pruning.TRUE] * 3),
        (~(a & b), [csg_pruning.TRUE] * 3),
    ):
        start, code = Pruner(postfix(solid)).programs(none, none, 3)
        assert code.tolist() == expected and start.tolist() == [len(expected) // 3 * i for i in range(4)]
    start, code = Pruner(postfix(~a)).programs(np.array([1]), np.array([0]), 3)
    assert start.tolist() == [0, 1, 2, 3] and code.tolist() == [
        csg_pruning.TRUE,
        csg_pruning.NEGATED | csg_pruning.PUSH,
        csg_pruning.TRUE,
    ]
