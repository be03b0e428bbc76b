"""Error measurement of a finished picture, by a replicate of some of its blocks.

A replicate has the same samples in another scrambling. The error of its mean in a pixel is as large as the picture's
error, and independent of it. So half the mean square difference of the two means is the mean square error of each,
whatever the picture shows, and however fast errors fall with more samples (randomized quasi-Monte Carlo: Cranley and
Patterson 1976, Owen 1997, "Scrambled net variance for integrals of smooth functions"). On edges and lines of all widths
the measured and the true error agree within 8 % (scene/sequences.py), on random scenes within 20 %, soft shadows
included (benchmarks/estimates.py).

A replicate of all pixels would take as long as the picture. BLOCKS blocks are nearly as accurate, if a block is chosen
with a probability that follows from the spread of its samples: sampling proportional to size, in which each chosen
block represents its own squared error divided by its probability (Horvitz and Thompson 1952). Blocks with a large
spread are always chosen.

The measurement fails if few blocks hold most of the squared error, for example a small light's glints on metal: the two
means then differ by chance. The criterion is the effective number of blocks, (sum s)^2 / sum s^2 of the contributions
s. Below _FEW the error is uncertain, and a lower bound is stated instead: the sum of the smaller contributions alone,
less its own standard error.

No measurement contains a feature that no sample of either picture hits. The scene's small bright features are known
(compiler/bright_features.py). If they may add half as much as was measured, the error is uncertain, too, and the
measured error is a lower bound.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.draws import SAMPLES_PER_SUM, replicate_at
from raytracer.compiler.meshes import PER_CELL, Rectangle
from raytracer.formats.estimate import (
    FEW_PIXELS,
    UNSEEN,
    WORST_PIXEL_FACTOR,
    Estimate,
    find_largest,
    is_dominated_by_few,
)
from raytracer.rendering.estimator import P
from raytracer.rendering.tile_renderer import TileRenderer

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The number of blocks of a replicate. With 64 blocks the measurement scatters by up to a third more than with all
# blocks, with 128 by a tenth more.
BLOCKS = 128
# The least effective number of blocks of a certain error. With six blocks the root mean square scatters by a fifth.
_FEW = 6.0
# The distance of a lower bound from the sum of contributions, in standard errors.
_BOUND_DISTANCE = 1.5
# The least lower bound, as a share of the sum. If one of the two pictures hit a bright feature by chance, the error is
# less than a tenth of the difference only if less than 0.1 samples hit the feature on average: in one of ten cases.
_LEAST_BOUND = 0.01
# The most squared error that possibly missed features may add to a certain error, as a share of the measured squared
# error: with half as much again the root is off by less than a quarter.
_UNSEEN_SHARE = 0.5


class Spread(NamedTuple):
    """The spread of the samples of a picture's pixels. Arrays are (H, W), the top row first."""

    deviation: NDArray[np.float32]  # the root of the samples' variance, summed over channels
    samples: NDArray[np.int32] | int  # the number of samples of each pixel, or one number for all

    def relative_errors(self) -> NDArray[np.float32]:
        """Return the errors of the pixels' means, up to a common factor (H, W)."""
        if isinstance(self.samples, int):
            return self.deviation
        return self.deviation * np.power(self.samples, -P, dtype=np.float32)


class Measurement(NamedTuple):
    """The squared error of a picture, summed over pixels and channels, as measured by a replicate."""

    total: float
    least: float  # a lower bound
    is_uncertain: bool  # whether only the lower bound is valid
    scale: float  # the factor from Spread.relative_errors() to the errors of pixels


