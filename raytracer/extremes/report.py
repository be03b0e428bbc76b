"""The ledger on the terminal and in files."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

from raytracer.checks import InputError
from raytracer.extremes import measure
from raytracer.extremes.ledger import HEADING, as_csv, as_markdown, summary
from raytracer.film import written_whole
from raytracer.progress import Progress
from raytracer.renderer import Renderer


def check_folder(path: str) -> Path:
    """`path` if files can be written there; InputError otherwise."""
    folder = Path(path)
    if not folder.is_dir():
        raise InputError(f"{path}: expected a folder that exists")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: expected a folder that can be written to")
    return folder


def report(renderer: Renderer, folder: Path, short: bool, scenes: int, progress: Progress | None) -> bool:
    """Measure, print the worst of each row, write extremes.csv and extremes.md; whether all bounds are kept."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    findings = measure(renderer, short=short, scenes=scenes, progress=progress)
    table = Table(*HEADING)
    for row, before in zip(rows := summary(findings), [[""], *rows], strict=False):
        table.add_row("" if row[0] == before[0] else row[0], *map(escape, row[1:]))
    Console(width=None if sys.stdout.isatty() else 160).print(table)
    broken = sum(not f.kept for f in findings)
    print(f"{len(findings)} measurements, {broken or 'none'} beyond their bounds")
    info = renderer.context.info
    machine = f"{info['GL_RENDERER']}, {info['GL_VERSION']}, {platform.machine()}"
    for name, text in (("extremes.csv", as_csv(findings)), ("extremes.md", as_markdown(findings, machine))):
        with written_whole(folder / name) as file:
            file.write(text.encode())
        print(f"wrote {folder / name}")
    return broken == 0
