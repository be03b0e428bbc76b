"""Pictures that are read from `.npz` and `.png` files, in linear radiance: the files may be anything."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.image_difference import check_radiance
from raytracer.core.files import opened
from raytracer.core.npz import read_arrays, read_shape
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path, printable
from raytracer.formats.image import linear
from raytracer.formats.png_file import check_whole, read_header

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

SUFFIXES = (".npz", ".png")
# Pixels of a picture: 8K (7680x4320), as more would take gigabytes.
MAX_PIXELS = 2**25
# Bytes of its file: from 2 GB on NumPy writes another kind of archive; a PNG's pixels take at most half of this.
_MAX_BYTES = {".npz": 2**31 - 1, ".png": 16 * MAX_PIXELS}
_MAX_ARRAY = 16 * 3 * MAX_PIXELS


class Levels:
    """A picture as the levels (H, W, 3) of a PNG, and the radiance of each level: an eighth of the radiance's memory.

    Rows by a slice are float64 radiance, as an array's would be.
    """

    def __init__(self, levels: NDArray[Any], radiance: NDArray[np.float64]) -> None:
        self._levels = levels
        self._radiance = radiance

    @property
    def shape(self) -> tuple[int, ...]:
        """(height, width, 3)."""
        return self._levels.shape

    def __getitem__(self, rows: slice) -> NDArray[np.float64]:
        return self._radiance[self._levels[rows]]


def size_in(path: str | os.PathLike[str]) -> tuple[int, int]:
    """(width, height) of the picture in a file, of which no more is read. Raises InputError as load_radiance()."""
    with _opened(path) as (file, suffix):
        if suffix == ".png":
            return read_header(file, MAX_PIXELS)[:2]
        height, width, _ = read_shape(file, "radiance", _check_array, _MAX_ARRAY)
        return width, height


def load_radiance(path: str | os.PathLike[str]) -> NDArray[Any] | Levels:
    """The linear radiance (H, W, 3) in a file: the array `radiance` of an `.npz`, or an opaque `.png`, taken for sRGB.

    Its rows are read by slices. A PNG may have 8 or 16 bits, of colour or grey. Raises InputError, which begins with
    the file's name.
    """
    with _opened(path) as (file, suffix):
        return _from_png(file) if suffix == ".png" else _from_npz(file)


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[tuple[IO[bytes], str]]:
    """A picture's file and its suffix. Errors in the block are about the file: they begin with its name."""
    path = check_path(path, "path")
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"expected a file that ends in {' or '.join(SUFFIXES)}", file=str(path))
    try:
        with opened(path) as file:
            if (size := os.fstat(file.fileno()).st_size) > (most := _MAX_BYTES[suffix]):
                raise InputError(f"expected a file of at most {most} bytes, got {size}")
            yield file, suffix
    except OSError as error:
        reason = f"expected a picture that can be read: {error.strerror or error}{did_you_mean_file(path)}"
        raise InputError(reason, file=str(path)) from None
    except InputError as error:
        raise error.at(path) from None


def _from_npz(file: IO[bytes]) -> NDArray[Any]:
    [picture] = read_arrays(file, lambda names: ["radiance"], _check_array, _MAX_ARRAY).values()
    check_radiance(picture, "radiance")
    return picture


def _check_array(name: str, shape: tuple[int, ...], dtype: Any) -> None:
    if len(shape) != 3 or shape[2] != 3 or min(shape) < 1 or dtype.kind != "f":
        raise InputError(f"expected an array (H, W, 3) of floating-point numbers, got {shape} of {dtype}", name)
    _check_size(shape[1], shape[0])


def _check_size(width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        raise InputError(f"expected at most {MAX_PIXELS} pixels, got {width}x{height}")


def _from_png(file: IO[bytes]) -> Levels:
    deep = check_whole(file, MAX_PIXELS).bits == 16
    try:
        pixels = _deep(file) if deep else _plain(file)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # what damaged files can raise is not written down anywhere
        raise InputError(f"expected a PNG file: {' '.join(printable(str(error)).split())[:100]}") from None
    most = 65535 if deep else 255
    if pixels.shape[2] == 4 and (pixels[..., 3] != most).any():
        raise InputError("expected an opaque picture, got one with transparent pixels")
    return Levels(pixels[..., :3], linear(np.arange(most + 1) / most))


@contextmanager
def _undecoded(file: IO[bytes]) -> Iterator[ImageFile]:
    """A PNG, whose pixels are not read yet."""
    from PIL import Image

    file.seek(0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # its size is known to be right
        picture = Image.open(file, formats=["PNG"])
    with picture:
        yield picture


def _plain(file: IO[bytes]) -> NDArray[Any]:
    """The pixels (H, W, 4) of a PNG with 8 bits or less."""
    with _undecoded(file) as picture:
        if picture.mode == "P" and picture.palette:
            colours = len(picture.palette.palette) // 3  # before the pixels are there, which fill the palette up
            if np.asarray(picture).max() >= colours:
                raise InputError(f"expected a PNG file: a pixel has none of the palette's {colours} colours")
        return np.asarray(picture.convert("RGBA"))


def _deep(file: IO[bytes]) -> NDArray[Any]:
    """The pixels (H, W, 3 or 4) of a PNG with 16 bits.

    Pillow keeps the first 8 bits of colours, the upper ones. By another layout the lower ones are first.
    """
    with _undecoded(file) as picture:
        layout = str(picture.tile[0][3])
        if "transparency" in picture.info or layout not in ("RGB;16B", "RGBA;16B", "I;16B"):
            raise InputError(f"expected RGB, RGBA or grey of 16 bits without transparent pixels, got {layout}")
        if layout == "I;16B":
            return np.repeat(np.asarray(picture)[..., None], 3, axis=2)
        upper = np.asarray(picture).astype(np.uint16)
    with _undecoded(file) as picture:
        codec, box, offset, _ = picture.tile[0]
        picture.tile = [(codec, box, offset, layout.replace("16B", "16L"))]  # pyright: ignore[reportAttributeAccessIssue]
        upper <<= 8  # in place, as all of this is large
        upper |= np.asarray(picture)
        return upper
