"""The estimate of a picture's error, from the picture's own samples: by how far means still move as samples are added.

The mean M_n of a pixel's n samples has an error e_n. From n / 2 samples to n the mean moves by D_n = M_n - M_(n/2).
Where the new samples have nothing to do with the error of the old ones, e_(n/2)^2 = e_n^2 + D_n^2 on average over
pixels. If e_n falls as n^-p, then

    e_n^2 = D_n^2 / (4^p - 1).

Scrambled Sobol' points on an edge have p = 3/4, and so have points on a light, along the light's outline: e_n is 0.74
of D_n. Independent samples have p = 1/2: e_n is as large as D_n. The same holds for features smaller than the distance
of samples, until samples get as dense. Where light changes smoothly p is 1 or more, but there errors are small. One p
serves all pictures. The fall of earlier movements would tell p, but less surely than a constant: as a ratio of two sums
it may depend on a few pixels. Movements are measured where n is a power of two, as the points are spread best then;
from there on the error is taken to fall as the error of independent samples. On random edges, lines and discs of all
sizes the estimate is within 30 % of the true error (tests/rendering/test_estimator.py).

The estimate is an average over many pixels, as good as the number of pixels that move. Where a few blocks of pixels
hold most of the movement, such as a small light's glint on metal, the estimate is uncertain: a lower bound. That is
told by the number of blocks of equal weight that would scatter as much, (sum s)^2 / sum s^2 of the blocks' squared
movements s. On the assignment that number is 20 to 30, on random scenes 15 to 200, and 2 to 5 on the example
`materials`, where the movement tells a third to twice the true error.

The error of a single pixel follows from the distance between its samples, sqrt(variance / n), scaled so that the mean
square over all pixels is the same.

The estimate is blind for everything that no sample meets. Where many things are smaller than the distance of samples,
samples meet some, and those stand for the others; where there are few things, samples may meet none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.formats.estimate import FEW_PIXELS, Estimate, rests_on_few

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# The error falls as n^-P, as on edges.
P = 0.75
# The mean square of the last movement times FACTOR is the mean square of the error.
FACTOR = 1.0 / (4.0**P - 1.0)
# Standard errors that the worst of many pixels is off by.
_WORST = 3.0
# In a tile in whose cells with anything in them are more pixels, every fifth cell tells what moved: they are a knight's
# moves apart, so that some are in each row, column and diagonal.
_ENOUGH, _PART = 2**18, 5


class BlockStatistics(NamedTuple):
    """The statistics of one tile's blocks at the last look at each. Arrays are (rows, columns), the lowest row first.

    `variance` and `most` are known of all blocks, `at` and `moved` only of the blocks that are `watched`.
    """

    watched: Mask  # whole cells
    share: float  # of the cells with anything in them, the share that is watched
    at: NDArray[np.int32]  # the number of samples, 0 before any look
    moved: NDArray[np.float32]  # how far the means moved: squares, summed over the block's pixels and channels
    variance: NDArray[np.float32]  # of a pixel's samples, summed likewise
    most: NDArray[np.float32]  # the largest variance of one pixel

    def squared_errors(self, samples: NDArray[np.int32]) -> Array:
        """Estimate each block's squared error with so many `samples` of each block, summed over pixels and channels."""
        # From the last look on, the error falls as if samples were independent.
        return FACTOR * self.moved * (self.at / np.maximum(samples, 1))

    def rmse(self, samples: NDArray[np.int32], part: tuple[slice, slice], pixels: int) -> float:
        """Estimate the root mean square error of a `part` of the blocks that has so many `pixels`."""
        total = self.squared_errors(samples)[part].sum() / self.share
        return float(np.sqrt(total / (3 * pixels)))

    def is_uncertain(self, samples: NDArray[np.int32], part: tuple[slice, slice]) -> bool:
        """Whether rmse() of a `part` of the blocks is but a lower bound."""
        squared_errors = self.squared_errors(samples)[part]
        return rests_on_few(squared_errors.sum() / self.share, np.square(squared_errors).sum() / self.share)


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

    `measurements` (rows, columns, 3 or more) come from movement.frag: movement, variance, the largest variance.
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
    for n in np.flatnonzero(np.bincount(samples.ravel())):
        alike = seen & (samples == n)
        if alike.any():
            scales[n] = _scale(squared_errors, spread, alike)
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


def _scale(squared_errors: Array, spread: Array, chosen: Mask) -> float:
    """The squared errors of the `chosen` blocks over the squared errors that independent samples would have."""
    total = float(spread[chosen].sum(dtype=float))
    return float(squared_errors[chosen].sum()) / total if total else 0.0


def pixel_errors(variance: NDArray[np.float32], samples: NDArray[np.int32] | int, scales: Array) -> NDArray[np.float32]:
    """(H, W): the estimated error of each pixel, whose samples have that `variance` (H, W)."""
    error = variance * np.asarray(scales[samples] / samples / 3.0, np.float32)
    return np.sqrt(error, out=error)


def estimate(
    tiles: Sequence[TileStatistics],
    size: tuple[int, int],
    samples: float,
    seconds: float,
    max_error: float | None = None,
) -> Estimate:
    """The estimate of a picture of `size` (width, height) that consists of `tiles`, and was to have `max_error`."""
    width, height = size
    worst = max(tiles, key=lambda tile: tile.worst)
    total, fourth = sum(tile.total for tile in tiles), sum(tile.fourth for tile in tiles)
    x, y = worst.at
    uncertain = rests_on_few(total, fourth)
    return Estimate(
        samples,
        seconds,
        math.sqrt(total / (3 * width * height)),
        _WORST * math.sqrt(worst.worst / 3.0),
        (min(x, width - 1), max(0, height - 1 - y)),
        unknown=FEW_PIXELS if uncertain else "",
        uncertain=uncertain,
        max_error=max_error,
    )
