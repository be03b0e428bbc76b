"""Edges and lines in pixels, with the shares of the pixels that they cover: closed forms for errors of sampling."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SIZE = 256, 256


def lines(rng: np.random.Generator, thickness: float) -> tuple[Callable[[Array], Array], Array]:
    """Whether a point is in the random strip that crosses its pixel, as wide as `thickness`, and which share is."""
    count = SIZE[0] * SIZE[1]
    angle, offset = rng.uniform(0, math.pi / 2, count), rng.uniform(-0.7, 0.7, count)
    a, b = np.maximum(np.cos(angle), np.sin(angle)), np.minimum(np.cos(angle), np.sin(angle))

    def below(z: Array) -> Array:  # the share of a unit square where a x + b y < z
        parts = ((a + b) / 2, 1), ((a - b) / 2, -1), ((b - a) / 2, -1), (-(a + b) / 2, 1)
        return sum((sign * np.maximum(z + at, 0.0) ** 2 for at, sign in parts), np.zeros(count)) / (2 * a * b)

    def inside(p: Array) -> Array:
        along = a * p[..., 0] + b * p[..., 1] - offset
        return ((along < thickness) & (along >= 0.0)).astype(float)

    return inside, below(offset + thickness) - below(offset)
