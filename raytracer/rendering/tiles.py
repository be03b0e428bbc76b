"""Tiles: the parts of a picture that are drawn one after another into the same targets."""

from __future__ import annotations

from collections.abc import Iterator

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.meshes import Rectangle

# The side of a tile in pixels. A tile's targets take up to 65 bytes per pixel, 273 MB at this size.
TILE = 2048
# The number of pixels of a tile that gets one sample: rows of cells that fit into the processor's cache.
_STRIP = 2**19


def tile_size(size: tuple[int, int], side: int, *, is_drawn_once: bool) -> tuple[int, int]:
    """Return width and height of the largest tile of a picture of `size`, at most `side` pixels each.

    They are whole cells, at least one, or end at the picture's edge. A tile that is drawn once is a strip, because the
    first use of a large target's memory takes longer than the drawing.
    """
    side = max(1, side // CELL) * CELL
    width = min(size[0], side)
    rows = max(CELL, _STRIP // width // CELL * CELL) if is_drawn_once else side
    return width, min(size[1], side, rows)


def split(part: Rectangle, tile: tuple[int, int]) -> Iterator[Rectangle]:
    """Yield the tiles of a part of a picture, from the top down. `tile` is the size of the largest tile."""
    left, low, width, height = part
    # Tiles start at the lowest row, because cells and blocks do.
    for y in reversed(range(0, height, tile[1])):
        for x in range(0, width, tile[0]):
            yield left + x, low + y, min(tile[0], width - x), min(tile[1], height - y)


def place(tile: Rectangle, part: Rectangle) -> tuple[slice, slice]:
    """Return the rows and columns of a tile in arrays of a part of a picture, the top row first."""
    x, y, columns, rows = tile
    left, top = x - part[0], part[1] + part[3] - y - rows
    return slice(top, top + rows), slice(left, left + columns)
