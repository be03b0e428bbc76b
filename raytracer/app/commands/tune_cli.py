"""`raytracer tune`: arguments, and the settings that meet an error or a time."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from raytracer.app.options import add_backend, add_own, add_scene, add_size, given, warn_about
from raytracer.core.interrupts import STATUS
from raytracer.core.terminal import complain, note, say
from raytracer.core.validation import about, check_size, number
from raytracer.formats.scene_file import parse_all, read
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.scene.presets import OWN, Fields, combined, over, own
from raytracer.scene.presets import flags as as_flags
from raytracer.scene.settings import Settings

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
    add_own(parser, *OWN)
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
    flags = given(options)
    combined(own(flags))
    scene, of_file = parse_all(*read(options.scene))
    size = flags.get("size") or of_file.get("size") or DEFAULT_SIZE
    from raytracer.analysis.tradeoffs.tune import tune
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    check_size(size)
    settings = combined(own(of_file), own(flags))
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
    _report(tuned, size, of_file)
    if not tuned.complete:
        return STATUS
    return 0 if tuned.pick else 1


def _report(tuned: Tuned, size: tuple[int, int], of_file: Fields) -> None:
    """Print the settings, and how good they are."""
    best = tuned.best
    # What says nothing that the file does not say is said all the same.
    named = over(of_file, best.settings) or over({}, best.settings) or {"samples": best.settings.samples}
    says = (
        f"{as_flags(named)}: {best.seconds:.3g} s, error {best.error:.2g} (RMSE, linear radiance), "
        f"{best.samples:.3g} samples a pixel at {size[0]}x{size[1]}"
    )
    if not tuned.complete:
        say(f"interrupted: the best of {tuned.tried} that were measured by then:")
    if tuned.pick:
        say(says, "", *settings_section(best.settings, of_file.get("size")).splitlines())
    else:
        why = ", and that tells that no other will" if tuned.hopeless else ""
        say(f"of {tuned.tried} tried nothing meets that{why}; the closest is {says}")


def settings_section(settings: Settings, size: tuple[int, int] | None = None) -> str:
    """The table `[settings]` of a scene file, of what is not by default; `size`: one that the file has already."""
    lines = [f"size = [{size[0]}, {size[1]}]"] if size else []
    lines += [
        f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value}"
        for name, value in over({}, settings).items()
    ]
    return "\n".join(["[settings]", *lines]) + "\n"
