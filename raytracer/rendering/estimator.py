"""Error estimator for a picture that still gains samples, based on the movement of the means of blocks of pixels.

The mean M_n of a pixel's n samples has an error e_n. From n / 2 samples to n the mean moves by D_n = M_n - M_(n/2).
If the new samples are independent of the error of the old ones, e_(n/2)^2 = e_n^2 + D_n^2 on average over pixels. If
e_n falls as n^-p, then

    e_n^2 = D_n^2 / (4^p - 1).

Scrambled Sobol' points on an edge have p = 3/4, and so do points on a light along its outline: e_n is 0.74 D_n.
Independent samples have p = 1/2: e_n is as large as D_n. If both the place in the pixel and the point on the light
matter, e_n falls fast from 8 samples to 16, and from 128 to 256: it may be 0.4 of the estimate with p = 3/4. Movements
are measured if n is a power of two, because the points are spread best then. Between two measurements the error is
assumed to fall like the error of independent samples.

The stopping rule uses the estimate to find the blocks that need more samples, and the window shows it while a picture
gains samples. The error of a finished picture is measured by replicate.py instead, which needs no p.

The estimate is an average over pixels, and the more pixels move, the better it is. If a few blocks of pixels hold most
of the movement, for example a small light's glint on metal, the estimate is uncertain. The measure is the effective
number of blocks, (sum s)^2 / sum s^2 of the blocks' squared movements s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK
from raytracer.formats.estimate import Estimate, find_largest, measured_estimate

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# The exponent of the error n^-P: edges have 3/4.
P = 0.75
# The mean square error over the mean square of the last movement.
FACTOR = 1.0 / (4.0**P - 1.0)


class BlockStatistics(NamedTuple):
    """The statistics of blocks, each at its last look. Arrays are (rows, columns), the lowest row first."""

    at: NDArray[np.int32]  # the number of samples at the look, 0 before any look
    moved: NDArray[np.floating]  # the squared movement of the means, summed over the block's pixels and channels
    most: NDArray[np.floating]  # the largest variance of one pixel's samples, summed over channels

    def squared_errors(self, samples: NDArray[np.int32]) -> Array:
        """Estimate each block's squared error, summed over pixels and channels, from its number of `samples`."""
        # After the last look, the error is assumed to fall like the error of independent samples.
        return FACTOR * self.moved * (self.at / np.maximum(samples, 1))

    def rmse(self, samples: NDArray[np.int32], part: tuple[slice, slice], pixels: int) -> float:
        """Estimate the root mean square error of a `part` of the blocks. `pixels`: the number of its pixels."""
        return math.sqrt(self.squared_errors(samples)[part].sum() / (3 * pixels))

    def estimate(
        self,
        samples: NDArray[np.int32],
        part: tuple[slice, slice],
        size: tuple[int, int],
        mean_samples: float,
        seconds: float,
        max_error: float | None,
    ) -> Estimate:
        """Estimate the error of a picture of `size` (width, height), which is a `part` of the blocks."""
        squared_errors = self.squared_errors(samples)[part]
        # The worst pixel is in the block with the largest variance of a mean.
        _, (column, row) = find_largest(self.most[part] / np.maximum(samples[part], 1))
        x, y = (BLOCK * index + BLOCK // 2 for index in (column, row))
        return measured_estimate(
            mean_samples,
            seconds,
            squared_errors,
            self.rmse(samples, part, size[0] * size[1]),
            math.sqrt(squared_errors[row, column] / 3.0),
            (min(x, size[0] - 1), max(0, size[1] - 1 - y)),
            max_error,
        )


def empty_statistics(shape: tuple[int, ...]) -> BlockStatistics:
    """Return the statistics of (rows, columns) blocks without any sample."""
    zeros = np.zeros(shape, np.float32)
    return BlockStatistics(np.zeros(shape, np.int32), zeros, zeros)


def update_statistics(
    statistics: BlockStatistics, samples: int, measurements: NDArray[np.floating], active: Mask
) -> BlockStatistics:
    """Update the statistics of the `active` blocks by a look after `samples` samples, and return them.

    `measurements` come from movement.frag: movement and largest variance (rows, columns, 2 or more).
    """
    return BlockStatistics(
        np.where(active, np.int32(samples), statistics.at),
        np.where(active, measurements[..., 0], statistics.moved),
        np.where(active, measurements[..., 1], statistics.most),
    )
