"""The finished picture: linear radiance and what each pixel sees; sRGB; files."""

from __future__ import annotations

import io
import itertools
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from raytracer.checks import InputError

SUFFIXES = (".png", ".npz")
# Rows are encoded this many values at a time, so that no temporary is as large as the picture.
_BLOCK = 4_000_000


def srgb8(radiance: NDArray[Any]) -> NDArray[np.uint8]:
    """Linear RGB (H, W, 3), clipped to [0, 1], by the sRGB transfer function (IEC 61966-2-1:1999) to 8 bits."""
    encoded = np.empty(radiance.shape, np.uint8)
    rows = max(1, _BLOCK // max(1, radiance[:1].size))
    for start in range(0, len(radiance), rows):
        linear = np.clip(radiance[start : start + rows], 0.0, 1.0)
        curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        encoded[start : start + rows] = curve * 255.0 + 0.5
    return encoded


@dataclass(frozen=True)
class Image:
    """A rendered picture. All arrays have the top row first.

    `radiance` is (H, W, 3) float32, linear RGB. The others are those of each pixel's centre ray,
    or None if they were not asked for: `depth` (H, W) float32, the distance along the unit ray,
    inf where nothing was hit; `normal` (H, W, 3) float32, unit, world space, towards the viewer's
    side, 0 where nothing was hit; `material` (H, W) int32, index into `Scene.materials`, -1 where
    nothing was hit. The reference's images are float64. `metadata` goes into PNG files as text.
    """

    radiance: NDArray[Any]
    depth: NDArray[Any] | None = None
    normal: NDArray[Any] | None = None
    material: NDArray[np.int32] | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        return f"<Image {width}x{height}>"

    def srgb8(self) -> NDArray[np.uint8]:
        """The picture as (H, W, 3) uint8, sRGB."""
        return srgb8(self.radiance)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a .png (8-bit sRGB) or .npz (the arrays), whole or not at all.

        Raises InputError for another suffix, a folder that is not there, or arrays that were not rendered.
        """
        path = check_output(path)
        if path.suffix.lower() == ".npz":
            arrays = {name: getattr(self, name) for name in ("radiance", "depth", "normal", "material")}
            missing = [name for name, array in arrays.items() if array is None]
            if missing:
                raise InputError(f"{path}: expected an image rendered with geometry=True, got none of {missing}")
            with written_whole(path) as file:
                np.savez(file, **arrays)
        else:
            with written_whole(path) as file:
                self.write_png(file)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        buffer = io.BytesIO()
        self.write_png(buffer)
        return buffer.getvalue()

    def write_png(self, file: IO[bytes]) -> None:
        """Write the picture as PNG (8-bit sRGB), with the metadata as text."""
        from PIL import Image as Pillow
        from PIL.PngImagePlugin import PngInfo

        text = PngInfo()
        for key, value in self.metadata.items():
            text.add_itxt(key, value)
        Pillow.fromarray(self.srgb8()).save(file, "PNG", pnginfo=text)


def check_output(path: str | os.PathLike[str]) -> Path:
    """`path` if a picture can be written there by its suffix and folder; InputError otherwise."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: expected an output that ends in {' or '.join(SUFFIXES)}")
    try:
        if path.is_dir():
            raise InputError(f"{path}: expected a file, got a folder")
        path.exists()  # raises where the name is longer than the file system takes
        check_folder(path.parent, path)
    except OSError as error:
        raise InputError(f"{path}: expected a place that can be written to: {error.strerror}") from None
    return path


def check_folder(folder: Path, path: Path | None = None) -> None:
    """Raise InputError, about `path` or else the folder, unless files can be written into `folder`."""
    try:
        if not folder.is_dir():
            raise InputError(f"{path or folder}: expected a folder that exists, got {folder}")
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{path or folder}: expected a place that can be written to: {error.strerror}") from None


@contextmanager
def written_whole(path: Path) -> Iterator[IO[Any]]:
    """A binary file that becomes `path` when the block ends well, and vanishes when it does not."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem[:40]}-", suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


@contextmanager
def written_new(stem: str, suffix: str) -> Iterator[tuple[Path, IO[Any]]]:
    """The first path of stem-1, stem-2, ... that is not there yet, and a binary file for it.

    The file vanishes when the block does not end well.
    """
    numbers = itertools.count(1)
    while True:
        path = Path(f"{stem}-{next(numbers)}{suffix}")
        with suppress(FileExistsError):
            file = path.open("xb")
            break
    try:
        with file:
            yield path, file
    except BaseException:
        path.unlink()
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
