"""Arrays of linear radiance [H, W, 3]: processing in blocks of rows, and checks of untrusted pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import InputError

# The most pixels of a picture that is read from a file: 8K (7680x4320). Larger pictures would take gigabytes.
MAX_PIXELS = 2**25
# The number of values in a block of rows, which fit into the processor's cache.
_BLOCK = 30_000
# The largest accepted radiance: the largest float32. Rendered pictures have no larger one, and squares of larger
# numbers may exceed float64.
MAX_RADIANCE = float(np.finfo(np.float32).max)


def row_blocks(shape: tuple[int, ...]) -> Iterator[slice]:
    """Return slices that split the rows of a picture of this shape [H, W, 3] into blocks."""
    rows = max(1, _BLOCK // max(1, math.prod(shape[1:])))
    return (slice(start, start + rows) for start in range(0, shape[0], rows))


def check_radiance(picture: NDArray[Any], name: str) -> None:
    """Raise InputError unless all numbers of the array `name`, a picture [H, W, 3], are finite in float32."""
    wrong = 0
    for rows in row_blocks(picture.shape):
        with np.errstate(over="ignore"):  # numbers beyond float64 become infinite
            values = np.asarray(picture[rows], np.float64)
        wrong += int(np.count_nonzero(~(np.abs(values) <= MAX_RADIANCE)))  # this counts NaN, too
    if wrong:
        raise InputError(f"expected finite numbers within +-{MAX_RADIANCE:.2g}, got {wrong} others", name)


def check_pixels(width: int, height: int) -> None:
    """Raise InputError if a picture has more than MAX_PIXELS pixels."""
    if width * height > MAX_PIXELS:
        raise InputError(f"expected at most {MAX_PIXELS} pixels, got {width}x{height}")
