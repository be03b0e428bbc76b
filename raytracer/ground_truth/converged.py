"""What a picture converges to: the float64 reference with many samples, and an estimate of what it is still off by.

Nothing is shared with how pictures are sampled, so that their error does not hide: of each pixel the points are
random ones, stratified, of its own. A *round* gives a pixel four independent *sets* of samples. Of n samples in a
set one is anywhere in each of n equal boxes of the pixel, and at each light that has a radius it looks along 2 x 2
rays, of which each set's n samples spread over the light in the same way, paired at random with their boxes
("padding", Kollig and Keller 2002, "Efficient multidimensional sampling").

The four sets are independent, whatever the correlations within one, so a quarter of their sample variance is,
in the mean, the squared error of the round's mean. A pixel's rounds are weighted by their samples. After each round
only those pixels go on which are estimated to be off by more than the tolerance, or have a neighbour that is, each
with as many samples as it has. So do pixels that had ended, once a neighbour turns out to be off: an edge cuts many
pixels in a row, and of which of them few samples meet it is chance. What no sample meets in any of nine pixels, such as
a sliver far smaller than they are, is in no estimate; and as samples end where the estimate is low, that is a little
too low in the mean. On the assignment, against 2 x 8192 samples by the GPU, that is not seen: with up to 1024 samples
it is estimated to be off by 2.8e-4 at 160x90 and 1.95e-4 at 320x180 and is by 2.7e-4 and 1.96e-4; with up to 4096 and
a tolerance of 1e-4, by 9.2e-5 and 7.1e-5, and is by 8.7e-5 and 7.2e-5.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.core.progress import Progress
from raytracer.core.validation import check_size, number, whole
from raytracer.formats.image import Image
from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.workers import Processes
from raytracer.scene.options import MAX_SAMPLES
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

Array = NDArray[np.float64]

# In linear radiance, of a pixel. Pictures that users ask for have a root mean square error of 2e-3 or so: a truth that
# is off by a quarter of that makes what is measured against it wrong by 3 %.
TOLERANCE = 5e-4
# At most of a pixel. One that an edge from 0 to 1 cuts is then still off by 4e-3, but few are: the assignment at
# 160x90 is off by 3e-4 in all, a picture of 16 samples by 3.5e-3.
SAMPLES = 1024

# Enough to tell their variance, and few enough for each to be well stratified.
_SETS = 4
# Of a pixel in the first round, in which all pixels are: a set then has 2 x 2 boxes.
FIRST = 16
# Rays to a light, squared: a sample that costs one ray from the camera may cost a few to the lights.
_LIGHT_RAYS = 2
# Of the random numbers; any will do.
_SEED = 20_190_521

# Rays are traced so many at a time that those of all primitives stay within some processors' caches and 64 MiB,
# and are no more than this.
RAYS, _RAYS_TIMES_LEAVES = 1 << 13, 1 << 21
# The share of pixels that are expected to go on after the first round, of which nothing is known before it ends.
EXPECTED = 0.1


def truth(
    scene: Scene,
    size: tuple[int, int],
    settings: Settings | None = None,
    *,
    samples: int = SAMPLES,
    tolerance: float = TOLERANCE,
    cache: bool = True,
    workers: int | None = None,
    progress: Progress | None = None,
    before: Callable[[Job], None] | None = None,
) -> Image:
    """What the picture of `scene` at `size` (width, height) converges to, in float64, as a film.Image.

    Of `settings` only what changes that counts: shading, shadows and bounces. Pixels get 16 samples, and more, up to
    `samples`, while they are estimated to be off by more than `tolerance`, in linear radiance. `error` (H, W) is each
    pixel's estimated standard error, `samples` (H, W) what it got; depth, normal and material are the centre rays'.
    What was made once is read from the disk, unless `cache` is False (disk_cache.py). As many processes as `workers`,
    by default as the machine has processors, work on it; the result does not depend on that. They are spawned:
    a script that calls this needs `if __name__ == "__main__":`. `progress` is told (done, expected) samples,
    `before` what is going to be traced, if it is. Raises InputError.
    """
    size = check_size(size)
    samples, tolerance = checked_accuracy(samples, tolerance)
    given = settings or Settings()
    job = Job(scene, size, Settings(shading=given.shading, shadows=given.shadows, bounces=given.bounces))
    for material in scene.materials:
        job.settings.shaded(material)  # what cannot be is found here, not in another process
    from raytracer.ground_truth import disk_cache

    file = disk_cache.path_of(job, samples, tolerance) if cache else None
    if file and (image := disk_cache.read(file, size, len(scene.materials), (FIRST, most_samples(samples)))):
        return image
    if before:
        before(job)
    image = _traced(job, samples, tolerance, workers, progress)
    if file:
        disk_cache.write(file, image)
    return image


def checked_accuracy(samples: Any, tolerance: Any) -> tuple[int, float]:
    """These arguments of `truth`. Raises InputError."""
    expected = "a finite number of at least 0 (linear radiance)"
    return whole(samples, "samples", FIRST, MAX_SAMPLES), number(tolerance, "tolerance", 0.0, expected=expected)


class Job(msgspec.Struct, frozen=True):
    """What is to be traced."""

    scene: Scene
    size: tuple[int, int]
    settings: Settings


class Task(NamedTuple):
    """Some pixels of a round that all have as many samples: their flat indices, how many samples each gets.

    `key`: what no other task has, for their random numbers: the round, the samples, the place of the first pixel.
    """

    pixels: NDArray[np.intp]
    samples: int
    key: tuple[int, int, int]


def _traced(job: Job, samples: int, tolerance: float, workers: int | None, progress: Progress | None) -> Image:
    width, height = job.size
    count = width * height
    total, variance = np.zeros((count, 3)), np.zeros((count, 3))  # n times the mean, n^2 times the mean's variance
    taken = np.zeros(count, np.int32)
    depth, normal, material = np.empty(count), np.empty((count, 3)), np.empty(count, np.int32)
    going = np.arange(count)
    most = most_samples(samples)
    done = 0  # samples of all pixels
    with Processes(Tracing, job, workers) as processes:
        for turn in itertools.count():
            more = np.where(taken[going], taken[going], FIRST)
            left = most - taken[going] if done else np.array([count * FIRST + EXPECTED * count * (most - FIRST)])
            expected = done + int(left.sum())
            for task, found in processes.map(_tasks(going, more, turn)):
                at, n = task.pixels, task.samples
                total[at] += n * found.mean
                variance[at] += n**2 * found.variance
                taken[at] += n
                if found.centre:
                    depth[at], normal[at], material[at] = found.centre[1:]
                done += n * len(at)
                if progress:
                    progress(done, max(expected, done + 1))
            off = np.sqrt(variance.mean(axis=1)) / taken > tolerance
            going = np.flatnonzero(_and_around(off.reshape(height, width)).ravel() & (taken < most))
            if not len(going):
                break
    if progress:
        progress(done, done)
    return Image(
        radiance=(total / taken[:, None]).reshape(height, width, 3),
        depth=depth.reshape(height, width),
        normal=normal.reshape(height, width, 3),
        material=material.reshape(height, width),
        samples=taken.reshape(height, width),
        error=(np.sqrt(variance.mean(axis=1)) / taken).reshape(height, width),
    )


def most_samples(samples: int) -> int:
    """What a pixel gets at most: 16, doubled as often as `samples` allows."""
    return FIRST << int(math.log2(samples / FIRST))


def _and_around(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Those pixels (H, W), and their 8 neighbours."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(mask, 1), (3, 3))
    return np.any(around, axis=(2, 3))


def _tasks(pixels: NDArray[np.intp], samples: NDArray[np.int32], turn: int) -> Iterator[Task]:
    """All pixels of a round, cut in a way that does not depend on who traces them."""
    for n in map(int, np.unique(samples)):
        step = max(1, RAYS // n)
        own = pixels[samples == n]
        for start in range(0, len(own), step):
            yield Task(own[start : start + step], n, (turn, n, start))


class Found(NamedTuple):
    """What a task found, of each pixel: the mean, (P, 3), and its variance."""

    mean: Array
    variance: Array
    centre: ray_tracer.Seen | None  # of a first round


class Tracing:
    """What a process does with its tasks."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._tracer = ray_tracer.Tracer(job.scene)
        self._rays = min(RAYS, max(1, _RAYS_TIMES_LEAVES // len(self._tracer.leaves)))

    def __call__(self, task: Task) -> Found:
        y, x = np.divmod(task.pixels, self._job.size[0])
        lights = len(self._job.scene.lights) if self._job.settings.shadows == "soft" else 0
        rng = np.random.default_rng((_SEED, *task.key))
        within, *at_lights = _spread(rng, len(x), task.samples, 1 + lights)
        shifts = np.stack(at_lights, axis=-2) if lights else None
        seen = self._look(x[:, None, None] + within[..., 0], y[:, None, None] + within[..., 1], shifts).radiance
        sets = seen.reshape(len(x), _SETS, -1, 3).mean(axis=2)
        centre = self._look(x + 0.5, y + 0.5, None) if task.key[0] == 0 else None
        return Found(sets.mean(axis=1), sets.var(axis=1, ddof=1) / _SETS, centre)

    def _look(self, x: Array, y: Array, shifts: Array | None) -> ray_tracer.Seen:
        """What is seen through points of the picture, as many at a time as fit."""
        job = self._job
        rd = ray_tracer.rays_through(job.scene.camera, job.size, x.ravel(), y.ravel())
        shifts = shifts if shifts is None else shifts.reshape(len(rd), -1, 2)
        parts = [
            ray_tracer.look(
                job.scene, job.settings, self._tracer, rd[rows], _LIGHT_RAYS, None if shifts is None else shifts[rows]
            )
            for rows in (slice(start, start + self._rays) for start in range(0, len(rd), self._rays))
        ]
        return ray_tracer.Seen(*map(np.concatenate, zip(*parts, strict=True)))


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
