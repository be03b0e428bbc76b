"""The blocks of BLOCK x BLOCK pixels of a tile: how many samples each has got, and which get more."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.meshes import PER_CELL, Mask, Rectangle
from raytracer.rendering.stopping_rule import APRON

# The most pixels beyond each of a tile's sides that surrounded() adds to it.
MARGIN = CELL + BLOCK + APRON


def surrounded(tile: Rectangle, size: tuple[int, int]) -> Rectangle:
    """The area that decides on a tile's pixels: the tile's blocks and APRON pixels around, in whole cells."""
    (x, right), (y, top) = (
        (
            max(0, (at // BLOCK * BLOCK - APRON) // CELL * CELL),
            min(side, -(-(-(-(at + length) // BLOCK) * BLOCK + APRON) // CELL) * CELL),
        )
        for side, at, length in zip(size, tile[:2], tile[2:], strict=True)
    )
    return x, y, right - x, top - y


class Blocks(NamedTuple):
    """The blocks of an area, whole cells. Arrays are (rows, columns), the lowest row first, as OpenGL has it."""

    area: Rectangle
    cells: Mask  # the cells with active blocks in which anything may be seen
    active: Mask  # the blocks that get more samples
    is_whole: bool  # whether these are all
    samples: NDArray[np.int32]  # how many each has got

    @staticmethod
    def all_of(area: Rectangle, cells: Mask) -> Blocks:
        """All blocks of an area in whose `cells` anything may be seen, without a sample."""
        shape = PER_CELL * cells.shape[0], PER_CELL * cells.shape[1]
        return Blocks(area, cells, np.ones(shape, bool), True, np.zeros(shape, np.int32))

    def sampled(self, more: int) -> Blocks:
        """The same after so many `more` samples of the active blocks."""
        return self._replace(samples=self.samples + np.int32(more) * self.active)

    def narrowed(self, active: Mask) -> Blocks:
        """The same with fewer blocks `active`."""
        # Measurements know nothing of a cell in which nothing is seen, such as its sums before.
        return self._replace(active=active, cells=self.cells & self.by_cell(active), is_whole=bool(active.all()))

    def where(self, area: Rectangle, side: int = BLOCK) -> tuple[slice, slice]:
        """Where the blocks of an `area` of whole cells are in the arrays, or where squares of another `side` are.

        Blocks of cells at the picture's edge count, though they be beyond it.
        """
        x, y = area[0] - self.area[0], area[1] - self.area[1]
        (rows, columns), per = (-(-length // CELL) for length in (area[3], area[2])), CELL // side
        return slice(y // side, y // side + per * rows), slice(x // side, x // side + per * columns)

    def around(self, tile: Rectangle, area: Rectangle) -> Blocks:
        """The blocks of an `area` around a `tile`, both of whole cells.

        Once some blocks have stopped, only blocks of the tile are active: others no longer decide on them.
        """
        if area == self.area:
            return self
        where, active = self.where(area), self.active
        if self.is_whole:
            return Blocks(area, self.cells[self.where(area, CELL)], active[where], True, self.samples[where])
        own = np.zeros_like(active)
        own[self.where(tile)] = active[self.where(tile)]
        part = self._replace(area=area, cells=self.cells[self.where(area, CELL)], samples=self.samples[where])
        return part.narrowed(own[where])._replace(is_whole=False)

    def by_cell(self, mask: Mask) -> Mask:
        """(rows, columns) of cells: True for cells with a block that is True in `mask`."""
        return np.asarray(mask.reshape(len(self.cells), PER_CELL, -1, PER_CELL).any(axis=(1, 3)))

    def samples_in(self, part: Rectangle) -> NDArray[np.int32]:
        """(H, W), top row first: how many samples each pixel got in a part of the area."""
        samples, (x, y) = self.samples[self.part(part)], self._within_block(part)
        return samples.repeat(BLOCK, axis=1)[:, x : x + part[2]].repeat(BLOCK, axis=0)[y : y + part[3]][::-1]

    def divisors_in(self, part: Rectangle) -> NDArray[np.float32]:
        """(H, W, 3): the same for each channel. By broadcasting, a division takes three times as long."""
        samples, (x, y) = self.samples[self.part(part)], self._within_block(part)
        # Rows last: they are copied whole.
        each = samples.astype(np.float32).repeat(3 * BLOCK, axis=1)[:, 3 * x : 3 * (x + part[2])]
        return each.repeat(BLOCK, axis=0)[y : y + part[3]][::-1].reshape(part[3], part[2], 3)

    def _within_block(self, part: Rectangle) -> tuple[int, int]:
        """Where in a block the lower left pixel of a part of the area is."""
        return (part[0] - self.area[0]) % BLOCK, (part[1] - self.area[1]) % BLOCK

    def part(self, tile: Rectangle) -> tuple[slice, slice]:
        """Where the blocks of a tile are in the arrays."""
        x, y = tile[0] - self.area[0], tile[1] - self.area[1]
        return slice(y // BLOCK, -(-(y + tile[3]) // BLOCK)), slice(x // BLOCK, -(-(x + tile[2]) // BLOCK))
