"""The programs (csg_pruning.py) of large objects, in all cells of a picture or around a light, as rows of lists."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import ProgramBatch
from raytracer.compiler.csg_pruning import GRID, LEAF_SHIFT, NEGATED, OR_LEAF, TRUE, mark_chains
from raytracer.core.validation import InputError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

# Finds all pairs of a cell and a ball that rays through the cell may meet, from the balls' centers (N, 3) and radii
# (N,).
FindPairs: TypeAlias = Callable[[Array, Array], tuple[Ints, Ints]]

# The most pairs of a primitive of a large object and a cell, over all cells of the picture, or of all lights. A pair
# takes some 150 bytes and 1 microsecond: in all 1.2 GB and 8 seconds.
MAX_LISTED = 2**23
# The limit for each cell of a large picture, which takes longer to draw than its lists; in all up to 4 MAX_LISTED.
_LISTED_IN_CELL = 2**10


class Rows(NamedTuple):
    """Rows of lists. Row i is the program code[start[i] : start[i + 1]] of the object order[i] in the cell cell[i].

    No program is empty.
    """

    cell: Ints
    order: Ints
    start: Ints
    code: NDArray[np.int32]  # with surface indices instead of leaf numbers

    def entries(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the cell of each entry, and the entries. A row has -(1 + number of codes), the object, the codes."""
        count = np.diff(self.start)
        begin = self.start[:-1] + 2 * np.arange(len(count))
        values = np.zeros(len(self.code) + 2 * len(count), np.int32)
        is_code = np.ones(len(values), bool)
        is_code[begin] = is_code[begin + 1] = False
        values[begin], values[begin + 1], values[is_code] = -count - 1, self.order, self.code
        return np.repeat(self.cell.astype(np.int32), count + 2), values


def most_listed(cells: int) -> int:
    """Return the most pairs of a primitive and a cell in the lists of a picture with `cells` cells."""
    return max(MAX_LISTED, min(_LISTED_IN_CELL * cells, 4 * MAX_LISTED))


def check_listed(count: float, most: int) -> None:
    """Raise InputError for more than `most` pairs of a primitive and a cell: their lists would take too much memory."""
    if count > most:
        raise InputError(
            f"expected at most {most} pairs of a primitive of a large object and a cell in which rays "
            f"may meet it, got about {count:.3g}, whose lists take about {count * 1.5e-7:.2g} GB; remedies are fewer "
            "lights, a smaller picture, objects of fewer primitives, and half-spaces only together with solids that "
            "bound them",
            "objects",
        )


def rows_without_spheres(batch: ProgramBatch, bounded: int) -> Rows:
    """Return the programs of the objects for rays that meet none of their bounded leaves, as rows of cell 0.

    There are no rows if such rays miss the objects.
    """
    planes = np.flatnonzero(batch.surfaces[0] >= bounded)
    _, code = batch.pruner.programs(np.zeros(len(planes), np.int64), planes, 1)
    count = len(batch.order)
    instance = np.repeat(np.arange(count), 1 if len(code) else 0)
    return _make_rows(
        batch, np.zeros_like(instance), instance, np.arange(len(instance) + 1) * len(code), np.tile(code, count)
    )


def rows_of_cells(
    batch: ProgramBatch, bounded: int, centers: Array, radii: Array, find_pairs: FindPairs, listed: int, most: int
) -> tuple[Ints, Rows, int]:
    """Return the programs of the objects in cells whose rays may meet their bounded leaves.

    The values are the sorted pairs cell * objects + object of these programs, the rows, and the number of pairs of a
    primitive and a cell. Raises InputError if this number and the `listed` pairs of other batches exceed `most`.
    """
    count = len(batch.order)
    is_bounded = batch.surfaces[0] < bounded
    leaves, planes = np.flatnonzero(is_bounded), np.flatnonzero(~is_bounded)
    surfaces = batch.surfaces[:, leaves].ravel()
    bits = batch.surfaces.shape[1].bit_length()
    cell, number = find_pairs(centers[surfaces], radii[surfaces])
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
    return pair, _make_rows(batch, cell, instance, start, code), len(leaf)


