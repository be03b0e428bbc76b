"""Graphics adapters, which EGL and users call devices. Users choose one by its index or by a part of its name.

The name of an adapter is its driver's GL_RENDERER and GL_VENDOR. It is known only while the adapter is open.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

import moderngl

from raytracer.core.shown import escape_unprintable, format_value
from raytracer.core.validation import InputError, integer

VARIABLE = "RAYTRACER_DEVICE"
# More adapters than any machine has. EGL reports the end of its list.
MAX_ADAPTERS = 64
REQUIRED = 330
# Drivers that draw on the processor, by their GL_RENDERER in lower case: Mesa's drivers, SwiftShader, Windows's own.
_SOFTWARE = ("llvmpipe", "softpipe", "swr", "swrast", "software rasterizer", "swiftshader", "gdi generic")

Adapter = int | str


class ListedAdapter(NamedTuple):
    """An adapter of the list, with its context, or the reason why none opened."""

    number: int  # its index in EGL's list
    context: moderngl.Context | None
    name: str  # GL_RENDERER and GL_VENDOR
    problem: str = ""

    @property
    def is_software(self) -> bool:
        """Whether the adapter draws on the processor."""
        return any(name in self.name.lower() for name in _SOFTWARE)

    def matches(self, adapter: Adapter | None) -> bool:
        """Return whether this is the requested adapter; for None, whether it is hardware."""
        if adapter is None:
            return not self.is_software
        return adapter in self.name.lower() if isinstance(adapter, str) else adapter == self.number


def choose_adapter(adapter: Any = None) -> Adapter | None:
    """Return the requested adapter: an index, a part of a name in lower case, or None for the best adapter.

    `adapter` is an index or a part of a name; None reads RAYTRACER_DEVICE. Raises InputError for any other value.
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
        return integer(value, where, 0, MAX_ADAPTERS)
    except InputError:
        expected = "the index of an EGL device, or a part of its name"
        raise InputError(f"expected {expected}, got {format_value(value)}", where) from None


def open_adapter(adapter: Adapter | None = None, where: str = "device") -> moderngl.Context:
    """Open a context on an adapter, and make it current.

    None stands for the first adapter that is hardware, or else for the first that opens. `where` names the option that
    chose the adapter, for messages. Raises InputError for an adapter that does not exist; RuntimeError if there is no
    adapter at all, or if the adapter does not open.
    """
    seen: list[ListedAdapter] = []
    software: moderngl.Context | None = None
    for opened in opened_adapters(adapter if isinstance(adapter, int) else None):
        seen.append(opened)
        if not opened.context:
            continue
        if opened.matches(adapter):
            if software:
                software.release()
            return opened.context
        make_none_current(opened.context)
        if adapter is None and not software:
            software = opened.context
        else:
            opened.context.release()
    if software:
        software.__enter__()
        return software
    if adapter is not None and not seen:
        seen = [*closed_adapters()]
    if adapter is None or (isinstance(adapter, int) and any(entry.number == adapter for entry in seen)) or not seen:
        raise RuntimeError("; ".join(f"device {entry.number}: {entry.problem}" for entry in seen) or "no EGL device")
    names = "; ".join(f"{entry.number} ({entry.name or entry.problem})" for entry in seen)
    expected = f"the index or a part of the name of one of the EGL devices, {names}"
    raise InputError(f"expected {expected}; got {format_value(adapter)}", where)


def opened_adapters(index: int | None = None) -> Iterator[ListedAdapter]:
    """Yield all adapters, or only the adapter `index`, each open and current; the caller releases it."""
    for i in range(MAX_ADAPTERS) if index is None else (index,):
        try:
            context = _open(i)
        except Exception as error:  # every driver fails in its own way
            reason = str(error) or type(error).__name__
            if "requested device index" in reason:  # past the end of the list
                return
            yield ListedAdapter(i, None, "", reason)
            if "not loaded" in reason:  # EGL itself is missing
                return
        else:
            yield ListedAdapter(
                i, context, escape_unprintable(f"{context.info['GL_RENDERER']}, {context.info['GL_VENDOR']}")
            )


def closed_adapters() -> Iterator[ListedAdapter]:
    """Yield all adapters, each closed before the next one."""
    for opened in opened_adapters():
        yield opened
        if opened.context:
            make_none_current(
                opened.context
            )  # a current context, though released, would keep the next one from opening
            opened.context.release()


def _open(index: int) -> moderngl.Context:
    from glcontext import egl  # pyright: ignore[reportAttributeAccessIssue] # missing on Windows and macOS

    # The run-time packages have the .so.1 names; only -dev packages have the bare .so. Without these names, glcontext
    # imports a module to look the libraries up, which takes half as long as opening the context.
    loader = egl.create_context(
        mode="standalone", glversion=REQUIRED, device_index=index, libgl="libGL.so.1", libegl="libEGL.so.1"
    )
    context = moderngl.create_context(require=REQUIRED, standalone=True, context=loader)
    context.extra = loader  # the loader of OpenGL's functions, for those that moderngl does not call (gl.py)
    return context


def make_none_current(context: moderngl.Context) -> None:
    """Make no context current. While it is current in this thread, no other thread can use it."""
    context.__exit__(None, None, None)
