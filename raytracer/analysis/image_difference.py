"""Error metrics: the differences between a picture and a reference, in linear radiance.

To add a metric, add a field to Comparison and an entry to METRICS, from which `raytracer compare` takes its table, its
JSON and its options. A metric that is measured only on request also needs a keyword of `compare`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.core.arrays import number_array
from raytracer.core.record import Record, public
from raytracer.core.suggest import install_command, missing_extra
from raytracer.core.validation import MAX_SIDE, InputError, Keys, check_choice, number, vector
from raytracer.formats.image import Image
from raytracer.formats.image_files import FORMATS, load_picture
from raytracer.formats.radiance import MAX_RADIANCE, PictureRows, StoredPicture, check_radiance, row_blocks

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
        alpha: The root mean square difference of alpha, where an opaque picture has an alpha of 1; None if both
            pictures are opaque. The radiance of transparent pictures is compared premultiplied, as before black.
    """

    rmse: float
    largest: float
    pixel: tuple[int, int]
    psnr: float
    relative: float | None
    threshold: float
    over: float
    flip: float | None = None
    alpha: float | None = None


def compare(
    a: Image | ArrayLike | str | Path,
    b: Image | ArrayLike | str | Path,
    *,
    threshold: float = THRESHOLD,
    flip: Literal["ldr", "hdr"] | None = None,
) -> Comparison:
    """Measure the differences between a picture and a reference.

    Args:
        a: The picture: an Image, an array (H, W, 3) of linear radiance, or the path of a .png, .npz or .exr. If only
            one of the two is a .png, the other one is clipped to [0, 1], as every .png is.
        b: The reference, of the same size.
        threshold: A pixel counts in `over` if a channel differs by more. Linear radiance. Default: 0.01.
        flip: Measure FLIP, too, of radiance within [0, 1] ("ldr"), or at all exposures that suit the reference ("hdr";
            Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images"). It needs the package
            flip-evaluator. Default: None.

    Raises InputError for other arrays, for files that are no pictures, for pictures of two sizes, for numbers that are
    not finite, for a threshold below 0, and if flip-evaluator is not installed.
    """
    threshold = number(threshold, "threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    if flip is not None:
        check_choice(flip, "flip", ("ldr", "hdr"), expected="ldr, hdr or None")
    requested, span = ((), "ldr") if flip is None else (("flip",), flip)
    clipped = [_is_clipped(picture) for picture in (a, b)]
    pictures = [_picture(a, "a"), _picture(b, "b")]
    if clipped[0] != clipped[1]:
        pictures = [clip(picture) for picture in pictures]
    return measure_difference(*pictures, threshold, requested, span)


# The range of radiance that FLIP compares: [0, 1], as a screen shows it, or all of it.
Span = Literal["ldr", "hdr"]


class Metric(NamedTuple):
    """A metric of the table that `raytracer compare` prints.

    Attributes:
        field: The field of Comparison that holds the value.
        row: Returns the label and the value as text, or None if the metric was not measured.
        help: The help text of the metric's option.
        measure: Measures whole pictures. A metric with `measure` is measured only on request.
    """

    field: str
    row: Callable[[Comparison], tuple[str, str] | None]
    help: str = ""
    measure: Callable[[PictureRows, PictureRows, Span], float] | None = None


class _ClippedRows:
    """A picture (H, W, 3) whose rows are clipped to [0, 1] when they are read."""

    def __init__(self, picture: PictureRows) -> None:
        self._picture = picture

    @property
    def shape(self) -> tuple[int, ...]:
        return self._picture.shape

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        return np.clip(self._picture[rows], 0.0, 1.0)


def clip(picture: StoredPicture) -> StoredPicture:
    """Return a picture whose radiance is clipped to [0, 1], as every .png is."""
    return picture._replace(radiance=_ClippedRows(picture.radiance))


def measure_difference(
    first: StoredPicture,
    second: StoredPicture,
    threshold: float,
    requested: Collection[str] = (),
    span: Span = "ldr",
) -> Comparison:
    """Measure the differences between two checked pictures.

    `requested` lists the fields of metrics to measure in addition to the default ones. Without `requested`, only some
    rows of the pictures are in memory at a time. Raises InputError for pictures of two sizes, and if a metric's package
    is not installed.
    """
    a, b = first.radiance, second.radiance
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
        alpha=_alpha_difference(first.alpha, second.alpha),
        **{m.field: m.measure(a, b, span) for m in METRICS if m.measure and m.field in requested},
    )


def _alpha_difference(a: NDArray[Any] | None, b: NDArray[Any] | None) -> float | None:
    """Return the root mean square difference of alpha [H, W], where None is opaque; None if both are opaque."""
    if a is None and b is None:
        return None
    off = np.subtract(1.0 if a is None else a, 1.0 if b is None else b, dtype=np.float64)
    return math.sqrt(np.mean(np.square(off)))


def as_json(comparison: Comparison) -> dict[str, Any]:
    """Return all fields of a comparison by name. An infinite value becomes None, because JSON has no infinity."""
    fields = {name: getattr(comparison, name) for name in comparison.__struct_fields__}
    return {name: None if value == math.inf else value for name, value in fields.items()}


def as_rows(comparison: Comparison) -> list[tuple[str, str]]:
    """Return a label and a text for each metric that was measured."""
    return [row for metric in METRICS if (row := metric.row(comparison))]


def size_text(picture: PictureRows) -> str:
    """Return a picture's size as text, such as 320x180."""
    height, width = picture.shape[:2]
    return f"{width}x{height}"


def _is_clipped(picture: Any) -> bool:
    """Whether a picture is the path of a file of a format that clips radiance."""
    suffix = Path(picture).suffix.lower() if isinstance(picture, str | Path) else ""
    return suffix in FORMATS and FORMATS[suffix].is_clipped


def _picture(values: Image | ArrayLike | str | Path, name: str) -> StoredPicture:
    if isinstance(values, str | Path):
        return load_picture(values)
    expected = "an Image, an array (H, W, 3) of numbers, or the path of a picture"
    picture = number_array(values, name, MAX_SIDE, _row, expected)
    if picture.ndim != 3 or picture.shape[2] != 3 or not picture.size:
        raise InputError(f"expected {expected}, got {picture.shape} of {picture.dtype}", name)
    check_radiance(picture, name)
    return StoredPicture(picture, values.alpha if isinstance(values, Image) else None)


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
        lambda c: None if c.flip is None else ("FLIP", f"{c.flip:.3g}"),
        "also measure FLIP; without a .png in high dynamic range. Needs flip-evaluator: "
        f"{install_command('flip')} in the checkout.",
        _flip,
    ),
    Metric(
        "alpha",
        lambda c: None if c.alpha is None else ("alpha", f"RMSE {c.alpha:.3g}; the radiance is premultiplied"),
    ),
)
