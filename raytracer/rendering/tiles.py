"""Tiles: the parts of a picture that are drawn one after the other into the same targets."""

from __future__ import annotations

from collections.abc import Iterator

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.meshes import Rectangle

# Side of a tile in pixels. A tile's targets take up to 65 bytes a pixel, 273 MB at this size.
TILE = 2048
# Pixels of a tile that is drawn once: rows of cells in the processor's cache.
_STRIP = 2**19


def tile_size(size: tuple[int, int], side: int, *, is_drawn_once: bool) -> tuple[int, int]:
    """Width and height of the largest tile of a picture of `size`, at most `side` pixels a side: whole cells, at least
    one, or up to the picture's edge.

    To draw into a tile once takes less time than to use the memory of a large target for the first time: such a tile is
    a strip.
    """
    side = max(1, side // CELL) * CELL
    width = min(size[0], side)
    rows = max(CELL, _STRIP // width // CELL * CELL) if is_drawn_once else side
    return width, min(size[1], side, rows)


def split(size: tuple[int, int], tile: tuple[int, int]) -> Iterator[Rectangle]:
    """The tiles of a picture, from the top row down; `tile` is the size of the largest."""
    width, height = size
    # Counted from the lowest row, as the cells and blocks are that they consist of.
    for y in reversed(range(0, height, tile[1])):
        for x in range(0, width, tile[0]):
            yield x, y, min(tile[0], width - x), min(tile[1], height - y)


def place(tile: Rectangle, height: int) -> tuple[slice, slice]:
    """The rows and columns of a tile in arrays with the top row first, of a picture of `height` rows."""
    x, y, columns, rows = tile
    return slice(height - y - rows, height - y), slice(x, x + columns)
