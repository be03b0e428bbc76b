"""`raytracer tune`: arguments, and the settings that meet an error or a time."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from raytracer.app.options import (
    add_backend,
    add_compile_options,
    add_scene,
    add_size,
    chosen_settings,
    chosen_size,
    warn_about,
)
from raytracer.core.interrupts import STATUS
from raytracer.core.terminal import complain, note, say
from raytracer.core.validation import about, check_size, number
from raytracer.formats.estimate import FEW_PIXELS, LEAST
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE, SettingsSection, section_text
from raytracer.scene.settings_patch import fewest, flags

if TYPE_CHECKING:
    from raytracer.analysis.tradeoffs.tune import Tuned


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `tune`."""
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
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `tune`; the exit status, 1 also if nothing meets the target, STATUS after Ctrl-C."""
    for value, name, unit in (
        (options.max_error, "--max-error", "linear radiance"),
        (options.time, "--time", "seconds"),
    ):
        if value is not None:
            number(value, name, math.ulp(0.0), expected=f"a finite number above 0 ({unit})")
    chosen = chosen_settings(options).without_sampling()  # --max-error and --time are targets
    chosen.resolve()
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    size = chosen_size(options) or section.size or DEFAULT_SIZE
    from raytracer.analysis.tradeoffs.tune import tune
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    check_size(size)
    settings = (section.settings.without_sampling() | chosen).resolve()
    warn_about(options.scene, scene, settings)
    renderer = Renderer(shared_device(options.backend, options.device))
    try:
        with about(options.scene):
            tuned = tune(
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
    _report(tuned, size, section)
    if not tuned.complete:
        return STATUS
    return 0 if tuned.pick else 1


def _report(tuned: Tuned, size: tuple[int, int], section: SettingsSection) -> None:
    """Print the settings, and how good they are."""
    best = tuned.best
    # There are flags also where the file, or the defaults, give the same settings.
    options = flags(fewest(best.settings, section.settings)) or flags(fewest(best.settings))
    options = options or f"--samples {best.settings.samples}"
    error = f"{best.error:.2g} (RMSE, linear radiance)"
    if best.uncertain:  # the reference may be as wrong as the picture
        error = f"at least {LEAST * best.error:.2g} (RMSE, linear radiance), perhaps far more: {FEW_PIXELS}"
    says = f"{options}: {best.seconds:.3g} s, error {error}, {best.samples:.3g} samples a pixel at {size[0]}x{size[1]}"
    if not tuned.complete:
        say(f"interrupted: the best of {tuned.tried} that were measured by then:")
    if tuned.pick:
        say(says, "", *section_text(best.settings, section.size).splitlines())
    else:
        why = ", and that tells that no other will" if tuned.hopeless else ""
        say(f"of {tuned.tried} tried nothing meets that{why}; the closest is {says}")
