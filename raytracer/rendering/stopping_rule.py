"""The rule by which samples end: which blocks of pixels get more of them, and when a picture has enough.

By a threshold (`adaptive`), blocks whose mean is still uncertain go on, and those beside them. The estimate of a
pixel's error, from the pixel's n samples c (linear RGB), is the standard error of the mean,
sqrt(sum |c - mean|^2 / (n (n - 1))): Painter and Sloan 1989, "Antialiased ray tracing by adaptive progressive
refinement". |.| is the length over red, green and blue, so no channel's error is estimated higher, and
edges between colours of equal brightness count. Where all samples surely are 1 or more in all channels it is
0: they are shown alike. Where only some are above 1, which is shown as 1, it may be too high. Samples lie
more evenly than random ones, which makes it too high as well.

All pixels get FIRST samples. Then blocks of BLOCK x BLOCK pixels, at fixed places of the picture, go on if a
pixel in them, or one that touches them, has an error above the threshold; or if means of two of these
pixels, shown (clipped to [0, 1]), differ by more than 2 n times the threshold: an edge between the two
may cut 1 / n off a pixel that no sample of it sees, 1 / (2 n) on average. That compares neighbours as Mitchell
1987 does, "Generating antialiased images at low sampling densities". After NEXT samples, and twice, 4 times, ...
as many, a block stops if no pixel of its own has an error above the threshold. So the decision on a block depends on
no pixel more than APRON away.

For an error or a time (`max_error`, `time`), blocks stop by the estimates of estimator.py instead. With 8, 16, 32, ...
samples those blocks stop that together hold next to none of the squared error that is the goal: `max_error`, or the
error that the time allows. The blocks must have held as little with half the samples already. No block stops if the
blocks that held as little then hold much more now.

Nothing shows that none of the FIRST samples of all these pixels meets: a ball of a quarter of a pixel, a thin line. The
sums' rounding to float32 makes an error of about 2e-4 times a pixel's radiance where there is
none: so low a threshold chooses by chance, though always the same blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.rendering.estimator import P
from raytracer.scene.options import SamplingOptions

Mask = NDArray[np.bool_]

# Samples that all pixels get. Of discs with a radius of a quarter of a pixel, 2 samples meet 37 %, 3 meet 53 %,
# 4 meet 67 %, 8 meet 98 %; of those twice as large 3 meet all.
FIRST = 3
# A power of two. After fewer, the samples of a pixel on an edge often agree still.
NEXT = 8
# Pixels around a block that decide on the block, too.
APRON = 1
# The share of the squared error asked for that blocks may hold which get no more samples: a fortieth of the error.
_LEFT = 0.05
# Times this share the blocks may hold now that could have done with half the samples.
_MISJUDGED = 2.0
# The factors by which an estimate must be below `max_error`, from _SURE_FROM samples on and with fewer: an estimate may
# be as far off.
_SURE, _LESS_SURE, _SURE_FROM = 1.05, 1.4, 8
# The fewest samples that tell that the error is small enough. Two of each pixel, and two of a replicate, often all miss
# bright slivers and gaps: pictures that ended with two had up to 14 times the error asked for, with four none had more.
_FEWEST = 4


class Choice(NamedTuple):
    """The choice between blocks of pixels. Masks are (rows, columns)."""

    active: Mask  # the blocks that get more samples
    spare: Mask | None  # the blocks that could do without more, as far as is known now


def chooses_blocks(options: SamplingOptions) -> bool:
    """Whether some blocks may get fewer samples than others: by a threshold, or by the estimated error."""
    return options.adaptive is not None or (options.has_stopping_rule and options.estimates_error)


def is_choice_due(options: SamplingOptions, samples: int) -> bool:
    """Whether choose_blocks() is to choose with so many `samples`."""
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

    `errors` (rows, columns) come from error.frag. The rest serves a choice without a threshold: `squared_errors` are
    estimates, `spare` comes from the choice before, there are so many `pixels`, and at last there will be `growth`
    times as many samples as now.
    """
    if options.adaptive is not None:
        return Choice(active & (errors > options.adaptive), None)
    assert squared_errors is not None
    goal = squared_errors.sum() / max(growth, 1.0) ** (2.0 * P)
    if options.max_error is not None:
        goal = max(goal, options.max_error**2 * 3 * pixels)
    now = _surest(active, errors, squared_errors, _LEFT * goal)
    if spare is None or squared_errors[spare & active].sum() > _MISJUDGED * _LEFT * goal:
        # There are features that so many samples often miss.
        return Choice(active, now)
    return Choice(active & ~(spare & now), now)


def _surest(active: Mask, errors: NDArray[np.floating], squared_errors: NDArray[np.floating], most: float) -> Mask:
    """The `active` blocks with the smallest `errors` that hold at most so much together with those not active."""
    left = most - squared_errors[~active].sum()
    order = np.argsort(errors[active], kind="stable")
    count = np.searchsorted(np.cumsum(squared_errors[active][order]), left, side="right")
    chosen = np.zeros(len(order), bool)
    chosen[order[:count]] = True
    surest = np.zeros(active.shape, bool)
    surest[active] = chosen
    return surest


def may_end_by_error(samples: int) -> bool:
    """Whether so many `samples` tell that the error is small enough: 4, 6, 8, 12, 16, ... With others the points are
    not spread as well.
    """
    power = samples // 3 if samples % 3 == 0 else samples
    return samples >= _FEWEST and not power & (power - 1)


def is_surely_below(max_error: float, rmse: float, samples: int) -> bool:
    """Whether a picture whose error is estimated as `rmse` with so many `samples` is good enough for `max_error`."""
    sure = _SURE if samples >= _SURE_FROM else _LESS_SURE
    return may_end_by_error(samples) and sure * rmse <= max_error
