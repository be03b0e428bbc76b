"""Turns with OpenGL: one thread of a process at a time has a context current, and no forked process has any.

A context can be current in one thread at a time, and a draw depends on what is bound in it. So threads take turns:
`turn()` for as long as one of them draws, `alone()` while one opens a context.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import moderngl


class ContextError(RuntimeError):
    """No OpenGL context could be opened or used; the message says why, and a remedy.

    `problems`: why each backend that was tried does not open, by its name.
    """

    def __init__(self, message: str, problems: Mapping[str, str] | None = None) -> None:
        super().__init__(message)
        self.problems = dict(problems or {})


class _Process:
    """The state of this process, which a fork makes anew."""

    def __init__(self, *, is_cut_off: bool = False) -> None:
        self.is_cut_off = is_cut_off  # forked from a process that had begun with OpenGL
        self.has_begun = False
        self.lock = threading.Lock()
        self.owner: int | None = None  # the thread that holds the lock


_process = _Process()


def _after_fork() -> None:
    """Forget the parent's lock, which a thread that is not in this process may hold."""
    global _process
    _process = _Process(is_cut_off=_process.is_cut_off or _process.has_begun)


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_after_fork)


def check_process() -> None:
    """Raise ContextError in a process that was forked from one that had begun with OpenGL.

    A driver has threads and locks, and a fork copies no thread. So the driver waits for ever for threads that are not
    there, also where it opens a new context: Mesa's contexts share a screen, and its threads.
    """
    if _process.is_cut_off:
        raise ContextError(
            "this process was forked after its parent used OpenGL, whose drivers do not survive a fork: start it by "
            'multiprocessing.get_context("spawn"), or fork before the first picture'
        )


def is_cut_off() -> bool:
    """Whether this process was forked from one that had begun with OpenGL, and so cannot use OpenGL."""
    return _process.is_cut_off


def has_turn() -> bool:
    """Whether this thread has a turn, as a progress callback has, in which OpenGL is of no other use."""
    return _process.owner == threading.get_ident()


def begin() -> None:
    """Take note that this process uses OpenGL from now on. Raises ContextError as check_process()."""
    check_process()
    _process.has_begun = True


@contextmanager
def exclusive() -> Iterator[None]:
    """Keep all other threads of this process from such a block.

    Raises RuntimeError within another such block of the same thread.
    """
    process = _process
    if process.owner == threading.get_ident():
        raise RuntimeError(
            "expected no use of OpenGL from within a picture's progress callback: render when that picture is done"
        )
    with process.lock:
        try:
            process.owner = threading.get_ident()
            yield
        finally:
            process.owner = None


@contextmanager
def alone() -> Iterator[None]:
    """Keep all other threads from OpenGL for a block. Errors are those of exclusive() and check_process()."""
    check_process()
    with exclusive():
        yield


@contextmanager
def turn(context: moderngl.Context) -> Iterator[None]:
    """Have `context` current for a block, and none after it. Errors are those of alone()."""
    with alone():
        try:
            context.__enter__()
            yield
        finally:
            # Also where __enter__ was interrupted: a context that stays current in a thread is lost to all others.
            context.__exit__(None, None, None)
