"""Distribution of jobs to the workers of a roster: few at a time, again after a worker's death, each outcome once.

The client assigns each job to one worker. So it knows which jobs a dying worker had. These jobs are tried again, each
alone on its worker: a further death is then the fault of that job, and the jobs that only waited beside it succeed.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

from raytracer.farm.remote import Answer, call, own_code
from raytracer.farm.roster import FarmError, Roster, other_code
from raytracer.farm.tasks import Done, Failed

if TYPE_CHECKING:
    from distributed import Client, Future

# Deaths of workers after which a job is reported as failed. Two deaths may be chance, such as a full memory.
MOST_DEATHS = 3
# Seconds of work that a worker has waiting, so that it need not wait for the client: an exchange takes some 10 ms. The
# more, the longer the last worker of all works alone.
_AHEAD = 1.0
# The most jobs of a worker at a time, for jobs that take next to no time.
_MOST_JOBS = 8
# Seconds between two looks at the workers while no outcome comes.
_TICK = 0.1
# Threads that fetch results. Each fetch waits for the network.
_FETCHERS = 4


class _Job:
    """A job: its index, its pickle, and the workers that ended while they had it."""

    __slots__ = ("deaths", "index", "payload")

    def __init__(self, index: int, payload: bytes) -> None:
        self.index, self.payload = index, payload
        self.deaths: list[str] = []


class _Flight(NamedTuple):
    """A job on its way: the worker's address, and Dask's future."""

    job: _Job
    worker: str
    future: Future


class Dispatch:
    """One run of a function with many jobs. See tasks.Run.

    Args:
        client: a connected client.
        roster: the workers.
        mixed: whether workers may have other code.
        patience: the seconds to wait for a worker, while there is none.
    """

    def __init__(self, client: Client, roster: Roster, mixed: bool, patience: float) -> None:
        self._client, self._roster, self._patience = client, roster, patience
        self._code = None if mixed else own_code()
        self._flights: dict[str, _Flight] = {}
        self._again: deque[_Job] = deque()
        self._results: SimpleQueue[tuple[str, Answer | BaseException]] = SimpleQueue()
        self._mean_seconds = _AHEAD * _MOST_JOBS  # no job waits until the first one has told its time

    def run(self, function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]]) -> Iterator[Done | Failed]:
        """Yield the outcomes. Raises FarmError, and the errors of the function except InputError."""
        packed = (_Job(index, pickle.dumps((function, job), protocol=5)) for index, job in jobs)
        last_worker = time.monotonic()
        with ThreadPoolExecutor(_FETCHERS, "raytracer-farm") as fetchers:
            try:
                while True:
                    self._assign(packed, fetchers)
                    if not self._flights and not self._again:
                        job = next(packed, None)  # there is no worker for it, or no job
                        if job is None:
                            return
                        self._again.append(job)
                    yield from self._outcomes()
                    self._check_connection()
                    self._roster.refresh()
                    yield from self._bury()
                    now = time.monotonic()
                    last_worker = now if self._roster.accepted else last_worker
                    if now - last_worker > self._patience:
                        raise FarmError(self._roster.absence(self._patience))
            finally:
                self._cancel([flight.future for flight in self._flights.values()])
                self._flights.clear()

    def _assign(self, packed: Iterator[_Job], fetchers: ThreadPoolExecutor) -> None:
        """Give jobs to the workers that have too few, first to those that have fewest."""
        loads = dict.fromkeys(self._roster.accepted, 0)
        closed: set[str] = set()  # workers with a job that must be alone
        for flight in self._flights.values():
            loads[flight.worker] = loads.get(flight.worker, 0) + 1
            if flight.job.deaths:
                closed.add(flight.worker)
        depth = 1 if self._again else 1 + min(int(_AHEAD / max(self._mean_seconds, 1e-6)), _MOST_JOBS - 1)
        for level in range(depth):
            for worker in self._roster.accepted:
                if loads[worker] != level or worker in closed or (self._again and level):
                    continue
                job = self._again.popleft() if self._again else next(packed, None)
                if job is None:
                    return
                self._send(job, worker, fetchers)
                loads[worker] += 1
                if job.deaths:
                    closed.add(worker)

    def _send(self, job: _Job, worker: str, fetchers: ThreadPoolExecutor) -> None:
        future = self._client.submit(call, job.payload, self._code, workers=[worker], pure=False)
        self._flights[str(future.key)] = _Flight(job, worker, future)
        future.add_done_callback(lambda done: fetchers.submit(self._fetch, done))

    def _fetch(self, future: Future) -> None:
        """Fetch a result, in a thread of its own."""
        try:
            result: Answer | BaseException = Answer(*future.result())
        except BaseException as error:  # a CancelledError, too: the main thread decides
            result = error
        self._results.put((str(future.key), result))

    def _outcomes(self) -> Iterator[Done | Failed]:
        """Wait a little for results, and yield their outcomes."""
        timeout: float = _TICK
        while True:
            try:
                key, result = self._results.get(timeout=timeout)
            except Empty:
                return
            timeout = 0.0
            flight = self._flights.pop(key, None)
            if flight is None:  # the job was given to another worker meanwhile
                continue
            if isinstance(result, BaseException):
                yield from self._after_error(flight, result)
            elif self._code not in (None, result.code):
                self._roster.refuse(flight.worker, other_code(result.code))
                self._again.append(flight.job)
            elif result.refusal is not None:
                yield Failed(flight.job.index, result.refusal)
            else:
                is_first = self._mean_seconds == _AHEAD * _MOST_JOBS
                share = 1.0 if is_first else 0.2  # of the newest time in the mean, which follows slow changes
                self._mean_seconds += share * (result.seconds - self._mean_seconds)
                yield Done(flight.job.index, result.value)

    def _after_error(self, flight: _Flight, error: BaseException) -> Iterator[Failed]:
        """Send a job again whose result was lost, or raise the error of the function."""
        name = type(error).__name__
        if name == "KilledWorker":  # the scheduler itself noticed the death
            yield from self._count_death(flight)
        elif "Cancelled" in name:  # the connection to the scheduler was lost
            self._again.append(flight.job)
        else:
            raise error

    def _bury(self) -> Iterator[Failed]:
        """Take back the jobs of workers that have gone."""
        lost = {key: flight for key, flight in self._flights.items() if flight.worker not in self._roster.accepted}
        if not lost:
            return
        for key in lost:
            del self._flights[key]
        self._cancel([flight.future for flight in lost.values()])
        for flight in lost.values():
            if flight.worker in self._roster.refused or flight.future.status == "lost":
                self._again.append(flight.job)
            else:
                yield from self._count_death(flight)

    def _count_death(self, flight: _Flight) -> Iterator[Failed]:
        job = flight.job
        job.deaths.append(flight.worker)
        if len(job.deaths) < MOST_DEATHS:
            self._again.append(job)
        else:
            workers = ", ".join(job.deaths)
            yield Failed(job.index, f"{len(job.deaths)} workers ended while they worked on it: {workers}")

    def _cancel(self, futures: list[Future]) -> None:
        if futures and self._client.status == "running":
            self._client.cancel(futures, force=True)

    def _check_connection(self) -> None:
        if self._client.status == "closed":
            raise FarmError("the scheduler of the farm ended, and did not come back; start it again and repeat")
