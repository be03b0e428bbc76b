"""Pictures as OpenEXR files `.exr`: float32 channels as compositors expect them, compressed without loss (ZIP).

The package OpenEXR writes and decodes. Its decoders trust the sizes in a file's header, so the header is checked first.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.shown import escape_unprintable, format_value
from raytracer.core.suggest import missing_extra
from raytracer.core.validation import InputError
from raytracer.formats.radiance import MAX_PIXELS, StoredPicture, check_alpha, check_pixels, check_radiance

# The chromaticities of red, green, blue and white of Rec. 709 (ITU-R BT.709), which sRGB shares.
_REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
# The prefix of the header's attributes that hold the texts of a picture.
_TEXTS = "raytracer:"
# The array and its component of each channel of floating-point numbers.
_FLOATS = {
    "R": ("radiance", 0),
    "G": ("radiance", 1),
    "B": ("radiance", 2),
    "A": ("alpha", None),
    "Z": ("planar_depth", None),
    "distance.Z": ("depth", None),
    "N.X": ("normal", 0),
    "N.Y": ("normal", 1),
    "N.Z": ("normal", 2),
    "error.Y": ("error", None),
}
# The array of each channel of whole numbers. EXR has no negative ones: the background, -1, becomes 0xffffffff.
_INTEGERS = {"material.id": "material", "samples.Y": "samples"}
# The largest size of all decoded channels, in bytes: the 12 above, and four others, of the largest picture.
_MOST_DECODED = 4 * 16 * MAX_PIXELS
# The most channels of all parts. Renderers write a hundred at most.
_MOST_CHANNELS = 1024


def require() -> Any:
    """Return the package OpenEXR. Raises InputError if it is not installed."""
    try:
        import OpenEXR  # an extra
    except ImportError:
        raise InputError(missing_extra(".exr files need", "OpenEXR", "exr")) from None
    return OpenEXR


def write(file: IO[bytes], arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> None:
    """Write a picture's arrays by name as channels, and its metadata as texts of the header."""
    exr = require()
    header = {
        "type": exr.scanlineimage,
        "compression": exr.ZIP_COMPRESSION,
        "chromaticities": _REC_709,
        **_attributes(metadata),
    }
    with exr.File(header, channels(arrays)) as picture:
        picture.write(file)


class ExrWriter:
    """Writes an EXR file row by row, from the top, so that a picture need not fit into memory.

    The header has no chromaticities, because the package cannot write them here; without them, EXR means Rec. 709.
    """

    def __init__(self, file: IO[bytes], width: int, height: int, channels: int, texts: Mapping[str, str]) -> None:
        """Write the header.

        Args:
            file: an open and empty binary file of the file system, because the package needs its path.
            width, height: the picture's size in pixels.
            channels: 3 for R, G, B, or 4 with A.
            texts: texts by name.
        """
        self._exr = exr = require()
        self._path = os.fspath(file.name)
        header = exr.Header(width, height)  # ZIP, and float32 for R, G and B
        header["channels"] = dict.fromkeys("RGBA"[:channels], header["channels"]["R"])
        header.update({name: text.encode() for name, text in _attributes(texts).items()})
        self._channels = "RGBA"[:channels]
        self._output = exr.OutputFile(self._path, header)

    def write_rows(self, pixels: NDArray[np.float32]) -> None:
        """Write the next rows [rows, width, channels]: premultiplied radiance, then alpha. Raises OSError."""
        data = {name: pixels[..., i].tobytes() for i, name in enumerate(self._channels)}
        self._output.writePixels(data, len(pixels))

    def close(self, texts: Mapping[str, str] | None = None) -> None:
        """Write the end of the file. The header is written, so there is no place for more `texts`. Raises OSError."""
        del texts
        self._output.close()
        if not self._exr.InputFile(self._path).isComplete():  # the package hides errors at the end of a file
            raise OSError("the end of the EXR file cannot be written")


def join_channels(radiance: NDArray[Any], alpha: NDArray[Any] | None) -> NDArray[np.float32]:
    """Join radiance [H, W, 3] and alpha [H, W] for ExrWriter.write_rows()."""
    parts = [radiance] if alpha is None else [radiance, alpha[..., None]]
    return np.concatenate(parts, axis=2, dtype=np.float32)


