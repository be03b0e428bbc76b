"""Lines in pixels, with the share of each pixel that its line covers: closed forms for errors of sampling."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SIZE = 256, 256


def random_strips(rng: np.random.Generator, thickness: float) -> tuple[Callable[[Array], Array], Array]:
    """Return random strips of `thickness`, one across each pixel.

    The first value tells whether points are inside their strips; the second is the covered share of each pixel.
    """
    count = SIZE[0] * SIZE[1]
    angle, offset = rng.uniform(0, math.pi / 2, count), rng.uniform(-0.7, 0.7, count)
    a, b = np.maximum(np.cos(angle), np.sin(angle)), np.minimum(np.cos(angle), np.sin(angle))

    def below(z: Array) -> Array:  # the share of a unit square in which a x + b y < z
        parts = ((a + b) / 2, 1), ((a - b) / 2, -1), ((b - a) / 2, -1), (-(a + b) / 2, 1)
        return sum((sign * np.maximum(z + at, 0.0) ** 2 for at, sign in parts), np.zeros(count)) / (2 * a * b)

    def inside(p: Array) -> Array:
        along = a * p[..., 0] + b * p[..., 1] - offset
        return ((along < thickness) & (along >= 0.0)).astype(float)

    return inside, below(offset + thickness) - below(offset)
