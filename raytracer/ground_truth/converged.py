"""Converged pictures: traced in float64 with many random samples, with an estimate of their own error.

The sampling is independent of the renderer's sampling, so that an error of the latter shows: each pixel has stratified
random points of its own. A *round* gives a pixel four independent *sets* of n samples. A set has one random point in
each of n equal boxes of the pixel. Each sample sends 2 x 2 rays to each light that has a radius. The points on the
light are stratified over the set's samples in the same way, and paired with the boxes at random ("padding", Kollig and
Keller 2002, "Efficient multidimensional sampling").

The four sets are independent, even though the samples within a set are correlated. So a quarter of their sample
variance is an unbiased estimate of the squared error of the round's mean. A pixel's rounds are weighted by their
samples. After each round, only pixels whose estimated error exceeds the tolerance, and their neighbours, continue, and
each doubles its samples. A pixel that had stopped continues if a neighbour turns out to exceed the tolerance: an edge
cuts many pixels in a row, and it is chance in which of them few samples hit it.

The estimate has two limits. It does not include features that no sample hits in any of nine pixels, such as slivers far
smaller than a pixel. And it is slightly too low on average, because sampling stops where the estimate is low. On the
assignment, compared with 2 x 8192 samples by the GPU, this bias does not show. With up to 1024 samples, the estimated
errors are 2.8e-4 at 160x90 and 1.95e-4 at 320x180, and the true ones 2.7e-4 and 1.96e-4. With up to 4096 samples and a
tolerance of 1e-4, the estimated errors are 9.2e-5 and 7.1e-5, and the true ones 8.7e-5 and 7.2e-5.

If few pixels hold most of the squared error, the estimate rests on few sets and is uncertain: the stated lower bound is
half of the estimate. This was measured for 93 references of 37 scenes at 40x24, with glints and random scenes, against
2 x 16384 samples or more by the GPU. 35 were uncertain, and in 34 of these the lower bound was at most 1.25 times the
true error. In 53 of the other 58 the estimate was within 25 % of the true error. Three of the remaining five have eight
emitters of a twentieth of a pixel in the dark, which no sample hit.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate, find_largest, measured_estimate, picture_texts
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
    transparent: bool = False,
    cache: bool = True,
    workers: int | None = None,
    progress: Progress | None = None,
    before: Callable[[Job], None] | None = None,
) -> Image:
    """Trace a converged picture in float64, or read it from the disk cache.

    Args:
        scene: the scene.
        size: (width, height) in pixels.
        settings: only shading, shadows and bounces count. Default: Settings().
        samples: the most samples per pixel. Each pixel gets at least 16.
        tolerance: the accepted standard error of a pixel, in linear radiance. Pixels above it get more samples.
        transparent: whether the picture has an alpha, and radiance without the background behind it. Default: False.
        cache: whether to use the disk cache (disk_cache.py). Default: True.
        workers: the number of processes; the result does not depend on it. Default: one per processor. Processes are
            spawned, so a script that calls this function needs `if __name__ == "__main__":`.
        progress: a function of (done, expected) numbers of samples.
        before: a function that is called with the job before tracing, but not if the picture is in the cache.

    Returns:
        The picture. `error` is the estimated standard error of each pixel [H, W], `samples` its number of samples
        [H, W]. depth, normal and material belong to the rays through the pixels' centres. `estimate.seconds` is the
        time of this call. `metadata` has it only if the picture was traced.

    Raises:
        InputError: a wrong value.
    """
    begin = time.perf_counter()
    job = make_job(scene, size, settings or Settings(), samples, tolerance, transparent=transparent)
    file = disk_cache.cache_path(job) if cache else None
    image = disk_cache.read(file, job) if file else None
    is_traced = image is None
    if image is None:
        if before:
            before(job)
        image = _trace(job, workers, progress)
        if file:
            disk_cache.write(file, image)
    assert image.error is not None and image.samples is not None
    estimate = _estimate(image.error, float(image.samples.mean()), time.perf_counter() - begin)
    metadata = picture_texts(scene.name, _description(job), estimate, is_timed=is_traced)
    return image.replace(estimate=estimate, metadata=metadata, camera=scene.camera)


def _description(job: Job) -> str:
    """Describe a job, as renderer.metadata() describes the settings of other pictures."""
    settings = job.settings
    return (
        f"{job.size[0]}x{job.size[1]}, float64 reference(samples={job.samples}, tolerance={job.tolerance:g}, "
        f"shading={settings.shading!r}, shadows={settings.shadows!r}, bounces={settings.bounces})"
    )


def _estimate(error: NDArray[np.float64], samples: float, seconds: float) -> Estimate:
    """Return the estimate for a picture, from the standard errors of its pixels [H, W] and their mean samples."""
    squares = np.square(error)
    return measured_estimate(samples, seconds, squares, math.sqrt(squares.mean()), *find_largest(error))


def _trace(job: Job, workers: int | None, progress: Progress | None) -> Image:
    """Trace a job in rounds, until no pixel needs more samples."""
    width, height = job.size
    count = width * height
    total, variance = np.zeros((count, 3)), np.zeros((count, 3))  # n times the mean, n^2 times the mean's variance
    taken = np.zeros(count, np.int32)  # samples of each pixel so far
    covered = np.zeros(count)  # the samples of each pixel that hit a surface
    depth, normal, material = np.empty(count), np.empty((count, 3)), np.empty(count, np.int32)
    active = np.arange(count)  # the pixels that get more samples in this round
    most = job.most_samples
    done = 0  # samples of all pixels so far
    with Processes(TaskTracer, job, workers) as processes:
        for round_number in itertools.count():
            more = np.where(taken[active], taken[active], FIRST_SAMPLES)
            left = (most - taken[active]).sum() if done else count * job.expected_samples
            expected = done + int(left)
            for task, result in processes.map(round_tasks(active, more, round_number)):
                pixels, n = task.pixels, task.samples
                total[pixels] += n * result.mean
                variance[pixels] += n**2 * result.variance
                taken[pixels] += n
                covered[pixels] += n * result.coverage
                if result.centre:
                    depth[pixels], normal[pixels], material[pixels] = result.centre[1:]
                done += n * len(pixels)
                if progress:
                    progress(done, max(expected, done + 1))
            is_above = np.sqrt(variance.mean(axis=1)) / taken > job.tolerance
            active = np.flatnonzero(_extend(is_above.reshape(height, width)).ravel() & (taken < most))
            if not len(active):
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
        alpha=(covered / taken).reshape(height, width) if job.transparent else None,
    )


def _extend(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask [H, W] extended by the 8 neighbours of each pixel."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(mask, 1), (3, 3))
    return np.any(windows, axis=(2, 3))