def rows_of_grids(batch: ProgramBatch, first: int, centers: Array, radii: Array, find_pairs: FindPairs) -> Rows:
    """Return the entries of objects with grids, in cells whose rays may meet them, as rows of one code each.

    `first` is the number of the first object's grid. The others follow.
    """
    cell, instance = find_pairs(*_bounding_balls(batch, centers, radii))
    code = ((first + instance) << LEAF_SHIFT | GRID).astype(np.int32)
    return Rows(cell, batch.order[instance], np.arange(len(cell) + 1), code)


def _bounding_balls(batch: ProgramBatch, centers: Array, radii: Array) -> tuple[Array, Array]:
    """Return balls (n, 3), (n,) around the objects of a long chain: the smallest ball that bounds a conjunction, or a
    ball around all leaves of a union."""
    codes = batch.pruner.whole_program()
    if (codes[-1] & 7) == OR_LEAF:
        middle = centers[batch.surfaces].mean(axis=1)
        away = np.linalg.norm(centers[batch.surfaces] - middle[:, None], axis=2)
        return middle, (away + radii[batch.surfaces]).max(axis=1)
    leaves = codes[(codes & NEGATED) == 0] >> LEAF_SHIFT
    surfaces = batch.surfaces[:, leaves[batch.surfaces[0, leaves] < len(radii)]]
    smallest = surfaces[np.arange(len(surfaces)), np.argmin(radii[surfaces], axis=1)]
    return centers[smallest], radii[smallest]


def fill_rows(batch: ProgramBatch, rows: Rows, bare: Rows, pairs: Ints, cells: Ints, most: int) -> Rows:
    """Return `rows` with the `bare` programs added in each of `cells` in which an object has none.

    `pairs` are the sorted pairs of rows_of_cells(), `bare` the rows of rows_without_spheres(). Raises InputError above
    `most` pairs.
    """
    count = len(batch.order)
    size = int(bare.start[1])
    check_listed(float(len(cells)) * count * size, most)
    every = (cells[:, None] * count + np.arange(count)).ravel()
    missing = every[~_are_in(every, pairs)]
    cell, instance = np.divmod(missing, count)
    code = bare.code.reshape(count, size)[instance].ravel()
    start = np.concatenate((rows.start, rows.start[-1] + size * np.arange(1, len(cell) + 1)))
    order = np.concatenate((rows.order, batch.order[instance]))
    return Rows(np.concatenate((rows.cell, cell)), order, start, np.concatenate((rows.code, code)))


def _are_in(values: Ints, sorted_values: Ints) -> Mask:
    """Return whether each of the values is among `sorted_values`."""
    if not len(sorted_values):
        return np.zeros(len(values), bool)
    at = np.searchsorted(sorted_values, values)
    return sorted_values[np.minimum(at, len(sorted_values) - 1)] == values


def _make_rows(batch: ProgramBatch, cell: Ints, instance: Ints, start: Ints, code: NDArray[np.int32]) -> Rows:
    """Make rows of the programs that are neither empty nor the constant True."""
    count = np.diff(start)
    if len(code):
        whole = np.zeros(len(count), bool)
        whole[count > 0] = (code[start[:-1][count > 0]] & 7) == TRUE
        count = np.where(whole, 0, count)
        code = code[(code & 7) != TRUE]
        start = _starts(count)
    code = mark_chains(start, code)
    surface = batch.surfaces[np.repeat(instance, count), code >> LEAF_SHIFT].astype(np.int32)
    code = (surface << LEAF_SHIFT) | (code & ((1 << LEAF_SHIFT) - 1))
    some = count > 0
    return Rows(cell[some], batch.order[instance[some]], _starts(count[some]), code)


def _starts(count: Ints) -> Ints:
    """Return (N + 1,): where each row of so many codes begins, and where the last row ends."""
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(count)))
