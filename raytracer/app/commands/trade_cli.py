"""`raytracer trade`: write the time and the error of each setting to a folder."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from raytracer.app.options import add_backend, add_scene, add_size, chosen_size, parse_integer, warn_about_scene
from raytracer.core.interrupts import STATUS
from raytracer.core.progress import announce_step, step_bar
from raytracer.core.terminal import print_lines
from raytracer.core.validation import InputError, check_size, locate_errors
from raytracer.formats.scene_file import find_scene, read_document

# Pictures are small because references of large pictures take long; the quick form is for tests.
_SIZE, _QUICK_SIZE = (320, 180), (64, 36)
_ROUNDS, _QUICK_ROUNDS = 5, 2
_QUICK_GPU_SAMPLES = 256


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `trade`."""
    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        required=True,
        help="folder for trade.html, trade.csv and trade.json; created if missing, existing files are overwritten",
    )
    add_size(parser, f"{_SIZE[0]}x{_SIZE[1]}, because references of larger pictures take long")
    parser.add_argument(
        "--rounds",
        metavar="N",
        type=parse_integer,
        help="how often each configuration is timed; all configurations take turns. "
        f"Default: {_ROUNDS}, with --quick {_QUICK_ROUNDS}.",
    )
    parser.add_argument(
        "--truth",
        choices=("auto", "gpu", "float64"),
        default="auto",
        help="reference of the measured errors: gpu (many samples on the GPU), float64 (see raytracer reference), or "
        "auto (gpu, and in scenes of few primitives also the difference between gpu and float64). Default: auto.",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help=f"for a first look: {_QUICK_SIZE[0]}x{_QUICK_SIZE[1]} pixels, few configurations, and by default a "
        "reference from the GPU",
    )
    add_backend(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `trade` and return the exit status: STATUS if Ctrl-C ended the measurement."""
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    if options.rounds is not None and options.rounds < 1:
        raise InputError("expected at least 1, got 0", "--rounds")
    from raytracer.analysis.figures import require_matplotlib
    from raytracer.analysis.tradeoffs.approximations import add_approximations
    from raytracer.analysis.tradeoffs.configurations import FULL, QUICK, plan
    from raytracer.analysis.tradeoffs.measurement import measure_tradeoffs
    from raytracer.analysis.tradeoffs.page import FILES, write_page, write_tables
    from raytracer.core.output import check_folder, check_place
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    require_matplotlib()  # before the measurement, which takes minutes
    size = chosen_size(options) or (_QUICK_SIZE if options.quick else _SIZE)
    check_size(size)
    folder = Path(options.output)
    if os.path.lexists(folder):
        check_folder(folder, *FILES)
    else:
        check_place(folder)
    extent = QUICK if options.quick else FULL
    renderer = Renderer(shared_device(options.backend, options.device))
    base = section.settings.without_sampling().resolve()
    warn_about_scene(options.scene, scene, base.replace(shadows="hard"))  # plan() has hard shadows, too
    planned = plan(scene, extent, section.settings)
    add_approximations(planned, scene, extent, renderer)
    with locate_errors(options.scene):
        trade = measure_tradeoffs(
            scene,
            planned,
            renderer,
            size,
            options.rounds or (_QUICK_ROUNDS if options.quick else _ROUNDS),
            step_bar,
            method="gpu" if options.quick and options.truth == "auto" else options.truth,
            **({"gpu_samples": _QUICK_GPU_SAMPLES} if options.quick else {}),
        )
    measured = f"{sum(result.measured for result in trade.results)} configurations of {scene.name}"
    folder.mkdir(exist_ok=True)
    write_tables(trade, folder, options.write)
    announce_step("drawing trade.html")
    try:
        page = write_page(trade, renderer, folder, options.write)
    except KeyboardInterrupt:
        print_lines(f"wrote trade.csv and trade.json in {folder}: {measured}", "interrupted: trade.html is missing")
        return STATUS
    print_lines(f"wrote {page}, with trade.csv and trade.json: {measured}")
    if not trade.complete:
        print_lines("interrupted: the files have the results until then")
    return 0 if trade.complete else STATUS