def measure(
    renderer: TileRenderer,
    tiles: Sequence[Rectangle],
    corner: tuple[int, int],
    radiance: NDArray[np.float32],
    spread: Spread,
) -> Generator[None, None, Measurement]:
    """Measure the error of a picture. Yields after each sample of the replicate. The sums of the tiles stay unchanged.

    Args:
        renderer, tiles: the renderer that drew the picture, or a part of it, and its tiles
        corner: the lower left pixel of the part
        radiance: the part (H, W, 3), the top row first
        spread: the spread of its samples
    """
    errors = spread.relative_errors()
    # In units of the largest error, so that no square overflows.
    unit = float(errors.max(initial=0.0))
    if not unit:
        return Measurement(0.0, 0.0, False, 0.0)
    weights = block_sums(np.square(errors / np.float32(unit)))
    rows, columns, probabilities = choose_blocks(weights, BLOCKS)
    squares = np.zeros(len(rows))
    for tile in tiles:
        x, y, width, height = tile[0] - corner[0], tile[1] - corner[1], *tile[2:]
        low, left = y // BLOCK, x // BLOCK
        inside = (rows >= low) & (rows * BLOCK < y + height) & (columns >= left) & (columns * BLOCK < x + width)
        if inside.any():
            blocks = rows[inside], columns[inside]
            squares[inside] = yield from _squared_differences(renderer, tile, corner, *blocks, radiance, spread)
    total, least, is_uncertain = squared_error(squares / 2.0, probabilities)
    return Measurement(total, least, is_uncertain, math.sqrt(total / (3.0 * weights.sum())) / unit)


def block_sums(values: NDArray[np.float32]) -> Array:
    """Return the sums over blocks (rows, columns), the lowest row first, of `values` (H, W), the top row first."""
    height, width = values.shape
    if height % BLOCK or width % BLOCK:
        values = np.pad(values, ((-height % BLOCK, 0), (0, -width % BLOCK)))
    # Rows first, because whole rows are added fast.
    in_rows = values.reshape(-1, BLOCK, values.shape[1]).sum(axis=1)
    return in_rows.reshape(len(in_rows), -1, BLOCK).sum(axis=2)[::-1].astype(np.float64)


def choose_blocks(weights: Array, count: int) -> tuple[Ints, Ints, Array]:
    """Choose about `count` blocks, and return their rows, their columns, and the probabilities of their choice.

    The probability is proportional to the weight, but at most 1. In the list of all blocks, one block is chosen from
    each stretch whose probabilities add up to 1 (systematic sampling, Madow 1949).
    """
    rows, columns = np.nonzero(weights)
    weight = weights[rows, columns]
    probabilities = np.ones(len(weight))
    if len(weight) > count:
        # The k largest weights have probability 1: the weight times the number of choices left is at least the sum of
        # itself and all smaller weights.
        descending = np.sort(weight)[::-1]
        left = np.cumsum(descending[::-1])[::-1][:count]
        k = int(np.argmax(descending[:count] * (count - np.arange(count)) < left))
        probabilities = np.minimum(weight * ((count - k) / left[k]), 1.0)
        sums = np.cumsum(probabilities)
        chosen = np.floor(sums + 0.5) > np.floor(sums - probabilities + 0.5)
        rows, columns, probabilities = rows[chosen], columns[chosen], probabilities[chosen]
    return rows, columns, probabilities


def squared_error(squares: Array, probabilities: Array) -> tuple[float, float, bool]:
    """Estimate the sum of all blocks' squared errors from the `squares` of chosen blocks.

    `probabilities` has the probability of the choice of each. Returns the sum, a lower bound, and whether few blocks
    hold most of the sum.
    """
    contributions = np.sort(squares / probabilities)
    sums, fourths = np.cumsum(contributions), np.cumsum(np.square(contributions))
    least = max(_LEAST_BOUND * float(sums[-1]), float(np.max(sums - _BOUND_DISTANCE * np.sqrt(fourths))))
    return float(sums[-1]), least, is_dominated_by_few(contributions, _FEW)


