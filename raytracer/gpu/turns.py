"""Turns of threads with OpenGL: one thread of a process at a time has a current context; forked processes have none.

A context can be current in only one thread, and a draw depends on the context's bindings. So threads take turns: a
thread holds `turn()` while it draws, and `opengl_lock()` while it opens a context.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import moderngl


class ContextError(RuntimeError):
    """No OpenGL context could be opened or used. The message has the reason and a remedy.

    `problems` has, by the backend's name, the reason why each tried backend did not open.
    """

    def __init__(self, message: str, problems: Mapping[str, str] | None = None) -> None:
        super().__init__(message)
        self.problems = dict(problems or {})


class _Process:
    """The state of this process. A forked process gets a new one."""

    def __init__(self, *, is_cut_off: bool = False) -> None:
        self.is_cut_off = is_cut_off  # whether the process was forked after its parent had used OpenGL
        self.has_used_opengl = False
        self.lock = threading.Lock()
        self.owner: int | None = None  # the thread that holds the lock


_process = _Process()


def _after_fork() -> None:
    """Forget the parent's lock, which a thread that is not in this process may hold."""
    global _process
    _process = _Process(is_cut_off=_process.is_cut_off or _process.has_used_opengl)


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_after_fork)


def check_process() -> None:
    """Raise ContextError in a process that was forked after its parent had used OpenGL.

    A driver has threads and locks, and a fork copies no thread. So the driver waits for ever for threads that do not
    exist, even for a new context: Mesa's contexts share a screen and its threads.
    """
    if _process.is_cut_off:
        raise ContextError(
            "this process was forked after its parent used OpenGL, and OpenGL drivers do not survive a fork: start "
            'it by multiprocessing.get_context("spawn"), or fork before the first picture'
        )


def is_cut_off() -> bool:
    """Return whether this process was forked after its parent had used OpenGL, and so cannot use OpenGL."""
    return _process.is_cut_off


def has_turn() -> bool:
    """Return whether this thread holds a turn, for example in a progress callback, and cannot take another one."""
    return _process.owner == threading.get_ident()


def record_use() -> None:
    """Record that this process uses OpenGL from now on. Raises ContextError as check_process() does."""
    check_process()
    _process.has_used_opengl = True


@contextmanager
def hold_lock() -> Iterator[None]:
    """Hold the process's one lock for a block: no other thread is in such a block meanwhile.

    Raises RuntimeError within another such block of the same thread.
    """
    process = _process
    if process.owner == threading.get_ident():
        raise RuntimeError(
            "expected no use of OpenGL from within a picture's progress callback: render after that picture is done"
        )
    with process.lock:
        try:
            process.owner = threading.get_ident()
            yield
        finally:
            process.owner = None


@contextmanager
def opengl_lock() -> Iterator[None]:
    """Keep all other threads from OpenGL for a block. Raises the errors of hold_lock() and check_process()."""
    check_process()
    with hold_lock():
        yield


@contextmanager
def turn(context: moderngl.Context) -> Iterator[None]:
    """Make `context` current for a block, and no context after it. Raises the errors of opengl_lock()."""
    with opengl_lock():
        try:
            context.__enter__()
            yield
        finally:
            # Also if __enter__ was interrupted: no other thread could use a context that stays current in this one.
            context.__exit__(None, None, None)
