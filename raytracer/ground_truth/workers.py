"""Work on all processors: the same object in each of some processes, called with one task after the other."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from types import TracebackType
from typing import Any, TypeVar

T = TypeVar("T")

# Fewer tasks than this are done here: other processes take half a second to start.
_FEW = 8


class Processes:
    """`make(job)` in each of `workers` processes, by default as many as the machine has processors.

    They are spawned, as threads of OpenGL drivers do not survive a fork. Ctrl-C is for this process alone, and when it
    ends in any way so do they.
    """

    def __init__(self, make: Callable[[Any], Callable[[Any], Any]], job: Any, workers: int | None = None) -> None:
        self._make, self._job = make, job
        self._workers = workers or os.cpu_count() or 1
        self._pool: ProcessPoolExecutor | None = None
        self._here: Callable[[Any], Any] | None = None

    def __enter__(self) -> Processes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool:
            self._pool.shutdown(cancel_futures=True)

    def map(self, tasks: Iterable[T]) -> Iterator[tuple[T, Any]]:
        """Each task with its result, in any order."""
        tasks = list(tasks)
        if self._workers == 1 or (len(tasks) < _FEW and not self._pool):
            self._here = self._here or self._make(self._job)
            yield from ((task, self._here(task)) for task in tasks)
            return
        if not self._pool:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self._workers, context, _begin, (self._make, self._job))
        with _uninterrupted():
            futures = {self._pool.submit(_work, task): task for task in tasks}
        for future in as_completed(futures):
            yield futures.pop(future), future.result()


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Ctrl-C waits; a process that is started in the block never gets it, not even while it starts."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# The object of this process, if this process is a worker. A pool hands its tasks to functions of a module only.
_worker: Callable[[Any], Any] | None = None


def _begin(make: Callable[[Any], Callable[[Any], Any]], job: Any) -> None:
    global _worker
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _worker = make(job)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _work(task: Any) -> Any:
    assert _worker is not None
    return _worker(task)