def _squared_differences(
    renderer: TileRenderer,
    tile: Rectangle,
    corner: tuple[int, int],
    rows: Ints,
    columns: Ints,
    radiance: NDArray[np.float32],
    spread: Spread,
) -> Generator[None, None, Array]:
    """Return the squared differences between the picture and a replicate, summed over each of some blocks of a tile.

    `rows` and `columns` count the blocks from the `corner` of the part that `radiance` and `spread` show.
    """
    x, y, width, height = tile[0] - corner[0], tile[1] - corner[1], *tile[2:]
    # Views with the lowest row first, because rows of blocks are counted from the bottom.
    picture, samples = radiance[::-1], spread.samples
    corners = np.column_stack((columns * BLOCK, rows * BLOCK))
    counts = np.full(len(rows), samples) if isinstance(samples, int) else samples[::-1][corners[:, 1], corners[:, 0]]
    sums = [np.zeros((min(BLOCK, y + height - v), min(BLOCK, x + width - u), 3)) for u, v in corners.tolist()]
    mask = np.zeros((PER_CELL * -(-height // CELL), PER_CELL * -(-width // CELL)), bool)
    ends, most = set(counts.tolist()), int(counts.max())
    for number in range(most):
        if number == 0 or number in ends:
            mask = np.zeros_like(mask)
            going = counts > number
            mask[rows[going] - y // BLOCK, columns[going] - x // BLOCK] = True
        renderer.draw(tile, [replicate_at(number)], mask, target="replicate")
        yield
        # A sum is read before the next sum begins.
        if (number + 1) % SAMPLES_PER_SUM == 0 or number + 1 == most:
            for total, (u, v), count in zip(sums, corners.tolist(), counts, strict=True):
                if count > number // SAMPLES_PER_SUM * SAMPLES_PER_SUM:
                    total += renderer.read_replicate((u - x, v - y, total.shape[1], total.shape[0]))
    squares = []
    for total, (u, v), count in zip(sums, corners.tolist(), counts, strict=True):
        difference = total / count - picture[v : v + total.shape[0], u : u + total.shape[1]]
        squares.append(float(np.square(difference).sum()))
    return np.array(squares)


def replicate_seconds(renderer: TileRenderer, tile: Rectangle) -> float:
    """Measure the seconds for one sample of a replicate whose blocks are spread over a `tile`."""
    rows, columns = (PER_CELL * -(-side // CELL) for side in (tile[3], tile[2]))
    mask = np.zeros(rows * columns, bool)
    mask[:: max(1, mask.size // BLOCKS)] = True
    seconds = 0.0
    # The first draw is not timed: it creates the texture and the meshes.
    for _ in range(2):
        begin = time.perf_counter()
        renderer.draw(tile, [replicate_at(0)], mask.reshape(rows, columns), target="replicate")
        seconds = time.perf_counter() - begin
    return seconds


def estimate(
    measurement: Measurement, spread: Spread, unseen: float, samples: float, seconds: float, max_error: float | None
) -> Estimate:
    """Return the estimate of a picture's error, from the measurement.

    Args:
        measurement, spread: the measurement, and the spread of the picture's samples
        unseen: squared error of features that samples may have missed, summed like measurement.total
        samples: mean number of samples per pixel
        seconds: duration of the drawing
        max_error: the requested error, or None
    """
    errors = spread.relative_errors()
    worst, worst_at = find_largest(errors)
    total = measurement.least if measurement.is_uncertain else measurement.total
    unknown = FEW_PIXELS if measurement.is_uncertain else UNSEEN if unseen > _UNSEEN_SHARE * total else ""
    rmse = math.sqrt(total / (3 * errors.size))
    return Estimate(
        samples, seconds, rmse, WORST_PIXEL_FACTOR * measurement.scale * worst, worst_at, unknown, max_error
    )


def pixel_errors(measurement: Measurement, spread: Spread) -> NDArray[np.float32]:
    """Return the error of each pixel, proportional to the spread of its samples, with the measured sum (H, W)."""
    return spread.relative_errors() * np.float32(measurement.scale)
