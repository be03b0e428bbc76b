"""Tasks: some pixels of a round of a converged picture (converged.py), each traced by one process."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.intersection import Tracer
from raytracer.ground_truth.job import Job

Array = NDArray[np.float64]

# Enough sets to tell their variance, and few enough for each to be well stratified.
_SETS = 4
# Of a pixel's sample to a light, squared: a sample that costs one ray from the camera may cost a few to the lights.
_LIGHT_RAYS = 2
# Of the random numbers; any will do.
_SEED = 20_190_521

# Rays are traced so many at a time that those of all primitives stay within some processors' caches and 64 MiB,
# and are no more than this.
RAYS, _RAYS_TIMES_LEAVES = 1 << 13, 1 << 21


class Task(NamedTuple):
    """Some pixels of a round that all get the same number of samples: their flat indices, and that number.

    `key` decides the task's random numbers, and no other task has it: the round, the samples, the place of the first
    pixel.
    """

    pixels: NDArray[np.intp]
    samples: int
    key: tuple[int, int, int]


class TaskResult(NamedTuple):
    """The results of a task's pixels: mean radiance, (P, 3), its variance, and in the first round the centre rays."""

    mean: Array
    variance: Array
    centre: ray_tracer.RayResults | None


def round_tasks(pixels: NDArray[np.intp], samples: NDArray[np.int32], turn: int) -> Iterator[Task]:
    """Cut the pixels of round `turn` into tasks, in a way that does not depend on which process traces them."""
    for n in map(int, np.unique(samples)):
        step = max(1, RAYS // n)
        alike = pixels[samples == n]
        for start in range(0, len(alike), step):
            yield Task(alike[start : start + step], n, (turn, n, start))


class TaskTracer:
    """Traces the tasks of a job: a process has one."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._tracer = Tracer(job.scene)
        self._rays = min(RAYS, max(1, _RAYS_TIMES_LEAVES // len(self._tracer.leaves)))

    def __call__(self, task: Task) -> TaskResult:
        y, x = np.divmod(task.pixels, self._job.size[0])
        lights = len(self._job.scene.lights) if self._job.settings.shadows == "soft" else 0
        rng = np.random.default_rng((_SEED, *task.key))
        within, *at_lights = _spread(rng, len(x), task.samples, 1 + lights)
        shifts = np.stack(at_lights, axis=-2) if lights else None
        radiance = self._trace(x[:, None, None] + within[..., 0], y[:, None, None] + within[..., 1], shifts).radiance
        sets = radiance.reshape(len(x), _SETS, -1, 3).mean(axis=2)
        centre = self._trace(x + 0.5, y + 0.5, None) if task.key[0] == 0 else None
        return TaskResult(sets.mean(axis=1), sets.var(axis=1, ddof=1) / _SETS, centre)

    def _trace(self, x: Array, y: Array, shifts: Array | None) -> ray_tracer.RayResults:
        """Trace the rays through points of the picture, as many at a time as fit."""
        job = self._job
        rd = ray_tracer.rays_through(job.scene.camera, job.size, x.ravel(), y.ravel())
        shifts = shifts if shifts is None else shifts.reshape(len(rd), -1, 2)
        parts = [
            ray_tracer.trace_rays(
                job.scene, job.settings, self._tracer, rd[rows], _LIGHT_RAYS, None if shifts is None else shifts[rows]
            )
            for rows in (slice(start, start + self._rays) for start in range(0, len(rd), self._rays))
        ]
        return ray_tracer.RayResults(*map(np.concatenate, zip(*parts, strict=True)))


def _spread(rng: np.random.Generator, pixels: int, samples: int, kinds: int) -> Iterator[Array]:
    """Points of so many kinds in [0, 1)^2, each (P, sets, n, 2): of each set one is in each of n equal boxes.

    The boxes of the first kind are in order, those of the others in an order of each set's own.
    """
    n = samples // _SETS
    rows = 1 << (n.bit_length() - 1) // 2
    boxes = np.stack(np.divmod(np.arange(n), rows), axis=-1)
    for kind in range(kinds):
        box = np.broadcast_to(np.arange(n), (pixels, _SETS, n))
        box = rng.permuted(box, axis=-1) if kind else box
        yield (boxes[box] + rng.random((pixels, _SETS, n, 2))) / (n // rows, rows)
