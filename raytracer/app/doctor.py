"""Which OpenGL contexts open here, on what device, and what to install if none does."""

from __future__ import annotations

import json
import sys

import moderngl
import msgspec

from raytracer.core.terminal import cell, say, say_json, say_table
from raytracer.gpu.adapters import closed_adapters, leave
from raytracer.gpu.context import BACKENDS, PACKAGES, open_context
from raytracer.gpu.turns import ContextError, begin


class Report(msgspec.Struct, frozen=True):
    """The driver's own words and limits on one way to reach OpenGL, or why it did not open."""

    backend: str
    opens: bool
    device: int | None = None
    vendor: str = ""
    renderer: str = ""
    version: str = ""
    max_texture_size: int = 0
    max_uniform_block: int = 0
    problem: str = ""

    @property
    def name(self) -> str:
        """The backend, and the device."""
        return self.backend if self.device is None else f"{self.backend} {self.device}"


def examine() -> list[Report]:
    """Open and close a context of each kind, for EGL on each device."""
    return [
        report
        for backend in BACKENDS
        for report in (_device_reports() if backend == "egl" else [_backend_report(backend)])
    ]


def _device_reports() -> list[Report]:
    begin()
    reports = [
        _report("egl", each.context, each.number)
        if each.context
        else Report("egl", False, each.number, problem=each.problem)
        for each in closed_adapters()
    ]
    if any(report.opens for report in reports):
        return reports
    # EGL itself is not there: no device is to blame.
    problems = dict.fromkeys(report.problem for report in reports)
    return reports if len(reports) > 1 else [Report("egl", False, problem="; ".join(problems) or "no EGL device")]


def _backend_report(backend: str) -> Report:
    try:
        context = open_context(backend)
    except ContextError as error:
        return Report(backend, False, problem=error.problems[backend])
    report = _report(backend, context)
    leave(context)  # a released one that is current keeps the next from opening
    context.release()
    return report


def _report(backend: str, context: moderngl.Context, device: int | None = None) -> Report:
    info = context.info
    return Report(
        backend,
        True,
        device,
        vendor=info["GL_VENDOR"],
        renderer=info["GL_RENDERER"],
        version=info["GL_VERSION"],
        max_texture_size=info["GL_MAX_TEXTURE_SIZE"],
        max_uniform_block=info["GL_MAX_UNIFORM_BLOCK_SIZE"],
    )


def print_report(reports: list[Report], *, as_json: bool = False) -> None:
    """A table on standard output, and remedies; or JSON."""
    if as_json:
        say_json(json.dumps(msgspec.to_builtins(reports), indent=2))
        return
    from rich.table import Table

    table = Table("backend", *(cell(report.name) for report in reports))
    table.add_row("opens", *("yes" if report.opens else f"no: {cell(report.problem)}" for report in reports))
    for name in ("renderer", "vendor", "version"):
        table.add_row(name, *(cell(getattr(report, name)) for report in reports))
    table.add_row("largest texture", *(f"{r.max_texture_size}" if r.opens else "" for r in reports))
    table.add_row("uniform block", *(f"{r.max_uniform_block // 1024} KiB" if r.opens else "" for r in reports))
    say_table(table)
    if sys.platform != "linux":
        return
    for backend in dict.fromkeys(report.backend for report in reports):
        if not any(report.opens for report in reports if report.backend == backend):
            without_screen = " and, without a screen, run under xvfb-run" if backend == "window" else ""
            packages = PACKAGES[backend]
            say(f"For {backend} on Debian or Ubuntu: apt-get install {packages}{without_screen}")
