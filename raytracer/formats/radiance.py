"""Linear radiance [H, W, 3] and alpha [H, W]: processing in blocks of rows, and checks of untrusted pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

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


class PictureRows(Protocol):
    """A picture [H, W, 3] of finite linear radiance that is read by slices of rows: an array, or an open file."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    def __getitem__(self, rows: slice, /) -> NDArray[Any]: ...


class StoredPicture(NamedTuple):
    """The contents of a picture file that a comparison needs.

    Attributes:
        radiance: the linear radiance [H, W, 3], whose rows are read by slices; premultiplied if there is an alpha.
        alpha: the coverage in [0, 1] of each pixel [H, W]. None if the picture is opaque.
    """

    radiance: PictureRows
    alpha: NDArray[Any] | None = None


def row_blocks(shape: tuple[int, ...]) -> Iterator[slice]:
    """Return slices that split the rows of a picture of this shape [H, W, 3] into blocks."""
    rows = max(1, _BLOCK // max(1, math.prod(shape[1:])))
    return (slice(start, start + rows) for start in range(0, shape[0], rows))


def check_radiance(picture: NDArray[Any], name: str) -> None:
    """Raise InputError unless all numbers of the array `name`, a picture [H, W, 3], are finite in float32."""
    wrong = 0
    for rows in row_blocks(picture.shape):
        with np.errstate(over="ignore", invalid="ignore"):  # of numbers beyond float64, and of signaling NaN
            values = np.asarray(picture[rows], np.float64)
        wrong += int(np.count_nonzero(~(np.abs(values) <= MAX_RADIANCE)))  # this counts NaN, too
    if wrong:
        raise InputError(f"expected finite numbers within +-{MAX_RADIANCE:.2g}, got {wrong} others", name)


def check_alpha(alpha: NDArray[Any], name: str) -> NDArray[Any] | None:
    """Return alpha [H, W], or None if all pixels are opaque. Raises InputError for numbers outside [0, 1] and NaN."""
    wrong = int(np.count_nonzero(~((alpha >= 0.0) & (alpha <= 1.0))))
    if wrong:
        raise InputError(f"expected numbers in [0, 1], got {wrong} others", name)
    return None if (alpha == 1.0).all() else alpha


def check_pixels(width: int, height: int) -> None:
    """Raise InputError if a picture has more than MAX_PIXELS pixels."""
    if width * height > MAX_PIXELS:
        raise InputError(f"expected at most {MAX_PIXELS} pixels, got {width}x{height}")
