"""Error metrics: the differences between a picture and a reference, in linear radiance.

To add a metric, add a field to Comparison and an entry to METRICS, from which `raytracer compare` takes its table, its
JSON and its options. A metric that is measured only on request also needs a keyword of `compare`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.core.arrays import number_array
from raytracer.core.record import Record, public
from raytracer.core.suggest import install_command, missing_extra
from raytracer.core.validation import MAX_SIDE, InputError, Keys, check_choice, number, vector
from raytracer.formats.image import Image
from raytracer.formats.radiance import MAX_RADIANCE, check_radiance, row_blocks

# A visible difference: one of 255 sRGB levels near white, three in middle grey.
THRESHOLD = 0.01
# FLIP for high dynamic range computes exposures from the reference's luminance, and ends the process if no luminance
# reaches 1.2e-7. A channel of 1e-5 has more luminance, even if it is blue. Below, _flip() sets the exposures.
_DARK = 1e-5


@public
class Comparison(Record, frozen=True):
    """The differences between a picture and a reference, in linear radiance.

    Attributes:
        rmse: The root mean square difference over all pixels and channels.
        largest: The largest difference of a channel.
        pixel: The pixel with the largest difference: (x, y) from the top left.
        psnr: The peak signal-to-noise ratio, 20 log10(1 / rmse), in dB; inf if rmse is 0.
        relative: rmse divided by the root mean square of the reference; None if the reference is black.
        threshold: The difference above which a pixel counts in `over`.
        over: The share of pixels with a channel that differs by more than `threshold`.
        flip: The mean of FLIP's error map, 0 to 1 (Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating
            Images"); None unless the caller requested it.
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
    """Measure the differences between a picture and a reference.

    Args:
        a: The picture: an Image, or an array (H, W, 3) of linear radiance.
        b: The reference, of the same size.
        threshold: A pixel counts in `over` if a channel differs by more. Linear radiance. Default: 0.01.
        flip: Measure FLIP, too, of radiance within [0, 1] ("ldr"), or at all exposures that suit the reference ("hdr";
            Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images"). It needs the package
            flip-evaluator. Default: None.

    Raises InputError for other arrays, for pictures of two sizes, for numbers that are not finite, for a threshold
    below 0, and if flip-evaluator is not installed.
    """
    threshold = number(threshold, "threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    if flip is not None:
        check_choice(flip, "flip", ("ldr", "hdr"), expected="ldr, hdr or None")
    requested, span = ((), "ldr") if flip is None else (("flip",), flip)
    return measure_difference(_picture(a, "a"), _picture(b, "b"), threshold, requested, span)


class PictureRows(Protocol):
    """A picture (H, W, 3) of finite linear radiance that is read by slices of rows: an array, or an open file."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    def __getitem__(self, rows: slice, /) -> NDArray[Any]: ...


# The range of radiance that FLIP compares: [0, 1], as a screen shows it, or all of it.
Span = Literal["ldr", "hdr"]


class Metric(NamedTuple):
    """A metric of the table that `raytracer compare` prints.

    Attributes:
        field: The field of Comparison that holds the value.
        row: Returns the label and the value as text.
        help: The help text of the metric's option.
        measure: Measures whole pictures. A metric with `measure` is measured only on request.
    """

    field: str
    row: Callable[[Comparison], tuple[str, str]]
    help: str = ""
    measure: Callable[[PictureRows, PictureRows, Span], float] | None = None


def measure_difference(
    a: PictureRows, b: PictureRows, threshold: float, requested: Collection[str] = (), span: Span = "ldr"
) -> Comparison:
    """Measure the differences between two checked pictures.

    `requested` lists the fields of metrics to measure in addition to the default ones. Without `requested`, only some
    rows of the pictures are in memory at a time. Raises InputError for pictures of two sizes, and if a metric's package
    is not installed.
    """
    if a.shape != b.shape:
        raise InputError(f"expected pictures of one size, got {size_text(a)} and {size_text(b)}")
    height, width, _ = a.shape
    squares, level, largest, pixel, over = [], [], -1.0, (0, 0), 0
    for rows in row_blocks(a.shape):
        reference = np.asarray(b[rows], np.float64)
        off = np.abs(np.asarray(a[rows], np.float64) - reference)
        squares.append(np.sum(off**2))
        level.append(np.sum(reference**2))
        off = off.max(axis=2)
        if (most := float(off.max())) > largest:  # of equal differences, the first counts
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
        **{m.field: m.measure(a, b, span) for m in METRICS if m.measure and m.field in requested},
    )


def as_json(comparison: Comparison) -> dict[str, Any]:
    """Return all fields of a comparison by name. An infinite value becomes None, because JSON has no infinity."""
    fields = {name: getattr(comparison, name) for name in comparison.__struct_fields__}
    return {name: None if value == math.inf else value for name, value in fields.items()}


def as_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """Return a label and a text for each metric that was measured."""
    measured = [metric for metric in METRICS if not metric.measure or getattr(comparison, metric.field) is not None]
    return [metric.row(comparison) for metric in measured]


def size_text(picture: PictureRows) -> str:
    """Return a picture's size as text, such as 320x180."""
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
        raise InputError(missing_extra("FLIP needs", "flip-evaluator", "flip")) from None
    # FLIP accepts no negative radiance and only contiguous arrays.
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
        "also measure FLIP; for two .npz files in high dynamic range. Needs flip-evaluator: "
        f"{install_command('flip')} in the checkout.",
        _flip,
    ),
)
