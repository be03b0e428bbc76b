"""How far two pictures are apart, in linear radiance; and reading them from `.npz` and `.png` files."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer import __version__
from raytracer.checks import InputError, number, printable, shown
from raytracer.files import opened
from raytracer.film import Image, linear
from raytracer.npz import read_arrays, read_shape
from raytracer.png_file import check_whole, read_header
from raytracer.record import Record

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

Array = NDArray[np.float64]

SUFFIXES = (".npz", ".png")
# Of a picture that is read: 8K (7680x4320), as more would take gigabytes.
MAX_PIXELS = 2**25
# Of its file: from 2 GB on NumPy writes another kind of archive; a PNG's pixels take at most half of this.
_MAX_BYTES = {".npz": 2**31 - 1, ".png": 16 * MAX_PIXELS}
_MAX_ARRAY = 16 * 3 * MAX_PIXELS
# What float32 can hold: what a file has beyond was not rendered, and its square might be beyond float64.
_LARGEST = float(np.finfo(np.float32).max)
# A difference that is seen as one: 1/255 where the sRGB curve is steepest in the middle of its range.
THRESHOLD = 0.01
# The difference picture's scale in linear radiance: black, far less than 8 bits can show, and white, the peak.
DARKEST, BRIGHTEST = 1e-4, 1.0
SCALE = (
    f"the largest difference of a pixel's channels in linear radiance, grey by its logarithm: black {DARKEST:g} or "
    f"less, a quarter of the levels more for each factor of 10, white {BRIGHTEST:g} or more"
)
# FLIP for high dynamic range takes exposures from the reference's luminance, and ends the process where that is
# nowhere 1.2e-7. Of a channel that is 1e-5, be it blue, it is more; where none is, exposures are given.
_DARK = 1e-5


class Comparison(Record, frozen=True):
    """How far a picture is from a reference, in linear radiance.

    `rmse`: the root mean square difference over all pixels and channels. `largest`: the largest difference of a
    channel, and `pixel`, (x, y) from the top left, where it is. `psnr`: 20 log10(1 / rmse) in dB, inf where that is
    0. `relative`: rmse over the reference's root mean square; None where the reference is black. `over`: the share of
    pixels of which a channel differs by more than `threshold`. `flip`: the mean of FLIP's error map (Andersson et al.
    2020, "FLIP: A Difference Evaluator for Alternating Images"), 0 to 1, or None where it was not asked for.
    """

    rmse: float
    largest: float
    pixel: tuple[int, int]
    psnr: float
    relative: float | None
    threshold: float
    over: float
    flip: float | None = None


def compare(
    a: Image | ArrayLike,
    b: Image | ArrayLike,
    *,
    threshold: float = THRESHOLD,
    flip: Literal["ldr", "hdr"] | None = None,
) -> Comparison:
    """How far the picture `a` is from the reference `b`, each an Image, or an array (H, W, 3) of linear radiance.

    `threshold`: above which difference of a channel a pixel counts in `over`; linear radiance. Default: 0.01.
    `flip`: with FLIP, of what is within [0, 1] ("ldr"), or at all exposures at which the reference can be looked
    at ("hdr"; Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images"). It needs the package
    flip-evaluator. Raises InputError for pictures that are no such arrays, of two sizes or not finite, for a threshold
    below 0, and if that package is missing.
    """
    threshold = number(threshold, "threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    if flip not in (None, "ldr", "hdr"):
        raise InputError(f"flip: expected ldr, hdr or None, got {shown(flip)}")
    a, b = _picture(a, "a"), _picture(b, "b")
    if a.shape != b.shape:
        raise InputError(f"expected pictures of one size, got {size_of(a)} and {size_of(b)}")
    off = np.abs(a - b).max(axis=2)
    y, x = np.unravel_index(off.argmax(), off.shape)
    rmse, level = _rms(a - b), _rms(b)
    return Comparison(
        rmse=rmse,
        largest=float(off.max()),
        pixel=(int(x), int(y)),
        psnr=-20.0 * math.log10(rmse) if rmse else math.inf,
        relative=rmse / level if level else None,
        threshold=threshold,
        over=float(np.mean(off > threshold)),
        flip=_flip(a, b, flip) if flip else None,
    )


def difference(a: NDArray[Any], b: NDArray[Any]) -> Image:
    """The picture of where `a` and `b`, (H, W, 3) linear radiance, differ: by SCALE."""
    off = np.clip(np.abs(a - b).max(axis=2), DARKEST, BRIGHTEST)
    level = np.log10(off / DARKEST) / math.log10(BRIGHTEST / DARKEST)
    about = {"Title": "difference", "Description": SCALE, "Software": f"raytracer {__version__}"}
    return Image(np.repeat(linear(level)[..., None], 3, axis=2), metadata=about)


def size_of(picture: NDArray[Any]) -> str:
    """As in 320x180."""
    height, width = picture.shape[:2]
    return f"{width}x{height}"


def _picture(values: Image | ArrayLike, name: str) -> Array:
    expected = "an Image, or an array (H, W, 3) of numbers"
    try:
        picture = np.asarray(values)
    except ValueError:  # rows of different lengths
        raise InputError(f"{name}: expected {expected}, got {shown(values)}") from None
    if picture.ndim != 3 or picture.shape[2] != 3 or not picture.size or picture.dtype.kind not in "iuf":
        kind = shown(values) if picture.ndim == 0 else f"{picture.shape} of {picture.dtype}"
        raise InputError(f"{name}: expected {expected}, got {kind}")
    picture = np.asarray(picture, np.float64)
    if wrong := int(np.count_nonzero(~(np.abs(picture) <= _LARGEST))):  # NaN is not, either
        raise InputError(f"{name}: expected finite numbers within +-{_LARGEST:.2g}, got {wrong} others")
    return picture


def _rms(values: Array) -> float:
    return math.sqrt(np.mean(values**2))


def _flip(a: Array, b: Array, kind: Literal["ldr", "hdr"]) -> float:
    try:
        import flip_evaluator
    except ImportError:
        raise InputError(
            "FLIP needs flip-evaluator, which is not installed: pip install 'roth-raytracer[flip]'"
        ) from None
    # It takes no negative radiance, and no pictures that are not contiguous.
    most = 1.0 if kind == "ldr" else _LARGEST
    test, reference = (np.ascontiguousarray(np.clip(picture, 0.0, most), np.float32) for picture in (a, b))
    exposures = {"startExposure": 0.0, "stopExposure": 0.0} if kind == "hdr" and reference.max() < _DARK else {}
    _, mean, _ = flip_evaluator.evaluate(
        reference, test, kind.upper(), inputsRGB=False, applyMagma=False, parameters=exposures
    )
    return float(mean)


def size_in(path: str | os.PathLike[str]) -> tuple[int, int]:
    """(width, height) of the picture in a file, of which no more is read. Raises InputError as load_radiance()."""
    with _opened(path) as (file, suffix):
        if suffix == ".png":
            return read_header(file, MAX_PIXELS)[:2]
        height, width, _ = read_shape(file, "radiance", _check_array, _MAX_ARRAY)
        return width, height


def load_radiance(path: str | os.PathLike[str]) -> Array:
    """The linear radiance (H, W, 3) in a file: the array `radiance` of an `.npz`, or an opaque `.png`, taken for sRGB.

    A PNG may have 8 or 16 bits, of colour or grey. Raises InputError, which begins with the file's name.
    """
    with _opened(path) as (file, suffix):
        return _from_png(file) if suffix == ".png" else _from_npz(file)


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[tuple[IO[bytes], str]]:
    """A picture's file and its suffix. Errors in the block are about the file: they begin with its name."""
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: expected a file that ends in {' or '.join(SUFFIXES)}")
    try:
        with opened(path) as file:
            if (size := os.fstat(file.fileno()).st_size) > (most := _MAX_BYTES[suffix]):
                raise InputError(f"expected a file of at most {most} bytes, got {size}")
            yield file, suffix
    except OSError as error:
        raise InputError(f"{path}: expected a picture that can be read: {error.strerror or error}") from None
    except ValueError as error:  # InputError is one; so is what Python makes of a name with a null character
        raise InputError(f"{path}: {error}") from None


def _from_npz(file: IO[bytes]) -> Array:
    [picture] = read_arrays(file, lambda names: ["radiance"], _check_array, _MAX_ARRAY).values()
    return _picture(picture, "radiance")


def _check_array(name: str, shape: tuple[int, ...], dtype: Any) -> None:
    if len(shape) != 3 or shape[2] != 3 or min(shape) < 1 or dtype.kind != "f":
        raise InputError(f"{name}: expected an array (H, W, 3) of floating-point numbers, got {shape} of {dtype}")
    _check_size(shape[1], shape[0])


def _check_size(width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        raise InputError(f"expected at most {MAX_PIXELS} pixels, got {width}x{height}")


def _from_png(file: IO[bytes]) -> Array:
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
    # By a table, as linear() takes several times a large picture's memory.
    return linear(np.arange(most + 1) / most)[pixels[..., :3]]


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
        return np.asarray(picture.convert("RGBA"))


def _deep(file: IO[bytes]) -> NDArray[Any]:
    """The pixels (H, W, 3 or 4) of a PNG with 16 bits.

    Of colours Pillow keeps the upper 8: told that files have the lower ones first, it keeps these.
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
        return upper << 8 | np.asarray(picture)
