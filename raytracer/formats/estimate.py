"""A picture's estimate of its own error."""

from __future__ import annotations

import math

from raytracer.core.record import Record

# An average over fewer blocks is called uncertain.
_FEW = 10.0


class Estimate(Record, frozen=True):
    """The error of a picture by its own estimate, and the samples and the time that the picture took.

    `rmse`: root mean square over pixels and channels, linear radiance; `worst`: the error that the worst pixel may
    have, three times its own; it is in the block of pixels around `worst_at` (x, y), from the top left. All None where
    nothing can be known, and then `unknown` says why. `blocks`: how many blocks of pixels, of the same weight, would
    tell as much: of few it may be off by half or more. `samples`: how many a pixel got on average. `seconds`: what
    they took.
    """

    samples: float
    seconds: float
    rmse: float | None = None
    worst: float | None = None
    worst_at: tuple[int, int] | None = None
    unknown: str = ""
    blocks: float | None = None

    @property
    def spacing(self) -> float:
        """The distance of samples, in pixels: the samples may miss a part or all of a smaller thing."""
        return 1.0 / math.sqrt(self.samples)

    def __str__(self) -> str:
        if self.rmse is None or self.worst_at is None:
            return f"error unknown: {self.unknown}"
        x, y = self.worst_at
        few = ", most of it in few pixels: it may be off by half or more" if (self.blocks or _FEW) < _FEW else ""
        return (
            f"error about {self.rmse:.2g} (RMSE, linear radiance){few}, up to {self.worst:.2g} near pixel ({x}, {y}); "
            f"what is smaller than {self.spacing:.2g} pixels may have been missed"
        )
