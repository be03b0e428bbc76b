"""`raytracer view`: show a scene in a window."""

from __future__ import annotations

import argparse

from raytracer.app.options import add_scene, add_settings, chosen_settings, chosen_size
from raytracer.core.interrupts import STATUS
from raytracer.core.validation import check_size, number
from raytracer.scene.sequences import PROGRESSIVE


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `view`."""
    from raytracer.app.viewer.events import CONTROLS, DEFAULT_SAMPLES

    add_scene(parser)
    add_settings(parser, DEFAULT_SAMPLES, PROGRESSIVE, adaptive=False)
    parser.add_argument(
        "--budget",
        metavar="MS",
        type=float,
        default=33.0,
        help="time limit for each sample of a moving picture, which gets larger pixels to keep the limit. "
        "Milliseconds. Default: 33. Range: 0.001-1000000.",
    )
    width = max(len(control.key) for control in CONTROLS)
    controls = "".join(f"  {control.key:{width}}  {control.effect}\n" for control in CONTROLS)
    parser.epilog = f"mouse and keys:\n{controls}\n{parser.epilog}"
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `view` and return the exit status: STATUS if Ctrl-C closed the window."""
    budget = number(options.budget, "--budget", 0.001, 1e6, "milliseconds in [0.001, 1e6]") / 1000.0
    chosen, size = chosen_settings(options), chosen_size(options)
    chosen.resolve()

    from raytracer.app.viewer.window import view

    if size:
        check_size(size)
    try:
        view(options.scene, chosen, size, budget)
    except KeyboardInterrupt:  # Ctrl-C closes the window
        return STATUS
    return 0
