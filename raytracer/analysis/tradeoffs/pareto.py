"""The Pareto front: the configurations that no other beats, and who beats the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def beaten_by(points: Sequence[tuple[float, float]]) -> list[int | None]:
    """The index of the fastest point that beats each point (seconds, error); None for points on the front.

    One beats another if it is neither slower nor more wrong, and either faster or less wrong.
    """
    order = sorted(range(len(points)), key=lambda i: points[i])
    winners: list[int | None] = [None] * len(points)
    for i, (seconds, error) in enumerate(points):
        for k in order:
            if points[k][0] > seconds:
                break
            if points[k][1] <= error and points[k] != (seconds, error):
                winners[i] = k
                break
    return winners


def slope(counts: Sequence[float], errors: Sequence[float]) -> tuple[float, float] | None:
    """(p, c) of error = c n^-p, by least squares of the logarithms; None of fewer than 2 points."""
    if len(counts) < 2:
        return None
    p, c = np.polyfit(np.log(counts), np.log(errors), 1)
    return -float(p), float(np.exp(c))
