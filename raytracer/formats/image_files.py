"""Picture files: the formats by suffix, and reading of untrusted pictures.

To add a format, add a module with `write`, `read_size`, `read_picture` and `read_metadata`, and an entry in FORMATS.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, NamedTuple, Protocol

from numpy.typing import NDArray

from raytracer.core.files import open_regular
from raytracer.core.output import check_output
from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path
from raytracer.formats import image_exr, image_npz, image_png
from raytracer.formats.exr_writer import ExrWriter
from raytracer.formats.png_chunks import PngWriter
from raytracer.formats.radiance import MAX_PIXELS, StoredPicture


class RowWriter(Protocol):
    """Writes a picture row by row, from the top."""

    def write_rows(self, pixels: NDArray[Any], /) -> None:
        """Write the next rows of pixels [rows, W, 3 or 4]."""
        ...

    def close(self, texts: Mapping[str, str], /) -> None:
        """Write the end of the file, with texts by name that only the finished picture has, if the format can."""
        ...


class RowFormat(NamedTuple):
    """The way to write a picture of a format row by row, so that it need not fit into memory.

    Attributes:
        encode: a function of (radiance, alpha or None) that returns pixels for the writer. If the format has `bits`,
            this function and `open` have a keyword `bits`.
        open: a function of (file, width, height, number of channels, texts by name) that begins a file.
    """

    encode: Callable[..., NDArray[Any]]
    open: Callable[..., RowWriter]


class ImageFormat(NamedTuple):
    """A picture format.

    Attributes:
        write: a function of (file, arrays by name, metadata) that writes a picture. If there are `bits`, it has a
            keyword `bits` for the number of bits per channel.
        needed: the names of the arrays that an image must have.
        optional: the names of the arrays that are written if the image has them.
        read_size: a function that returns (width, height) of an open file. It raises InputError for wrong bytes.
        read_picture: a function that returns the picture in an open file. It raises InputError for wrong bytes.
        read_metadata: a function that returns the texts of an open file by name. It raises InputError for wrong bytes
            and for a file that is cut off.
        most_bytes: the largest size of a file that is read, in bytes.
        is_clipped: whether the format clips radiance to [0, 1].
        bits: the numbers of bits per channel that can be written, the default first. Default: none, no choice.
        writing_bytes: the memory that writing takes besides the image's arrays, in bytes per pixel. Default: 0, as rows
            are written one after another.
        require: a function that raises InputError if the package is missing that the format needs. Default: none.
        rows: the way to write a picture row by row. None: there is none.
    """

    write: Callable[..., None]
    needed: tuple[str, ...]
    optional: tuple[str, ...]
    read_size: Callable[[IO[bytes]], tuple[int, int]]
    read_picture: Callable[[IO[bytes]], StoredPicture]
    read_metadata: Callable[[IO[bytes]], Mapping[str, str]]
    most_bytes: int
    is_clipped: bool
    bits: tuple[int, ...] = ()
    writing_bytes: int = 0
    require: Callable[[], object] | None = None
    rows: RowFormat | None = None

    @property
    def has_geometry(self) -> bool:
        """Whether a file contains depth, normals and materials."""
        return "depth" in self.needed or "depth" in self.optional


FORMATS: dict[str, ImageFormat] = {
    ".png": ImageFormat(
        write=image_png.write,
        needed=("radiance",),
        optional=("alpha",),
        read_size=image_png.read_size,
        read_picture=image_png.read_picture,
        read_metadata=image_png.read_metadata,
        most_bytes=16 * MAX_PIXELS,  # twice the uncompressed size of the largest picture, 4 channels of 16 bits
        is_clipped=True,
        bits=(8, 16),
        rows=RowFormat(image_png.encode_levels, PngWriter),
    ),
    ".npz": ImageFormat(
        write=image_npz.write,
        needed=("radiance", "depth", "normal", "material"),
        optional=("alpha", "samples", "error"),
        read_size=image_npz.read_size,
        read_picture=image_npz.read_picture,
        read_metadata=image_npz.read_metadata,
        most_bytes=2**31 - 1,  # for 2 GB and more NumPy writes a zip64 archive, which core/npz.py does not read
        is_clipped=False,
    ),
    ".exr": ImageFormat(
        write=image_exr.write,
        needed=("radiance",),
        optional=("alpha", "depth", "planar_depth", "normal", "material", "samples", "error"),
        read_size=image_exr.read_size,
        read_picture=image_exr.read_picture,
        read_metadata=image_exr.read_metadata,
        most_bytes=2**31 - 1,  # as for .npz: more than the uncompressed size of all our channels of the largest picture
        is_clipped=False,
        writing_bytes=4 * 12,  # a copy of each channel
        require=image_exr.require,
        rows=RowFormat(image_exr.join_channels, ExrWriter),
    ),
}


def check_picture_output(
    path: str | os.PathLike[str], bits: int | None = None, suffixes: Iterable[str] | None = None
) -> Path:
    """Return `path` if a picture of that format can be written there, with `bits` per channel.

    Args:
        path: the file.
        bits: the number of bits per channel. None: the default of the format.
        suffixes: the accepted suffixes. Default: all formats.

    Raises:
        InputError: another suffix, a path that cannot be written to, other bits, or a missing package.
    """
    path = check_output(path, [*(FORMATS if suffixes is None else suffixes)])
    suffix = path.suffix.lower()
    check_bits(suffix, bits)
    if require := FORMATS[suffix].require:
        require()
    return path


def check_bits(suffix: str, bits: int | None) -> dict[str, int]:
    """Return the keywords of `bits` for the function `write` of a format. Raises InputError for other bits."""
    if bits is None:
        return {}
    known = FORMATS[suffix].bits
    if not known:
        with_bits = " or ".join(name for name, form in FORMATS.items() if form.bits)
        raise InputError(f"expected no bits for {suffix}; only {with_bits} has a choice", "bits")
    if not isinstance(bits, int) or isinstance(bits, bool) or bits not in known:
        raise InputError(f"expected {' or '.join(map(str, known))}, got {format_value(bits)}", "bits")
    return {"bits": bits}


def read_size(path: str | os.PathLike[str]) -> tuple[int, int]:
    """Read only the (width, height) of a picture file. Raises InputError as load_picture() does."""
    with _open_picture(path) as (file, form):
        return form.read_size(file)


def load_picture(path: str | os.PathLike[str]) -> StoredPicture:
    """Read the linear radiance of a picture file [H, W, 3], and its alpha [H, W] unless all pixels are opaque.

    Args:
        path: an .npz file with an array `radiance`, an .exr file with channels R, G and B, or a .png file (sRGB, colour
            or grey, 8 or 16 bits).

    Raises:
        InputError: the file cannot be read, or contains something else. The message begins with the file's name.
    """
    with _open_picture(path) as (file, form):
        return form.read_picture(file)


def read_metadata(path: str | os.PathLike[str]) -> Mapping[str, str]:
    """Read the texts of a picture file, by name.

    Raises InputError as load_picture() does, and for a file that is cut off.
    """
    with _open_picture(path) as (file, form):
        return form.read_metadata(file)


@contextmanager
def _open_picture(path: str | os.PathLike[str]) -> Iterator[tuple[IO[bytes], ImageFormat]]:
    """Open a picture file; the value is (file, format). Errors raised in the block get the file's name."""
    path = check_path(path, "path")
    form = FORMATS.get(path.suffix.lower())
    if form is None:
        raise InputError(f"expected a file that ends in {' or '.join(FORMATS)}", file=str(path))
    try:
        with open_regular(path) as file:
            if (size := os.fstat(file.fileno()).st_size) > form.most_bytes:
                raise InputError(f"expected a file of at most {form.most_bytes} bytes, got {size}")
            yield file, form
    except OSError as error:
        reason = f"expected a picture that can be read: {error.strerror or error}{did_you_mean_file(path)}"
        raise InputError(reason, file=str(path)) from None
    except InputError as error:
        raise error.at(path) from None
