"""`raytracer reference` and `raytracer compare`. Exit status as in `cli.py`; of compare 1 above the tolerance, too."""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import msgspec

from raytracer.analysis.image_difference import SCALE, THRESHOLD, Comparison, Rows, difference, measure, size_of
from raytracer.app.options import (
    add_compile_options,
    add_scene,
    add_size,
    chosen_settings,
    chosen_size,
    warn_about,
    whole,
)
from raytracer.core.output import check_output
from raytracer.core.progress import progress_bar
from raytracer.core.terminal import complain, say, say_json
from raytracer.core.validation import InputError, about, check_size, number
from raytracer.formats.image_reader import SUFFIXES, load_radiance, size_in
from raytracer.formats.scene_file import parse_all, read

# Pixels of a picture that is read in no time.
_SMALL = 1 << 16


def reference_arguments(parser: argparse.ArgumentParser) -> None:
    """What `raytracer reference` takes."""
    from raytracer.ground_truth.converged import FIRST, SAMPLES, TOLERANCE
    from raytracer.ground_truth.disk_cache import MOST_BYTES
    from raytracer.ground_truth.picture import REFERENCE_SIZE

    add_scene(parser)
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=".npz (float64 arrays)")
    add_size(parser, f"{REFERENCE_SIZE[0]}x{REFERENCE_SIZE[1]}, as this takes long")
    parser.add_argument(
        "--samples",
        metavar="N",
        type=whole,
        default=SAMPLES,
        help=f"rays a pixel at most, {FIRST} at least: {FIRST}, doubled as often as it takes (default: {SAMPLES})",
    )
    parser.add_argument(
        "--tolerance",
        metavar="T",
        type=float,
        default=TOLERANCE,
        help="more samples where a pixel's error is estimated to be above T, in linear radiance "
        f"(default: {TOLERANCE:g})",
    )
    add_compile_options(parser, ("shading", "shadows", "bounces"))
    parser.add_argument(
        "--no-cache",
        action="store_true",
        help="make it anew, and do not keep it (default: keep it in the folder that the variable RAYTRACER_CACHE "
        f"names, or the user's cache, which has the last {MOST_BYTES / 1e9:.0f} GB of them)",
    )
    parser.set_defaults(run=_reference)


def compare_arguments(parser: argparse.ArgumentParser) -> None:
    """What `raytracer compare` takes."""
    kinds = " or ".join(SUFFIXES)
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
    parser.add_argument(
        "--flip", action="store_true", help="FLIP, too, of high dynamic range for two .npz (needs flip-evaluator)"
    )
    parser.add_argument("-o", "--output", metavar="OUT", help=f"a .png of {SCALE}")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table; an infinite PSNR is null")
    parser.set_defaults(run=_compare)


def _reference(options: argparse.Namespace) -> int:
    import numpy as np

    from raytracer.ground_truth.converged import Job, truth
    from raytracer.ground_truth.cost import check_cost, cost
    from raytracer.ground_truth.picture import REFERENCE_SIZE, WORTH_MENTION

    chosen = chosen_settings(options).without_sampling()  # --samples is the reference's own
    chosen.resolve()
    size = chosen_size(options) or REFERENCE_SIZE
    check_size(size)
    output = check_output(options.output, (".npz",))
    scene, section = parse_all(*read(options.scene))
    settings = (section.settings.without_sampling() | chosen).resolve()
    with about(options.scene):
        for material in scene.materials:
            settings.shaded(material)
        check_cost(scene, size)
    warn_about(options.scene, scene, msgspec.structs.replace(settings, precision=64))
    start = time.monotonic()
    traced = False

    def before(job: Job) -> None:
        nonlocal traced
        traced = True
        if (takes := cost(job, options.samples)).seconds > WORTH_MENTION:
            complain(f"this takes {takes}")

    with progress_bar(f"tracing {output.name}") as progress:
        image = truth(
            scene,
            size,
            settings,
            samples=options.samples,
            tolerance=options.tolerance,
            cache=not options.no_cache,
            progress=progress,
            before=before,
        )
    image.save(output)
    assert image.samples is not None and image.error is not None
    n, rmse = image.samples, math.sqrt(np.mean(image.error**2))
    took = f"{time.monotonic() - start:.1f} s" if traced else "from the cache"
    samples = f"{n.min()} to {n.max()} samples a pixel, {n.mean():.1f} on average"
    say(f"wrote {output}: {size_of(image.radiance)}, {samples}, RMSE about {rmse:.1e}, {took}")
    return 0


