"""Reports on the OpenGL contexts of this machine: the backends that open, with their devices and drivers."""

from __future__ import annotations

import moderngl
import msgspec

from raytracer.gpu.adapters import closed_adapters, make_none_current
from raytracer.gpu.context import BACKENDS, open_context
from raytracer.gpu.turns import ContextError, record_use


class ContextReport(msgspec.Struct, frozen=True):
    """The driver's names and limits for one backend and device, or the reason why no context opened."""

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
        """The backend's name, with the device's number if there are several devices."""
        return self.backend if self.device is None else f"{self.backend} {self.device}"


def examine_contexts() -> list[ContextReport]:
    """Open and close a context of each backend, with EGL on each device, and report on them."""
    return [
        report
        for backend in BACKENDS
        for report in (_device_reports() if backend == "egl" else [_backend_report(backend)])
    ]


def _device_reports() -> list[ContextReport]:
    record_use()
    reports = [
        _report("egl", adapter.context, adapter.number)
        if adapter.context
        else ContextReport("egl", False, adapter.number, problem=adapter.problem)
        for adapter in closed_adapters()
    ]
    if len(reports) > 1 or any(report.opens for report in reports):
        return reports
    # EGL itself is missing, so the problem is not one of a device.
    problem = "; ".join(report.problem for report in reports) or "no EGL device"
    return [ContextReport("egl", False, problem=problem)]


def _backend_report(backend: str) -> ContextReport:
    try:
        context = open_context(backend)
    except ContextError as error:
        return ContextReport(backend, False, problem=error.problems[backend])
    report = _report(backend, context)
    make_none_current(context)  # a current context, though released, would keep the next one from opening
    context.release()
    return report


def _report(backend: str, context: moderngl.Context, device: int | None = None) -> ContextReport:
    info = context.info
    return ContextReport(
        backend,
        True,
        device,
        vendor=info["GL_VENDOR"],
        renderer=info["GL_RENDERER"],
        version=info["GL_VERSION"],
        max_texture_size=info["GL_MAX_TEXTURE_SIZE"],
        max_uniform_block=info["GL_MAX_UNIFORM_BLOCK_SIZE"],
    )
