"""A farm: worker processes on this machine, or the workers of a scheduler in the network, by Dask."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any

from raytracer.core.suggest import missing_extra
from raytracer.core.validation import InputError, integer
from raytracer.farm.dispatch import Dispatch
from raytracer.farm.quiet import SILENT, quiet_logs
from raytracer.farm.remote import Identity
from raytracer.farm.roster import FarmError, Roster
from raytracer.farm.scheduler_address import check_address, check_server
from raytracer.farm.tasks import MAX_WORKERS, Done, Failed

if TYPE_CHECKING:
    from distributed import Client

# Seconds to wait for a worker while there is none: a worker starts in 3 to 10 s, also on a slow disk.
_PATIENCE = 60.0
# Seconds that the client tries to reach a scheduler that ended: enough to start it again by hand or by a service.
_RECONNECT = 60.0
# Seconds for one connection. The default, 30 s, would delay each look at the workers of a lost scheduler.
_CONNECT = 5.0
# Seconds for the client's start at a scheduler that has accepted a connection.
_START = 15.0


class Cluster:
    """An open farm. open_cluster() creates it.

    Attributes:
        workers: the identity (code and driver) of each worker that gets work, by its address.
    """

    def __init__(self, client: Client, roster: Roster, mixed: bool, patience: float) -> None:
        self._client, self._roster, self._mixed, self._patience = client, roster, mixed, patience

    @property
    def workers(self) -> Mapping[str, Identity]:
        return dict(self._roster.accepted)

    def run(self, function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]]) -> Iterator[Done | Failed]:
        """Call a function with many jobs on the workers. See tasks.Run.

        A job whose worker dies is called again. A job with which three workers died fails. Raises FarmError if there
        is no scheduler or no worker for a minute, and the errors of the function except InputError.
        """
        return Dispatch(self._client, self._roster, self._mixed, self._patience).run(function, jobs)


@contextmanager
def open_cluster(
    workers: int | None = None,
    scheduler: str | None = None,
    *,
    mixed: bool = False,
    variables: Mapping[str, str] | None = None,
    patience: float = _PATIENCE,
) -> Iterator[Cluster]:
    """Open a farm, and end it with the block.

    Args:
        workers: the number of processes to start on this machine. Range: 1-256. They listen on the loopback only.
        scheduler: in place of `workers`, the address of a running scheduler: tcp://HOST:PORT or tls://HOST:PORT. The
            certificates of TLS are those of Dask's configuration.
        mixed: accept workers with other code than this process, and with different drivers. Default: False.
        variables: environment variables of the processes on this machine.
        patience: the time to wait for a worker while there is none. Default: 60. Seconds.

    Raises:
        InputError: a wrong argument.
        FarmError: no scheduler answers, or no worker can be used.
    """
    if (workers is None) == (scheduler is None):
        raise InputError("expected either workers or scheduler")
    count = 1 if workers is None else integer(workers, "workers", 1, MAX_WORKERS)
    address = None if scheduler is None else check_address(scheduler)
    try:
        import distributed  # noqa: F401
        from dask import config as dask_config
    except ModuleNotFoundError:
        raise InputError(missing_extra("a farm needs", "distributed", "farm")) from None
    if address:
        check_server(address)
    settings: dict[str, Any] = {
        "distributed.comm.timeouts.connect": _CONNECT,
        "distributed.nanny.pre-spawn-environ": {},  # these variables would stay in this process
        "distributed.worker.profile.enabled": False,
        "distributed.scheduler.http.routes": [],  # Dask listens for HTTP in any case, but serves no page
        "distributed.worker.http.routes": [],
    }
    with ExitStack() as stack:
        stack.enter_context(quiet_logs())
        stack.enter_context(dask_config.set(settings))
        if address is None:
            client = stack.enter_context(_local_client(count, variables or {}))
        else:
            client = stack.enter_context(_remote_client(address))
        roster = Roster(client, mixed)
        roster.open(count, patience)
        yield Cluster(client, roster, mixed, patience)


@contextmanager
def _local_client(count: int, variables: Mapping[str, str]) -> Iterator[Client]:
    """Start worker processes on this machine. They end with this process, also if it is killed."""
    from distributed import Client, LocalCluster

    environment = {"LP_NUM_THREADS": str(max(1, _cores() // count)), "OMP_NUM_THREADS": "1"}
    environment = {name: os.environ.get(name, value) for name, value in environment.items()} | dict(variables)
    try:
        with _block_interrupts():  # the threads of Dask, and the processes that they start, never receive Ctrl-C
            cluster = LocalCluster(
                host="127.0.0.1",
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                memory_limit=0,  # a worker beyond its limit would pause for ever; the compiled shaders of one take 1 GB
                dashboard_address="127.0.0.1:0",
                silence_logs=SILENT,
                env=environment,
            )
    except (OSError, RuntimeError, TimeoutError) as error:
        raise FarmError(f"no worker process starts on this machine: {error}") from None
    with cluster, Client(cluster, timeout=_RECONNECT, set_as_default=False, direct_to_workers=True) as client:
        yield client


@contextmanager
def _remote_client(address: str) -> Iterator[Client]:
    """Connect to a scheduler."""
    from distributed import Client

    clients: list[Client] = []
    errors: list[BaseException] = []

    def connect() -> None:
        try:
            clients.append(Client(address, timeout=_RECONNECT, set_as_default=False))
        except BaseException as error:
            errors.append(error)

    # A thread of its own, because Dask waits without a limit for the first message of a server.
    with _block_interrupts():
        thread = threading.Thread(target=connect, daemon=True)
        thread.start()
    thread.join(_START)
    if not clients:
        reason = " ".join(str(errors[0]).split()) if errors else f"no answer within {_START:g} s"
        raise FarmError(f"no connection to the scheduler at {address}: {reason}")
    with clients[0] as client:
        yield client


def _cores() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def _block_interrupts() -> Iterator[None]:
    """Keep Ctrl-C from threads that start in the block, and from their processes. It arrives after the block."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # its start, which comes with the first process, would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
