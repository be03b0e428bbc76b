"""Picture files: the format of each suffix, and the size and the radiance of a picture that anyone may have made.

A new format is a module with `write`, `read_size` and `read_radiance`, and an entry in FORMATS.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import IO, Any, NamedTuple

from numpy.typing import NDArray

from raytracer.core.files import opened
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path
from raytracer.formats import image_npz, image_png
from raytracer.formats.radiance import MAX_PIXELS


class ImageFormat(NamedTuple):
    """The way in which pictures are written to files with one suffix, and read from them.

    `write(file, arrays, metadata)` writes the arrays of an image that are in `needed`, all of which an image must have,
    and in `optional`. `read_size(file)` is (width, height), and `read_radiance(file)` the linear radiance (H, W, 3), of
    which rows are read by slices; both raise InputError, and may be given any bytes. `most_bytes`: of a file that is
    read. `is_clipped`: whether a file holds nothing outside [0, 1].
    """

    write: Callable[[IO[bytes], Mapping[str, NDArray[Any]], Mapping[str, str]], None]
    needed: tuple[str, ...]
    optional: tuple[str, ...]
    read_size: Callable[[IO[bytes]], tuple[int, int]]
    read_radiance: Callable[[IO[bytes]], NDArray[Any] | image_png.Levels]
    most_bytes: int
    is_clipped: bool

    @property
    def has_geometry(self) -> bool:
        """Whether a file holds what each pixel sees."""
        return "depth" in self.needed


FORMATS: dict[str, ImageFormat] = {
    ".png": ImageFormat(
        write=image_png.write,
        needed=("radiance",),
        optional=(),
        read_size=image_png.read_size,
        read_radiance=image_png.read_radiance,
        most_bytes=16 * MAX_PIXELS,  # the pixels take at most half of this
        is_clipped=True,
    ),
    ".npz": ImageFormat(
        write=image_npz.write,
        needed=("radiance", "depth", "normal", "material"),
        optional=("samples", "error"),
        read_size=image_npz.read_size,
        read_radiance=image_npz.read_radiance,
        most_bytes=2**31 - 1,  # from 2 GB on NumPy writes another kind of archive
        is_clipped=False,
    ),
}


def read_size(path: str | os.PathLike[str]) -> tuple[int, int]:
    """Read (width, height) of the picture in a file, and no more of it. Raises InputError as load_radiance()."""
    with _opened(path) as (file, form):
        return form.read_size(file)


def load_radiance(path: str | os.PathLike[str]) -> NDArray[Any] | image_png.Levels:
    """Read the linear radiance (H, W, 3) in a file: the array `radiance` of an `.npz`, or an opaque `.png`, as sRGB.

    Its rows are read by slices. A PNG may have 8 or 16 bits, of colour or grey. Raises InputError, which begins with
    the file's name.
    """
    with _opened(path) as (file, form):
        return form.read_radiance(file)


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[tuple[IO[bytes], ImageFormat]]:
    """A picture's file and its format. Errors in the block are about the file: they begin with its name."""
    path = check_path(path, "path")
    form = FORMATS.get(path.suffix.lower())
    if form is None:
        raise InputError(f"expected a file that ends in {' or '.join(FORMATS)}", file=str(path))
    try:
        with opened(path) as file:
            if (size := os.fstat(file.fileno()).st_size) > form.most_bytes:
                raise InputError(f"expected a file of at most {form.most_bytes} bytes, got {size}")
            yield file, form
    except OSError as error:
        reason = f"expected a picture that can be read: {error.strerror or error}{did_you_mean_file(path)}"
        raise InputError(reason, file=str(path)) from None
    except InputError as error:
        raise error.at(path) from None
