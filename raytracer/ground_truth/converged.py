"""The picture that a scene converges to: traced in float64 with many samples, and an estimate of its own error.

Nothing is shared with how pictures are sampled, so that an error of theirs does not hide: a pixel's points are random
ones, stratified, of its own. A *round* gives a pixel four independent *sets* of samples. Of n samples in a
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

Where few pixels hold most of the squared error, a handful of sets tell it, and the picture's error is uncertain: at
least half of what they say. Of 93 references of 37 scenes at 40x24, glints and random scenes among them, against 2 x
16384 samples or more by the GPU, 35 were uncertain, and of these the bound was at most 1.25 times the true error in 34;
of the other 58 the estimate was within 25 % in 53. Three of the five that were not have eight emitters of a twentieth
of a pixel in the dark, which no sample met.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raytracer.core.progress import Progress
from raytracer.formats.estimate import FEW_PIXELS, LEAST, WORST, Estimate, largest, rests_on_few
from raytracer.formats.image import Image
from raytracer.ground_truth import disk_cache
from raytracer.ground_truth.job import FIRST_SAMPLES, SAMPLES, TOLERANCE, Job, make_job
from raytracer.ground_truth.pixel_tasks import TaskTracer, round_tasks
from raytracer.ground_truth.workers import Processes
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings


def trace_converged(
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
    """Trace the picture that `scene` at `size` (width, height) converges to, in float64.

    Of `settings` shading, shadows and bounces count. Pixels get 16 samples, and more, up to `samples`, while a pixel is
    estimated to be off by more than `tolerance`, in linear radiance. `error` (H, W) is each pixel's estimated standard
    error, `samples` (H, W) its number of samples; depth, normal and material are the centre rays'. `estimate` is that
    of the picture; its `seconds` are those of this call.

    A picture that was made before is read from the disk, unless `cache` is False (disk_cache.py). `workers` processes
    trace, by default one for each processor; the result does not depend on their number. They are spawned: a script
    that calls this needs `if __name__ == "__main__":`. `progress` gets (done, expected) samples, `before` the job that
    is going to be traced, if one is. Raises InputError.
    """
    begin = time.perf_counter()
    job = make_job(scene, size, settings or Settings(), samples, tolerance)
    file = disk_cache.path_of(job) if cache else None
    image = disk_cache.read(file, job) if file else None
    if image is None:
        if before:
            before(job)
        image = _trace(job, workers, progress)
        if file:
            disk_cache.write(file, image)
    assert image.error is not None and image.samples is not None
    estimate = _estimate(image.error, float(image.samples.mean()), time.perf_counter() - begin)
    return image.replace(estimate=estimate)


def _estimate(error: NDArray[np.float64], samples: float, seconds: float) -> Estimate:
    """The estimate of a picture whose pixels have these standard errors (H, W) and so many `samples` on average."""
    squares = np.square(error)
    is_uncertain = rests_on_few(squares)
    rmse = (LEAST if is_uncertain else 1.0) * math.sqrt(squares.mean())
    worst, worst_at = largest(error)
    return Estimate(samples, seconds, rmse, WORST * worst, worst_at, FEW_PIXELS if is_uncertain else "")


def _trace(job: Job, workers: int | None, progress: Progress | None) -> Image:
    width, height = job.size
    count = width * height
    total, variance = np.zeros((count, 3)), np.zeros((count, 3))  # n times the mean, n^2 times the mean's variance
    taken = np.zeros(count, np.int32)
    depth, normal, material = np.empty(count), np.empty((count, 3)), np.empty(count, np.int32)
    going = np.arange(count)
    most = job.most_samples
    done = 0  # samples of all pixels
    with Processes(TaskTracer, job, workers) as processes:
        for turn in itertools.count():
            more = np.where(taken[going], taken[going], FIRST_SAMPLES)
            left = (most - taken[going]).sum() if done else count * job.expected_samples
            expected = done + int(left)
            for task, result in processes.map(round_tasks(going, more, turn)):
                at, n = task.pixels, task.samples
                total[at] += n * result.mean
                variance[at] += n**2 * result.variance
                taken[at] += n
                if result.centre:
                    depth[at], normal[at], material[at] = result.centre[1:]
                done += n * len(at)
                if progress:
                    progress(done, max(expected, done + 1))
            off = np.sqrt(variance.mean(axis=1)) / taken > job.tolerance
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


def _and_around(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels of a mask (H, W), and the 8 neighbours of each."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(mask, 1), (3, 3))
    return np.any(around, axis=(2, 3))
