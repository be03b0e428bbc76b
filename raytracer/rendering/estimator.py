"""The estimate of a picture's error, from the picture's own samples: by how far means still move as samples are added.

The mean M_n of a pixel's n samples is off by e_n. From n / 2 samples to n it moves by D_n = M_n - M_(n/2), and where
what was added has nothing to do with what was wrong before, e_(n/2)^2 = e_n^2 + D_n^2 on average over pixels. If e_n
falls as n^-p, then

    e_n^2 = D_n^2 / (4^p - 1).

Scrambled Sobol' points on an edge have p = 3/4, and so have those on a light, of its outline: e_n is 0.74 of D_n.
Independent samples have p = 1/2: it is as large as D_n. So it is of features smaller than the distance of samples,
until these get as dense. Where light changes smoothly p is 1 or more, but there errors are small. One p is taken for
all pictures: how fast movements fell before would tell, but less surely than not to look, as it is a ratio of two sums
of which a few pixels may be most. It is measured where n is a power of two, as the points are spread best then; from
there to the number of samples it is taken to fall as that of independent ones. On random edges, lines and discs of
all sizes it is within 30 % of the true one (tests/rendering/test_estimator.py).

It is an average over many pixels, as good as the number of those that move. Where a few blocks of pixels hold most of
what moved, such as those of a small light's glint on metal, it may be off by half or more, and says so: by how many
blocks of the same weight would scatter as much, (sum s)^2 / sum s^2 of their squared movements s. On the assignment
these are 20 to 30, on random scenes 15 to 200, and 2 to 5 on the example `materials`, where what is estimated is a
third to twice what is true. What single pixels are off by is told by how far apart their samples lie, sqrt(variance /
n), scaled so that its mean square is the same.

Blind is this for what no sample meets. Of many things smaller than the distance of samples some are met, and they
stand for the others; of a few it may be none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.formats.estimate import Estimate

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# How the error falls, as n^-P: as on edges.
P = 0.75
# The mean square of the last movement times FACTOR is that of the error.
FACTOR = 1.0 / (4.0**P - 1.0)
# Standard errors that the worst of many pixels is off by.
_WORST = 3.0
# In a tile in whose cells with anything in them are more pixels, every fifth cell tells what moved: they are a knight's
# moves apart, so that some are in each row, column and diagonal.
_ENOUGH, _PART = 2**18, 5


class BlockStatistics(NamedTuple):
    """The statistics of one tile's blocks at the last look at each. Arrays are (rows, columns), the lowest row first.

    `variance` and `most` are those of all blocks, `at` and `moved` only those of the blocks that are `watched`.
    """

    watched: Mask  # whole cells
    share: float  # of the cells with anything in them, the share that is watched
    at: NDArray[np.int32]  # the number of samples, 0 before any look
    moved: NDArray[np.float32]  # how far the means moved: squares, summed over the block's pixels and channels
    variance: NDArray[np.float32]  # of a pixel's samples, summed likewise
    most: NDArray[np.float32]  # the largest variance of one pixel

    def squared_errors(self, samples: NDArray[np.int32]) -> Array:
        """Estimate each block's squared error with so many `samples` of each block, summed over pixels and channels."""
        # From the last look on, the error falls as that of independent samples.
        return FACTOR * self.moved * (self.at / np.maximum(samples, 1))

    def rmse(self, samples: NDArray[np.int32], part: tuple[slice, slice], pixels: int) -> float:
        """Estimate the root mean square error of a `part` of the blocks that has so many `pixels`."""
        total = self.squared_errors(samples)[part].sum() / self.share
        return float(np.sqrt(total / (3 * pixels)))


class TileStatistics(NamedTuple):
    """The squared errors of one tile, summed over channels."""

    total: float  # of all pixels
    fourth: float  # the sum of the squares of the blocks' squared errors
    worst: float  # of the worst pixel
    at: tuple[int, int]  # a pixel near that one, from the picture's lower left
    scales: Array  # of pixels that got n samples, by n: squared error over variance / n


