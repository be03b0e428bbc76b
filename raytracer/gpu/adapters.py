"""Adapters, which EGL and users call devices: one is chosen by its index, by a part of its name, or as the best one.

The name of an adapter is its driver's GL_RENDERER and GL_VENDOR. Only an open adapter tells its name.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

import moderngl

from raytracer.core.shown import printable, shown
from raytracer.core.validation import InputError, whole

VARIABLE = "RAYTRACER_DEVICE"
# More adapters than any machine has; EGL says itself where its list ends.
MAX_ADAPTERS = 64
REQUIRED = 330
# Drivers that draw on the processor, by their GL_RENDERER in lower case: Mesa's, SwiftShader, Windows's own.
_SOFTWARE = ("llvmpipe", "softpipe", "swr", "swrast", "software rasterizer", "swiftshader", "gdi generic")

Adapter = int | str


class Opened(NamedTuple):
    """An adapter of the list: its context, or why it has none."""

    number: int  # in the list
    context: moderngl.Context | None
    name: str  # the renderer and the vendor
    problem: str = ""

    @property
    def is_software(self) -> bool:
        """Whether it draws on the processor."""
        return any(name in self.name.lower() for name in _SOFTWARE)

    def matches(self, adapter: Adapter | None) -> bool:
        """Whether it is the wanted adapter; for None, whether it is hardware."""
        if adapter is None:
            return not self.is_software
        return adapter in self.name.lower() if isinstance(adapter, str) else adapter == self.number


def wanted_adapter(adapter: Any = None) -> Adapter | None:
    """`adapter`, or the value of RAYTRACER_DEVICE if None: an index, a part of a name in lower case; None for the best.

    Raises InputError for anything else.
    """
    where = VARIABLE if adapter is None else "device"
    value: Any = os.environ.get(VARIABLE) or None if adapter is None else adapter
    if value is None:
        return None
    text = value.strip() if isinstance(value, str) else ""
    if text:
        is_index = text.isascii() and text.isdecimal() and len(text) <= len(str(MAX_ADAPTERS))
        return int(text) if is_index else text.lower()
    try:
        return whole(value, where, 0, MAX_ADAPTERS)
    except InputError:
        expected = "the index of an EGL device, or a part of its name"
        raise InputError(f"expected {expected}, got {shown(value)}", where) from None


def open_adapter(adapter: Adapter | None = None, where: str = "device") -> moderngl.Context:
    """A new context, current, on the adapter: for None the first that is hardware, or else the first that opens.

    Raises InputError for an adapter that is not there, with `where` it is named; RuntimeError if there is none, or if
    the adapter does not open.
    """
    seen: list[Opened] = []
    software: moderngl.Context | None = None
    for opened in opened_adapters(adapter if isinstance(adapter, int) else None):
        seen.append(opened)
        if not opened.context:
            continue
        if opened.matches(adapter):
            if software:
                software.release()
            return opened.context
        leave(opened.context)
        if adapter is None and not software:
            software = opened.context
        else:
            opened.context.release()
    if software:
        software.__enter__()
        return software
    if adapter is not None and not seen:
        seen = [*closed_adapters()]
    if adapter is None or (isinstance(adapter, int) and any(each.number == adapter for each in seen)) or not seen:
        raise RuntimeError("; ".join(f"device {each.number}: {each.problem}" for each in seen) or "no EGL device")
    names = "; ".join(f"{each.number} ({each.name or each.problem})" for each in seen)
    expected = f"the index or a part of the name of one of the EGL devices, {names}"
    raise InputError(f"expected {expected}; got {shown(adapter)}", where)


def opened_adapters(index: int | None = None) -> Iterator[Opened]:
    """Yield all adapters, or the one of that index, each open and current; the caller releases it."""
    for i in range(MAX_ADAPTERS) if index is None else (index,):
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


def closed_adapters() -> Iterator[Opened]:
    """Yield all adapters, each closed before the next one."""
    for opened in opened_adapters():
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
