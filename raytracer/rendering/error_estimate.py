"""How wrong a picture is, from its own samples: by how much the means still move as samples are added.

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
all sizes it is within 30 % of the true one (tests/rendering/test_error_estimate.py).

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
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.formats.estimate import Estimate

# How the error falls, as n^-p: as on edges.
P = 0.75
# What the mean square of the last movement is multiplied by to give that of the error.
FACTOR = 1.0 / (4.0**P - 1.0)


# Standard errors that the worst of many pixels is off by.
_WORST = 3.0
# By how much an estimate must be below the error that is asked for, from 8 samples on and with fewer: so far off it may
# be.
_SURE, _LESS_SURE, _SURE_FROM = 1.05, 1.4, 8


def is_surely_below(error: float, rmse: Callable[[], float], samples: int) -> bool:
    """Whether with so many samples a picture, estimated to be off by `rmse()`, is good enough for the `error` asked
    for.

    Only with 2, 3, 4, 6, 8, 12, 16 ... samples: with others the points are not spread as well.
    """
    power = samples // 3 if samples % 3 == 0 else samples
    sure = _SURE if samples >= _SURE_FROM else _LESS_SURE
    return samples > 1 and not power & (power - 1) and sure * rmse() <= error


class Moved(NamedTuple):
    """What is found of a tile: squared errors, summed over channels."""

    total: float  # of all its pixels
    fourth: float  # the sum of the squares of those of its blocks
    worst: float  # of the worst pixel
    at: tuple[int, int]  # a pixel near that one, from the picture's lower left
    scales: NDArray[np.float64]  # of pixels that got n samples, by n: squared error over variance / n


def estimated(found: Sequence[Moved], size: tuple[int, int], samples: float, seconds: float) -> Estimate:
    """What the tiles of a picture of `size` (width, height) say together."""
    width, height = size
    worst = max(found, key=lambda moved: moved.worst)
    rmse = math.sqrt(sum(moved.total for moved in found) / (3 * width * height))
    x, y = worst.at
    fourth = sum(moved.fourth for moved in found)
    return Estimate(
        samples,
        seconds,
        rmse,
        _WORST * math.sqrt(worst.worst / 3.0),
        (min(x, width - 1), max(0, height - 1 - y)),
        blocks=sum(moved.total for moved in found) ** 2 / fourth if fourth else None,
    )
