"""Metrics of how far two pictures are apart, in linear radiance.

A new metric is a field of Comparison and an entry of METRICS, which say how the number is measured and shown. The
option, the JSON and the table of `raytracer compare` follow from them. `compare` gets a keyword for a metric that is
measured only where a caller asks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.core.arrays import number_array
from raytracer.core.record import Record, public
from raytracer.core.validation import MAX_SIDE, InputError, Keys, check_choice, number, vector
from raytracer.formats.image import Image
from raytracer.formats.radiance import MAX_RADIANCE, check_radiance, row_blocks
from raytracer.formats.srgb import decode_srgb
from raytracer.version import __version__

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


@public
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
    """Measure how far the picture `a` is from the reference `b`, Images or arrays (H, W, 3) of linear radiance.

    `threshold`: above which difference of a channel a pixel counts in `over`; linear radiance. Default: 0.01.
    `flip`: with FLIP, of what is within [0, 1] ("ldr"), or at all exposures at which the reference can be looked
    at ("hdr"; Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images"). It needs the package
    flip-evaluator. Raises InputError for pictures that are no such arrays, of two sizes or not finite, for a threshold
    below 0, and if that package is missing.
    """
    threshold = number(threshold, "threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    if flip is not None:
        check_choice(flip, "flip", ("ldr", "hdr"), expected="ldr, hdr or None")
    asked, span = ((), "ldr") if flip is None else (("flip",), flip)
    return measure_difference(_picture(a, "a"), _picture(b, "b"), threshold, asked, span)


class PictureRows(Protocol):
    """A picture (H, W, 3) of finite linear radiance, of which rows are read by a slice: an array, or a file's."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    def __getitem__(self, rows: slice, /) -> NDArray[Any]: ...


# The radiance that counts: within [0, 1], as a screen shows it, or all.
Span = Literal["ldr", "hdr"]


class Metric(NamedTuple):
    """A metric: the field of a Comparison with its value, and `row`, a label and the value as text.

    A metric with `measure` is measured only where a caller asks, of whole pictures; `help` is the text of its option.
    """

    field: str
    row: Callable[[Comparison], tuple[str, str]]
    help: str = ""
    measure: Callable[[PictureRows, PictureRows, Span], float] | None = None


def measure_difference(
    a: PictureRows, b: PictureRows, threshold: float, asked: Collection[str] = (), span: Span = "ldr"
) -> Comparison:
    """Compare checked pictures by all metrics that are always measured, and by those whose fields are `asked` for.

    Without the latter, only some rows of the pictures are in memory at a time. Raises InputError for pictures of two
    sizes, and if a package that a metric needs is missing.
    """
    if a.shape != b.shape:
        raise InputError(f"expected pictures of one size, got {size_of(a)} and {size_of(b)}")
    height, width, _ = a.shape
    squares, level, largest, pixel, over = [], [], -1.0, (0, 0), 0
    for rows in row_blocks(a.shape):
        reference = np.asarray(b[rows], np.float64)
        off = np.abs(np.asarray(a[rows], np.float64) - reference)
        squares.append(np.sum(off**2))
        level.append(np.sum(reference**2))
        off = off.max(axis=2)
        if (most := float(off.max())) > largest:  # the first of equal ones
            y, x = divmod(int(off.argmax()), width)
            largest, pixel = most, (x, rows.start + y)
        over += int(np.count_nonzero(off > threshold))
    rmse, root = (math.sqrt(math.fsum(sums) / (3 * height * width)) for sums in (squares, level))
    return Comparison(
        rmse=rmse,
        largest=largest,
        pixel=pixel,
        psnr=-20.0 * math.log10(rmse) if rmse else math.inf,
        relative=rmse / root if root else None,
        threshold=threshold,
        over=over / (height * width),
        **{metric.field: metric.measure(a, b, span) for metric in METRICS if metric.measure and metric.field in asked},
    )


def as_json(comparison: Comparison) -> dict[str, Any]:
    """All fields of a comparison; an infinite one is None, as JSON has no infinity."""
    fields = {name: getattr(comparison, name) for name in comparison.__struct_fields__}
    return {name: None if value == math.inf else value for name, value in fields.items()}


def as_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """A label and a text for each metric that was measured."""
    asked = [metric for metric in METRICS if not metric.measure or getattr(comparison, metric.field) is not None]
    return [metric.row(comparison) for metric in asked]


def difference(a: PictureRows, b: PictureRows) -> Image:
    """The picture of where `a` and `b` differ: by SCALE."""
    radiance = np.empty(a.shape, np.float32)
    for rows in row_blocks(a.shape):
        off = np.abs(np.asarray(a[rows], np.float64) - b[rows]).max(axis=2)
        level = np.log10(np.clip(off, DARKEST, BRIGHTEST) / DARKEST) / math.log10(BRIGHTEST / DARKEST)
        radiance[rows] = decode_srgb(level)[..., None]
    about = {"Title": "difference", "Description": SCALE, "Software": f"raytracer {__version__}"}
    return Image(radiance, metadata=about)


def size_of(picture: PictureRows) -> str:
    """Write a picture's size as in 320x180."""
    height, width = picture.shape[:2]
    return f"{width}x{height}"


def _picture(values: Image | ArrayLike, name: str) -> NDArray[Any]:
    expected = "an Image, or an array (H, W, 3) of numbers"
    picture = number_array(values, name, MAX_SIDE, _row, expected)
    if picture.ndim != 3 or picture.shape[2] != 3 or not picture.size:
        raise InputError(f"expected {expected}, got {picture.shape} of {picture.dtype}", name)
    check_radiance(picture, name)
    return picture


def _row(values: Any, keys: Keys) -> NDArray[Any]:
    return number_array(values, keys, MAX_SIDE, _pixel)


def _pixel(values: Any, keys: Keys) -> tuple[float, float, float]:
    return vector(values, keys, -MAX_RADIANCE, MAX_RADIANCE, "3 finite numbers (linear RGB)")


def _flip(a: PictureRows, b: PictureRows, span: Span) -> float:
    try:
        import flip_evaluator
    except ImportError:
        raise InputError(
            "FLIP needs flip-evaluator, which is not installed: pip install 'roth-raytracer[flip]'"
        ) from None
    # It takes no negative radiance, and no pictures that are not contiguous.
    most = 1.0 if span == "ldr" else MAX_RADIANCE
    test, reference = (np.ascontiguousarray(np.clip(picture[:], 0.0, most), np.float32) for picture in (a, b))
    exposures = {"startExposure": 0.0, "stopExposure": 0.0} if span == "hdr" and reference.max() < _DARK else {}
    _, mean, _ = flip_evaluator.evaluate(
        reference, test, span.upper(), inputsRGB=False, applyMagma=False, parameters=exposures
    )
    return float(mean)


def _largest_row(comparison: Comparison) -> tuple[str, str]:
    x, y = comparison.pixel
    return "largest", f"{comparison.largest:.3g}" + (f", in the pixel ({x}, {y})" if comparison.largest else "")


def _relative_row(comparison: Comparison) -> tuple[str, str]:
    black = comparison.relative is None
    return "relative", "the reference is black" if black else f"{comparison.relative:.3g}"


METRICS = (
    Metric("rmse", lambda c: ("RMSE", f"{c.rmse:.3g}")),
    Metric("largest", _largest_row),
    Metric("psnr", lambda c: ("PSNR", f"{c.psnr:.1f} dB")),
    Metric("relative", _relative_row),
    Metric("over", lambda c: (f"over {c.threshold:g}", f"{100.0 * c.over:.3g} % of the pixels")),
    Metric(
        "flip",
        lambda c: ("FLIP", f"{c.flip:.3g}"),
        "FLIP, too, of high dynamic range for two .npz (needs flip-evaluator)",
        _flip,
    ),
)