def _compare(options: argparse.Namespace) -> int:
    import numpy as np

    if options.tolerance is not None:
        number(options.tolerance, "--tolerance", 0.0, expected="a finite number of at least 0 (linear radiance)")
    number(options.threshold, "--threshold", 0.0, expected="a finite number of at least 0 (linear radiance)")
    output = check_output(options.output, (".png",)) if options.output is not None else None
    names = (options.a, options.b)
    sizes = [size_in(name) for name in names]
    if sizes[0] != sizes[1]:  # before a large one takes time and memory
        for name, (width, height) in zip(names, sizes, strict=True):
            if width * height <= _SMALL:
                load_radiance(name)  # an error about the file itself comes first
        size, expected = ("{}x{}".format(*size) for size in sizes)
        raise InputError(f"expected the size of {names[1]}, {expected}, got {size}", file=names[0])
    pictures = [load_radiance(name) for name in names]
    deep = [Path(name).suffix.lower() == ".npz" for name in names]
    clipped = (
        next((name for name, is_deep in zip(names, deep, strict=True) if is_deep), None) if sum(deep) == 1 else None
    )
    if clipped is not None:
        for picture in pictures:
            if isinstance(picture, np.ndarray):
                np.clip(picture, 0.0, 1.0, out=picture)
    a, b = pictures
    flip = None if not options.flip else "hdr" if all(deep) else "ldr"
    comparison = measure(a, b, options.threshold, flip)
    if output:
        image = difference(a, b)
        image.save(output)
    within = options.tolerance is None or comparison.rmse <= options.tolerance
    if options.json:
        say_json(json.dumps(_json(comparison, options, a, clipped, within), indent=1, allow_nan=False))
    else:
        _print(comparison, options, a, clipped, within)
    return 0 if within else 1


def _json(
    comparison: Comparison, options: argparse.Namespace, a: Rows, clipped: str | None, within: bool
) -> dict[str, Any]:
    return {
        "a": options.a,
        "b": options.b,
        "size": [a.shape[1], a.shape[0]],
        "clipped": clipped,
        "rmse": comparison.rmse,
        "largest": comparison.largest,
        "pixel": comparison.pixel,
        "psnr": comparison.psnr if math.isfinite(comparison.psnr) else None,
        "relative": comparison.relative,
        "threshold": comparison.threshold,
        "over": comparison.over,
        "flip": comparison.flip,
        "tolerance": options.tolerance,
        "within_tolerance": within,
    }


def _print(comparison: Comparison, options: argparse.Namespace, a: Rows, clipped: str | None, within: bool) -> None:
    x, y = comparison.pixel
    rows = [
        ("size", size_of(a)),
        ("RMSE", f"{comparison.rmse:.3g}"),
        ("largest", f"{comparison.largest:.3g}" + (f", in the pixel ({x}, {y})" if comparison.largest else "")),
        ("PSNR", f"{comparison.psnr:.1f} dB"),
        ("relative", "the reference is black" if comparison.relative is None else f"{comparison.relative:.3g}"),
        (f"over {comparison.threshold:g}", f"{100.0 * comparison.over:.3g} % of the pixels"),
    ]
    if comparison.flip is not None:
        rows.append(("FLIP", f"{comparison.flip:.3g}"))
    if clipped is not None:
        rows.append(("clipped", f"{clipped}, to [0, 1]"))
    if options.tolerance is not None:
        rows.append(("tolerance", f"{options.tolerance:g}: {'kept' if within else 'the RMSE is above it'}"))
    if options.output:
        rows.append(("wrote", options.output))
    width = max(len(name) for name, _ in rows)
    say(*(f"{name:{width}}  {value}" for name, value in rows))
