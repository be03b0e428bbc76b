"""Pictures as `.png` files: written as 8-bit sRGB, read with 8 or 16 bits per channel, colour or grey.

Pillow reads pictures but does not write them: importing Pillow, and its search for the best filter of each row, take
longer than writing the file here.
"""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raytracer.core.shown import escape_unprintable
from raytracer.core.validation import InputError
from raytracer.formats.png_chunks import SIGNATURE, check_whole, read_header, read_texts
from raytracer.formats.radiance import MAX_PIXELS, row_blocks
from raytracer.formats.srgb import decode_srgb, encode_srgb8

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile


# The colour type of pictures with red, green, blue and alpha.
_RGBA = 6


class Levels:
    """The radiance of a PNG, stored as integer levels [H, W, 3] and a table of each level's radiance.

    The levels take an eighth (8 bits) or a quarter (16 bits) of the radiance's memory. A slice of rows returns float64
    radiance, like an array.
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


def write(file: IO[bytes], arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> None:
    """Write the array `radiance` as PNG (8-bit sRGB), with the metadata as text (ISO/IEC 15948)."""
    radiance = arrays["radiance"]
    height, width = radiance.shape[:2]
    file.write(SIGNATURE)
    _write_chunk(file, b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0))  # 8 bits, RGB
    for key, value in metadata.items():
        _write_chunk(file, b"iTXt", key.encode("latin-1") + bytes(5) + value.encode())  # plain, no language
    # Run-length encoding suits the filtered rows: differences to the left neighbour are runs of zeros in flat areas.
    compressor = zlib.compressobj(strategy=zlib.Z_RLE)
    for rows in row_blocks(radiance.shape):
        pixels = encode_srgb8(radiance[rows]).reshape(-1, 3 * width)
        filtered = np.ones((len(pixels), 1 + 3 * width), np.uint8)  # a row begins with its filter type: 1 is "Sub"
        filtered[:, 1:4] = pixels[:, :3]
        np.subtract(pixels[:, 3:], pixels[:, :-3], out=filtered[:, 4:])
        if data := compressor.compress(filtered.data):
            _write_chunk(file, b"IDAT", data)
    _write_chunk(file, b"IDAT", compressor.flush())
    _write_chunk(file, b"IEND", b"")


def _write_chunk(file: IO[bytes], kind: bytes, data: bytes) -> None:
    file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))


def read_size(file: IO[bytes]) -> tuple[int, int]:
    """Read only the (width, height) of a picture. Raises InputError."""
    return read_header(file, MAX_PIXELS)[:2]


def read_metadata(file: IO[bytes]) -> dict[str, str]:
    """Return the texts of a PNG file by their names. Raises InputError for a damaged or incomplete file."""
    check_whole(file, MAX_PIXELS)
    return read_texts(file)


def read_radiance(file: IO[bytes]) -> Levels:
    """Read an opaque picture with up to 16 bits per channel. Raises InputError."""
    is_16_bit = check_whole(file, MAX_PIXELS).bits == 16
    try:
        pixels = _pixels16(file) if is_16_bit else _pixels8(file)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # Pillow does not document the errors that damaged files cause
        raise InputError(f"expected a PNG file: {' '.join(escape_unprintable(str(error)).split())[:100]}") from None
    top_level = 65535 if is_16_bit else 255
    if pixels.shape[2] == 4 and (pixels[..., 3] != top_level).any():
        raise InputError("expected an opaque picture, got one with transparent pixels")
    return Levels(pixels[..., :3], decode_srgb(np.arange(top_level + 1) / top_level))


def read_pixels(file: IO[bytes]) -> NDArray[np.uint8]:
    """Return the pixels of a PNG with 8 bits per channel: sRGB [H, W, 3], or [H, W, 4] with alpha.

    Raises InputError for another file.
    """
    header = check_whole(file, MAX_PIXELS)
    if header.bits != 8:
        raise InputError(f"expected 8 bits per channel, got {header.bits}")
    return _pixels8(file)[..., : 4 if header.colour == _RGBA else 3]


@contextmanager
def _open_undecoded(file: IO[bytes]) -> Iterator[ImageFile]:
    """Open a PNG with Pillow, which does not read the pixels yet."""
    from PIL import Image

    file.seek(0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # check_whole() has checked the size
        picture = Image.open(file, formats=["PNG"])
    with picture:
        yield picture


def _pixels8(file: IO[bytes]) -> NDArray[Any]:
    """Return the RGBA pixels [H, W, 4] of a PNG with 8 bits per channel or less."""
    with _open_undecoded(file) as picture:
        if picture.mode == "P" and picture.palette:
            colours = len(picture.palette.palette) // 3  # counted before Pillow reads the pixels and pads the palette
            if np.asarray(picture).max() >= colours:
                raise InputError(f"expected a PNG file: a pixel has none of the palette's {colours} colours")
        return np.asarray(picture.convert("RGBA"))


def _pixels16(file: IO[bytes]) -> NDArray[Any]:
    """Return the pixels [H, W, 3 or 4] of a PNG with 16 bits per channel.

    Pillow returns only the first byte of each colour channel, the upper one. So the file is decoded twice: with the
    opposite byte order in Pillow's layout string, the first byte is the lower one.
    """
    with _open_undecoded(file) as picture:
        layout = str(picture.tile[0][3])
        if "transparency" in picture.info or layout not in ("RGB;16B", "RGBA;16B", "I;16B"):
            raise InputError(f"expected RGB, RGBA or grey of 16 bits without transparent pixels, got {layout}")
        if layout == "I;16B":
            return np.repeat(np.asarray(picture)[..., None], 3, axis=2)
        upper = np.asarray(picture).astype(np.uint16)
    with _open_undecoded(file) as picture:
        codec, box, offset, _ = picture.tile[0]
        picture.tile = [(codec, box, offset, layout.replace("16B", "16L"))]  # pyright: ignore[reportAttributeAccessIssue]
        upper <<= 8  # in place, because the arrays are large
        upper |= np.asarray(picture)
        return upper
