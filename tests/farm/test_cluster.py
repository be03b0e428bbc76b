"""Farms keep every outcome, once, whatever ends in the middle: a worker, the scheduler, the disk, or the client."""

from __future__ import annotations

import errno
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from raytracer.core.validation import InputError
from raytracer.farm import dispatch, roster, scheduler_address
from raytracer.farm.cluster import Cluster, open_cluster
from raytracer.farm.roster import FarmError
from raytracer.farm.scheduler_address import check_address, check_server
from raytracer.farm.tasks import Done, Failed
from tests.farm_functions import Job, die_always, die_once, read_notes, refuse_odd, work
from tests.processes import list_processes, running_process
from tests.scenes import CHECKOUT

pytest.importorskip("distributed")
pytestmark = pytest.mark.gl  # each worker opens a context before it gets work


def jobs(folder: Path, count: int, seconds: float = 0.0) -> Iterator[tuple[int, Job]]:
    return ((number, Job(number, folder, seconds)) for number in range(count))


def numbers(outcomes: list[Done | Failed]) -> list[int]:
    return sorted(outcome.job for outcome in outcomes if isinstance(outcome, Done))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    with open_cluster(workers=2) as cluster:
        yield cluster


@contextmanager
def dask(*arguments: str, path: str = "") -> Iterator[subprocess.Popen[bytes]]:
    """Run a scheduler or a worker, as a user starts it."""
    environment = dict(os.environ) | {"PYTHONPATH": os.pathsep.join(filter(None, (path, str(CHECKOUT))))}
    command = (sys.executable, "-m", "dask", *arguments)
    with running_process(
        *command, env=environment, cwd=path or CHECKOUT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        yield process


def free_port() -> int:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        return server.getsockname()[1]


def wait_for_scheduler(address: str) -> None:
    for _ in range(300):
        try:
            return check_server(address)
        except FarmError:
            time.sleep(0.1)
    raise AssertionError("the scheduler did not start")


def scheduler_at(port: int) -> tuple[str, ...]:
    return "scheduler", "--host", "127.0.0.1", "--port", str(port), "--dashboard-address", "127.0.0.1:0"


def worker_of(address: str) -> tuple[str, ...]:
    return (
        "worker",
        address,
        "--host",
        "127.0.0.1",
        "--nthreads",
        "1",
        "--dashboard-address",
        "127.0.0.1:0",
        "--memory-limit",
        "0",
    )


def test_workers_share_the_jobs_and_the_cores(cluster: Cluster, tmp_path: Path) -> None:
    outcomes = [*cluster.run(work, jobs(tmp_path, 12, 0.05))]
    assert numbers(outcomes) == sorted(read_notes(tmp_path, "ended")) == [*range(12)]
    assert {outcome.value[1] for outcome in outcomes if isinstance(outcome, Done)}.isdisjoint({os.getpid()})
    assert len(cluster.workers) == 2
    assert len({*cluster.workers.values()}) == 1


def test_jobs_are_taken_as_they_are_needed(cluster: Cluster, tmp_path: Path) -> None:
    taken = 0

    def endless() -> Iterator[tuple[int, Job]]:
        nonlocal taken
        while True:
            yield taken, Job(taken, tmp_path)
            taken += 1

    run = cluster.run(work, endless())
    for _ in range(5):
        next(run)
    run.close()  # pyright: ignore[reportAttributeAccessIssue]
    assert taken <= 5 + 2 * 8 * 2


def test_a_refused_job_leaves_the_others_alone(cluster: Cluster, tmp_path: Path) -> None:
    outcomes = [*cluster.run(refuse_odd, jobs(tmp_path, 6))]
    assert numbers(outcomes) == [0, 2, 4]
    refused = {outcome.job: outcome.reason for outcome in outcomes if isinstance(outcome, Failed)}
    assert refused == {number: f"frames[{number}]: expected an even number" for number in (1, 3, 5)}


def test_a_killed_worker_costs_its_job_once_more(cluster: Cluster, tmp_path: Path) -> None:
    outcomes = [*cluster.run(die_once, jobs(tmp_path, 12, 0.05))]
    assert numbers(outcomes) == [*range(12)]
    assert read_notes(tmp_path, "deaths") == [3]


def test_a_job_that_kills_three_workers_fails_and_all_others_are_done(cluster: Cluster, tmp_path: Path) -> None:
    outcomes = [*cluster.run(die_always, jobs(tmp_path, 12, 0.05))]
    assert numbers(outcomes) == [number for number in range(12) if number != 3]
    [failed] = [outcome for outcome in outcomes if isinstance(outcome, Failed)]
    assert failed.job == 3
    assert failed.reason.startswith("3 workers ended while they worked on it: tcp://127.0.0.1:")
    assert read_notes(tmp_path, "deaths") == [3, 3, 3]


def test_a_full_disk_ends_the_run_and_keeps_the_outcomes_before(cluster: Cluster, tmp_path: Path) -> None:
    kept = []
    with pytest.raises(OSError, match="No space left") as error:
        for outcome in cluster.run(work, jobs(tmp_path, 200, 0.01)):
            with open("/dev/full" if len(kept) == 3 else os.devnull, "w") as file:
                file.write("a picture")
            kept.append(outcome)
    assert error.value.errno == errno.ENOSPC
    assert len({outcome.job for outcome in kept}) == 3
    time.sleep(0.5)
    assert len(read_notes(tmp_path, "begun")) < 100
    assert numbers([*cluster.run(work, jobs(tmp_path, 4))]) == [0, 1, 2, 3]


def test_a_restarted_scheduler_gets_only_the_jobs_that_are_not_done(tmp_path: Path) -> None:
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    with ExitStack() as stack:
        scheduler = stack.enter_context(dask(*scheduler_at(port)))
        wait_for_scheduler(address)
        with ExitStack() as workers:
            workers.enter_context(dask(*worker_of(address)))
            cluster = stack.enter_context(open_cluster(scheduler=address))
            run = cluster.run(work, jobs(tmp_path, 20, 0.1))
            outcomes = [next(run) for _ in range(5)]
            scheduler.kill()
            scheduler.wait()
        before = {*read_notes(tmp_path, "ended")}
        stack.enter_context(dask(*scheduler_at(port)))
        stack.enter_context(dask(*worker_of(address)))  # a worker that starts late
        outcomes += run
    assert numbers(outcomes) == [*range(20)]
    ended = read_notes(tmp_path, "ended")
    drawn_twice = {number for number in ended if ended.count(number) > 1}
    assert drawn_twice <= before - {outcome.job for outcome in outcomes[:5]}


@pytest.fixture(scope="module")
def other_workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A scheduler with a worker of other code, and one without this project."""
    folder = tmp_path_factory.mktemp("empty")
    (folder / "raytracer").mkdir()
    (folder / "raytracer" / "__init__.py").write_text("")
    address = f"tcp://127.0.0.1:{free_port()}"
    with dask(*scheduler_at(int(address.rpartition(":")[2]))):
        wait_for_scheduler(address)
        with dask(*worker_of(address)), dask(*worker_of(address), path=str(folder)):
            yield address


def test_a_worker_without_the_project_is_said_and_gets_no_work(other_workers: str, tmp_path: Path) -> None:
    with (
        pytest.warns(UserWarning, match="lacks the Python package raytracer"),
        open_cluster(scheduler=other_workers) as cluster,
    ):
        for _ in range(3):  # the second worker may answer late
            assert numbers([*cluster.run(work, jobs(tmp_path, 8, 0.1))]) == [*range(8)]
        assert len(cluster.workers) == 1


def test_a_worker_of_another_version_is_refused_unless_mixed(
    other_workers: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (roster, dispatch):
        monkeypatch.setattr(module, "own_code", lambda: "9.9.9 (another)")
    with pytest.warns(UserWarning) as warnings, pytest.raises(FarmError, match="no worker of the farm can be used"):
        open_cluster(scheduler=other_workers, patience=10).__enter__()
    assert any("runs raytracer 0." in str(w.message) and "expected 9.9.9" in str(w.message) for w in warnings)
    with pytest.warns(UserWarning, match="lacks"), open_cluster(scheduler=other_workers, mixed=True) as cluster:
        assert numbers([*cluster.run(work, jobs(tmp_path, 2))]) == [0, 1]


def test_no_worker_in_time_is_a_clear_error() -> None:
    port = free_port()
    with dask(*scheduler_at(port)):
        wait_for_scheduler(f"tcp://127.0.0.1:{port}")
        with (
            pytest.raises(FarmError, match="no worker of the farm answered within 1 s"),
            open_cluster(scheduler=f"tcp://127.0.0.1:{port}", patience=1),
        ):
            pass


BAD = [
    "",
    "x",
    "tcp://",
    "tcp://host",
    "http://127.0.0.1:8786",
    "tcp://h:0",
    "tcp://h:65536",
    "tcp://h:1/x",
    "tcp://a b:1",
]
BAD += [
    "tcp://h:1\n",
    "tcp://user@h:1",
    "//h:1",
    "h:1",
    "tcp://:1",
    "ucx://h:1",
    "tcp://h:-1",
    "tcp://h:x",
    "inproc://1",
]


@pytest.mark.parametrize("address", BAD)
def test_an_address_of_another_form_is_refused(address: str) -> None:
    with pytest.raises(InputError, match="expected tcp://HOST:PORT"):
        check_address(address)


@pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-OpenSSH_9.2p1 Debian\r\n", b"HTTP/1.1 400 Bad Request\r\n\r\n"])
def test_another_server_at_the_port_is_no_scheduler(greeting: bytes) -> None:
    lines = [
        "import socket",
        "server = socket.create_server(('127.0.0.1', 0))",
        "print(server.getsockname()[1], flush=True)",
        "connection, _ = server.accept()",
        f"connection.sendall({greeting!r})",
        "connection.close()",
    ]
    code = "\n".join(lines)
    with running_process(sys.executable, "-c", code, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        with pytest.raises(FarmError, match="no Dask scheduler"):
            check_server(f"tcp://127.0.0.1:{int(process.stdout.readline())}")


def test_a_scheduler_that_is_not_there_is_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler_address, "_SECONDS", 0.5)  # of attempts, because a scheduler may be starting
    for address in (f"tcp://127.0.0.1:{free_port()}", "tcp://no-such-host.invalid:8786"):
        with pytest.raises(FarmError, match="no scheduler at tcp://"):
            check_server(address)


SCRIPT = """
import sys
from pathlib import Path
from raytracer.farm.cluster import open_cluster
from tests.farm_functions import Job, work
if __name__ == "__main__":
    folder = Path(sys.argv[1])
    with open_cluster(workers=2) as cluster:
        for outcome in cluster.run(work, ((k, Job(k, folder, 0.2)) for k in range(10**6))):
            print(outcome.job, flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_the_client(number: signal.Signals, tmp_path: Path) -> None:
    (tmp_path / "client.py").write_text(SCRIPT)
    environment = dict(os.environ) | {"PYTHONPATH": str(CHECKOUT)}
    command = (sys.executable, tmp_path / "client.py", tmp_path)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with running_process(*command, env=environment, text=True, **pipes) as process:
        assert process.stdout and process.stderr
        assert process.stdout.readline() and process.stdout.readline()
        send: Callable[[int, int], None] = os.killpg if number == signal.SIGINT else os.kill  # a terminal's Ctrl-C
        send(process.pid, number)
        errors = process.stderr.read()
        process.wait(30)
        for _ in range(100):
            if not list_processes(process.pid):
                break
            time.sleep(0.1)
        assert not list_processes(process.pid)
    if number == signal.SIGINT:
        assert errors.splitlines()[-1] == "KeyboardInterrupt"
        assert errors.count("Traceback") == 1, errors
    else:
        assert "Traceback" not in errors
