"""A bar on the terminal for what takes longer than a moment."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

# What takes longer than this on a terminal shows a progress bar.
_SECONDS_WITHOUT_PROGRESS = 1.0

Progress = Callable[[int, int], None]


@contextmanager
def progress_bar(title: str) -> Iterator[Progress | None]:
    """A callback that shows a bar on a terminal once the work has taken more than a moment.

    It is told (done, total), both in the same unit; the total may be another one each time.
    """
    if not sys.stderr.isatty():
        yield None
        return
    start = time.monotonic()
    bar: Any = None
    task: Any = None

    def progress(done: int, total: int) -> None:
        nonlocal bar, task
        if bar is None and done < total and time.monotonic() - start > _SECONDS_WITHOUT_PROGRESS:
            from rich.console import Console
            from rich.markup import escape
            from rich.progress import Progress as Bar

            bar = Bar(console=Console(stderr=True), transient=True)
            task = bar.add_task(escape(title), total=total)
            bar.start()
        if bar is not None:
            bar.update(task, completed=done, total=total)

    try:
        yield progress
    finally:
        if bar is not None:
            bar.stop()
