"""The error of a picture, measured by a replicate of some of its blocks.

A replicate has the same samples in another scrambling. Its mean of a pixel has an error of the same size as the
picture's, and independent of it. So half the mean square of the differences of both means is the mean square error
of either, whatever is in the picture and however fast errors fall with more samples (randomized quasi-Monte Carlo:
Cranley and Patterson 1976, Owen 1997, "Scrambled net variance for integrals of smooth functions"). On edges and lines
of all widths both agree within 8 % (scene/sequences.py), on random scenes within 20 %, soft shadows included
(benchmarks/estimates.py).

A replicate of all pixels would take as long as the picture. BLOCKS blocks tell nearly as much, as the probability with
which a block is among them follows from the spread of its samples: sampling proportional to size, in which each chosen
block stands for its own squared error divided by its probability (Horvitz and Thompson 1952). Blocks with a large
spread are all chosen.

The measurement fails where few blocks hold most of the squared error, such as a small light's glints on metal: both
means then differ by chance. That is told by the number of blocks of equal weight that would scatter as much,
(sum s)^2 / sum s^2 of the contributions s. With fewer than _FEW the error is uncertain, and a lower bound is stated:
the sum of the smaller contributions alone, less its own standard error.

A feature that no sample of either picture meets is in no measurement. The scene tells its small bright features
(compiler/bright_features.py). Where these may add half as much as was measured, the error is uncertain, too, and the
measured one is a lower bound.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.draws import SUMMED, replicate_at
from raytracer.compiler.meshes import PER_CELL, Rectangle
from raytracer.formats.estimate import FEW_PIXELS, UNSEEN, WORST, Estimate, largest, rests_on_few
from raytracer.rendering.estimator import P
from raytracer.rendering.tile_renderer import TileRenderer

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Blocks that are drawn again. Of 64 the measurement scatters by up to a third more than of all, of 128 by a tenth.
BLOCKS = 128
# The least number of blocks of equal weight that tell an error. Of six, the root mean square scatters by a fifth.
_FEW = 6.0
# Standard errors by which a lower bound is below the sum of contributions.
_BELOW = 1.5
# The least share of the sum that is stated as a lower bound. Where one of both pictures met a bright feature by chance,
# the error is less than a tenth of the difference if less than 0.1 samples meet it on average: in one of ten cases.
_LEAST = 0.01
# The part of a measured squared error that features which samples may miss can add without making it uncertain: with
# half as much again the root is off by less than a quarter.
_UNSEEN = 0.5


class Spread(NamedTuple):
    """How far apart the samples of a picture's pixels lie. Arrays are (H, W), the top row first."""

    deviation: NDArray[np.float32]  # the root of the samples' variance, summed over channels
    samples: NDArray[np.int32] | int  # how many samples there are, or of all alike

    def relative_errors(self) -> NDArray[np.float32]:
        """(H, W): the errors of the pixels' means, up to a factor that is the same for all."""
        if isinstance(self.samples, int):
            return self.deviation
        return self.deviation * np.power(self.samples, -P, dtype=np.float32)


class Measurement(NamedTuple):
    """The squared error of a picture, summed over its pixels and channels, as its replicate tells it."""

    total: float
    least: float  # a lower bound
    is_uncertain: bool  # whether the total is worthless
    scale: float  # a pixel's error over its Spread.relative_errors()


def measure(
    renderer: TileRenderer, tiles: Sequence[Rectangle], radiance: NDArray[np.float32], spread: Spread
) -> Generator[None, None, Measurement]:
    """Measure the error of the picture `radiance` (H, W, 3), the top row first, that `renderer` drew in `tiles`.

    Yields after each sample of the replicate. Sums of the tiles' samples stay as they are.
    """
    errors = spread.relative_errors()
    # In units of the largest, so that no square overflows.
    unit = float(errors.max(initial=0.0))
    if not unit:
        return Measurement(0.0, 0.0, False, 0.0)
    weights = block_sums(np.square(errors / np.float32(unit)))
    rows, columns, probabilities = choose_blocks(weights, BLOCKS)
    squares = np.zeros(len(rows))
    for tile in tiles:
        x, y, width, height = tile
        low, left = y // BLOCK, x // BLOCK
        inside = (rows >= low) & (rows * BLOCK < y + height) & (columns >= left) & (columns * BLOCK < x + width)
        if inside.any():
            blocks = rows[inside], columns[inside]
            squares[inside] = yield from _squared_differences(renderer, tile, *blocks, radiance, spread)
    total, least, is_uncertain = squared_error(squares / 2.0, probabilities)
    return Measurement(total, least, is_uncertain, math.sqrt(total / (3.0 * weights.sum())) / unit)


