"""`raytracer compare`: the differences between a picture and a reference."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from raytracer.analysis.figures import SUFFIXES, require_matplotlib
from raytracer.analysis.image_difference import (
    METRICS,
    THRESHOLD,
    Comparison,
    as_json,
    as_rows,
    clip,
    measure_difference,
)
from raytracer.core.output import check_output
from raytracer.core.suggest import install_command
from raytracer.core.terminal import print_json, print_lines
from raytracer.core.validation import InputError, number
from raytracer.formats.image_files import FORMATS, load_picture, read_size

# The number of pixels up to which reading a picture takes less than 0.1 s.
_SMALL = 1 << 16
# The metrics that have an option. The others are always measured.
_OPTIONAL = [metric for metric in METRICS if metric.measure]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `compare`."""
    kinds = " or ".join(FORMATS)
    parser.add_argument("a", metavar="A", help=f"a picture: {kinds}")
    parser.add_argument(
        "b",
        metavar="B",
        help=f"the reference: {kinds}; if only one of the two is a .png, the other one is clipped to [0, 1], as every "
        ".png is. Transparent pictures are compared premultiplied, and alpha by itself.",
    )
    parser.add_argument(
        "--threshold",
        metavar="T",
        type=float,
        default=THRESHOLD,
        help=f"count the pixels with a channel that differs by more than T. Linear radiance. Default: {THRESHOLD:g}.",
    )
    parser.add_argument(
        "--tolerance",
        metavar="RMSE",
        type=float,
        help="exit status 1 if the RMSE is above this. Linear radiance. Default: no limit.",
    )
    for metric in _OPTIONAL:
        parser.add_argument(f"--{metric.field}", action="store_true", help=metric.help)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        help="write a figure of the largest channel difference of each pixel: .png, .svg or .pdf. Its colour scale is "
        f"logarithmic. Range: 0.0001-1. Needs matplotlib: {install_command('plots')} in the checkout.",
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table; an infinite PSNR is null")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `compare`. Return the exit status: 1 if the RMSE is above the tolerance."""
    if options.tolerance is not None:
        number(options.tolerance, "--tolerance", 0.0, expected="a finite number of at least 0 (linear radiance)")
    number(options.threshold, "--threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    output = check_output(options.output, SUFFIXES) if options.output is not None else None
    if output:
        require_matplotlib()  # before the pictures take time
    names = (options.a, options.b)
    sizes = [read_size(name) for name in names]
    if sizes[0] != sizes[1]:  # before a large picture takes time and memory
        for name, (width, height) in zip(names, sizes, strict=True):
            if width * height <= _SMALL:
                load_picture(name)  # errors in the file itself come first
        size, expected = ("{}x{}".format(*size) for size in sizes)
        raise InputError(f"expected the size of {names[1]}, {expected}, got {size}", file=names[0])
    pictures = [load_picture(name) for name in names]
    unclipped = [name for name in names if not FORMATS[Path(name).suffix.lower()].is_clipped]
    clipped = unclipped[0] if len(unclipped) == 1 else None
    if clipped is not None:
        pictures = [clip(picture) for picture in pictures]
    a, b = pictures
    requested = [metric.field for metric in _OPTIONAL if getattr(options, metric.field)]
    comparison = measure_difference(a, b, options.threshold, requested, "hdr" if len(unclipped) == 2 else "ldr")
    if output:
        from raytracer.analysis.difference_figure import write_difference

        note = f"; {Path(clipped).name} is clipped to [0, 1]" if clipped else ""
        write_difference(output, (a.radiance, b.radiance), names, comparison, note, options.write)
    within = options.tolerance is None or comparison.rmse <= options.tolerance
    if options.json:
        print_json(json.dumps(_json(comparison, options, sizes[0], clipped, within), indent=1, allow_nan=False))
    else:
        _print(comparison, options, sizes[0], clipped, within)
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
        rows.append(("tolerance", f"{options.tolerance:g}: {'kept' if within else 'the RMSE is above the tolerance'}"))
    if options.output:
        rows.append(("wrote", options.output))
    width = max(len(name) for name, _ in rows)
    print_lines(*(f"{name:{width}}  {value}" for name, value in rows))
