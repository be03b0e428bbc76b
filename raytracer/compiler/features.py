"""The small bright features of a picture, and the estimated error by features that its samples may miss."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK
from raytracer.compiler.meshes import Mask, Rectangle

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The smallest expected number of samples on a feature with which the samples count as having hit it. With 4, all of
# them miss it in 2 % of the cases, if they are independent.
_MET_SAMPLES = 4.0
# The smallest expected number of samples on all features together with which the samples themselves show the error.
# Six equal squared errors show it (replicate.py), and half of the features may be hidden behind other objects.
_ENOUGH_SAMPLES = 12.0


class Features(NamedTuple):
    """F small bright features of a picture."""

    x: Array  # (F,): the place of each feature, in pixels from the left
    y: Array  # (F,): in pixels from the top
    areas: Array  # (F,), in pixels: the expected number of samples that meet the feature, with one in each pixel
    pixels: Array  # (F,): the number of pixels over which its light is spread: for a glint, the light's mirror image
    radiance: Array  # (F, 3)

    def missed_error(self, samples: NDArray[np.int32] | int) -> float:
        """Return the squared error, summed over pixels and channels, of the features that too few samples meet.

        `samples` is the number of samples of each pixel (H, W), or of all pixels. The result is 0 if enough samples are
        expected to meet features: the samples themselves then show the error.
        """
        if isinstance(samples, int):
            n = np.full(len(self.areas), float(samples))
        else:
            # In float64 squares do not overflow.
            n = samples[self._corners(samples.shape)].min(axis=0).astype(float)
        is_small = n * self.areas < _MET_SAMPLES
        if not is_small.any():
            return 0.0
        n, areas, pixels, radiance = n[is_small], self.areas[is_small], self.pixels[is_small], self.radiance[is_small]
        # In units of the brightest feature, so that no fourth power overflows.
        unit = float(radiance.max())
        radiance = radiance / unit
        squares = np.einsum("...i,...i->...", radiance, radiance)
        met = n * areas
        # The squared error that each sample on a feature adds. These errors scatter as much as
        # (met @ added)^2 / (met @ added^2) equal ones: enough of them show the error.
        added = squares / np.square(n)
        if (met @ added) ** 2 >= _ENOUGH_SAMPLES * (met @ np.square(added)):
            return 0.0
        return float((np.square(areas) * squares / np.maximum(met, pixels)).sum()) * unit**2

    def find_missed_blocks(self, samples: int, max_error: float, size: tuple[int, int], shape: tuple[int, ...]) -> Mask:
        """Find the blocks (rows, columns), the lowest row first, with features that `samples` of each pixel may miss.

        There are none if the features cannot make the error of a picture of `size` larger than `max_error`. `shape` is
        (rows, columns).
        """
        width, height = size
        blocks = np.zeros(shape, bool)
        if self.missed_error(samples) > max_error**2 * 3 * width * height:
            rows, columns = (
                pixels[:, samples * self.areas < _MET_SAMPLES] for pixels in self._corners((height, width))
            )
            blocks[(height - 1 - rows) // BLOCK, columns // BLOCK] = True
        return blocks

    def within(self, part: Rectangle, size: tuple[int, int]) -> Features:
        """Return the features in a part of the picture of `size`, with their places in the part."""
        x, y = self.x - part[0], self.y - (size[1] - part[1] - part[3])
        seen = (x >= 0.0) & (x <= part[2]) & (y >= 0.0) & (y <= part[3])
        return Features(x[seen], y[seen], self.areas[seen], self.pixels[seen], self.radiance[seen])

    def _corners(self, shape: tuple[int, ...]) -> tuple[Ints, Ints]:
        """Return the rows and columns (4, F each) of the pixels around each centre, in a picture of `shape` (H, W)."""
        (top, bottom), (left, right) = (
            [np.clip(np.floor(place + side).astype(np.int64), 0, end - 1) for side in (-0.5, 0.5)]
            for place, end in ((self.y, shape[0]), (self.x, shape[1]))
        )
        return np.stack([top, top, bottom, bottom]), np.stack([left, right, left, right])


_EMPTY = np.zeros(0)
NO_FEATURES = Features(_EMPTY, _EMPTY, _EMPTY, _EMPTY, np.zeros((0, 3)))
