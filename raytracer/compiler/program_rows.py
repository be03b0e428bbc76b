"""Programs (csg_pruning.py) of a scene's large objects in all cells of some views: rows of candidate_lists.py."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import ProgramBatch
from raytracer.compiler.csg_pruning import LEAF_SHIFT, TRUE, chains
from raytracer.core.validation import InputError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# All pairs of a cell and a ball that rays through the cell may meet, by the balls' centers (N, 3) and radii (N,).
FindPairs: TypeAlias = Callable[[Array, Array], tuple[Ints, Ints]]

# Pairs of a primitive of a large object and a cell, in all cells of the picture or of all lights. A pair takes some
# 150 bytes and 1 microsecond: 1.2 GB, and 8 seconds.
MAX_LISTED = 2**23
# More for pictures so large that they take longer than their lists: so many for each cell, up to 4 times as many.
_LISTED_IN_CELL = 2**10


class Rows(NamedTuple):
    """Row i is the program code[start[i] : start[i + 1]], never an empty one, of the object order[i] in cell[i]."""

    cell: Ints
    order: Ints
    start: Ints
    code: NDArray[np.int32]  # with numbers of surfaces in place of leaves

    def entries(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The cell of each entry of the lists, and the entry: a row is its negative length, its object, its codes."""
        count = np.diff(self.start)
        begin = self.start[:-1] + 2 * np.arange(len(count))
        values = np.zeros(len(self.code) + 2 * len(count), np.int32)
        is_code = np.ones(len(values), bool)
        is_code[begin] = is_code[begin + 1] = False
        values[begin], values[begin + 1], values[is_code] = -count - 1, self.order, self.code
        return np.repeat(self.cell.astype(np.int32), count + 2), values


def most_listed(cells: int) -> int:
    """Give the most pairs of a primitive and a cell in the lists of a picture of so many cells."""
    return max(MAX_LISTED, min(_LISTED_IN_CELL * cells, 4 * MAX_LISTED))


def check_listed(count: float, most: int) -> None:
    """Raise InputError for more than `most` pairs of a primitive and a cell, whose lists take too much memory."""
    if count > most:
        raise InputError(
            f"expected at most {most} pairs of a primitive of a large object and a cell in which rays "
            f"may meet it, got about {count:.3g}, whose lists take about {count * 1.5e-7:.2g} GB; remedies are fewer "
            "lights, a smaller picture, objects of fewer primitives, and half-spaces only together with spheres that "
            "bound them",
            "objects",
        )


def everywhere(batch: ProgramBatch, spheres: int) -> Rows:
    """The programs where no sphere of the objects is met: rows of cell 0, none if there is nothing of them."""
    planes = np.flatnonzero(batch.surfaces[0] >= spheres)
    _, code = batch.pruner.programs(np.zeros(len(planes), np.int64), planes, 1)
    count = len(batch.order)
    instance = np.repeat(np.arange(count), 1 if len(code) else 0)
    return _rows(
        batch, np.zeros_like(instance), instance, np.arange(len(instance) + 1) * len(code), np.tile(code, count)
    )


def met(
    batch: ProgramBatch, spheres: int, centers: Array, radii: Array, view: FindPairs, listed: int, most: int
) -> tuple[Ints, Rows, int]:
    """The programs where spheres of the objects are met, and all pairs cell * objects + object of these, sorted.

    The third value is how many pairs of a primitive and a cell there are. Raises InputError for more than `most` of
    them together with the `listed` ones of other batches.
    """
    count = len(batch.order)
    is_sphere = batch.surfaces[0] < spheres
    leaves, planes = np.flatnonzero(is_sphere), np.flatnonzero(~is_sphere)
    surfaces = batch.surfaces[:, leaves].ravel()
    bits = batch.surfaces.shape[1].bit_length()
    cell, number = view(centers[surfaces], radii[surfaces])
    check_listed(listed + len(cell), most)
    instance, leaf = np.divmod(number, max(len(leaves), 1))
    key = (cell * count + instance) << bits | leaves[leaf]
    key.sort()
    pair, leaf = key >> bits, key & ((1 << bits) - 1)
    first = np.ones(len(pair), bool)
    np.not_equal(pair[1:], pair[:-1], out=first[1:])
    row = np.cumsum(first) - 1
    pair = pair[first]
    if len(planes):
        check_listed(listed + len(leaf) + len(pair) * len(planes), most)
        unbounded = np.repeat(np.arange(len(pair)), len(planes)) << bits | np.tile(planes, len(pair))
        key = np.sort(np.concatenate((row << bits | leaf, unbounded)))
        row, leaf = key >> bits, key & ((1 << bits) - 1)
    start, code = batch.pruner.programs(row, leaf, len(pair))
    cell, instance = np.divmod(pair, count)
    return pair, _rows(batch, cell, instance, start, code), len(leaf)


def filled(batch: ProgramBatch, rows: Rows, bare: Rows, pairs: Ints, cells: Ints, most: int) -> Rows:
    """The rows, and the bare ones in each of `cells` where an object has none; else as of met()."""
    count = len(batch.order)
    size = int(bare.start[1])
    check_listed(float(len(cells)) * count * size, most)
    every = (cells[:, None] * count + np.arange(count)).ravel()
    missing = every[~_among(every, pairs)]
    cell, instance = np.divmod(missing, count)
    code = bare.code.reshape(count, size)[instance].ravel()
    start = np.concatenate((rows.start, rows.start[-1] + size * np.arange(1, len(cell) + 1)))
    order = np.concatenate((rows.order, batch.order[instance]))
    return Rows(np.concatenate((rows.cell, cell)), order, start, np.concatenate((rows.code, code)))


def _among(values: Ints, sorted_values: Ints) -> Mask:
    """Whether each of the values is among others."""
    if not len(sorted_values):
        return np.zeros(len(values), bool)
    at = np.searchsorted(sorted_values, values)
    return sorted_values[np.minimum(at, len(sorted_values) - 1)] == values


def _rows(batch: ProgramBatch, cell: Ints, instance: Ints, start: Ints, code: NDArray[np.int32]) -> Rows:
    """The programs of objects that are neither empty nor all around."""
    count = np.diff(start)
    if len(code):
        whole = np.zeros(len(count), bool)
        whole[count > 0] = (code[start[:-1][count > 0]] & 7) == TRUE
        count = np.where(whole, 0, count)
        code = code[(code & 7) != TRUE]
        start = _starts(count)
    code = chains(start, code)
    surface = batch.surfaces[np.repeat(instance, count), code >> LEAF_SHIFT].astype(np.int32)
    code = (surface << LEAF_SHIFT) | (code & ((1 << LEAF_SHIFT) - 1))
    some = count > 0
    return Rows(cell[some], batch.order[instance[some]], _starts(count[some]), code)


def _starts(count: Ints) -> Ints:
    """(N + 1,): where each row of so many codes begins, and the last one ends."""
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(count)))
