"""Bright things of a picture that are smaller than the distance of its samples, and what it may lack without them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK
from raytracer.compiler.meshes import Mask

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Samples that meet a feature in the mean if it is surely met: of independent samples all miss it in 2 %.
_MET = 4.0
# The same for all features together, of which half may be hidden: six equal squares tell an error (replicate.py).
_ENOUGH = 12.0


class Features(NamedTuple):
    """F bright things in a picture."""

    x: Array  # (F,): where they are, in pixels from the left
    y: Array  # (F,): and from the top
    areas: Array  # (F,): in pixels: how many of the samples of a pixel meet their radiance
    pixels: Array  # (F,): over how many pixels that is spread: of a lamp's glint, the lamp's mirror image
    radiance: Array  # (F, 3)

    def missed(self, samples: NDArray[np.int32] | int) -> float:
        """The squared error, summed over pixels and channels, that pictures may have without their samples telling it.

        `samples` is (H, W), or how many each pixel got. 0 if it is to be expected that enough of them meet the
        features to tell the error.
        """
        if isinstance(samples, int):
            n = np.full(len(self.areas), samples)
        else:
            rows, columns = self._corners(self.areas > 0.0, samples.shape)
            n = samples[rows, columns].min(axis=0, initial=np.iinfo(np.int32).max)
        is_small = n * self.areas < _MET
        if not is_small.any():
            return 0.0
        n, areas, pixels, radiance = n[is_small], self.areas[is_small], self.pixels[is_small], self.radiance[is_small]
        # In units of the brightest, so that no fourth power overflows.
        unit = float(radiance.max())
        radiance = radiance / unit
        squares = np.einsum("...i,...i->...", radiance, radiance)
        met = n * areas
        # What each sample that meets a feature adds to the squared error, and the number of equal ones that would
        # scatter as much.
        added = squares / np.square(n)
        if (met @ added) ** 2 >= _ENOUGH * (met @ np.square(added)):
            return 0.0
        return float((np.square(areas) * squares / np.maximum(met, pixels)).sum()) * unit**2

    def unmet(self, samples: int, max_error: float, size: tuple[int, int], shape: tuple[int, ...]) -> Mask:
        """(rows, columns), the lowest row first: the blocks with features that `samples` of each pixel may miss.

        None if these cannot make the error of a picture of `size` larger than `max_error`. `shape` is the result's.
        """
        width, height = size
        blocks = np.zeros(shape, bool)
        if self.missed(samples) <= max_error**2 * 3 * width * height:
            return blocks
        rows, columns = self._corners(samples * self.areas < _MET, (height, width))
        blocks[(height - 1 - rows) // BLOCK, columns // BLOCK] = True
        return blocks

    def _corners(self, chosen: NDArray[np.bool_], shape: tuple[int, ...]) -> tuple[Ints, Ints]:
        """(4, N) each: the rows and columns of the pixels of a picture around the centres of N features."""
        pixels = []
        for place, end in ((self.y[chosen], shape[0]), (self.x[chosen], shape[1])):
            pixels.append([np.clip(np.floor(place + side).astype(np.int64), 0, end - 1) for side in (-0.5, 0.5)])
        (top, bottom), (left, right) = pixels
        return np.stack([top, top, bottom, bottom]), np.stack([left, right, left, right])
