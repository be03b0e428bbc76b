"""`raytracer tune`: print the best settings for an error or a time."""

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
    warn_about_scene,
)
from raytracer.core.interrupts import STATUS
from raytracer.core.terminal import print_error, print_lines, print_note
from raytracer.core.validation import check_size, locate_errors, number
from raytracer.formats.estimate import FEW_PIXELS, LOWER_BOUND_FACTOR
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE, SettingsSection, section_text
from raytracer.scene.settings_patch import flags, minimal_patch

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
        help="find the fastest settings with a root mean square error (RMSE) of at most E. Linear radiance, above 0.",
    )
    targets.add_argument(
        "--time",
        metavar="T",
        type=float,
        help="find the most accurate settings that render the picture within T. Seconds, above 0.",
    )
    add_size(parser)
    add_compile_options(parser)
    add_backend(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `tune` and return the exit status: 1 if no settings reach the target, STATUS after Ctrl-C."""
    for value, name, unit in (
        (options.max_error, "--max-error", "linear radiance"),
        (options.time, "--time", "seconds"),
    ):
        if value is not None:
            number(value, name, math.ulp(0.0), expected=f"a finite number above 0 ({unit})")
    chosen = chosen_settings(options).without_sampling()  # --max-error and --time are targets, no settings
    chosen.resolve()
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    size = chosen_size(options) or section.size or DEFAULT_SIZE
    from raytracer.analysis.tradeoffs.tune import tune
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    check_size(size)
    settings = (section.settings.without_sampling() | chosen).resolve()
    warn_about_scene(options.scene, scene, settings)
    renderer = Renderer(shared_device(options.backend, options.device))
    try:
        with locate_errors(options.scene):
            tuned = tune(
                renderer,
                scene,
                size,
                settings,
                max_error=options.max_error,
                time=options.time,
                progress=print_note,
            )
    except KeyboardInterrupt:
        print_error("interrupted before a picture of the full size was measured")
        return STATUS
    _report(tuned, size, section)
    if not tuned.is_complete:
        return STATUS
    return 0 if tuned.pick else 1


def _report(tuned: Tuned, size: tuple[int, int], section: SettingsSection) -> None:
    """Print the best settings with their time and error."""
    best = tuned.best
    # Options are printed even if the file, or the defaults, already have the same settings.
    options = flags(minimal_patch(best.settings, section.settings)) or flags(minimal_patch(best.settings))
    options = options or f"--samples {best.settings.samples}"
    error = f"{best.error:.2g} (RMSE, linear radiance)"
    if best.is_uncertain:  # the reference may have the same error as the picture
        error = (
            f"at least {LOWER_BOUND_FACTOR * best.error:.2g} (RMSE, linear radiance), perhaps far more: {FEW_PIXELS}"
        )
    line = (
        f"{options}: {best.seconds:.3g} s, error {error}, {best.samples:.3g} samples per pixel at {size[0]}x{size[1]}"
    )
    if not tuned.is_complete:
        print_lines(f"interrupted: the best of {tuned.measured_count} measured candidates:")
    if tuned.pick:
        print_lines(line, "", *section_text(best.settings, section.size).splitlines())
    else:
        others = ", and no other is likely to" if tuned.is_hopeless else ""
        print_lines(f"none of {tuned.measured_count} candidates reaches the target{others}; closest: {line}")