def block_sums(values: NDArray[np.float32]) -> Array:
    """(rows, columns), the lowest row first: the sums over blocks of `values` (H, W), the top row first."""
    height, width = values.shape
    if height % BLOCK or width % BLOCK:
        values = np.pad(values, ((-height % BLOCK, 0), (0, -width % BLOCK)))
    # Rows first: whole rows are added at once.
    in_rows = values.reshape(-1, BLOCK, values.shape[1]).sum(axis=1)
    return in_rows.reshape(len(in_rows), -1, BLOCK).sum(axis=2)[::-1].astype(np.float64)


def choose_blocks(weights: Array, count: int) -> tuple[Ints, Ints, Array]:
    """Choose about `count` blocks: their rows, their columns, and the probability with which each of them is chosen.

    The probability is proportional to the weight, but at most 1. One block is chosen from each part of the row of all
    blocks in which the probabilities add up to 1 (systematic sampling, Madow 1949).
    """
    rows, columns = np.nonzero(weights)
    weight = weights[rows, columns]
    probabilities = np.ones(len(weight))
    if len(weight) > count:
        # The k largest weights are chosen for sure: each has at least an equal part of the sum of the smaller weights.
        descending = np.sort(weight)[::-1]
        left = np.cumsum(descending[::-1])[::-1][:count]
        k = int(np.argmax(descending[:count] * (count - np.arange(count)) < left))
        probabilities = np.minimum(weight * ((count - k) / left[k]), 1.0)
        sums = np.cumsum(probabilities)
        chosen = np.floor(sums + 0.5) > np.floor(sums - probabilities + 0.5)
        rows, columns, probabilities = rows[chosen], columns[chosen], probabilities[chosen]
    return rows, columns, probabilities


def squared_error(squares: Array, probabilities: Array) -> tuple[float, float, bool]:
    """The sum of all blocks' squared errors, from the `squares` of some, chosen with these `probabilities`.

    Returns the sum, a lower bound, and whether few blocks hold most of the sum.
    """
    contributions = np.sort(squares / probabilities)
    sums, fourths = np.cumsum(contributions), np.cumsum(np.square(contributions))
    least = max(_LEAST * float(sums[-1]), float(np.max(sums - _BELOW * np.sqrt(fourths))))
    return float(sums[-1]), least, rests_on_few(contributions, _FEW)


def _squared_differences(
    renderer: TileRenderer,
    tile: Rectangle,
    rows: Ints,
    columns: Ints,
    radiance: NDArray[np.float32],
    spread: Spread,
) -> Generator[None, None, Array]:
    """The squared differences between the picture and its replicate in some blocks of a tile, summed over each."""
    x, y, width, height = tile
    # Views with the lowest row first, as rows of blocks are counted.
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
        # A sum is read before the next begins.
        if (number + 1) % SUMMED == 0 or number + 1 == most:
            for each, (u, v), count in zip(sums, corners.tolist(), counts, strict=True):
                if count > number // SUMMED * SUMMED:
                    each += renderer.read_replicate((u - x, v - y, each.shape[1], each.shape[0]))
    squares = []
    for each, (u, v), count in zip(sums, corners.tolist(), counts, strict=True):
        difference = each / count - picture[v : v + each.shape[0], u : u + each.shape[1]]
        squares.append(float(np.square(difference).sum()))
    return np.array(squares)


def replicate_seconds(renderer: TileRenderer, tile: Rectangle) -> float:
    """The seconds that a sample of the replicate of a picture takes, if its blocks are spread over a `tile`."""
    rows, columns = (PER_CELL * -(-side // CELL) for side in (tile[3], tile[2]))
    mask = np.zeros(rows * columns, bool)
    mask[:: max(1, mask.size // BLOCKS)] = True
    seconds = 0.0
    # The first draw makes the texture and the meshes.
    for _ in range(2):
        begin = time.perf_counter()
        renderer.draw(tile, [replicate_at(0)], mask.reshape(rows, columns), target="replicate")
        seconds = time.perf_counter() - begin
    return seconds


def estimate(
    measurement: Measurement, spread: Spread, unseen: float, samples: float, seconds: float, max_error: float | None
) -> Estimate:
    """The estimate of the error of a picture that got `samples` a pixel on average and was to have `max_error`.

    `unseen` is the squared error, summed as measurement.total, of features that samples may have missed.
    """
    errors = spread.relative_errors()
    worst, worst_at = largest(errors)
    total = measurement.least if measurement.is_uncertain else measurement.total
    unknown = FEW_PIXELS if measurement.is_uncertain else UNSEEN if unseen > _UNSEEN * total else ""
    rmse = math.sqrt(total / (3 * errors.size))
    return Estimate(samples, seconds, rmse, WORST * measurement.scale * worst, worst_at, unknown, max_error)


def pixel_errors(measurement: Measurement, spread: Spread) -> NDArray[np.float32]:
    """(H, W): the error of each pixel by the spread of its samples, so that all together have the squared error."""
    return spread.relative_errors() * np.float32(measurement.scale)