def _attributes(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return the attributes of the header for the texts of a picture."""
    header = {f"{_TEXTS}{key}": text for key, text in metadata.items()}
    if "Software" in metadata:  # the names that OpenEXR proposes, which other programs show
        header["software"] = metadata["Software"]
    if comments := "; ".join(metadata[key] for key in ("Title", "Description", "Error") if metadata.get(key)):
        header["comments"] = comments
    return header


def channels(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return the channels of a picture's arrays by name, float32 or uint32 [H, W]."""
    made: dict[str, NDArray[Any]] = {}
    for channel, (name, part) in _FLOATS.items():
        if name in arrays:
            values = arrays[name] if part is None else arrays[name][..., part]
            with np.errstate(over="ignore"):  # float64 of a reference that is beyond float32 becomes infinite
                made[channel] = np.ascontiguousarray(values, np.float32)
    for channel, name in _INTEGERS.items():
        if name in arrays:
            made[channel] = np.ascontiguousarray(arrays[name].astype(np.uint32))
    return made


def read_size(file: IO[bytes]) -> tuple[int, int]:
    """Read only the (width, height) of a picture. Raises InputError."""
    return _read_header(file).size


def read_picture(file: IO[bytes]) -> StoredPicture:
    """Read the channels R, G, B and, if there is one, A of the first part that has them. Raises InputError."""
    header = _read_header(file)
    width, height = header.size
    radiance = np.empty((height, width, 3), np.float32)
    alpha = np.empty((height, width), np.float32) if "A" in header.channels else None
    with _open(file, header_only=False) as parts:
        decoded = parts[header.part].channels
        for i, name in enumerate("RGB"):
            radiance[..., i] = _pixels(decoded[name].pixels, radiance.shape[:2])
        if alpha is not None:
            alpha[...] = _pixels(decoded["A"].pixels, alpha.shape)
    check_radiance(radiance, "R, G, B")
    return StoredPicture(radiance, None if alpha is None else check_alpha(alpha, "A"))


def read_metadata(file: IO[bytes]) -> dict[str, str]:
    """Read the texts by name. Raises InputError."""
    texts = _read_header(file).attributes
    chosen = {key: value for key, value in texts.items() if key.startswith(_TEXTS) and isinstance(value, str)}
    return {key.removeprefix(_TEXTS): text for key, text in chosen.items()}


class _Header(NamedTuple):
    """The header of the first part with R, G and B."""

    part: int  # the index of the part
    size: tuple[int, int]  # (width, height)
    channels: Mapping[str, Any]
    attributes: Mapping[str, Any]


@contextmanager
def _open(file: IO[bytes], *, header_only: bool) -> Iterator[list[Any]]:
    """Open a file with OpenEXR; the value is the list of its parts. Errors of OpenEXR become InputError."""
    exr = require()
    file.seek(0)
    try:
        with exr.File(file, separate_channels=True, header_only=header_only) as picture:
            yield picture.parts
    except (InputError, MemoryError):
        raise
    except Exception as error:  # OpenEXR does not document the errors that damaged files cause
        raise InputError(f"expected an EXR file: {' '.join(escape_unprintable(str(error)).split())[:100]}") from None


def _read_header(file: IO[bytes]) -> _Header:
    """Read and check the headers of all parts, because OpenEXR decodes all parts. Raises InputError."""
    with _open(file, header_only=True) as parts:
        headers = [dict(part.header) for part in parts]
    names: list[str] = []
    picture, total = None, 0
    for index, header in enumerate(headers):
        channels = {channel.name: channel for channel in header["channels"]}
        names += channels
        if len(names) > _MOST_CHANNELS:
            raise InputError(f"expected an EXR file of at most {_MOST_CHANNELS} channels")
        if "deep" in str(header.get("type")):
            raise InputError("expected an EXR file of flat pixels, got one with deep pixels")
        if any(channel.xSampling != 1 or channel.ySampling != 1 for channel in channels.values()):
            raise InputError("expected an EXR file whose channels have all pixels, got subsampled channels")
        size = _size(header["dataWindow"])
        check_pixels(*size)
        # Levels of lower resolution (mipmaps) hold less than three times the pixels of the first one.
        total += (3 if "tiles" in header else 1) * math.prod(size) * 4 * len(channels)
        if picture is None and {"R", "G", "B"} <= channels.keys():
            if (shown := _size(header["displayWindow"])) != size:
                kinds = "{}x{} and {}x{}".format(*size, *shown)
                raise InputError(f"expected equal data and display windows, got {kinds}")
            picture = _Header(index, size, channels, header)
    if total > _MOST_DECODED:
        raise InputError(f"expected an EXR file of at most {_MOST_DECODED} bytes of pixels, got {total}")
    if picture is None:
        raise InputError(f"expected channels R, G and B, got {format_value(', '.join(sorted(names)))}")
    return picture


def _size(window: tuple[Any, Any]) -> tuple[int, int]:
    """Return the (width, height) of a window, the corners of which are in it. Raises InputError for an empty one."""
    (left, top), (right, bottom) = (corner.tolist() for corner in window)
    if right < left or bottom < top:
        raise InputError("expected an EXR file: its window is empty")
    return right - left + 1, bottom - top + 1


def _pixels(pixels: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return the decoded pixels of a channel [H, W]. Raises InputError if they have another shape or no numbers."""
    if not isinstance(pixels, np.ndarray) or pixels.shape != shape or pixels.dtype.kind != "f":
        raise InputError("expected an EXR file: channels of floating-point numbers of the size in its header")
    return pixels
