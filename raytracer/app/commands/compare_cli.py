"""`raytracer compare`: arguments, and how far a picture is from a reference."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from raytracer.analysis.image_difference import (
    METRICS,
    SCALE,
    THRESHOLD,
    Comparison,
    as_json,
    as_rows,
    difference,
    measure_difference,
)
from raytracer.core.output import check_output
from raytracer.core.terminal import say, say_json
from raytracer.core.validation import InputError, number
from raytracer.formats.image_files import FORMATS, load_radiance, read_size

# Pixels of a picture that is read in no time.
_SMALL = 1 << 16
# Measured only with an option of the metric's name.
_ASKED = [metric for metric in METRICS if metric.measure]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `compare`."""
    kinds = " or ".join(FORMATS)
    parser.add_argument("a", metavar="A", help=f"a picture: {kinds}")
    parser.add_argument(
        "b",
        metavar="B",
        help=f"the reference to compare it with: {kinds}; if just one of the two is a .png, the other is clipped "
        "to [0, 1] as that is",
    )
    parser.add_argument(
        "--threshold",
        metavar="T",
        type=float,
        default=THRESHOLD,
        help=f"which share of pixels has a channel that is off by more (default: {THRESHOLD:g})",
    )
    parser.add_argument("--tolerance", metavar="RMSE", type=float, help="exit status 1 if the RMSE is above this")
    for metric in _ASKED:
        parser.add_argument(f"--{metric.field}", action="store_true", help=metric.help)
    parser.add_argument("-o", "--output", metavar="OUT", help=f"a .png of {SCALE}")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table; an infinite PSNR is null")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `compare`; the exit status, 1 also if the pictures are further apart than the tolerance."""
    import numpy as np

    if options.tolerance is not None:
        number(options.tolerance, "--tolerance", 0.0, expected="a finite number of at least 0 (linear radiance)")
    number(options.threshold, "--threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    output = check_output(options.output, (".png",)) if options.output is not None else None
    names = (options.a, options.b)
    sizes = [read_size(name) for name in names]
    if sizes[0] != sizes[1]:  # before a large one takes time and memory
        for name, (width, height) in zip(names, sizes, strict=True):
            if width * height <= _SMALL:
                load_radiance(name)  # an error about the file itself comes first
        size, expected = ("{}x{}".format(*size) for size in sizes)
        raise InputError(f"expected the size of {names[1]}, {expected}, got {size}", file=names[0])
    pictures = [load_radiance(name) for name in names]
    unclipped = [name for name in names if not FORMATS[Path(name).suffix.lower()].is_clipped]
    clipped = unclipped[0] if len(unclipped) == 1 else None
    if clipped is not None:
        for picture in pictures:
            if isinstance(picture, np.ndarray):
                np.clip(picture, 0.0, 1.0, out=picture)
    a, b = pictures
    asked = [metric.field for metric in _ASKED if getattr(options, metric.field)]
    comparison = measure_difference(a, b, options.threshold, asked, "hdr" if len(unclipped) == 2 else "ldr")
    if output:
        with options.write(output) as file:
            difference(a, b).write(file, output.suffix)
    within = options.tolerance is None or comparison.rmse <= options.tolerance
    size = a.shape[1], a.shape[0]
    if options.json:
        say_json(json.dumps(_json(comparison, options, size, clipped, within), indent=1, allow_nan=False))
    else:
        _print(comparison, options, size, clipped, within)
    return 0 if within else 1


def _json(
    comparison: Comparison, options: argparse.Namespace, size: tuple[int, int], clipped: str | None, within: bool
) -> dict[str, Any]:
    return {
        "a": options.a,
        "b": options.b,
        "size": list(size),
        "clipped": clipped,
        **as_json(comparison),
        "tolerance": options.tolerance,
        "within_tolerance": within,
    }


def _print(
    comparison: Comparison, options: argparse.Namespace, size: tuple[int, int], clipped: str | None, within: bool
) -> None:
    rows = [("size", f"{size[0]}x{size[1]}"), *as_rows(comparison)]
    if clipped is not None:
        rows.append(("clipped", f"{clipped}, to [0, 1]"))
    if options.tolerance is not None:
        rows.append(("tolerance", f"{options.tolerance:g}: {'kept' if within else 'the RMSE is above it'}"))
    if options.output:
        rows.append(("wrote", options.output))
    width = max(len(name) for name, _ in rows)
    say(*(f"{name:{width}}  {value}" for name, value in rows))
