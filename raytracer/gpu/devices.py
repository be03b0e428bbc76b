"""EGL devices: which one a context is opened on, by its index, by a part of its name, or the best one there is.

A device's name is its driver's GL_RENDERER and GL_VENDOR. Nothing else names a device, so to know its name
is to open it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

import moderngl

from raytracer.core.validation import InputError, printable, shown, whole

VARIABLE = "RAYTRACER_DEVICE"
# More devices than any machine has; EGL says itself where its list ends.
MAX_DEVICES = 64
REQUIRED = 330
# Drivers that draw on the processor, by their GL_RENDERER in lower case: Mesa's, SwiftShader, Windows's own.
_SOFTWARE = ("llvmpipe", "softpipe", "swr", "swrast", "software rasterizer", "swiftshader", "gdi generic")

Device = int | str


class Opened(NamedTuple):
    """A device of the list: its context, or why it has none."""

    number: int  # in the list
    context: moderngl.Context | None
    name: str  # the renderer and the vendor
    problem: str = ""

    @property
    def is_software(self) -> bool:
        """Whether it draws on the processor."""
        return any(name in self.name.lower() for name in _SOFTWARE)

    def matches(self, device: Device | None) -> bool:
        """Whether it is the wanted device; for None, hardware."""
        if device is None:
            return not self.is_software
        return device in self.name.lower() if isinstance(device, str) else device == self.number


def wanted_device(device: Any = None) -> Device | None:
    """`device`, or the value of RAYTRACER_DEVICE if None: an index, a part of a name in lower case; None for the best.

    Raises InputError for anything else.
    """
    where = VARIABLE if device is None else "device"
    value: Any = os.environ.get(VARIABLE) or None if device is None else device
    if value is None:
        return None
    text = value.strip() if isinstance(value, str) else ""
    if text:
        return int(text) if text.isascii() and text.isdecimal() and len(text) <= len(str(MAX_DEVICES)) else text.lower()
    try:
        return whole(value, where, 0, MAX_DEVICES)
    except InputError:
        expected = "the index of an EGL device, or a part of its name"
        raise InputError(f"expected {expected}, got {shown(value)}", where) from None


def open_device(device: Device | None = None, where: str = "device") -> moderngl.Context:
    """A new context, current, on the device: for None the first that is hardware, or else the first that opens.

    Raises InputError for a device that is not there, about `where` it is named; RuntimeError if there is none, or if
    the device does not open.
    """
    seen: list[Opened] = []
    software: moderngl.Context | None = None
    for opened in opened_devices(device if isinstance(device, int) else None):
        seen.append(opened)
        if not opened.context:
            continue
        if opened.matches(device):
            if software:
                software.release()
            return opened.context
        leave(opened.context)
        if device is None and not software:
            software = opened.context
        else:
            opened.context.release()
    if software:
        software.__enter__()
        return software
    if device is not None and not seen:
        seen = [*closed_devices()]
    if device is None or (isinstance(device, int) and any(each.number == device for each in seen)) or not seen:
        raise RuntimeError("; ".join(f"device {each.number}: {each.problem}" for each in seen) or "no EGL device")
    names = "; ".join(f"{each.number} ({each.name or each.problem})" for each in seen)
    expected = f"the index or a part of the name of one of the EGL devices, {names}"
    raise InputError(f"expected {expected}; got {shown(device)}", where)


def opened_devices(index: int | None = None) -> Iterator[Opened]:
    """All devices, or the one of that index. Each is opened, and made current, in its turn; the caller releases it."""
    for i in range(MAX_DEVICES) if index is None else (index,):
        try:
            context = _open(i)
        except Exception as error:  # every driver fails in its own way
            reason = str(error) or type(error).__name__
            if "requested device index" in reason:  # beyond the list's end
                return
            yield Opened(i, None, "", reason)
            if "not loaded" in reason:  # EGL itself
                return
        else:
            yield Opened(i, context, printable(f"{context.info['GL_RENDERER']}, {context.info['GL_VENDOR']}"))


def closed_devices() -> Iterator[Opened]:
    """All devices, each closed before the next one."""
    for opened in opened_devices():
        yield opened
        if opened.context:
            leave(opened.context)  # a released one that is current keeps the next from opening
            opened.context.release()


def _open(index: int) -> moderngl.Context:
    from glcontext import egl  # pyright: ignore[reportAttributeAccessIssue] # there is none on Windows and macOS

    # The run-time packages have the .so.1 names; bare .so is in -dev packages only. Without the names, glcontext would
    # import a module to look libraries up, which takes half as long as all of this.
    loader = egl.create_context(
        mode="standalone", glversion=REQUIRED, device_index=index, libgl="libGL.so.1", libegl="libEGL.so.1"
    )
    context = moderngl.create_context(require=REQUIRED, standalone=True, context=loader)
    context.extra = loader  # what knows OpenGL's functions, for those that moderngl does not call (gl.py)
    return context


def leave(context: moderngl.Context) -> None:
    """Have no context current: in this thread it could be in no other one."""
    context.__exit__(None, None, None)
