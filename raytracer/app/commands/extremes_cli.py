"""`raytracer extremes`: print the ledger of errors at the ends of value ranges, and write it to files."""

from __future__ import annotations

import argparse
import platform
from pathlib import Path
from typing import TYPE_CHECKING

from raytracer.app.options import add_backend, parse_integer
from raytracer.core.progress import announce_step, progress_bar
from raytracer.core.terminal import print_lines, print_table, table_cell

if TYPE_CHECKING:
    from raytracer.analysis.numerics.findings import LedgerRow

_FILES = "extremes.csv", "extremes.md"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `extremes`."""
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        default=".",
        help="folder for extremes.csv and extremes.md; existing files are overwritten. Default: the current folder.",
    )
    parser.add_argument("--short", action="store_true", help="measure only the ends of the ranges, as the tests do")
    parser.add_argument(
        "--fuzz",
        metavar="N",
        type=parse_integer,
        default=1000,
        help="number of random scenes, with values from all ranges at once. Default: 1000.",
    )
    add_backend(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `extremes` and return the exit status: 1 if an error exceeds its bound."""
    from raytracer.analysis.machine import describe_machine
    from raytracer.analysis.numerics.ledger import measure_ledger
    from raytracer.analysis.numerics.ledger_page import as_csv, as_markdown
    from raytracer.core.output import check_folder
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    folder = Path(options.output)
    check_folder(folder, *_FILES)
    renderer = Renderer(shared_device(options.backend, options.device))
    with progress_bar("measuring") as progress:
        rows = measure_ledger(renderer, short=options.short, scenes=options.fuzz, progress=progress, step=announce_step)
        _print(rows)
        if 64 not in renderer.device.limits.precisions:
            print_lines("64-bit precision was not measured: it needs OpenGL 4.0")
        form = "in the short form" if options.short else "in full"
        machine = describe_machine(renderer)
        how = (
            f"Measured {form}, with {options.fuzz} fuzzed scenes, by raytracer {machine['raytracer']} "
            f"on {machine['device']}, {platform.machine()}."
        )
        findings = [finding for row in rows for finding in row.findings]
        for name, text in zip(_FILES, (as_csv(findings), as_markdown(rows, how)), strict=True):
            with options.write(folder / name) as file:
                file.write(text.encode())
            print_lines(f"wrote {folder / name}")
    return 0 if all(finding.is_within_bound for finding in findings) else 1


def _print(rows: list[LedgerRow]) -> None:
    """Print a line for each row, then each finding that exceeds its bound."""
    from rich.table import Table

    from raytracer.analysis.numerics.ledger_page import HEADING, number_text, summary

    table = Table(*HEADING)
    for line in summary(rows):
        table.add_row(*map(table_cell, line))
    print_table(table)
    findings = [finding for row in rows for finding in row.findings]
    beyond = [finding for finding in findings if not finding.is_within_bound]
    for finding in beyond:
        at = f"{finding.row}, {finding.at}, {finding.bits} bits"
        print_lines(f"{at}: {finding.measure}: {number_text(finding.measured)}, bound {number_text(finding.bound)}")
    print_lines(f"{len(findings)} measurements, {len(beyond) or 'none'} beyond their bounds")
