"""`raytracer trade`: arguments, and what each knob costs in a folder."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from raytracer.app.options import add_backend, add_scene, add_size, chosen_size, warn_about, whole
from raytracer.core.interrupts import STATUS
from raytracer.core.progress import step_bar, tell_step
from raytracer.core.terminal import say
from raytracer.core.validation import InputError, about, check_size
from raytracer.formats.scene_file import find_scene, read_document

# Small, as the references that errors are measured against take their time; quick is for tests.
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
        help="folder for trade.csv, trade.json and trade.html, over those that are there; made if it is not there",
    )
    add_size(parser, f"{_SIZE[0]}x{_SIZE[1]}, as references take their time")
    parser.add_argument(
        "--rounds", metavar="N", type=whole, help=f"how often each is timed, in turns with all (default: {_ROUNDS})"
    )
    parser.add_argument(
        "--truth",
        choices=("auto", "gpu", "float64"),
        default="auto",
        help="the reference that errors are measured against: many samples on the GPU, or float64 (default: auto, the "
        "GPU's, and for scenes of few primitives how far the float64 one is from it)",
    )
    parser.add_argument(
        "--quick", action="store_true", help="a tiny picture, few of all configurations, references by the GPU"
    )
    add_backend(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `trade`; the exit status, STATUS if Ctrl-C ended it before all was measured."""
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    if options.rounds is not None and options.rounds < 1:
        raise InputError("expected at least 1, got 0", "--rounds")
    from raytracer.analysis.figures import require_matplotlib
    from raytracer.analysis.tradeoffs.approximations import add_approximations
    from raytracer.analysis.tradeoffs.configurations import FULL, QUICK, plan
    from raytracer.analysis.tradeoffs.measurement import measure_tradeoffs
    from raytracer.analysis.tradeoffs.page import FILES, write_page, write_tables
    from raytracer.core.output import check_folder
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    require_matplotlib()  # before the measurements take time
    size = chosen_size(options) or (_QUICK_SIZE if options.quick else _SIZE)
    check_size(size)
    folder = Path(options.output)
    if os.path.lexists(folder):
        check_folder(folder, *FILES)
    else:
        check_folder(folder.parent, folder.name)
    extent = QUICK if options.quick else FULL
    renderer = Renderer(shared_device(options.backend, options.device))
    base = section.settings.without_sampling().resolve()
    warn_about(options.scene, scene, base.replace(shadows="hard"))  # as plan() has it
    planned = plan(scene, extent, section.settings)
    add_approximations(planned, scene, extent, renderer)
    with about(options.scene):
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
    tell_step("drawing trade.html")
    try:
        page = write_page(trade, renderer, folder, options.write)
    except KeyboardInterrupt:
        say(f"wrote trade.csv and trade.json in {folder}: {measured}", "interrupted: there is no trade.html")
        return STATUS
    say(f"wrote {page}, with trade.csv and trade.json: {measured}")
    if not trade.complete:
        say("interrupted: this is what was measured by then")
    return 0 if trade.complete else STATUS
