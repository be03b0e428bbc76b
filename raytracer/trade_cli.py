"""`raytracer trade` and `raytracer tune`: arguments, and what they do. Exit status as in `cli.py`."""

from __future__ import annotations

import argparse
from pathlib import Path

from raytracer.checks import InputError, printable
from raytracer.cli import _add_backend, _add_scene, _size, _whole
from raytracer.progress import progress_bar
from raytracer.scene_file import load

# Small, for the float64 reference takes its time; quick is for tests.
_SIZE, _QUICK_SIZE = (320, 180), (64, 36)
_ROUNDS, _QUICK_ROUNDS = 5, 2
_QUICK_GPU_SAMPLES = 256


def trade_arguments(parser: argparse.ArgumentParser) -> None:
    """Those of `raytracer trade`."""
    _add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        required=True,
        help="folder for trade.csv, trade.json and trade.html, over those that are there; made if it is not there",
    )
    parser.add_argument(
        "--size",
        metavar="WxH",
        type=_size,
        help=f"in pixels (default: {_SIZE[0]}x{_SIZE[1]}, as the float64 reference takes its time)",
    )
    parser.add_argument(
        "--rounds", metavar="N", type=_whole, help=f"how often each is timed, in turns with all (default: {_ROUNDS})"
    )
    parser.add_argument(
        "--truth",
        choices=("auto", "float64", "gpu"),
        default="auto",
        help="what errors are against: the float64 reference, or many samples on the GPU (default: auto, the "
        "reference for scenes of few primitives)",
    )
    parser.add_argument(
        "--quick", action="store_true", help="a tiny picture, few of all configurations, a truth by the GPU"
    )
    _add_backend(parser)
    parser.set_defaults(run=_trade)


def _trade(options: argparse.Namespace) -> int:
    """Measure, and write what there is; 1 if that is not all of it."""
    scene = load(options.scene)
    if options.rounds is not None and options.rounds < 1:
        raise InputError("--rounds: expected at least 1, got 0")
    from raytracer.film import check_folder
    from raytracer.limits import check_size
    from raytracer.renderer import shared_renderer
    from raytracer.trade.approximations import add_approximations
    from raytracer.trade.configurations import FULL, QUICK, plan
    from raytracer.trade.measure import measure
    from raytracer.trade.page import write

    size = options.size or (_QUICK_SIZE if options.quick else _SIZE)
    check_size(size)
    folder = Path(options.output)
    if not folder.exists():
        check_folder(folder.parent, folder)
        folder.mkdir()
    check_folder(folder)
    extent = QUICK if options.quick else FULL
    renderer = shared_renderer(options.backend)
    planned = plan(scene, extent)
    add_approximations(planned, scene, extent, renderer)
    found = measure(
        scene,
        planned,
        renderer,
        size,
        options.rounds or (_QUICK_ROUNDS if options.quick else _ROUNDS),
        progress_bar,
        source="gpu" if options.quick and options.truth == "auto" else options.truth,
        **({"gpu_samples": _QUICK_GPU_SAMPLES} if options.quick else {}),
    )
    page = write(found, renderer, folder)
    measured = sum(result.measured for result in found.results)
    print(f"wrote {page}, with trade.csv and trade.json: {measured} configurations of {printable(scene.name)}")
    if not found.complete:
        print("interrupted: this is what was measured by then")
    return 0 if found.complete else 1
