"""A picture's estimate of its own error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from raytracer.core.record import Record

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# With fewer equal parts a sum of squares tells little: the root mean square of ten normal errors is off by a fifth.
_FEW = 10.0
# Why an error is uncertain that is a mean of few squares, or mostly of few.
FEW_PIXELS = "few pixels hold most of it"
# Why an error is uncertain where no sample may have met the features that hold most of it.
UNSEEN = "small bright features may lie between the samples"
# The share of the root mean square of such an error that is stated as a lower bound (ground_truth/converged.py).
LEAST = 0.5
# Standard errors that the worst of many pixels is off by.
WORST = 3.0


def rests_on_few(squares: NDArray[np.floating], few: float = _FEW) -> bool:
    """Whether less than `few` of the `squares` hold most of their sum."""
    return float(squares.sum()) ** 2 < few * float((squares**2).sum())


def largest(values: NDArray[np.floating]) -> tuple[float, tuple[int, int]]:
    """The largest of the `values` (rows, columns), and its column and row."""
    row, column = divmod(int(values.argmax()), values.shape[1])
    return float(values[row, column]), (column, row)


class Estimate(Record, frozen=True):
    """The error of a picture by its own estimate, and the samples and the time that the picture took.

    `rmse`: root mean square over pixels and channels, linear radiance; `worst`: the error that the worst pixel may
    have, three times its own; it is in the block of pixels around `worst_at` (x, y), from the top left. All None where
    nothing can be known. `unknown` says why, or why the error is `uncertain`, and is "" otherwise. `samples`: the
    samples of a pixel on average. `seconds`: their time. `max_error`: the requested error, None without a request.
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
        """Whether the samples do not tell the error: `rmse` stays finite, and the error is that or more."""
        return self.rmse is not None and self.unknown != ""

    @property
    def reached(self) -> bool | None:
        """Whether the error is known to be at most `max_error`; None if none was asked for."""
        if self.max_error is None:
            return None
        return self.rmse is not None and not self.uncertain and self.rmse <= self.max_error

    @property
    def in_words(self) -> str:
        """The error in two or three words: "about 0.04", "at least 0.04" or "unknown"."""
        if self.rmse is None:
            return "unknown"
        return f"{'at least' if self.uncertain else 'about'} {self.rmse:.2g}"

    @property
    def spacing(self) -> float:
        """The distance of samples, in pixels: the samples may miss a part or all of a smaller feature."""
        return 1.0 / math.sqrt(self.samples)

    def __str__(self) -> str:
        if self.rmse is None or self.worst_at is None:
            return f"error {self.in_words}: {self.unknown}"
        # The worst of an uncertain error is no bound: the text has only its place.
        worst = f"perhaps far more: {self.unknown}; the worst is" if self.uncertain else f"up to {self.worst:.2g}"
        x, y = self.worst_at
        return (
            f"error {self.in_words} (RMSE, linear radiance), {worst} near pixel ({x}, {y}); "
            f"what is smaller than {self.spacing:.2g} pixels may have been missed"
        )
