"""Bright features of a picture that are smaller than the distance of its samples, and the light of those missed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK
from raytracer.compiler.meshes import Mask

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Samples that meet a feature on average if it is surely met: of independent samples all miss it in 2 %.
_MET = 4.0
# The same for all features together, of which half may be hidden: six equal squares tell an error (replicate.py).
_ENOUGH = 12.0


class Features(NamedTuple):
    """F small bright features of a picture."""

    x: Array  # (F,): the place of each, in pixels from the left
    y: Array  # (F,): and from the top
    areas: Array  # (F,), in pixels: how many of the samples of a pixel meet its radiance
    pixels: Array  # (F,): over how many pixels its light is spread: of a lamp's glint, the lamp's mirror image
    radiance: Array  # (F, 3)

    def missed(self, samples: NDArray[np.int32] | int) -> float:
        """The squared error, summed over pixels and channels, of the features that too few samples meet.

        `samples` is (H, W), or how many each pixel got. 0 if enough of them are expected to meet features: the samples
        themselves then tell the error.
        """
        if isinstance(samples, int):
            n = np.full(len(self.areas), float(samples))
        else:
            # As float64, in which squares do not overflow.
            n = samples[self._corners(samples.shape)].min(axis=0).astype(float)
        is_small = n * self.areas < _MET
        if not is_small.any():
            return 0.0
        n, areas, pixels, radiance = n[is_small], self.areas[is_small], self.pixels[is_small], self.radiance[is_small]
        # In units of the brightest, so that no fourth power overflows.
        unit = float(radiance.max())
        radiance = radiance / unit
        squares = np.einsum("...i,...i->...", radiance, radiance)
        met = n * areas
        # The squared error that each sample on a feature adds, and the number of equal ones that would scatter as much.
        added = squares / np.square(n)
        if (met @ added) ** 2 >= _ENOUGH * (met @ np.square(added)):
            return 0.0
        return float((np.square(areas) * squares / np.maximum(met, pixels)).sum()) * unit**2

    def unmet(self, samples: int, max_error: float, size: tuple[int, int], shape: tuple[int, ...]) -> Mask:
        """(rows, columns), the lowest row first: the blocks with features that `samples` of each pixel may miss.

        No block if these cannot make the error of a picture of `size` larger than `max_error`. `shape` is the result's.
        """
        width, height = size
        blocks = np.zeros(shape, bool)
        if self.missed(samples) > max_error**2 * 3 * width * height:
            rows, columns = (each[:, samples * self.areas < _MET] for each in self._corners((height, width)))
            blocks[(height - 1 - rows) // BLOCK, columns // BLOCK] = True
        return blocks

    def _corners(self, shape: tuple[int, ...]) -> tuple[Ints, Ints]:
        """(4, F) each: the rows and columns of the pixels around each centre, in a picture of `shape` (H, W)."""
        (top, bottom), (left, right) = (
            [np.clip(np.floor(place + side).astype(np.int64), 0, end - 1) for side in (-0.5, 0.5)]
            for place, end in ((self.y, shape[0]), (self.x, shape[1]))
        )
        return np.stack([top, top, bottom, bottom]), np.stack([left, right, left, right])


_NONE = np.zeros(0)
NO_FEATURES = Features(_NONE, _NONE, _NONE, _NONE, np.zeros((0, 3)))
