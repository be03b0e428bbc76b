"""Progress of long work, on standard error: a progress bar on a terminal, lines of text elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from raytracer.core.shown import escape_unprintable, format_value
from raytracer.core.terminal import print_note
from raytracer.core.validation import InputError

# Seconds of work after which a progress bar appears on a terminal.
_SECONDS_WITHOUT_BAR = 1.0
# Seconds between two lines: few lines for a log, yet often enough to tell slow work from a hang.
_SECONDS_WITHOUT_LINE = 10.0

# A function of (done, total), two numbers in the same unit.
Progress = Callable[[int, int], None]


def check_progress(value: Any) -> None:
    """Raise InputError unless `value` is a callable object or None."""
    if value is not None and (not callable(value) or isinstance(value, type)):
        raise InputError(f"expected a function of two numbers or None, got {format_value(value)}", "progress")


def progress_bar(title: str) -> AbstractContextManager[Progress]:
    """Return a context manager whose value is a progress callback, which shows progress once the work takes a while.

    The callback takes (done, total), both in the same unit. The total may change from call to call.
    """
    return _bar(title) if _is_terminal() else _lines(title)


@contextmanager
def step_bar(title: str) -> Iterator[Progress]:
    """Show progress as progress_bar() does, for one of several steps.

    If standard error is no terminal, a line announces the step.
    """
    announce_step(title)
    with progress_bar(title) as progress:
        yield progress


def announce_step(title: str) -> None:
    """Print a line that announces a step, unless standard error is a terminal, which shows a bar instead."""
    if not _is_terminal():
        print_note(title)


def format_duration(seconds: float) -> str:
    """Return a duration with one unit: "40 s", "12 min" or "3.5 h"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def _is_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def _lines(title: str) -> Iterator[Progress]:
    start = time.monotonic()
    last_line, last_percent = start, -1

    def progress(done: int, total: int) -> None:
        nonlocal last_line, last_percent
        now, percent = time.monotonic(), 100 * done // max(total, 1)
        if done < total and percent > last_percent and now - last_line >= _SECONDS_WITHOUT_LINE:
            left = f", {format_duration((now - start) * (total - done) / done)} left" if done else ""
            print_note(f"{title}: {percent} %{left}")
            last_line, last_percent = now, percent

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
            task = bar.add_task(escape(escape_unprintable(title)), total=total)
            bar.start()
        if bar is not None:
            bar.update(task, completed=done, total=total)

    try:
        yield progress
    finally:
        if bar is not None:
            bar.stop()
