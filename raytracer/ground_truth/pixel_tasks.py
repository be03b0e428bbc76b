"""Tasks: groups of pixels of one round of a converged picture (converged.py), which worker processes trace."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.intersection import Tracer
from raytracer.ground_truth.job import Job

Array = NDArray[np.float64]

# The number of independent sets of samples: enough to estimate their variance, and few enough that each set is well
# stratified.
_SETS = 4
# The square root of the number of rays from one sample to a light with a radius. A camera ray justifies a few of them.
_LIGHT_RAYS = 2
# The seed of the random numbers. Any number will do.
_SEED = 20_190_521

# The most rays that are traced at once, and the most rays times primitives, so that the arrays stay within 64 MiB and
# the caches of some processors.
RAYS, _RAYS_TIMES_LEAVES = 1 << 13, 1 << 21


class Task(NamedTuple):
    """Some pixels of a round, as flat indices, which all get the same number of samples.

    `key` is the seed of the task's random numbers, unique in the picture: the round, the number of samples, and the
    index of the first pixel among the round's pixels with this number of samples.
    """

    pixels: NDArray[np.intp]
    samples: int
    key: tuple[int, int, int]


class TaskResult(NamedTuple):
    """The results for P pixels: mean radiance and its variance [P, 3], the share of samples that hit a surface [P], and
    in the first round the centre rays.
    """

    mean: Array
    variance: Array
    coverage: Array
    centre: ray_tracer.RayResults | None


def round_tasks(pixels: NDArray[np.intp], samples: NDArray[np.int32], round_number: int) -> Iterator[Task]:
    """Split the pixels of a round into tasks. The split does not depend on the number of processes.

    `samples` is the number of samples of each of the `pixels` in this round.
    """
    for n in map(int, np.unique(samples)):
        step = max(1, RAYS // n)
        group = pixels[samples == n]
        for start in range(0, len(group), step):
            yield Task(group[start : start + step], n, (round_number, n, start))


class TaskTracer:
    """A function that traces the tasks of a job. Each process has one."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._tracer = Tracer(job.scene)
        self._rays = min(RAYS, max(1, _RAYS_TIMES_LEAVES // len(self._tracer.leaves)))

    def __call__(self, task: Task) -> TaskResult:
        y, x = np.divmod(task.pixels, self._job.size[0])
        lights = len(self._job.scene.lights) if self._job.settings.shadows == "soft" else 0
        rng = np.random.default_rng((_SEED, *task.key))
        offsets, *light_points = _stratified_points(rng, len(x), task.samples, 1 + lights)
        shifts = np.stack(light_points, axis=-2) if lights else None
        traced = self._trace(x[:, None, None] + offsets[..., 0], y[:, None, None] + offsets[..., 1], shifts)
        is_hit = np.isfinite(traced.depth)
        radiance = np.where(is_hit[:, None], traced.radiance, 0.0) if self._job.transparent else traced.radiance
        sets = radiance.reshape(len(x), _SETS, -1, 3).mean(axis=2)
        centre = self._trace(x + 0.5, y + 0.5, None) if task.key[0] == 0 else None
        coverage = is_hit.reshape(len(x), -1).mean(axis=1)
        return TaskResult(sets.mean(axis=1), sets.var(axis=1, ddof=1) / _SETS, coverage, centre)

    def _trace(self, x: Array, y: Array, shifts: Array | None) -> ray_tracer.RayResults:
        """Trace the rays through points of the picture, in batches that fit into memory."""
        job = self._job
        rd = ray_tracer.rays_through(job.scene.camera, job.size, x.ravel(), y.ravel())
        ro = ray_tracer.origins_through(job.scene.camera, job.size, x.ravel(), y.ravel())
        shifts = shifts if shifts is None else shifts.reshape(len(rd), -1, 2)
        parts = [
            ray_tracer.trace_rays(
                job.scene,
                job.settings,
                self._tracer,
                ro[rows],
                rd[rows],
                _LIGHT_RAYS,
                None if shifts is None else shifts[rows],
            )
            for rows in (slice(start, start + self._rays) for start in range(0, len(rd), self._rays))
        ]
        return ray_tracer.RayResults(*map(np.concatenate, zip(*parts, strict=True)))


def _stratified_points(rng: np.random.Generator, pixels: int, samples: int, kinds: int) -> Iterator[Array]:
    """Yield `kinds` arrays of stratified random points in [0, 1)^2 [pixels, sets, n, 2].

    Each set has one point in each of n equal boxes. The first array has the boxes in order. The other arrays have them
    in a random order of each set's own.
    """
    n = samples // _SETS
    rows = 1 << (n.bit_length() - 1) // 2
    boxes = np.stack(np.divmod(np.arange(n), rows), axis=-1)
    for kind in range(kinds):
        box = np.broadcast_to(np.arange(n), (pixels, _SETS, n))
        box = rng.permuted(box, axis=-1) if kind else box
        yield (boxes[box] + rng.random((pixels, _SETS, n, 2))) / (n // rows, rows)
