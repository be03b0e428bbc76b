"""Processes that tests start: none outlives its test, and each takes Ctrl-C, whatever the tests' own parent does."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

# For what takes a minute on two slow cores that do other things, too.
TIMEOUT = 600.0


@contextmanager
def running(*command: str | Path, **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """A process in a group of its own, which is killed with all that it started when the block ends in any way.

    `options` are subprocess.Popen's.
    """
    # Terminated, as by a time limit, this process would end without any `finally`. pytest has a way of its own.
    if signal.getsignal(signal.SIGTERM) == signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _exit)
    # What a shell starts with `&` ignores SIGINT, and so would all that it starts. A handler of ours is not inherited.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        process = subprocess.Popen(command, start_new_session=True, **options)
    finally:
        signal.signal(signal.SIGINT, before)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):  # all of the group has ended
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        for pipe in filter(None, (process.stdin, process.stdout, process.stderr)):
            pipe.close()


def _exit(number: int, _frame: object) -> NoReturn:
    sys.exit(128 + number)


def finished(*command: str | Path, timeout: float = TIMEOUT, **options: Any) -> subprocess.CompletedProcess[str]:
    """A process that has ended by itself, with its standard output and error. `options` are subprocess.Popen's."""
    pipes: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with running(*command, **pipes, text=True, **options) as process:
        output, errors = process.communicate(timeout=timeout)
    return subprocess.CompletedProcess(command, process.returncode, output, errors)


def output_of(*command: str | Path, **options: Any) -> str:
    """The standard output of a process that must end with status 0. Else as finished()."""
    done = finished(*command, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def in_group(group: int) -> list[str]:
    """The processes of a group that still run, as Linux shows them."""
    stats = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            stats.append(file.read_text())
    fields = [(stat, stat.rpartition(")")[2].split()) for stat in stats]
    return [stat for stat, (state, _, own, *_) in fields if int(own) == group and state != "Z"]
