"""Which OpenGL contexts open here, on what device, and what to install if none does."""

from __future__ import annotations

import json
import sys

import msgspec

from raytracer.context import BACKENDS, PACKAGES, ContextError, open_context
from raytracer.terminal import cell, say, say_json, say_table


class Report(msgspec.Struct, frozen=True):
    """What one way to reach OpenGL gave: the driver's own words and limits, or why it did not open."""

    backend: str
    opens: bool
    vendor: str = ""
    renderer: str = ""
    version: str = ""
    max_texture_size: int = 0
    max_uniform_block: int = 0
    problem: str = ""


def examine() -> list[Report]:
    """Open and close a context of each kind."""
    return [_examine(backend) for backend in BACKENDS]


def _examine(backend: str) -> Report:
    try:
        context = open_context(backend)
    except ContextError as error:
        reason = str(error).splitlines()[1].strip().removeprefix(f"{backend}: ")
        return Report(backend, False, problem=reason)
    info = context.info
    report = Report(
        backend,
        True,
        vendor=info["GL_VENDOR"],
        renderer=info["GL_RENDERER"],
        version=info["GL_VERSION"],
        max_texture_size=info["GL_MAX_TEXTURE_SIZE"],
        max_uniform_block=info["GL_MAX_UNIFORM_BLOCK_SIZE"],
    )
    with context:
        pass  # leaving makes no context current: a released one that still is keeps the next from opening
    context.release()
    return report


def print_report(reports: list[Report], *, as_json: bool = False) -> None:
    """A table on standard output, and remedies; or JSON."""
    if as_json:
        say_json(json.dumps(msgspec.to_builtins(reports), indent=2))
        return
    from rich.table import Table

    table = Table("backend", *(report.backend for report in reports))
    table.add_row("opens", *("yes" if report.opens else f"no: {cell(report.problem)}" for report in reports))
    for name in ("renderer", "vendor", "version"):
        table.add_row(name, *(cell(getattr(report, name)) for report in reports))
    table.add_row("largest texture", *(f"{r.max_texture_size}" if r.opens else "" for r in reports))
    table.add_row("uniform block", *(f"{r.max_uniform_block // 1024} KiB" if r.opens else "" for r in reports))
    say_table(table)
    if sys.platform != "linux":
        return
    for report in reports:
        if not report.opens:
            without_screen = " and, without a screen, run under xvfb-run" if report.backend == "window" else ""
            packages = PACKAGES[report.backend]
            say(f"For {report.backend} on Debian or Ubuntu: apt-get install {packages}{without_screen}")
