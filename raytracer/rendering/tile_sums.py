"""The sums of the samples of one tile: on the GPU, and of more samples than are summed there on the host."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.draws import Sample
from raytracer.compiler.meshes import Rectangle
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.pixel_blocks import Blocks
from raytracer.rendering.tile_renderer import TileRenderer

Counts = NDArray[np.int32] | int  # numbers of samples: (rows, columns) of the area's blocks, or one for all


class TileSums:
    """The sums of the samples of a tile and of an `area` around it: tile `number` of those that `renderer` draws."""

    def __init__(self, renderer: TileRenderer, number: int, tile: Rectangle, area: Rectangle) -> None:
        self.tile, self.area = tile, area
        self._renderer, self._number = renderer, number
        self._total: Any = None  # (H, W, 3): the sums of the area's samples that were read
        self._variance: NDArray[np.float32] | None = None  # (H, W), the lowest row first: of the first of them

    def take_turn(self) -> None:
        """Have the renderer draw and measure this tile from now on."""
        self._renderer.turn_to(self._number, self.area[2:])

    def draw(self, blocks: Blocks, samples: Sequence[Sample]) -> None:
        """Draw 1 or TOGETHER more samples of the area's active blocks. Errors are those of TileRenderer.draw()."""
        self._renderer.draw(self.area, samples, None if blocks.is_whole else blocks.active)

    def read_before_new(self, counts: Counts, measurements: BlockMeasurements | None) -> None:
        """Read the sums before new ones begin, and the first time the variance, if there are `measurements` for it."""
        total = self._so_far()
        if measurements and self._variance is None:
            self._variance = self._variance_so_far(counts, measurements)
        self._total = total
        self._renderer.write_sums_before(total)

    def read_mean(self, divisors: NDArray[np.float32] | int, out: NDArray[np.float32]) -> None:
        """Read the mean of the tile's samples into `out` (H, W, 3), the top row first.

        `divisors` are how many samples there are: (H, W, 3), or a number for all.
        """
        is_direct = self._total is None and self.area == self.tile and out.flags.c_contiguous
        sums = self._so_far(out if is_direct else None)
        if not (is_direct and isinstance(divisors, int) and divisors == 1):
            np.divide(sums[self._within()], divisors, out=out, casting="same_kind")

    def variance(self, counts: Counts, measurements: BlockMeasurements) -> NDArray[np.float32]:
        """(H, W), the top row first: the variance of each pixel's first samples, at most SUMMED of them."""
        variance = self._variance if self._variance is not None else self._variance_so_far(counts, measurements)
        return variance[::-1][self._within()]

    def _within(self) -> tuple[slice, slice]:
        """Where the tile is in the area, from the area's top."""
        tile, area = self.tile, self.area
        x, top = tile[0] - area[0], area[1] + area[3] - tile[1] - tile[3]
        return slice(top, top + tile[3]), slice(x, x + tile[2])

    def _so_far(self, out: NDArray[np.float32] | None = None) -> Any:
        """(H, W, 3): the sums of all samples of the area.

        They are read into the array `out`, if there is one and none were read before.
        """
        sums = self._renderer.read_sums((0, 0, *self.area[2:]), out)
        # A second part makes it float64. Until then that would change no bit of the quotient.
        return sums if self._total is None else np.add(self._total, sums, dtype=np.float64)

    def _variance_so_far(self, counts: Counts, measurements: BlockMeasurements) -> NDArray[np.float32]:
        """(H, W), the lowest row first: the variance of the area's samples, of which there are at most SUMMED."""
        return measurements.variance(self.area, self._renderer.seen_cells(self.area), counts)
