"""`raytracer trade` and `raytracer tune`: arguments, and what they do. Exit status as in `cli.py`."""

from __future__ import annotations

import argparse
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from raytracer.app.options import (
    add_backend,
    add_compile_options,
    add_scene,
    add_size,
    chosen_settings,
    chosen_size,
    warn_about,
    whole,
)
from raytracer.core.interrupts import STATUS
from raytracer.core.progress import step_bar, tell_step
from raytracer.core.terminal import complain, note, say
from raytracer.core.validation import InputError, about, check_size, number
from raytracer.formats.scene_file import parse_all, read
from raytracer.formats.settings_section import DEFAULT_SIZE, SettingsSection
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import fewest, flags

if TYPE_CHECKING:
    from raytracer.analysis.tradeoffs.tune import Tuned

# Small, for a truth takes its time; quick is for tests.
_SIZE, _QUICK_SIZE = (320, 180), (64, 36)
_ROUNDS, _QUICK_ROUNDS = 5, 2
_QUICK_GPU_SAMPLES = 256


def trade_arguments(parser: argparse.ArgumentParser) -> None:
    """Those of `raytracer trade`."""
    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        required=True,
        help="folder for trade.csv, trade.json and trade.html, over those that are there; made if it is not there",
    )
    add_size(parser, f"{_SIZE[0]}x{_SIZE[1]}, as a truth takes its time")
    parser.add_argument(
        "--rounds", metavar="N", type=whole, help=f"how often each is timed, in turns with all (default: {_ROUNDS})"
    )
    parser.add_argument(
        "--truth",
        choices=("auto", "gpu", "float64"),
        default="auto",
        help="what errors are against: many samples on the GPU, or the float64 reference (default: auto, the "
        "GPU's, and for scenes of few primitives how far the reference is from it)",
    )
    parser.add_argument(
        "--quick", action="store_true", help="a tiny picture, few of all configurations, a truth by the GPU"
    )
    add_backend(parser)
    parser.set_defaults(run=_trade)


def _trade(options: argparse.Namespace) -> int:
    """Measure, and write what there is; STATUS if that is not all of it."""
    scene, section = parse_all(*read(options.scene))
    if options.rounds is not None and options.rounds < 1:
        raise InputError("expected at least 1, got 0", "--rounds")
    from raytracer.analysis.tradeoffs.approximations import add_approximations
    from raytracer.analysis.tradeoffs.configurations import FULL, QUICK, plan
    from raytracer.analysis.tradeoffs.measure import measure
    from raytracer.analysis.tradeoffs.page import FILES, write_page, write_tables
    from raytracer.analysis.tradeoffs.plots import check_matplotlib
    from raytracer.core.output import check_folder
    from raytracer.rendering.renderer import shared_renderer

    check_matplotlib()  # not found out when all is measured
    size = chosen_size(options) or (_QUICK_SIZE if options.quick else _SIZE)
    check_size(size)
    folder = Path(options.output)
    if os.path.lexists(folder):
        check_folder(folder, *FILES)
    else:
        check_folder(folder.parent, folder.name)
    extent = QUICK if options.quick else FULL
    renderer = shared_renderer(options.backend, options.device)
    base = section.settings.without_sampling().resolve()
    warn_about(options.scene, scene, base.replace(shadows="hard"))  # as plan() has it
    planned = plan(scene, extent, section.settings)
    add_approximations(planned, scene, extent, renderer)
    with about(options.scene):
        found = measure(
            scene,
            planned,
            renderer,
            size,
            options.rounds or (_QUICK_ROUNDS if options.quick else _ROUNDS),
            step_bar,
            source="gpu" if options.quick and options.truth == "auto" else options.truth,
            **({"gpu_samples": _QUICK_GPU_SAMPLES} if options.quick else {}),
        )
    measured = f"{sum(result.measured for result in found.results)} configurations of {scene.name}"
    folder.mkdir(exist_ok=True)
    write_tables(found, folder)
    tell_step("drawing trade.html")
    try:
        page = write_page(found, renderer, folder)
    except KeyboardInterrupt:
        say(f"wrote trade.csv and trade.json in {folder}: {measured}", "interrupted: there is no trade.html")
        return STATUS
    say(f"wrote {page}, with trade.csv and trade.json: {measured}")
    if not found.complete:
        say("interrupted: this is what was measured by then")
    return 0 if found.complete else STATUS


def tune_arguments(parser: argparse.ArgumentParser) -> None:
    """What `raytracer tune` takes."""
    add_scene(parser)
    targets = parser.add_mutually_exclusive_group(required=True)
    targets.add_argument(
        "--max-error",
        metavar="E",
        type=float,
        help="find the fastest settings whose picture has at most this root mean square error, in linear radiance",
    )
    targets.add_argument(
        "--time", metavar="T", type=float, help="find those with the least error whose picture takes at most T seconds"
    )
    add_size(parser)
    add_compile_options(parser)
    add_backend(parser)
    parser.set_defaults(run=_tune)


def _tune(options: argparse.Namespace) -> int:
    """Search, and print the settings; 1 if nothing meets the target, STATUS after Ctrl-C."""
    for value, name, unit in (
        (options.max_error, "--max-error", "linear radiance"),
        (options.time, "--time", "seconds"),
    ):
        if value is not None:
            number(value, name, math.ulp(0.0), expected=f"a finite number above 0 ({unit})")
    chosen = chosen_settings(options).without_sampling()  # --max-error and --time are targets
    chosen.resolve()
    scene, section = parse_all(*read(options.scene))
    size = chosen_size(options) or section.size or DEFAULT_SIZE
    from raytracer.analysis.tradeoffs.tune import tune
    from raytracer.rendering.renderer import shared_renderer

    check_size(size)
    settings = (section.settings.without_sampling() | chosen).resolve()
    warn_about(options.scene, scene, settings)
    renderer = shared_renderer(options.backend, options.device)
    try:
        with about(options.scene):
            found = tune(
                renderer,
                scene,
                size,
                settings,
                max_error=options.max_error,
                time=options.time,
                progress=lambda what: note(f"measuring {what}"),
            )
    except KeyboardInterrupt:
        complain("interrupted before any picture of the full size was measured")
        return STATUS
    _report(found, size, section)
    if not found.complete:
        return STATUS
    return 0 if found.pick else 1


def _report(found: Tuned, size: tuple[int, int], section: SettingsSection) -> None:
    """Print what was found."""
    best = found.best
    # Flags are told also where the file or the defaults give the same.
    options = flags(fewest(best.settings, section.settings)) or flags(fewest(best.settings))
    options = options or f"--samples {best.settings.samples}"
    says = (
        f"{options}: {best.seconds:.3g} s, error {best.error:.2g} (RMSE, linear radiance), "
        f"{best.samples:.3g} samples a pixel at {size[0]}x{size[1]}"
    )
    if not found.complete:
        say(f"interrupted: the best of {found.tried} that were measured by then:")
    if found.pick:
        say(says, "", *settings_table(best.settings, section.size).splitlines())
    else:
        why = ", and that tells that no other will" if found.hopeless else ""
        say(f"of {found.tried} tried nothing meets that{why}; the closest is {says}")


def settings_table(settings: Settings, size: tuple[int, int] | None = None) -> str:
    """The table `[settings]` of a scene file, of what is not by default; `size`: one that the file has already."""
    lines = [f"size = [{size[0]}, {size[1]}]"] if size else []
    lines += [
        f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value}"
        for name, value in fewest(settings).fields().items()
    ]
    return "\n".join(["[settings]", *lines]) + "\n"
