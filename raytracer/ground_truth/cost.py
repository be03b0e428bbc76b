"""The memory and the time that a converged picture (converged.py) takes, estimated before it is traced."""

from __future__ import annotations

import os
import time
from typing import NamedTuple

import numpy as np

from raytracer.core.memory import check_memory, physical_memory
from raytracer.core.validation import InputError
from raytracer.ground_truth.job import FIRST_SAMPLES, Job
from raytracer.ground_truth.pixel_tasks import RAYS, Task, TaskTracer
from raytracer.scene.scene import Scene
from raytracer.scene.solids import leaves

# Bytes of each pixel: sums, results of processes that are not summed up yet, the picture, its masks.
_PIXEL = 256
# Those of a process, beside a table of which surfaces coincide.
_PROCESS = 1 << 26
# A ray meets each primitive of a tree at each root of each: so many steps of NumPy for a pair. One takes a microsecond.
_STEPS, _STEP_SECONDS = 16, 1e-6
# Seconds. A pixel that takes longer is not traced for an estimate.
_TRIED = 1.0
_UNITS = (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0))


class Cost(NamedTuple):
    """`seconds`, or at least so many if not `tried`; for so many `primitives`."""

    seconds: float
    tried: bool
    primitives: int

    def __str__(self) -> str:
        unit, length = next((each for each in _UNITS if self.seconds >= 2.0 * each[1]), ("seconds", 1.0))
        about = "about" if self.tried else "at least"
        return f"{about} {self.seconds / length:.0f} {unit}: each ray meets each of {self.primitives} primitives"


def check_cost(scene: Scene, size: tuple[int, int], workers: int | None = None) -> None:
    """Raise InputError if a converged picture needs more memory than this machine has; warn if it needs much."""
    workers = workers or os.cpu_count() or 1
    count = sum(len(leaves(solid)) for solid in scene.solids())
    table, physical = workers * count**2, physical_memory()
    if physical is not None and table > physical:
        most = int((physical / workers) ** 0.5)
        raise InputError(
            f"expected at most {most} primitives for the float64 reference in this machine's memory, got {count}; "
            "raytracer render has no such limit"
        )
    check_memory(size[0] * size[1] * _PIXEL + workers * _PROCESS + table, size)


def estimate_cost(job: Job, workers: int | None = None) -> Cost:
    """Estimate how long a job takes, by tracing some of its pixels."""
    width, height = job.size
    workers = min(workers or os.cpu_count() or 1, max(1, width * height * FIRST_SAMPLES // RAYS))
    counts = [len(leaves(solid)) for solid in job.scene.solids()]
    rays = width * height * job.expected_samples / workers
    least = sum(_STEPS * _STEP_SECONDS * count**2 for count in counts)  # of RAYS or fewer at once
    if least > _TRIED:
        return Cost(rays / RAYS * least, False, sum(counts))
    tracer = TaskTracer(job)
    rng = np.random.default_rng(0)
    pixels = np.sort(rng.choice(width * height, min(RAYS // FIRST_SAMPLES, width * height), replace=False))
    for tried in (pixels[:1], pixels):
        begin = time.perf_counter()
        tracer(Task(tried, FIRST_SAMPLES, (0, FIRST_SAMPLES, 0)))
        seconds = time.perf_counter() - begin
        if seconds > _TRIED:
            break
    # A single pixel's rays take about as long as all that are traced at once.
    return Cost(rays / (len(tried) * FIRST_SAMPLES if len(tried) > 1 else RAYS) * seconds, len(tried) > 1, sum(counts))
