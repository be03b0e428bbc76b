"""Parallel work: a pool of processes, each with a function that is created once and called for one task at a time."""

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

# Fewer tasks than this are done in the calling process, because worker processes take half a second to start.
_FEW = 8


class Processes:
    """A pool of worker processes, each of which calls the function `make(job)` with tasks.

    The processes are spawned, because threads of OpenGL drivers do not survive a fork. Only the calling process handles
    Ctrl-C. When it ends, for any reason, the worker processes end, too.

    Args:
        make: a function that takes the job and returns the function for tasks. Both must be importable.
        job: the argument of `make`.
        workers: the number of processes. Default: the number of processors.
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
        """Yield each task with its result, in any order."""
        tasks = list(tasks)
        if self._workers == 1 or (len(tasks) < _FEW and not self._pool):
            self._here = self._here or self._make(self._job)
            yield from ((task, self._here(task)) for task in tasks)
            return
        if not self._pool:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self._workers, context, _start_worker, (self._make, self._job))
        with _defer_interrupts():
            futures = {self._pool.submit(_work, task): task for task in tasks}
        for future in as_completed(futures):
            yield futures.pop(future), future.result()


@contextmanager
def _defer_interrupts() -> Iterator[None]:
    """Delay Ctrl-C until the end of the block. Processes that start in the block never receive it."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# The function of this process, if it is a worker. It is a global, because a pool can only call functions of a module.
_worker: Callable[[Any], Any] | None = None


def _start_worker(make: Callable[[Any], Callable[[Any], Any]], job: Any) -> None:
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
