"""The blocks of BLOCK x BLOCK pixels of a tile: the number of samples of each block, and the blocks that get more."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.meshes import PER_CELL, Mask, Rectangle
from raytracer.rendering.stopping_rule import APRON

# The most pixels that surrounding_area() adds at each side of a tile.
MARGIN = CELL + BLOCK + APRON


def surrounding_area(tile: Rectangle, bounds: Rectangle) -> Rectangle:
    """Return the area on which decisions about a tile depend: its blocks and APRON pixels around, in whole cells.

    The area ends at the `bounds`, which begin at a cell's corner.
    """
    (x, right), (y, top) = (
        (
            max(first, (at // BLOCK * BLOCK - APRON) // CELL * CELL),
            min(first + side, -(-(-(-(at + length) // BLOCK) * BLOCK + APRON) // CELL) * CELL),
        )
        for first, side, at, length in zip(bounds[:2], bounds[2:], tile[:2], tile[2:], strict=True)
    )
    return x, y, right - x, top - y


class Blocks(NamedTuple):
    """The blocks of an area of whole cells. Arrays are (rows, columns), the lowest row first, as in OpenGL."""

    area: Rectangle
    cells: Mask  # the cells with active blocks in which anything may be visible
    active: Mask  # the blocks that get more samples
    is_whole: bool  # whether all blocks are active
    samples: NDArray[np.int32]  # the number of samples of each block

    @staticmethod
    def make_all(area: Rectangle, cells: Mask) -> Blocks:
        """Return all blocks of an area, active and without a sample. `cells`: where anything may be visible."""
        shape = PER_CELL * cells.shape[0], PER_CELL * cells.shape[1]
        return Blocks(area, cells, np.ones(shape, bool), True, np.zeros(shape, np.int32))

    def add_samples(self, more: int) -> Blocks:
        """Return the blocks after `more` further samples of the active blocks."""
        return self._replace(samples=self.samples + np.int32(more) * self.active)

    def narrow(self, active: Mask) -> Blocks:
        """Return the blocks with fewer of them `active`."""
        # Only cells in which anything may be visible: measurements have no kept sums of others.
        return self._replace(active=active, cells=self.cells & self.cell_mask(active), is_whole=bool(active.all()))

    def block_slices(self, area: Rectangle, side: int = BLOCK) -> tuple[slice, slice]:
        """Return the slices of the arrays with the blocks of an `area` of whole cells.

        The slices include blocks beyond the picture's edge if they are in a cell at the edge. `side` is the side of the
        squares of the arrays. Default: BLOCK.
        """
        x, y = area[0] - self.area[0], area[1] - self.area[1]
        (rows, columns), per = (-(-length // CELL) for length in (area[3], area[2])), CELL // side
        return slice(y // side, y // side + per * rows), slice(x // side, x // side + per * columns)

    def surround(self, tile: Rectangle, area: Rectangle) -> Blocks:
        """Return the blocks of an `area` around a `tile`, both of whole cells.

        Once some blocks have stopped, only blocks of the tile are active, because decisions on them no longer depend on
        blocks around.
        """
        if area == self.area:
            return self
        where, active = self.block_slices(area), self.active
        if self.is_whole:
            return Blocks(area, self.cells[self.block_slices(area, CELL)], active[where], True, self.samples[where])
        own = np.zeros_like(active)
        own[self.block_slices(tile)] = active[self.block_slices(tile)]
        part = self._replace(area=area, cells=self.cells[self.block_slices(area, CELL)], samples=self.samples[where])
        return part.narrow(own[where])._replace(is_whole=False)

    def cell_mask(self, mask: Mask) -> Mask:
        """Return for each cell whether any of its blocks is True in `mask` (rows, columns)."""
        return np.asarray(mask.reshape(len(self.cells), PER_CELL, -1, PER_CELL).any(axis=(1, 3)))

    def samples_in(self, part: Rectangle) -> NDArray[np.int32]:
        """Return the number of samples of each pixel in a part of the area (H, W), the top row first."""
        samples, (x, y) = self.samples[self.part(part)], self._within_block(part)
        return samples.repeat(BLOCK, axis=1)[:, x : x + part[2]].repeat(BLOCK, axis=0)[y : y + part[3]][::-1]

    def divisors_in(self, part: Rectangle) -> NDArray[np.float32]:
        """Return the result of samples_in() for each channel (H, W, 3).

        A division by this array takes a third of the time of a division that broadcasts over channels.
        """
        samples, (x, y) = self.samples[self.part(part)], self._within_block(part)
        # Rows are repeated last, because whole rows are copied fast.
        row = samples.astype(np.float32).repeat(3 * BLOCK, axis=1)[:, 3 * x : 3 * (x + part[2])]
        return row.repeat(BLOCK, axis=0)[y : y + part[3]][::-1].reshape(part[3], part[2], 3)

    def _within_block(self, part: Rectangle) -> tuple[int, int]:
        """Return the place of the lower left pixel of a part of the area in its block."""
        return (part[0] - self.area[0]) % BLOCK, (part[1] - self.area[1]) % BLOCK

    def part(self, tile: Rectangle) -> tuple[slice, slice]:
        """Return the slices of the arrays with the blocks of a tile."""
        x, y = tile[0] - self.area[0], tile[1] - self.area[1]
        return slice(y // BLOCK, -(-(y + tile[3]) // BLOCK)), slice(x // BLOCK, -(-(x + tile[2]) // BLOCK))
