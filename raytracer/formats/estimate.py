"""Estimate: the error that a picture states about itself, with the samples and the time that it took."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from raytracer.core.record import Record
from raytracer.version import __version__

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# The effective number of squared errors below which their mean is uncertain: the root mean square of ten normally
# distributed errors has a standard deviation of about a fifth.
_FEW_SQUARES = 10.0
# The reason for an uncertain estimate if few pixels hold most of the squared error.
FEW_PIXELS = "few pixels hold most of it"
# The reason for an uncertain estimate if no sample may have hit the features that hold most of the error.
UNSEEN = "small bright features may lie between the samples"
# The lower bound of an uncertain error, as a fraction of the estimated root mean square (ground_truth/converged.py
# has the measurement).
LOWER_BOUND_FACTOR = 0.5
# The error of the worst of many pixels, in units of its standard error.
WORST_PIXEL_FACTOR = 3.0


def is_dominated_by_few(squares: NDArray[np.floating], few: float = _FEW_SQUARES) -> bool:
    """Whether the sum of `squares` rests on too few of them: their effective number is below `few`."""
    return float(squares.sum()) ** 2 < few * float((squares**2).sum())


def find_largest(values: NDArray[np.floating]) -> tuple[float, tuple[int, int]]:
    """Return the largest of the `values` [rows, columns], and its (column, row)."""
    row, column = divmod(int(values.argmax()), values.shape[1])
    return float(values[row, column]), (column, row)


class Estimate(Record, frozen=True):
    """The estimated error of a picture, and the samples and the time that the picture took.

    The estimate cannot include features that no sample hit (see `spacing`).

    Args:
        samples: the mean number of samples per pixel.
        seconds: the time for these samples.
        rmse: the root mean square error over all pixels and channels, in linear radiance. None if it is unknown.
        worst: an upper estimate of the error of the worst pixel, in linear radiance: three times its standard error.
            None if it is unknown.
        worst_at: (x, y) of a pixel in the block of pixels with the largest error, from the top left. None if unknown.
        unknown: the reason why the error is unknown or `uncertain`, "" otherwise.
        max_error: the requested error, None without a request.
    """

    samples: float
    seconds: float
    rmse: float | None = None
    worst: float | None = None
    worst_at: tuple[int, int] | None = None
    unknown: str = ""
    max_error: float | None = None

    @property
    def uncertain(self) -> bool:
        """Whether `rmse` is only a lower bound of the error; `unknown` holds the reason."""
        return self.rmse is not None and self.unknown != ""

    @property
    def reached(self) -> bool | None:
        """Whether the error is at most `max_error`, by a reliable estimate; None without a requested error."""
        if self.max_error is None:
            return None
        return self.rmse is not None and not self.uncertain and self.rmse <= self.max_error

    @property
    def in_words(self) -> str:
        """The error as a short text: "about 0.04", "at least 0.04" or "unknown"."""
        if self.rmse is None:
            return "unknown"
        return f"{'at least' if self.uncertain else 'about'} {self.rmse:.2g}"

    @property
    def spacing(self) -> float:
        """The distance between samples, in pixels. Samples may miss features that are smaller than this."""
        return 1.0 / math.sqrt(self.samples)

    def __str__(self) -> str:
        if self.rmse is None or self.worst_at is None:
            return f"error {self.in_words}: {self.unknown}"
        # If the error is uncertain, `worst` is no upper bound: the text has only its position.
        worst = f"perhaps far more: {self.unknown}; the worst is" if self.uncertain else f"up to {self.worst:.2g}"
        x, y = self.worst_at
        return (
            f"error {self.in_words} (RMSE, linear radiance), {worst} near pixel ({x}, {y}); "
            f"details smaller than {self.spacing:.2g} pixels may be missing"
        )


def measured_estimate(
    samples: float,
    seconds: float,
    squares: NDArray[np.floating],
    rmse: float,
    worst: float,
    worst_at: tuple[int, int],
    max_error: float | None = None,
) -> Estimate:
    """Return the estimate of a picture from squared errors, which is uncertain if few of them hold most of the sum.

    Args:
        samples: the mean number of samples per pixel.
        seconds: the time for these samples.
        squares: the squared errors of all pixels or blocks, of any shape.
        rmse: the root mean square error of the picture.
        worst: the standard error of the worst pixel.
        worst_at: (x, y) of the worst pixel, from the top left.
        max_error: the requested error, None without a request.
    """
    unknown = FEW_PIXELS if is_dominated_by_few(squares) else ""
    bound = LOWER_BOUND_FACTOR * rmse if unknown else rmse
    return Estimate(samples, seconds, bound, WORST_PIXEL_FACTOR * worst, worst_at, unknown, max_error)


def join_estimates(bands: Sequence[tuple[Estimate, int, int]]) -> Estimate:
    """Return the estimate of a picture from its bands: (estimate, number of pixels, first row from the top).

    The error is unknown if the error of any band is, and uncertain if the error of any band is.
    """
    pixels = sum(count for _, count, _ in bands)
    samples = sum(band.samples * count for band, count, _ in bands) / pixels
    seconds = sum(band.seconds for band, _, _ in bands)
    unknown = next((band.unknown for band, _, _ in bands if band.unknown), "")
    max_error = bands[0][0].max_error
    known = [(band.rmse, band.worst, band.worst_at, count, top) for band, count, top in bands]
    squares, worst, worst_at = 0.0, -1.0, (0, 0)
    for rmse, largest, at, count, top in known:
        if rmse is None or largest is None or at is None:
            return Estimate(samples, seconds, unknown=unknown, max_error=max_error)
        squares += rmse**2 * count
        if largest > worst:
            worst, worst_at = largest, (at[0], top + at[1])
    return Estimate(samples, seconds, math.sqrt(squares / pixels), worst, worst_at, unknown, max_error)


def picture_texts(title: str, description: str, estimate: Estimate | None, *, is_timed: bool = True) -> dict[str, str]:
    """Return the text entries of a picture's file, by name. `is_timed`: whether to include the time."""
    texts = {"Title": title, "Software": f"raytracer {__version__}", "Description": description}
    if estimate:
        texts["Samples"] = f"{estimate.samples:.6g}"
        if is_timed:
            texts["Seconds"] = f"{estimate.seconds:.3g}"
        texts["Error"] = str(estimate)
    return texts
