"""Stopping rule: decides which blocks of pixels get more samples, and when a picture has enough.

With a threshold (`adaptive`), blocks whose mean is still uncertain get more samples, and so do blocks beside them. The
estimate of a pixel's error, from the pixel's n samples c (linear RGB), is the standard error of the mean,
sqrt(sum |c - mean|^2 / (n (n - 1))): Painter and Sloan 1989, "Antialiased ray tracing by adaptive progressive
refinement". |.| is the length over red, green and blue, so that no channel's error is higher than the estimate, and
edges between colours of equal brightness count. If all samples surely are 1 or more in all channels, the estimate is 0,
because they all appear as 1. If only some are above 1, the estimate may be too high. It is too high as well because
samples are more evenly spread than random ones.

All pixels get FIRST samples. Then a block of BLOCK x BLOCK pixels, at fixed places of the picture, gets more samples in
two cases. In the first case, a pixel in the block, or one that touches it, has an error above the threshold. In the
second case, the displayed means (clipped to [0, 1]) of two of these pixels differ by more than 2 n times the threshold:
an edge between the two may cut off a part of a pixel that none of its samples hits, up to 1 / n, 1 / (2 n) on average.
Mitchell 1987 compares neighbours in this way, "Generating antialiased images at low sampling densities". After NEXT
samples, and twice, 4 times, ... as many, a block stops if none of its own pixels has an error above the threshold. So
the decision on a block depends on no pixel more than APRON away.

With an error or a time limit (`max_error`, `time`), blocks stop by the estimates of estimator.py instead. After 8, 16,
32, ... samples, the blocks stop that together hold almost none of the permitted squared error: the square of
`max_error`, or of the error that the time allows. A block stops only if it also qualified at half the number of
samples. If the blocks that qualified then hold much more error now, no block stops.

A feature that none of the FIRST samples of all these pixels hits is not noticed: a ball of a quarter of a pixel, a thin
line. Rounding of the sums to float32 adds an apparent error of about 2e-4 times a pixel's radiance. A threshold below
that chooses blocks by chance, though always the same blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.rendering.estimator import P
from raytracer.scene.options import SamplingOptions

Mask = NDArray[np.bool_]

# The number of samples that all pixels get. Of discs with a radius of a quarter of a pixel, 2 samples hit 37 %, 3 hit
# 53 %, 4 hit 67 %, 8 hit 98 %; of discs twice as large, 3 hit all.
FIRST = 3
# The number of samples at the second decision, a power of two. With fewer, the samples of a pixel on an edge often
# still agree by chance.
NEXT = 8
# The width in pixels of the border around a block on which decisions about the block depend, too.
APRON = 1
# The share of the permitted squared error that stopped blocks may hold together. It adds a fortieth to the error.
_STOPPED_SHARE = 0.05
# Blocks that qualified at half the number of samples may now hold this many times the share _STOPPED_SHARE.
_MISJUDGED = 2.0
# Safety factors by which an estimate must be below `max_error`, from _SURE_FROM samples on, and with fewer samples: the
# estimate may be wrong by as much.
_SURE, _LESS_SURE, _SURE_FROM = 1.05, 1.4, 8
# The fewest samples of a picture that ends by its error. Two samples of each pixel, and two of a replicate, often all
# miss bright slivers and gaps: pictures that ended with two had up to 14 times the requested error, with four none had
# more than the requested error.
_FEWEST = 4


class Choice(NamedTuple):
    """A choice of blocks of pixels. Masks are (rows, columns)."""

    active: Mask  # the blocks that get more samples
    spare: Mask | None  # the blocks with a small enough error: they stop if the next choice confirms it


def chooses_blocks(options: SamplingOptions) -> bool:
    """Whether some blocks may get fewer samples than others: by a threshold, or by the estimated error."""
    return options.adaptive is not None or (options.has_stopping_rule and options.estimates_error)


def is_choice_due(options: SamplingOptions, samples: int) -> bool:
    """Whether choose_blocks() must be called after this number of `samples`."""
    is_power = not samples & (samples - 1)
    if options.adaptive is not None:
        return samples == FIRST or (samples >= NEXT and is_power)
    return chooses_blocks(options) and samples >= NEXT // 2 and is_power


def choose_blocks(
    options: SamplingOptions,
    active: Mask,
    errors: NDArray[np.floating],
    squared_errors: NDArray[np.floating] | None,
    *,
    spare: Mask | None,
    pixels: int,
    growth: float,
) -> Choice:
    """Choose which of the `active` blocks get more samples.

    Args:
        options: the options of the samples
        active: the blocks that got samples until now (rows, columns)
        errors: errors by error.frag (rows, columns)
        squared_errors: estimates by BlockStatistics (rows, columns); not needed with a threshold
        spare: `Choice.spare` of the previous choice
        pixels: number of pixels
        growth: final over present number of samples
    """
    if options.adaptive is not None:
        return Choice(active & (errors > options.adaptive), None)
    assert squared_errors is not None
    goal = squared_errors.sum() / max(growth, 1.0) ** (2.0 * P)
    if options.max_error is not None:
        goal = max(goal, options.max_error**2 * 3 * pixels)
    now = _choose_surest(active, errors, squared_errors, _STOPPED_SHARE * goal)
    if spare is None or squared_errors[spare & active].sum() > _MISJUDGED * _STOPPED_SHARE * goal:
        # The picture has features that this number of samples often misses.
        return Choice(active, now)
    return Choice(active & ~(spare & now), now)


def _choose_surest(
    active: Mask, errors: NDArray[np.floating], squared_errors: NDArray[np.floating], most: float
) -> Mask:
    """Select the `active` blocks with the smallest `errors` that, with inactive blocks, hold at most `most`."""
    left = most - squared_errors[~active].sum()
    order = np.argsort(errors[active], kind="stable")
    count = np.searchsorted(np.cumsum(squared_errors[active][order]), left, side="right")
    chosen = np.zeros(len(order), bool)
    chosen[order[:count]] = True
    surest = np.zeros(active.shape, bool)
    surest[active] = chosen
    return surest


def may_end_by_error(samples: int) -> bool:
    """Whether a picture may end by its error after this number of `samples`: 4, 6, 8, 12, 16, ...

    Other numbers of points are not spread as well.
    """
    power = samples // 3 if samples % 3 == 0 else samples
    return samples >= _FEWEST and not power & (power - 1)


def is_surely_below(max_error: float, rmse: float, samples: int) -> bool:
    """Whether an estimate `rmse` after this number of `samples` is below `max_error` by the safety factor."""
    sure = _SURE if samples >= _SURE_FROM else _LESS_SURE
    return may_end_by_error(samples) and sure * rmse <= max_error
