"""The meshes of a tile: the cells, blocks and rectangles of a picture that each program draws."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL, Part, cells_in

Rectangle = Part  # x, y, width, height; (x, y) is the lower left pixel
Mask = NDArray[np.bool_]
Ints = NDArray[np.int32]

# The names of a scene's programs. SEE finds the surface of each pixel, SHAPES draws small objects over it one by one,
# and SHADE computes the light. PICTURE is SEE and SHADE in one. PLANE_ONLY draws the cells with half-spaces only, and
# EMPTY draws the cells with the background only. SEVERAL is PLANE_ONLY for several samples at once.
SEE, SHAPES, SHADE, PICTURE = "see", "shapes", "shade", "picture"
PLANE_ONLY, SEVERAL, EMPTY = "plane_only", "several", "empty"

# The number of blocks along each side of a cell.
PER_CELL = CELL // BLOCK
# The fixed cost of a rectangle, in pixels.
_RECTANGLE_COST = 64


class Cells(msgspec.Struct, frozen=True, eq=False):
    """A mesh for cells.vert: squares of the picture, each `side` pixels wide.

    Each of `rows` (N, 4 or 6) is a block of squares: its first column and row, its numbers of columns and rows, and
    with 6 numbers the begin and end of the cell's candidate list. If `as_points`, each block is one square, to be drawn
    as a point.
    """

    rows: Ints
    side: int
    as_points: bool = False


class Rectangles(msgspec.Struct, frozen=True, eq=False):
    """A mesh for shapes.vert: the scene's rectangles with these `numbers`.

    `costs` (N,) are in pixels. `largest` is the longest side of a rectangle, in pixels.
    """

    numbers: Ints
    costs: NDArray[np.int64]
    largest: int


class Coverage(msgspec.Struct, frozen=True, eq=False):
    """The cells and rectangles of a part of a picture that each program draws."""

    part: Rectangle  # whole cells, or up to the picture's edge
    cells: Mapping[str, Mask]  # (rows, columns) of the part's cells for each program, the lowest row first
    lists: Ints | None  # (cells, 2): where each cell's list begins and ends, in a scene with lists
    rectangles: Ints | None  # (N, 4 or more), for SHAPES: first column and row of pixels, and one past the last

    def seen_cells(self, area: Rectangle) -> Mask:
        """Return the cells (rows, columns) of an area in which any surface may be visible."""
        part = self.cell_slices(area)
        if EMPTY in self.cells:
            return ~self.cells[EMPTY][part]
        return np.ones(next(iter(self.cells.values()))[part].shape, bool)

    def cell_slices(self, area: Rectangle) -> tuple[slice, slice]:
        """Return the rows and columns of the cells of an area in the masks."""
        (x, y, columns, rows), (left, low, *_) = cells_in(area), cells_in(self.part)
        return slice(y - low, y - low + rows), slice(x - left, x - left + columns)

    def one_cell(self) -> Coverage:
        """Return the coverage of a picture of one cell, drawn by all programs that draw any cell of this picture."""
        cells = {name: np.ones((1, 1), bool) for name, cells in self.cells.items() if cells.any()}
        # A cell with a candidate list, if there are lists.
        busy = self.cells[SHADE].argmax() if SHADE in self.cells else 0
        lists = None if self.lists is None else self.lists[busy : busy + 1]
        rectangles = None if self.rectangles is None else self.rectangles[:1]
        return Coverage((0, 0, CELL, CELL), cells, lists, rectangles)


class Meshes(NamedTuple):
    """The meshes of one tile, by program. If `is_whole`, they cover all pixels of the tile."""

    cells: Mapping[str, Cells]
    rectangles: Rectangles | None
    is_whole: bool


def tile_meshes(coverage: Coverage, tile: Rectangle, mask: Mask | None, list_readers: Collection[str]) -> Meshes:
    """Return the meshes of a tile, or of its blocks that are True in `mask`.

    `mask` is (rows, columns) of blocks, the lowest row first, for whole cells. The tile must begin at a cell's corner.
    `list_readers` names the programs that read the candidate lists of cells.
    """
    meshes = {}
    where = coverage.cell_slices(tile)
    for name, cells in coverage.cells.items():
        lists = None
        if coverage.lists is not None and name in list_readers:
            lists = coverage.lists.reshape(*cells.shape, 2)[where]
        mesh = _cell_mesh(cells[where], tile, mask, lists)
        if len(mesh.rows):
            meshes[name] = mesh
    rectangles = None
    if coverage.rectangles is not None:
        rectangles = _rectangle_mesh(coverage.rectangles, tile, mask)
    return Meshes(meshes, rectangles, mask is None)


def _cell_mesh(cells: Mask, tile: Rectangle, mask: Mask | None, lists: Ints | None) -> Cells:
    """Return the mesh of a tile's `cells` (rows, columns), with their `lists` (rows, columns, 2) if there are any."""
    per = 1
    if mask is not None:
        per = PER_CELL
        cells = cells.repeat(per, axis=0).repeat(per, axis=1) & mask
    as_points = mask is not None or lists is not None
    rows = squares(cells) if as_points else cell_blocks(cells)
    if lists is not None:
        column, row = rows[:, :2].T // per
        rows = np.column_stack([rows, lists[row, column]]).astype(np.int32)
    rows[:, :2] += np.array([tile[0] // CELL * per, tile[1] // CELL * per], np.int32)
    return Cells(rows, CELL // per, as_points)


def _rectangle_mesh(rectangles: Ints, tile: Rectangle, mask: Mask | None) -> Rectangles:
    if mask is not None:
        numbers = np.flatnonzero(touches_squares(rectangles, mask, tile[:2], BLOCK))
    else:
        numbers = np.flatnonzero(touches_area(rectangles, tile))
    sides = rectangles[numbers, 2:4] - rectangles[numbers, :2]
    costs = sides[:, 0].astype(np.int64) * sides[:, 1] + _RECTANGLE_COST
    return Rectangles(numbers.astype(np.int32), costs, int(sides.max(initial=0)))


def cell_blocks(cells: Mask) -> Ints:
    """Return blocks of cells (N, 4) that cover each cell that is True once: column, row, columns and rows.

    A block is a run of cells along a row, together with equal runs in the rows above: fewer blocks are drawn faster.
    Besides, llvmpipe shades the pixels along a rectangle's diagonal twice, once for each triangle; that is a quarter of
    the pixels of a single row of cells.
    """
    edges = np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    order = np.lexsort((row, end, first))
    row, first, end = row[order], first[order], end[order]
    begins = np.ones(len(row), bool)
    begins[1:] = (np.diff(first) != 0) | (np.diff(end) != 0) | (np.diff(row) != 1)
    lowest = np.flatnonzero(begins)
    height = np.diff(np.append(lowest, len(row)))
    return np.column_stack([first[lowest], row[lowest], (end - first)[lowest], height]).astype(np.int32)


def squares(cells: Mask) -> Ints:
    """Return each cell that is True as a block (N, 4) of one square: its column, its row, 1, 1."""
    row, column = np.nonzero(cells)
    return np.column_stack([column, row, np.ones_like(row), np.ones_like(row)]).astype(np.int32)


def touches_squares(rectangles: Ints, squares: Mask, corner: tuple[int, int], side: int) -> Mask:
    """Return which rectangles (N,) touch a square that is True.

    Squares have `side` pixels along each side. The first one begins at the pixel `corner`.
    """
    sums = np.pad(squares.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    most = squares.shape[1], squares.shape[0]
    low = np.clip((rectangles[:, :2] - corner) // side, 0, most)
    high = np.clip((rectangles[:, 2:4] - corner - 1) // side + 1, 0, most)
    (x0, y0), (x1, y1) = low.T, np.maximum(high, low).T
    return sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0] > 0


def touches_area(rectangles: Ints, area: Rectangle) -> Mask:
    """Return which rectangles (N,) share a pixel with an area."""
    x, y, width, height = area
    x0, y0, x1, y1 = rectangles[:, :4].T
    return (x0 < x + width) & (x < x1) & (y0 < y + height) & (y < y1)


def cells_under(rectangles: Ints, part: Rectangle, side: int) -> Mask:
    """Return the squares of a picture, of `side` pixels along each side, that rectangles touch (rows, columns).

    `rectangles` are (N, 4 or more): first column and row of pixels, and one past the last. `part`: the squares that
    count, in squares.
    """
    corner, most = part[:2], (part[2] - 1, part[3] - 1)
    first = np.maximum(rectangles[:, :2] // side - corner, 0)
    last = np.minimum((rectangles[:, 2:4] - 1) // side - corner, most)
    inside = (first <= last).all(axis=1)
    first, last = first[inside], last[inside]
    count = np.zeros((part[3] + 1, part[2] + 1), np.int64)
    for rows, columns, sign in (
        (first[:, 1], first[:, 0], 1),
        (first[:, 1], last[:, 0] + 1, -1),
        (last[:, 1] + 1, first[:, 0], -1),
        (last[:, 1] + 1, last[:, 0] + 1, 1),
    ):
        np.add.at(count, (rows, columns), sign)
    return count.cumsum(0).cumsum(1)[:-1, :-1] > 0
