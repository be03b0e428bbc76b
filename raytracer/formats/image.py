"""The finished picture: linear radiance and what each pixel sees; sRGB; files."""

from __future__ import annotations

import io
import math
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import IO, Any

import msgspec
import numpy as np
from numpy.typing import DTypeLike, NDArray

from raytracer.core.output import check_output, written_whole
from raytracer.core.record import Record, public
from raytracer.core.validation import InputError, check_text, shown
from raytracer.formats.estimate import Estimate

SUFFIXES = (".png", ".npz")
# Rows are encoded about this many values at a time: few enough for the processor's cache.
_BLOCK = 30_000


def linear(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Values in [0, 1] by the sRGB transfer function (IEC 61966-2-1:1999) as linear ones, in float64."""
    encoded = np.asarray(encoded, np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


# The linear values from which 8 bits say 1, 2, ... 255: where the sRGB curve is half-way between two levels.
_EDGES = linear((np.arange(1, 256) - 0.5) / 255.0)
_EDGES32 = _EDGES.astype(np.float32)
_EDGES32 = np.where(_EDGES32 < _EDGES, np.nextafter(_EDGES32, np.float32(1)), _EDGES32)  # the first float32 beyond
# Values in [0, 1] by their upper half of 32 bits: no two edges share one.
_LOWER_HALF = 16
_KEYS = np.arange((int(np.float32(1).view(np.int32)) >> _LOWER_HALF) + 1, dtype=np.int32)
# The level at which the values of a key begin, and the edge to the next one, there or later.
_LEVELS = np.searchsorted(_EDGES32, (_KEYS << _LOWER_HALF).view(np.float32), "right").astype(np.uint8)
_NEXT_EDGES = np.append(_EDGES32, np.float32(np.inf))[_LEVELS]


def srgb8(radiance: NDArray[Any]) -> NDArray[np.uint8]:
    """Linear RGB (H, W, 3), clipped to [0, 1], by the sRGB transfer function (IEC 61966-2-1:1999) to 8 bits.

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


def row_blocks(shape: tuple[int, ...]) -> Iterator[slice]:
    """The rows of a picture of this shape, (H, W, 3), as many at a time as are worked on at once."""
    rows = max(1, _BLOCK // max(1, math.prod(shape[1:])))
    return (slice(start, start + rows) for start in range(0, shape[0], rows))


def _is_numbers(value: Any) -> bool:
    """Whether `value` is an array of real numbers, none of them masked."""
    return isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and not np.ma.is_masked(value)


def _kind(value: Any) -> str:
    return f"one of shape {value.shape} of {value.dtype}" if isinstance(value, np.ndarray) else shown(value)


def _check_keyword(key: Any) -> None:
    """Raise InputError for a name that PNG does not take for a text: 1 to 79 printable characters of Latin-1."""
    if not (isinstance(key, str) and key.isprintable() and 1 <= len(key) < 80 and max(key) <= "\xff"):
        raise InputError(f"expected names of 1 to 79 characters of Latin-1, got {shown(key)}", "metadata")


@public
class Image(Record, frozen=True, eq=False):
    """A rendered picture. All arrays have the top row first.

    `radiance` is (H, W, 3) float32, linear RGB. The others are those of each pixel's centre ray,
    or None if they were not asked for: `depth` (H, W) float32, the distance along the unit ray,
    inf where nothing was hit; `normal` (H, W, 3) float32, unit, world space, towards the viewer's
    side, 0 where nothing was hit; `material` (H, W) int32, index into `Scene.materials`, -1 where
    nothing was hit. The reference's images are float64. `samples` (H, W) int32: how many each pixel
    got, of a picture with adaptive samples, else None. `error` (H, W) float32: the estimated root mean square error of
    each pixel over red, green and blue, linear radiance, nan where it is not known. `estimate` says that of the
    picture. `metadata`, text by names, goes into files. `np.asarray(image)` is the radiance. Raises InputError for what
    is no such array, and for arrays of other sizes than the radiance.
    """

    radiance: NDArray[Any]
    depth: NDArray[Any] | None = None
    normal: NDArray[Any] | None = None
    material: NDArray[np.int32] | None = None
    samples: NDArray[np.int32] | None = None
    error: NDArray[Any] | None = None
    estimate: Estimate | None = None
    metadata: Mapping[str, str] = msgspec.field(default_factory=dict)

    def __post_init__(self) -> None:
        radiance: Any = self.radiance
        if not (_is_numbers(radiance) and radiance.ndim == 3 and radiance.shape[2] == 3 and radiance.size):
            raise InputError(f"expected an array (H, W, 3) of numbers, got {_kind(radiance)}", "radiance")
        shape = radiance.shape[:2]
        for name in ("depth", "normal", "material", "samples", "error"):
            value: Any = getattr(self, name)
            expected = radiance.shape if name == "normal" else shape
            if value is not None and not (_is_numbers(value) and value.shape == expected):
                raise InputError(f"expected an array {expected} of numbers or None, got {_kind(value)}", name)
        if self.estimate is not None and not isinstance(self.estimate, Estimate):
            raise InputError(f"expected an Estimate or None, got {shown(self.estimate)}", "estimate")
        if not isinstance(self.metadata, Mapping):
            raise InputError(f"expected text by names, got {shown(self.metadata)}", "metadata")
        for key, text in self.metadata.items():
            _check_keyword(key)
            check_text(text, ("metadata", key))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The radiance itself, for NumPy: a copy only where NumPy asks for one, or for another `dtype`."""
        array = np.asarray(self.radiance, dtype)
        if array is self.radiance:
            return array.copy() if copy else array
        if copy is False:
            raise ValueError(f"expected a copy to be allowed, as the radiance is {self.radiance.dtype}, not {dtype}")
        return array

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        return f"<Image {width}x{height}>"

    def srgb8(self) -> NDArray[np.uint8]:
        """The picture as (H, W, 3) uint8, sRGB."""
        return srgb8(self.radiance)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a .png (8-bit sRGB) or .npz (the arrays, and the metadata as JSON), whole or not at all.

        A file that is there keeps its permissions; a link stays, and its target is written. Raises InputError for
        another suffix, a place that cannot be written to, or arrays that were not rendered.
        """
        path = check_output(path, SUFFIXES)
        if path.suffix.lower() == ".npz":
            import json  # which a .png does without

            arrays = {name: getattr(self, name) for name in ("radiance", "depth", "normal", "material")}
            missing = [name for name, array in arrays.items() if array is None]
            if missing:
                raise InputError(
                    f"expected an image rendered with geometry=True, got none of {missing}", file=str(path)
                )
            more = {"samples": self.samples, "error": self.error}
            arrays |= {name: array for name, array in more.items() if array is not None}
            # Text and no object, so that it loads without pickles.
            arrays["metadata"] = np.array(json.dumps(dict(self.metadata)))
            with written_whole(path) as file:
                np.savez(file, **arrays)
        else:
            with written_whole(path) as file:
                self.write_png(file)

    def png(self) -> bytes:
        """The picture as the bytes of a PNG file, those that `save` writes. A notebook shows them."""
        buffer = io.BytesIO()
        self.write_png(buffer)
        return buffer.getvalue()

    _repr_png_ = png

    def write_png(self, file: IO[bytes]) -> None:
        """Write the picture as PNG (8-bit sRGB), with the metadata as text (ISO/IEC 15948).

        Not by Pillow, whose import and search for each row's best filter take longer than all this.
        """
        if not callable(getattr(file, "write", None)):
            raise InputError(f"expected a binary file, got {shown(file)}", "file")
        height, width = self.radiance.shape[:2]
        file.write(b"\x89PNG\r\n\x1a\n")
        _write_chunk(file, b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0))  # 8 bits, RGB
        for key, value in self.metadata.items():
            _write_chunk(file, b"iTXt", key.encode("latin-1") + bytes(5) + value.encode())  # plain, no language
        # Differences to the left neighbour are mostly small, and runs of zeros in flat parts.
        compressor = zlib.compressobj(strategy=zlib.Z_RLE)
        for rows in row_blocks(self.radiance.shape):
            pixels = srgb8(self.radiance[rows]).reshape(-1, 3 * width)
            filtered = np.ones((len(pixels), 1 + 3 * width), np.uint8)  # a row begins with its filter; 1 is "Sub"
            filtered[:, 1:4] = pixels[:, :3]
            np.subtract(pixels[:, 3:], pixels[:, :-3], out=filtered[:, 4:])
            if data := compressor.compress(filtered.data):
                _write_chunk(file, b"IDAT", data)
        _write_chunk(file, b"IDAT", compressor.flush())
        _write_chunk(file, b"IEND", b"")


def _write_chunk(file: IO[bytes], kind: bytes, data: bytes) -> None:
    file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
