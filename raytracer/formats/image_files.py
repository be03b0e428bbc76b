"""Picture files: the formats by suffix, and reading of untrusted pictures.

To add a format, add a module with `write`, `read_size`, `read_radiance` and `read_metadata`, and an entry in FORMATS.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import IO, Any, NamedTuple

from numpy.typing import NDArray

from raytracer.core.files import open_regular
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path
from raytracer.formats import image_npz, image_png
from raytracer.formats.radiance import MAX_PIXELS


class ImageFormat(NamedTuple):
    """A picture format.

    Attributes:
        write: a function of (file, arrays by name, metadata) that writes a picture.
        needed: the names of the arrays that an image must have.
        optional: the names of the arrays that are written if the image has them.
        read_size: a function that returns (width, height) of an open file. It raises InputError for wrong bytes.
        read_radiance: a function that returns the linear radiance of an open file [H, W, 3], whose rows are read by
            slices. It raises InputError for wrong bytes.
        read_metadata: a function that returns the texts of an open file by name. It raises InputError for wrong bytes
            and for a file that is cut off.
        most_bytes: the largest size of a file that is read, in bytes.
        is_clipped: whether the format clips radiance to [0, 1].
    """

    write: Callable[[IO[bytes], Mapping[str, NDArray[Any]], Mapping[str, str]], None]
    needed: tuple[str, ...]
    optional: tuple[str, ...]
    read_size: Callable[[IO[bytes]], tuple[int, int]]
    read_radiance: Callable[[IO[bytes]], NDArray[Any] | image_png.Levels]
    read_metadata: Callable[[IO[bytes]], Mapping[str, str]]
    most_bytes: int
    is_clipped: bool

    @property
    def has_geometry(self) -> bool:
        """Whether a file contains depth, normals and materials."""
        return "depth" in self.needed


FORMATS: dict[str, ImageFormat] = {
    ".png": ImageFormat(
        write=image_png.write,
        needed=("radiance",),
        optional=(),
        read_size=image_png.read_size,
        read_radiance=image_png.read_radiance,
        read_metadata=image_png.read_metadata,
        most_bytes=16 * MAX_PIXELS,  # twice the uncompressed size of the largest picture, 4 channels of 16 bits
        is_clipped=True,
    ),
    ".npz": ImageFormat(
        write=image_npz.write,
        needed=("radiance", "depth", "normal", "material"),
        optional=("samples", "error"),
        read_size=image_npz.read_size,
        read_radiance=image_npz.read_radiance,
        read_metadata=image_npz.read_metadata,
        most_bytes=2**31 - 1,  # for 2 GB and more NumPy writes a zip64 archive, which core/npz.py does not read
        is_clipped=False,
    ),
}


def read_size(path: str | os.PathLike[str]) -> tuple[int, int]:
    """Read only the (width, height) of a picture file. Raises InputError as load_radiance() does."""
    with _open_picture(path) as (file, form):
        return form.read_size(file)


def load_radiance(path: str | os.PathLike[str]) -> NDArray[Any] | image_png.Levels:
    """Read the linear radiance of a picture file [H, W, 3], whose rows are read by slices.

    Args:
        path: an .npz file with an array `radiance`, or an opaque .png file (sRGB, colour or grey, 8 or 16 bits).

    Raises:
        InputError: the file cannot be read, or contains something else. The message begins with the file's name.
    """
    with _open_picture(path) as (file, form):
        return form.read_radiance(file)


def read_metadata(path: str | os.PathLike[str]) -> Mapping[str, str]:
    """Read the texts of a picture file, by name.

    Raises InputError as load_radiance() does, and for a file that is cut off.
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
