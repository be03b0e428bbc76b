"""Tasks of a farm: a pure function, called with one job after another, in this process or on workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple, Protocol

from raytracer.core.validation import InputError

# The most worker processes on this machine. Each takes some 200 MB.
MAX_WORKERS = 256


class Done(NamedTuple):
    """The result of one job.

    Attributes:
        job: the index of the job.
        value: the value that the function returned.
    """

    job: int
    value: Any


class Failed(NamedTuple):
    """The failure of one job, which leaves all other jobs alone.

    Attributes:
        job: the index of the job.
        reason: the reason in one line: the message of an InputError, or the deaths of three workers.
    """

    job: int
    reason: str


class Run(Protocol):
    """A way to call a function with many jobs: run_here(), or the workers of a farm."""

    def __call__(self, function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]], /) -> Iterator[Done | Failed]:
        """Yield an outcome for each job, in any order, as soon as it is known.

        Args:
            function: a function of a module, without side effects, which may run in another process.
            jobs: (index, argument of the function). Jobs are taken as they are needed, so that there may be millions.
        """
        ...


def run_here(function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]]) -> Iterator[Done | Failed]:
    """Call the function with one job after another, in this process. See Run."""
    for index, job in jobs:
        try:
            value = function(job)
        except InputError as error:
            yield Failed(index, str(error))
        else:
            yield Done(index, value)
