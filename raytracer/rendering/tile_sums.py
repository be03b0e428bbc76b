"""Sums of the samples of one tile, on the GPU, and beyond SAMPLES_PER_SUM samples also in memory."""

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

# The number of pixels that are read and divided at a time, so that their arrays stay in the processor's cache.
_STRIP = 2**15
Counts = NDArray[np.int32] | int  # numbers of samples: (rows, columns) of the area's blocks, or one for all


class TileSums:
    """The sums of the samples of a tile, and of an `area` around it. `number`: the tile's number in `renderer`."""

    def __init__(self, renderer: TileRenderer, number: int, tile: Rectangle, area: Rectangle) -> None:
        self.tile, self.area = tile, area
        self._renderer, self._number = renderer, number
        self._total: Any = None  # the sums of the area that were read so far (H, W, 3)
        self._covered: NDArray[np.float32] | None = None  # the coverage of the area that was read so far (H, W)
        # The variance of the first SAMPLES_PER_SUM samples (H, W), bottom up.
        self._variance: NDArray[np.float32] | None = None

    def take_turn(self) -> None:
        """Switch the renderer to this tile."""
        self._renderer.turn_to(self._number, self.area[2:])

    def draw(self, blocks: Blocks, samples: Sequence[Sample], light_scale: float) -> None:
        """Draw 1 or SAMPLES_AT_ONCE more samples of the area's active blocks. Errors: see TileRenderer.draw()."""
        mask = None if blocks.is_whole else blocks.active
        self._renderer.draw(self.area, samples, mask, light_scale=light_scale)

    def read_before_new(self, counts: Counts, measurements: BlockMeasurements | None) -> None:
        """Read the sums before new sums begin. The first call also reads the variance, if there are `measurements`."""
        sums = self._renderer.read_sums((0, 0, *self.area[2:]))
        if measurements and self._variance is None:
            self._variance = self._variance_so_far(counts, measurements)
        # The total is float64 from the second part on; before, float64 would not change a bit of the mean.
        self._total = sums if self._total is None else np.add(self._total, sums, dtype=np.float64)
        self._renderer.write_sums_before(self._total)
        if self._renderer.is_transparent:
            # Exact in float32: there are at most 65536 samples.
            covered = self._renderer.read_coverage((0, 0, *self.area[2:]))
            self._covered = covered if self._covered is None else self._covered + covered

    def read_mean(self, counts: Blocks | int, out: NDArray[np.float32]) -> None:
        """Read the mean of the tile's samples into `out` (H, W, 3), the top row first.

        `counts` are the numbers of samples: blocks that cover the tile, or one number for all pixels.
        """
        x, y, width, height = self.tile
        rows = max(1, _STRIP // width)
        for top in range(0, height, rows):
            strip = x, max(y, y + height - top - rows), width, min(rows, height - top)
            self._read_mean_of(strip, counts, out[top : top + rows])

    def read_alpha(self, counts: Blocks | int, out: NDArray[np.float32]) -> None:
        """Read the share of the tile's samples that hit a surface into `out` (H, W). `counts`: see read_mean()."""
        (x, y, width, height), area = self.tile, self.area
        covered = self._renderer.read_coverage((x - area[0], y - area[1], width, height))
        if self._covered is not None:
            covered = covered + self._covered[_within(self.tile, area)]
        divisors = counts if isinstance(counts, int) else counts.samples_in(self.tile)
        np.divide(covered, divisors, out=out, casting="same_kind")

    def _read_mean_of(self, strip: Rectangle, counts: Blocks | int, out: NDArray[np.float32]) -> None:
        area = self.area
        sums: Any = out if out.flags.c_contiguous else None
        sums = self._renderer.read_sums((strip[0] - area[0], strip[1] - area[1], *strip[2:]), sums)
        if self._total is not None:
            sums = np.add(self._total[_within(strip, area)], sums, dtype=np.float64)
        divisors = counts if isinstance(counts, int) else counts.divisors_in(strip)
        if not (sums is out and isinstance(divisors, int) and divisors == 1):
            np.divide(sums, divisors, out=out, casting="same_kind")

    def variance(self, counts: Counts, measurements: BlockMeasurements) -> NDArray[np.float32]:
        """Return the variance of each pixel's first samples, at most SAMPLES_PER_SUM (H, W), the top row first."""
        variance = self._variance if self._variance is not None else self._variance_so_far(counts, measurements)
        return variance[::-1][_within(self.tile, self.area)]

    def _variance_so_far(self, counts: Counts, measurements: BlockMeasurements) -> NDArray[np.float32]:
        """Measure the variance of the area's samples, at most SAMPLES_PER_SUM (H, W), the lowest row first."""
        return measurements.variance(self.area, self._renderer.seen_cells(self.area), counts)


def _within(part: Rectangle, area: Rectangle) -> tuple[slice, slice]:
    """Return the slices of a part of an area, in arrays of the area with the top row first."""
    x, top = part[0] - area[0], area[1] + area[3] - part[1] - part[3]
    return slice(top, top + part[3]), slice(x, x + part[2])
