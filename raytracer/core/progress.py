"""The progress of work that takes longer than a moment: on standard error, a bar on a terminal, else lines."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from raytracer.core.shown import printable, shown
from raytracer.core.terminal import note
from raytracer.core.validation import InputError

# Seconds. Longer work shows a progress bar on a terminal.
_SECONDS_WITHOUT_BAR = 1.0
# Between lines: few enough for a log, and often enough to tell work from a hang.
_SECONDS_WITHOUT_LINE = 10.0

Progress = Callable[[int, int], None]


def check_progress(value: Any) -> None:
    """Raise InputError unless `value` can be called with two numbers, or is None."""
    if value is not None and (not callable(value) or isinstance(value, type)):
        raise InputError(f"expected a function of two numbers or None, got {shown(value)}", "progress")


def progress_bar(title: str) -> AbstractContextManager[Progress]:
    """A callback that shows how far the work is, once it has taken more than a moment.

    The callback takes (done, total), both in the same unit; the total may be another one each time.
    """
    return _bar(title) if _is_terminal() else _lines(title)


@contextmanager
def step_bar(title: str) -> Iterator[Progress]:
    """Do as progress_bar() for one of several steps: where there is no terminal, a line says that the step begins."""
    tell_step(title)
    with progress_bar(title) as progress:
        yield progress


def tell_step(title: str) -> None:
    """Say in a line that a step begins, but on a terminal, where a bar is."""
    if not _is_terminal():
        note(title)


def _is_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def _lines(title: str) -> Iterator[Progress]:
    told, percent = time.monotonic(), -1

    def progress(done: int, total: int) -> None:
        nonlocal told, percent
        now, share = time.monotonic(), 100 * done // max(total, 1)
        if done < total and share > percent and now - told >= _SECONDS_WITHOUT_LINE:
            note(f"{title}: {share} %")
            told, percent = now, share

    yield progress


@contextmanager
def _bar(title: str) -> Iterator[Progress]:
    start = time.monotonic()
    bar: Any = None
    task: Any = None

    def progress(done: int, total: int) -> None:
        nonlocal bar, task
        if bar is None and done < total and time.monotonic() - start > _SECONDS_WITHOUT_BAR:
            from rich.console import Console
            from rich.markup import escape
            from rich.progress import Progress as Bar

            bar = Bar(console=Console(stderr=True), transient=True)
            task = bar.add_task(escape(printable(title)), total=total)
            bar.start()
        if bar is not None:
            bar.update(task, completed=done, total=total)

    try:
        yield progress
    finally:
        if bar is not None:
            bar.stop()
