"""The sRGB transfer function (IEC 61966-2-1:1999): linear radiance to 8 bits, and encoded values to linear ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.formats.radiance import row_blocks


def decode_srgb(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Convert encoded values in [0, 1] to linear ones, in float64."""
    encoded = np.asarray(encoded, np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


# The linear values from which 8 bits say 1, 2, ... 255: where the sRGB curve is half-way between two levels.
_EDGES = decode_srgb((np.arange(1, 256) - 0.5) / 255.0)
_EDGES32 = _EDGES.astype(np.float32)
_EDGES32 = np.where(_EDGES32 < _EDGES, np.nextafter(_EDGES32, np.float32(1)), _EDGES32)  # the first float32 beyond
# Values in [0, 1] by their upper half of 32 bits: no two edges share one.
_LOWER_HALF = 16
_KEYS = np.arange((int(np.float32(1).view(np.int32)) >> _LOWER_HALF) + 1, dtype=np.int32)
# The level at which the values of a key begin, and the edge to the next one, there or later.
_LEVELS = np.searchsorted(_EDGES32, (_KEYS << _LOWER_HALF).view(np.float32), "right").astype(np.uint8)
_NEXT_EDGES = np.append(_EDGES32, np.float32(np.inf))[_LEVELS]


def encode_srgb8(radiance: NDArray[Any]) -> NDArray[np.uint8]:
    """Convert linear RGB (H, W, 3), clipped to [0, 1], to 8 bits.

    To the nearest level, exactly for float32, to which all else is rounded, and without a power for every value. NaN
    becomes 255.
    """
    encoded = np.empty(radiance.shape, np.uint8)
    for rows in row_blocks(radiance.shape):
        linear = np.abs(np.clip(radiance[rows], 0.0, 1.0)).astype(np.float32, copy=False)  # -0.0 becomes 0.0
        key = linear.view(np.int32) >> _LOWER_HALF
        # Beyond the last key is NaN alone.
        encoded[rows] = _LEVELS.take(key, mode="clip") + (linear >= _NEXT_EDGES.take(key, mode="clip"))
    return encoded
