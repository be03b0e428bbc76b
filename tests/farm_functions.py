"""Functions for the workers of a farm. Each notes its calls in files, where a test counts them."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import NamedTuple

from raytracer.core.validation import InputError


class Job(NamedTuple):
    """A job: its number, the folder of notes, and the time that it takes."""

    number: int
    folder: Path
    seconds: float = 0.0


def note(folder: Path, event: str, number: int) -> None:
    """Add a line to the notes of an event. Short lines are added whole, also by several processes."""
    with open(folder / event, "a") as file:
        file.write(f"{number}\n")


def read_notes(folder: Path, event: str) -> list[int]:
    """Return the numbers that were noted for an event."""
    file = folder / event
    return [int(line) for line in file.read_text().split()] if file.exists() else []


def work(job: Job) -> tuple[int, int]:
    """Take the time of the job, and return its number and the process."""
    note(job.folder, "begun", job.number)
    time.sleep(job.seconds)
    note(job.folder, "ended", job.number)
    return job.number, os.getpid()


def die_once(job: Job) -> tuple[int, int]:
    """Kill the process in the middle of job 3, the first time; otherwise work."""
    if job.number == 3 and 3 not in read_notes(job.folder, "deaths"):
        note(job.folder, "deaths", 3)
        os.kill(os.getpid(), signal.SIGKILL)
    return work(job)


def die_always(job: Job) -> tuple[int, int]:
    """Kill the process at each try of job 3, and work otherwise."""
    if job.number == 3:
        note(job.folder, "deaths", 3)
        os.kill(os.getpid(), signal.SIGKILL)
    return work(job)


def refuse_odd(job: Job) -> tuple[int, int]:
    """Refuse jobs of odd numbers as a scene's errors do."""
    if job.number % 2:
        raise InputError("expected an even number", ("frames", job.number))
    return work(job)
