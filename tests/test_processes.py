"""Processes of tests end with the tests, and react to Ctrl-C."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.processes import list_processes, run_for_output, run_to_end, running_process
from tests.scenes import CHECKOUT

SLEEP = "import time; print('ready', flush=True); time.sleep(600)"


@pytest.fixture(params=[signal.SIG_IGN, signal.default_int_handler], ids=["ignored", "handled"])
def interrupts(request: pytest.FixtureRequest) -> Iterator[object]:
    """Set SIGINT as for a background job of a shell, and as for a job in the foreground."""
    before = signal.signal(signal.SIGINT, request.param)
    yield request.param
    signal.signal(signal.SIGINT, before)


def test_a_process_reacts_to_ctrl_c_even_if_its_parent_ignores_it(interrupts: object) -> None:
    with running_process(sys.executable, "-c", SLEEP, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert signal.getsignal(signal.SIGINT) == interrupts
        assert process.stdout and process.stdout.readline() == b"ready\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(60) != 0


def test_a_process_and_its_children_end_with_the_block() -> None:
    script = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {SLEEP!r}]).wait()"
    with (
        pytest.raises(ZeroDivisionError),
        running_process(sys.executable, "-c", script, stdout=subprocess.PIPE) as process,
    ):
        assert process.stdout and process.stdout.readline() == b"ready\n" and len(list_processes(process.pid)) == 2
        raise ZeroDivisionError
    wait_until_ended(process.pid)
    with pytest.raises(subprocess.TimeoutExpired) as error:
        run_to_end(sys.executable, "-c", SLEEP, timeout=0.5)
    assert SLEEP in error.value.cmd


def wait_until_ended(group: int) -> None:
    """Wait until all processes of a killed group have ended."""
    deadline = time.monotonic() + 60
    while remaining := list_processes(group):
        assert time.monotonic() < deadline, remaining
        time.sleep(0.01)


TEST_FILE = f"""
import subprocess, sys
from tests.processes import running_process
def test_it():
    with running_process(sys.executable, '-c', {SLEEP!r}, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        print(process.pid, file=sys.__stderr__, flush=True)
        process.wait()
if __name__ == '__main__':
    test_it()
"""


@pytest.mark.parametrize("runner", [[], ["-m", "pytest", "-s", "-p", "tests.conftest", "-p", "no:cacheprovider"]])
def test_terminated_tests_and_benchmarks_end_the_processes_that_they_started(runner: list[str], tmp_path: Path) -> None:
    script = tmp_path / "test_it.py"
    script.write_text(TEST_FILE)
    variables = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with running_process(sys.executable, *runner, script, cwd=CHECKOUT, env=variables, **pipes) as process:
        assert process.stderr
        group = int(process.stderr.readline())
        process.terminate()
        assert process.wait(60) == 128 + signal.SIGTERM
    wait_until_ended(group)


def test_output_of_returns_standard_output_and_fails_with_the_process() -> None:
    assert run_for_output(sys.executable, "-c", "print(2)") == "2\n"
    with pytest.raises(AssertionError, match="no good"):
        run_for_output(sys.executable, "-c", "raise SystemExit('no good')")
