"""`raytracer doctor`: a table of the OpenGL contexts on this computer, and packages to install for missing ones."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

from raytracer.core.terminal import print_json, print_lines, print_table, table_cell

if TYPE_CHECKING:
    from raytracer.gpu.context_report import ContextReport


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `doctor`."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `doctor` and return the exit status: 1 if no context opens."""
    import msgspec

    from raytracer.gpu.context_report import examine_contexts

    reports = examine_contexts()
    if options.json:
        print_json(json.dumps(msgspec.to_builtins(reports), indent=2))
    else:
        _print_table(reports)
    return 0 if any(report.opens for report in reports) else 1


def _print_table(reports: list[ContextReport]) -> None:
    """Print a table of contexts, and the packages to install for backends that do not open."""
    from rich.table import Table

    from raytracer.gpu.context import PACKAGES

    table = Table("backend", *(table_cell(report.name) for report in reports))
    table.add_row("opens", *("yes" if report.opens else f"no: {table_cell(report.problem)}" for report in reports))
    for name in ("renderer", "vendor", "version"):
        table.add_row(name, *(table_cell(getattr(report, name)) for report in reports))
    table.add_row("largest texture", *(f"{r.max_texture_size}" if r.opens else "" for r in reports))
    table.add_row("uniform block", *(f"{r.max_uniform_block // 1024} KiB" if r.opens else "" for r in reports))
    print_table(table)
    if sys.platform != "linux":
        return
    for backend in dict.fromkeys(report.backend for report in reports):
        if not any(report.opens for report in reports if report.backend == backend):
            without_screen = "; without a screen, run under xvfb-run" if backend == "window" else ""
            packages = PACKAGES[backend]
            print_lines(f"To use the backend {backend} on Debian or Ubuntu: apt-get install {packages}{without_screen}")
