"""Pictures as OpenEXR files `.exr`: float32 channels as compositors expect them, compressed without loss (ZIP).

The package OpenEXR writes and decodes. It decodes in a process of its own, because a damaged file makes it print
messages, and may make it crash.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from raytracer.core.shown import format_value
from raytracer.core.suggest import missing_extra
from raytracer.core.validation import InputError
from raytracer.formats.exr_header import Part, check_whole, read_parts
from raytracer.formats.radiance import MAX_PIXELS, StoredPicture, check_alpha, check_pixels, check_radiance

# The chromaticities of red, green, blue and white of Rec. 709 (ITU-R BT.709), which sRGB shares.
REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
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
# The memory that the other process takes besides pixels, in bytes: Python, NumPy, and the stacks of threads.
_PROGRAM_BYTES = 4 << 30
# The program of the other process. It reads the file as standard input, and writes the channels as float32.
_DECODE = """
import json, os, sys
output = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)
sys.path[:], index, names, shape, most = json.loads(sys.argv[1])
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
except (ImportError, OSError, ValueError):
    pass
import numpy, OpenEXR
with OpenEXR.File(sys.stdin.buffer, separate_channels=True) as file, output:
    for name in names:
        pixels = file.parts[index].channels[name].pixels
        assert list(pixels.shape) == shape and pixels.dtype.kind == "f"
        output.write(numpy.ascontiguousarray(pixels, numpy.float32))
"""


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
        "chromaticities": REC_709,
        **header_texts(metadata),
    }
    with exr.File(header, channels(arrays)) as picture:
        picture.write(file)


def join_channels(radiance: NDArray[Any], alpha: NDArray[Any] | None) -> NDArray[np.float32]:
    """Join radiance [H, W, 3] and alpha [H, W] for ExrWriter."""
    parts = [radiance] if alpha is None else [radiance, alpha[..., None]]
    return np.concatenate(parts, axis=2, dtype=np.float32)


def header_texts(metadata: Mapping[str, str]) -> dict[str, str]:
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
    return _picture_part(file)[1].size


def read_metadata(file: IO[bytes]) -> dict[str, str]:
    """Read the texts that write() wrote, by name. Raises InputError for a damaged header and a file that is cut off."""
    index, part, _ = _picture_part(file)
    if index or not part.is_zip or not any(key.startswith(_TEXTS) for key in part.texts):
        return {}
    check_whole(file, part)
    texts = part.texts
    return {key.removeprefix(_TEXTS): text for key, text in texts.items() if key.startswith(_TEXTS)}


def read_picture(file: IO[bytes]) -> StoredPicture:
    """Read the channels R, G, B and, if there is one, A of the first part that has them. Raises InputError."""
    index, part, decoded = _picture_part(file)
    require()
    names = ["R", "G", "B", *(["A"] if "A" in part.channels else [])]
    width, height = part.size
    os.lseek(file.fileno(), 0, os.SEEK_SET)  # the other process reads the file by its descriptor
    order = json.dumps([sys.path, index, names, [height, width], 4 * decoded + _PROGRAM_BYTES])
    radiance = np.empty((height, width, 3), np.float32)
    alpha = np.empty((height, width), np.float32) if "A" in names else None
    plane = np.empty((height, width), np.float32)
    command = [sys.executable, "-I", "-c", _DECODE, order]
    with subprocess.Popen(command, stdin=file, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout
        for i, name in enumerate(names):
            if process.stdout.readinto(plane.data.cast("B")) != plane.nbytes:  # pyright: ignore[reportAttributeAccessIssue]
                raise InputError("expected an EXR file: its pixels are damaged or missing")
            if name == "A":
                assert alpha is not None
                alpha[...] = plane
            else:
                radiance[..., i] = plane
    check_radiance(radiance, "R, G, B")
    return StoredPicture(radiance, None if alpha is None else check_alpha(alpha, "A"))


def _picture_part(file: IO[bytes]) -> tuple[int, Part, int]:
    """Return the first part with R, G and B: its index and header, and the decoded size of all parts in bytes.

    Raises InputError for a file without such a part, and for one that would take too much memory: OpenEXR decodes all
    channels of all parts.
    """
    parts = read_parts(file)
    names = sorted({name for part in parts for name in part.channels})
    decoded = 0
    for part in parts:
        check_pixels(*part.size)
        # Levels of lower resolution hold less than three times the pixels of the first one.
        decoded += (4 if part.is_tiled else 1) * 4 * math.prod(part.size) * len(part.channels)
    if decoded > _MOST_DECODED:
        raise InputError(f"expected an EXR file of at most {_MOST_DECODED} bytes of pixels, got {decoded}")
    index = next((i for i, part in enumerate(parts) if {"R", "G", "B"} <= part.channels.keys()), None)
    if index is None:
        raise InputError(f"expected channels R, G and B, got {format_value(', '.join(names))}")
    part = parts[index]
    if not all(part.is_flat for part in parts):
        raise InputError("expected an EXR file of flat pixels, got deep or subsampled ones")
    if not all(part.channels[name] for name in part.channels.keys() & {*"RGBA"}):
        raise InputError("expected channels of floating-point numbers, got whole numbers")
    if part.shown != part.size:
        sizes = "{}x{} and {}x{}".format(*part.size, *part.shown)
        raise InputError(f"expected data and display windows of one size, got {sizes}")
    return index, part, decoded
