"""The command-line options of farms: --workers, --scheduler and --mixed."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from raytracer.app.options import parse_integer
from raytracer.core.validation import InputError, integer
from raytracer.farm.tasks import MAX_WORKERS, Run, run_here


class Farm(NamedTuple):
    """The processes that draw.

    Attributes:
        run: the way to call a function with many jobs.
        drivers: the drivers of the workers, as GL_RENDERER. Empty without a farm: this process draws.
    """

    run: Run
    drivers: tuple[str, ...]


def add_farm_options(parser: argparse.ArgumentParser) -> None:
    """Add --workers, --scheduler and --mixed."""
    parser.add_argument(
        "--workers",
        metavar="N",
        type=parse_integer,
        default=None,
        help="draw in N processes on this machine, which share its cores. More than 1 needs the extra farm. "
        f"Default: 1, this process. Range: 1-{MAX_WORKERS}.",
    )
    parser.add_argument(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="draw on the workers of this Dask scheduler, also tls://HOST:PORT. Needs the extra farm. Default: none.",
    )
    parser.add_argument(
        "--mixed",
        action="store_true",
        help="accept workers with another version of this program or another OpenGL driver: then the pictures may "
        "differ in their last bits.",
    )


def check_farm_options(options: argparse.Namespace) -> bool:
    """Return whether the user wants a farm. Raises InputError for wrong options."""
    if options.scheduler is not None:
        # Imported here, because the modules of sockets and OpenGL would delay each command and its help.
        from raytracer.farm.scheduler_address import check_address
        from raytracer.gpu.adapters import VARIABLE as DEVICE_VARIABLE
        from raytracer.gpu.context import VARIABLE as BACKEND_VARIABLE

        if options.workers is not None:
            raise InputError("expected --workers or --scheduler, got both")
        if options.backend is not None or options.device is not None:
            names = f"{BACKEND_VARIABLE} and {DEVICE_VARIABLE}"
            raise InputError(f"expected no --backend and --device with --scheduler: set {names} where a worker starts")
        check_address(options.scheduler, "--scheduler")
        return True
    workers = 1 if options.workers is None else integer(options.workers, "--workers", 1, MAX_WORKERS)
    if workers == 1 and options.mixed:
        raise InputError("expected --workers or --scheduler with --mixed")
    return workers > 1


@contextmanager
def open_farm(options: argparse.Namespace) -> Iterator[Farm]:
    """Open the farm of the options, and end it with the block. Without a farm, this process draws.

    Raises InputError for wrong options, and FarmError for a farm that does not work.
    """
    if not check_farm_options(options):
        yield Farm(run_here, ())
        return
    from raytracer.farm.cluster import open_cluster
    from raytracer.gpu.adapters import VARIABLE as DEVICE_VARIABLE
    from raytracer.gpu.context import VARIABLE as BACKEND_VARIABLE

    chosen = {BACKEND_VARIABLE: options.backend, DEVICE_VARIABLE: options.device}
    variables = {name: str(value) for name, value in chosen.items() if value is not None}
    with open_cluster(options.workers, options.scheduler, mixed=options.mixed, variables=variables) as cluster:
        drivers = dict.fromkeys(identity.driver for identity in cluster.workers.values())
        yield Farm(cluster.run, tuple(drivers))
