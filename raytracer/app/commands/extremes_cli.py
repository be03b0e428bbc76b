"""`raytracer extremes`: the ledger of extremes on the terminal and in files."""

from __future__ import annotations

import argparse
from pathlib import Path

from raytracer.app.options import add_backend, whole
from raytracer.core.progress import progress_bar


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `extremes`."""
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        default=".",
        help="gets extremes.csv and extremes.md, over those that are there (default: here)",
    )
    parser.add_argument("--short", action="store_true", help="only the ends of the ranges, as in the tests")
    parser.add_argument(
        "--fuzz", metavar="N", type=whole, default=1000, help="random scenes over all ranges together (default: 1000)"
    )
    add_backend(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `extremes`; the exit status, 1 if a bound is not kept."""
    from raytracer.analysis.numerics.report import FILES, report
    from raytracer.core.output import check_folder
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    folder = Path(options.output)
    check_folder(folder, *FILES)
    renderer = Renderer(shared_device(options.backend, options.device))
    with progress_bar("measuring") as progress:
        kept = report(renderer, folder, options.short, options.fuzz, progress, options.write)
    return 0 if kept else 1