def before_any_look(cells: Mask, *, is_sparse: bool) -> BlockStatistics:
    """The statistics of a tile in whose `cells` (rows, columns) there is anything.

    If `is_sparse`, a part of a large tile stands for the tile.
    """
    watched, per = np.ones_like(cells), CELL // BLOCK
    if is_sparse and cells.sum() * CELL**2 > _ENOUGH:
        row, column = np.indices(cells.shape)
        watched = (column + 2 * row) % _PART == 0
    share = float(watched[cells].mean()) if cells.any() else 1.0
    blocks = watched.repeat(per, axis=0).repeat(per, axis=1)
    zeros = np.zeros(blocks.shape, np.float32)
    return BlockStatistics(blocks, share, np.zeros(blocks.shape, np.int32), zeros, zeros, zeros)


def after_look(
    statistics: BlockStatistics, samples: int, measurements: NDArray[np.float32], active: Mask
) -> BlockStatistics:
    """The statistics after a look at the `active` blocks, with so many `samples`.

    `measurements` (rows, columns, 3 or more) are those of movement.frag: movement, variance, the largest variance.
    """
    moved, variance, most = np.moveaxis(measurements[..., :3], -1, 0)
    watched = active & statistics.watched
    return statistics._replace(
        at=np.where(watched, np.int32(samples), statistics.at),
        moved=np.where(watched, moved, statistics.moved),
        variance=np.where(active, variance, statistics.variance),
        most=np.where(active, most, statistics.most),
    )


def is_look_due(samples: int, last: int, *, has_all: bool) -> bool:
    """Whether to measure how far means moved with so many `samples`: if `has_all`, at each power of two, else at the
    two largest that are at most the number of the `last` sample.
    """
    return not samples & (samples - 1) and (has_all or 2 * samples >= 1 << last.bit_length() - 1)


def tile_statistics(
    statistics: BlockStatistics, samples: NDArray[np.int32], part: tuple[slice, slice], corner: tuple[int, int]
) -> TileStatistics:
    """The statistics of a `part` of the blocks. The first block of all begins at the picture's pixel `corner`."""
    squared_errors, samples = statistics.squared_errors(samples)[part], np.maximum(samples[part], 1)
    spread, seen = statistics.variance[part] / samples, statistics.at[part] > 0
    scales = np.full(samples.max() + 1, _scale(squared_errors, spread, seen))
    for n in np.unique(samples):
        those = seen & (samples == n)
        if those.any():
            scales[n] = _scale(squared_errors, spread, those)
    worst = scales[samples] * statistics.most[part] / samples
    row, column = np.unravel_index(int(worst.argmax()), worst.shape)
    y, x = (int(index + rows.start) * BLOCK + BLOCK // 2 for index, rows in zip((row, column), part, strict=True))
    return TileStatistics(
        float(squared_errors.sum()) / statistics.share,
        float(np.square(squared_errors).sum()) / statistics.share,
        float(worst[row, column]),
        (corner[0] + x, corner[1] + y),
        scales,
    )


def _scale(squared_errors: Array, spread: Array, those: Mask) -> float:
    """The squared errors of some blocks over those that independent samples would have."""
    total = float(spread[those].sum(dtype=float))
    return float(squared_errors[those].sum()) / total if total else 0.0


def sample_variance(sums: NDArray[np.float32], samples: NDArray[np.int32]) -> NDArray[np.float32]:
    """(H, W): the variance of each pixel's `samples` (H, W), summed over channels, from their `sums` (H, W, 4): of
    their red, green, blue and squared lengths.
    """
    squares = np.einsum("ijk,ijk->ij", sums[..., :3], sums[..., :3])
    return np.maximum(sums[..., 3] - squares / samples, 0.0) / np.maximum(samples - 1, 1).astype(np.float32)


def pixel_errors(variance: NDArray[np.float32], samples: NDArray[np.int32] | int, scales: Array) -> NDArray[np.float32]:
    """(H, W): the estimated error of each pixel, whose samples have that `variance` (H, W)."""
    return np.sqrt(variance * (scales[samples] / samples / 3.0), dtype=np.float32)


def estimate(tiles: Sequence[TileStatistics], size: tuple[int, int], samples: float, seconds: float) -> Estimate:
    """The estimate of a picture of `size` (width, height) that consists of `tiles`."""
    width, height = size
    worst = max(tiles, key=lambda tile: tile.worst)
    total, fourth = sum(tile.total for tile in tiles), sum(tile.fourth for tile in tiles)
    x, y = worst.at
    return Estimate(
        samples,
        seconds,
        math.sqrt(total / (3 * width * height)),
        _WORST * math.sqrt(worst.worst / 3.0),
        (min(x, width - 1), max(0, height - 1 - y)),
        blocks=total**2 / fourth if fourth else None,
    )
