"""Estimates of the memory and the time for tracing a converged picture (converged.py)."""

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
from raytracer.scene.solids.flattening import leaves

# Bytes per pixel: sums, results of processes that are not summed yet, the picture, masks.
_PIXEL = 256
# Bytes per process, without its table of coincident surfaces.
_PROCESS = 1 << 26
# Every primitive of a tree is tested at every root of every primitive: 16 NumPy operations per pair of primitives, each
# of at least a microsecond.
_STEPS, _STEP_SECONDS = 16, 1e-6
# The longest time for tracing sample pixels, in seconds. If one pixel takes longer, the time is not measured.
_TRIAL_SECONDS = 1.0
_UNITS = (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0))


class Cost(NamedTuple):
    """The estimated `seconds` for a scene of so many `primitives`. It is a lower bound unless it `is_measured`."""

    seconds: float
    is_measured: bool
    primitives: int

    def __str__(self) -> str:
        unit, length = next((entry for entry in _UNITS if self.seconds >= 2.0 * entry[1]), ("seconds", 1.0))
        about = "about" if self.is_measured else "at least"
        return (
            f"{about} {self.seconds / length:.0f} {unit}: each ray is tested against all {self.primitives} primitives"
        )


def check_cost(scene: Scene, size: tuple[int, int], workers: int | None = None) -> None:
    """Raise InputError if a converged picture needs more memory than the machine has; warn if it needs much.

    Args:
        scene: the scene.
        size: (width, height) in pixels.
        workers: the number of processes. Default: one per processor.
    """
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
    """Estimate the time of a job by tracing some of its pixels. Default of `workers`: one process per processor."""
    width, height = job.size
    workers = min(workers or os.cpu_count() or 1, max(1, width * height * FIRST_SAMPLES // RAYS))
    counts = [len(leaves(solid)) for solid in job.scene.solids()]
    rays = width * height * job.expected_samples / workers
    least = sum(_STEPS * _STEP_SECONDS * count**2 for count in counts)  # seconds for a batch of up to RAYS rays
    if least > _TRIAL_SECONDS:
        return Cost(rays / RAYS * least, False, sum(counts))
    tracer = TaskTracer(job)
    rng = np.random.default_rng(0)
    pixels = np.sort(rng.choice(width * height, min(RAYS // FIRST_SAMPLES, width * height), replace=False))
    for tried in (pixels[:1], pixels):
        begin = time.perf_counter()
        tracer(Task(tried, FIRST_SAMPLES, (0, FIRST_SAMPLES, 0)))
        seconds = time.perf_counter() - begin
        if seconds > _TRIAL_SECONDS:
            break
    # If only one pixel was traced: its rays take about as long as a full batch of RAYS rays.
    return Cost(rays / (len(tried) * FIRST_SAMPLES if len(tried) > 1 else RAYS) * seconds, len(tried) > 1, sum(counts))
