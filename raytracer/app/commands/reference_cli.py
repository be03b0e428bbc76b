"""`raytracer reference`: arguments, and the picture in float64 in a file."""

from __future__ import annotations

import argparse
import time

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
from raytracer.core.terminal import complain, say
from raytracer.core.validation import about, check_size
from raytracer.formats.scene_file import find_scene, read_document


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `reference`."""
    from raytracer.ground_truth.disk_cache import MOST_BYTES
    from raytracer.ground_truth.job import FIRST_SAMPLES, SAMPLES, TOLERANCE
    from raytracer.ground_truth.picture import REFERENCE_SIZE

    add_scene(parser)
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=".npz (float64 arrays)")
    add_size(parser, f"{REFERENCE_SIZE[0]}x{REFERENCE_SIZE[1]}, as this takes long")
    parser.add_argument(
        "--samples",
        metavar="N",
        type=whole,
        default=SAMPLES,
        help=f"rays a pixel at most, {FIRST_SAMPLES} at least: {FIRST_SAMPLES}, doubled as often as it takes "
        f"(default: {SAMPLES})",
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
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `reference`; the exit status."""
    from raytracer.ground_truth.converged import trace_converged
    from raytracer.ground_truth.cost import check_cost, estimate_cost
    from raytracer.ground_truth.job import Job
    from raytracer.ground_truth.picture import REFERENCE_SIZE, WORTH_MENTION

    chosen = chosen_settings(options).without_sampling()  # --samples is the reference's own
    chosen.resolve()
    size = chosen_size(options) or REFERENCE_SIZE
    check_size(size)
    output = check_output(options.output, (".npz",))
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    settings = (section.settings.without_sampling() | chosen).resolve()
    with about(options.scene):
        for material in scene.materials:
            settings.shaded(material)
        check_cost(scene, size)
    warn_about(options.scene, scene, settings.replace(precision=64))
    start = time.monotonic()
    traced = False

    def before(job: Job) -> None:
        nonlocal traced
        traced = True
        if (takes := estimate_cost(job)).seconds > WORTH_MENTION:
            complain(f"this takes {takes}")

    with progress_bar(f"tracing {output.name}") as progress:
        image = trace_converged(
            scene,
            size,
            settings,
            samples=options.samples,
            tolerance=options.tolerance,
            cache=not options.no_cache,
            progress=progress,
            before=before,
        )
    with options.write(output) as file:
        image.write(file, output.suffix)
    assert image.samples is not None and image.estimate
    n, estimate = image.samples, image.estimate
    why = f" ({estimate.unknown})" if estimate.uncertain else ""
    took = f"{time.monotonic() - start:.1f} s" if traced else "from the cache"
    samples = f"{n.min()} to {n.max()} samples a pixel, {n.mean():.1f} on average"
    say(f"wrote {output}: {size[0]}x{size[1]}, {samples}, RMSE {estimate.in_words}{why}, {took}")
    return 0
