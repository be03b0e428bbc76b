"""Linear radiance in arrays (H, W, 3): blocks of rows, and the numbers that a picture may hold."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import InputError

# Pixels of a picture that is read from a file: 8K (7680x4320), as more would take gigabytes.
MAX_PIXELS = 2**25
# Values of a block of rows: few enough for the processor's cache.
_BLOCK = 30_000
# The largest number of float32. No picture was rendered with a larger one, whose square may be beyond float64.
MAX_RADIANCE = float(np.finfo(np.float32).max)


def row_blocks(shape: tuple[int, ...]) -> Iterator[slice]:
    """Split the rows of a picture of this shape, (H, W, 3), into blocks."""
    rows = max(1, _BLOCK // max(1, math.prod(shape[1:])))
    return (slice(start, start + rows) for start in range(0, shape[0], rows))


def check_radiance(picture: NDArray[Any], name: str) -> None:
    """Raise InputError unless all numbers of a picture (H, W, 3) are finite, and float32 holds them."""
    wrong = 0
    for rows in row_blocks(picture.shape):
        with np.errstate(over="ignore"):  # a number of more bits becomes infinite
            values = np.asarray(picture[rows], np.float64)
        wrong += int(np.count_nonzero(~(np.abs(values) <= MAX_RADIANCE)))  # NaN is not, either
    if wrong:
        raise InputError(f"expected finite numbers within +-{MAX_RADIANCE:.2g}, got {wrong} others", name)


def check_pixels(width: int, height: int) -> None:
    """Raise InputError for a picture of more pixels than are read from a file."""
    if width * height > MAX_PIXELS:
        raise InputError(f"expected at most {MAX_PIXELS} pixels, got {width}x{height}")
