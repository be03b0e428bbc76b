"""Pareto front of time and error, and the slope of errors over numbers of samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def find_dominating(points: Sequence[tuple[float, float]]) -> list[int | None]:
    """Return for each point (seconds, error) the index of the fastest point that dominates it; None on the front.

    A point dominates another if it is neither slower nor less accurate, and is faster or more accurate.
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


def fit_slope(counts: Sequence[float], errors: Sequence[float]) -> tuple[float, float] | None:
    """Fit error = c n^-p by least squares of the logarithms, and return (p, c); None for fewer than 2 points."""
    if len(counts) < 2:
        return None
    p, c = np.polyfit(np.log(counts), np.log(errors), 1)
    return -float(p), float(np.exp(c))
