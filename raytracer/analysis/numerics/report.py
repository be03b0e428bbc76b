"""The ledger on the terminal and in files."""

from __future__ import annotations

import platform
from pathlib import Path

from raytracer.analysis.numerics import measure
from raytracer.analysis.numerics.ledger import HEADING, as_csv, as_markdown, shown, summary
from raytracer.core.output import written_whole
from raytracer.core.progress import Progress, tell_step
from raytracer.core.terminal import cell, say, say_table
from raytracer.rendering.renderer import Renderer
from raytracer.version import __version__

FILES = "extremes.csv", "extremes.md"


def report(renderer: Renderer, folder: Path, short: bool, scenes: int, progress: Progress | None) -> bool:
    """Measure, print a summary, write extremes.csv and extremes.md; whether all bounds are kept."""
    from rich.table import Table

    rows = measure(renderer, short=short, scenes=scenes, progress=progress, step=tell_step)
    findings = [finding for row in rows for finding in row.findings]
    table = Table(*HEADING)
    for line in summary(rows):
        table.add_row(*map(cell, line))
    say_table(table)
    for finding in findings:
        if not finding.kept:
            at = f"{finding.what}, {finding.at}, {finding.bits} bits"
            say(f"{at}: {finding.measure}: {shown(finding.found)}, bound {shown(finding.bound)}")
    broken = sum(not finding.kept for finding in findings)
    say(f"{len(findings)} measurements, {broken or 'none'} beyond their bounds")
    if 64 not in renderer.limits.precisions:
        say("nothing is measured with 64 bits: that needs OpenGL 4.0")
    info = renderer.context.info
    form = "in the short form" if short else "in full"
    measured = (
        f"Measured {form}, with {scenes} fuzzed scenes, by raytracer {__version__} "
        f"on {info['GL_RENDERER']}, {info['GL_VERSION']}, {platform.machine()}."
    )
    for name, text in zip(FILES, (as_csv(findings), as_markdown(rows, measured)), strict=True):
        with written_whole(folder / name) as file:
            file.write(text.encode())
        say(f"wrote {folder / name}")
    return broken == 0
