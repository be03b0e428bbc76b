"""The sRGB transfer function (IEC 61966-2-1:1999): encoding of linear radiance to 8 or 16 bits, and decoding."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.formats.radiance import row_blocks


def decode_srgb(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Convert sRGB values in [0, 1] to linear values in float64."""
    encoded = np.asarray(encoded, np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


# encode_srgb8() looks values up by the upper 16 bits of their float32 representation (the key), which is faster than a
# power for every value and exact. No two edges have the same key, so one comparison per value decides.
#
# The smallest linear values that are encoded as 1, 2, ... 255: the sRGB curve is half-way between two levels there.
_EDGES = decode_srgb((np.arange(1, 256) - 0.5) / 255.0)
_EDGES32 = _EDGES.astype(np.float32)
# The smallest float32 at or above each edge.
_EDGES32 = np.where(_EDGES32 < _EDGES, np.nextafter(_EDGES32, np.float32(1)), _EDGES32)
_LOWER_HALF = 16
# The keys of all values in [0, 1].
_KEYS = np.arange((int(np.float32(1).view(np.int32)) >> _LOWER_HALF) + 1, dtype=np.int32)
# The level of the smallest value of each key, and the next edge, for the same key or a later one.
_LEVELS = np.searchsorted(_EDGES32, (_KEYS << _LOWER_HALF).view(np.float32), "right").astype(np.uint8)
_NEXT_EDGES = np.append(_EDGES32, np.float32(np.inf))[_LEVELS]


def encode_srgb8(radiance: NDArray[Any]) -> NDArray[np.uint8]:
    """Convert linear RGB [H, W, 3] to 8-bit sRGB. Values are clipped to [0, 1], and NaN becomes 255.

    Each value gets the nearest level, exactly for float32. Numbers of other types are rounded to float32 first.
    """
    encoded = np.empty(radiance.shape, np.uint8)
    for rows in row_blocks(radiance.shape):
        linear = np.abs(np.clip(radiance[rows], 0.0, 1.0)).astype(np.float32, copy=False)  # -0.0 becomes 0.0
        key = linear.view(np.int32) >> _LOWER_HALF
        # Only NaN has a key beyond the last one.
        encoded[rows] = _LEVELS.take(key, mode="clip") + (linear >= _NEXT_EDGES.take(key, mode="clip"))
    return encoded


def encode_srgb16(radiance: NDArray[Any]) -> NDArray[np.uint16]:
    """Convert linear RGB [H, W, 3] to 16-bit sRGB. Values are clipped to [0, 1], and NaN becomes 65535."""
    encoded = np.empty(radiance.shape, np.uint16)
    for rows in row_blocks(radiance.shape):
        linear = np.nan_to_num(np.clip(radiance[rows], 0.0, 1.0).astype(np.float64), nan=1.0)
        # The linear piece ends where decode_srgb() has its end, so that decoding inverts the encoding.
        curve = np.where(linear <= 0.04045 / 12.92, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
        encoded[rows] = np.rint(65535.0 * curve)
    return encoded
