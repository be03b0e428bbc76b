"""Processes of tests: none outlives its test, and each reacts to Ctrl-C, even if the tests' own parent ignores it."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

# Seconds, for processes that take a minute on two busy slow cores.
TIMEOUT = 600.0


@contextmanager
def running_process(*command: str | Path, **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """Run a process in a group of its own, and kill the whole group when the block ends in any way.

    `options` are subprocess.Popen's.
    """
    # By default SIGTERM, for example from a time limit, ends this process without any `finally`. pytest has a handler.
    if signal.getsignal(signal.SIGTERM) == signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _exit)
    # A background job of a shell (`&`) ignores SIGINT, and its children inherit that. They do not inherit a handler.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        process = subprocess.Popen(command, start_new_session=True, **options)
    finally:
        signal.signal(signal.SIGINT, before)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):  # the whole group has ended
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        for pipe in filter(None, (process.stdin, process.stdout, process.stderr)):
            pipe.close()


def _exit(number: int, _frame: object) -> NoReturn:
    sys.exit(128 + number)


def run_to_end(*command: str | Path, timeout: float = TIMEOUT, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a process until it ends; return it with its standard output and error. `options` are subprocess.Popen's."""
    pipes: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with running_process(*command, **pipes, text=True, **options) as process:
        output, errors = process.communicate(timeout=timeout)
    return subprocess.CompletedProcess(command, process.returncode, output, errors)


def run_for_output(*command: str | Path, **options: Any) -> str:
    """Run a process that must end with status 0; return its standard output. `options`: as for run_to_end()."""
    done = run_to_end(*command, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def list_processes(group: int) -> list[str]:
    """Return the running processes of a group, as lines of /proc on Linux."""
    stats = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            stats.append(file.read_text())
    fields = [(stat, stat.rpartition(")")[2].split()) for stat in stats]
    return [stat for stat, (state, _, own, *_) in fields if int(own) == group and state != "Z"]
