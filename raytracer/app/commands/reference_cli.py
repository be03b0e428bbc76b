"""`raytracer reference`: write the ground truth of a scene, in float64, to a file."""

from __future__ import annotations

import argparse
import time

from raytracer.app.options import (
    add_compile_options,
    add_scene,
    add_size,
    add_transparent,
    chosen_settings,
    chosen_size,
    parse_integer,
    warn_about_scene,
)
from raytracer.core.progress import progress_bar
from raytracer.core.terminal import print_error, print_lines
from raytracer.core.validation import check_size, locate_errors
from raytracer.formats.image_files import check_picture_output
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.scene.options import MAX_SAMPLES


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `reference`."""
    from raytracer.ground_truth.disk_cache import MOST_BYTES
    from raytracer.ground_truth.job import FIRST_SAMPLES, SAMPLES, TOLERANCE
    from raytracer.ground_truth.picture import REFERENCE_SIZE

    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="file to write: .npz (float64 arrays) or .exr (float32 channels)",
    )
    add_transparent(parser)
    add_size(parser, f"{REFERENCE_SIZE[0]}x{REFERENCE_SIZE[1]}, because larger pictures take long")
    parser.add_argument(
        "--samples",
        metavar="N",
        type=parse_integer,
        default=SAMPLES,
        help=f"limit of samples per pixel. Every pixel gets {FIRST_SAMPLES}, which are doubled until the error is "
        f"below --tolerance. Default: {SAMPLES}. Range: {FIRST_SAMPLES}-{MAX_SAMPLES}.",
    )
    parser.add_argument(
        "--tolerance",
        metavar="T",
        type=float,
        default=TOLERANCE,
        help=f"draw more samples where the estimated error of a pixel exceeds T. Linear radiance. "
        f"Default: {TOLERANCE:g}.",
    )
    add_compile_options(parser, ("shading", "shadows", "bounces"))
    parser.add_argument(
        "--no-cache",
        action="store_true",
        help="neither read nor store the picture in the cache. Default: use the cache, in the folder of the "
        "environment variable RAYTRACER_CACHE, else in the user's cache folder. The cache keeps "
        f"{MOST_BYTES / 1e9:.0f} GB; the least recently used pictures are deleted.",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `reference` and return the exit status."""
    from raytracer.ground_truth.converged import trace_converged
    from raytracer.ground_truth.cost import check_cost, estimate_cost
    from raytracer.ground_truth.job import Job
    from raytracer.ground_truth.picture import REFERENCE_SIZE, WARN_SECONDS

    chosen = chosen_settings(
        options
    ).without_sampling()  # --samples is no setting here, but an argument of trace_converged()
    chosen.resolve()
    size = chosen_size(options) or REFERENCE_SIZE
    check_size(size)
    output = check_picture_output(options.output, suffixes=(".npz", ".exr"))
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    settings = (section.settings.without_sampling() | chosen).resolve()
    with locate_errors(options.scene):
        for material in scene.materials:
            settings.shaded(material)
        check_cost(scene, size)
    warn_about_scene(options.scene, scene, settings.replace(precision=64))
    start = time.monotonic()
    traced = False

    def before(job: Job) -> None:
        nonlocal traced
        traced = True
        if (takes := estimate_cost(job)).seconds > WARN_SECONDS:
            print_error(f"this takes {takes}")

    with progress_bar(f"tracing {output.name}") as progress:
        image = trace_converged(
            scene,
            size,
            settings,
            samples=options.samples,
            tolerance=options.tolerance,
            transparent=options.transparent,
            cache=not options.no_cache,
            progress=progress,
            before=before,
        )
    with options.write(output) as file:
        image.write(file, output.suffix)
    assert image.samples is not None and image.estimate
    n, estimate = image.samples, image.estimate
    reason = f" ({estimate.unknown})" if estimate.uncertain else ""
    duration = f"{time.monotonic() - start:.1f} s" if traced else "from the cache"
    samples = f"{n.min()} to {n.max()} samples per pixel, {n.mean():.1f} on average"
    print_lines(f"wrote {output}: {size[0]}x{size[1]}, {samples}, RMSE {estimate.in_words}{reason}, {duration}")
    return 0
