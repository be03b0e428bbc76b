"""Job: everything that a converged picture (converged.py) depends on, as one value."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from raytracer.core.validation import check_size, integer, number
from raytracer.scene.options import MAX_SAMPLES
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Samples per pixel in the first round, which covers all pixels. Each of the 4 sets of a pixel then has 2 x 2 boxes.
FIRST_SAMPLES = 16
# The default tolerance: the standard error of a pixel, in linear radiance. Users typically request a root mean square
# error of about 2e-3. A reference with a quarter of this error makes an error measured against it wrong by 3 %.
TOLERANCE = 5e-4
# The default of the most samples per pixel. A pixel cut by an edge from 0 to 1 then still has an error of 4e-3. Such
# pixels are few: the assignment at 160x90 has an error of 3e-4 in all, and a picture with 16 samples has 3.5e-3.
SAMPLES = 1024
# The share of pixels that are expected to need more samples after the first round.
_SHARE_AFTER_FIRST_ROUND = 0.1


class Job(msgspec.Struct, frozen=True):
    """A converged picture to trace: scene, `size` (width, height), accuracy and whether it is transparent, as for
    `converged.trace_converged`.

    In `settings`, only shading, shadows and bounces may differ from the defaults.
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings
    samples: int = SAMPLES
    tolerance: float = TOLERANCE
    transparent: bool = False

    @property
    def most_samples(self) -> int:
        """The most samples per pixel: FIRST_SAMPLES, doubled as often as `samples` allows."""
        return FIRST_SAMPLES << int(math.log2(self.samples / FIRST_SAMPLES))

    @property
    def expected_samples(self) -> float:
        """The expected mean number of samples per pixel, a guess before tracing."""
        return FIRST_SAMPLES + _SHARE_AFTER_FIRST_ROUND * (self.most_samples - FIRST_SAMPLES)


def make_job(
    scene: Scene, size: tuple[int, int], settings: Settings, samples: int, tolerance: float, *, transparent: bool
) -> Job:
    """Check all values and return a job, without the settings that do not affect a converged picture.

    Raises InputError.
    """
    size = check_size(size)
    samples, tolerance = check_accuracy(samples, tolerance)
    settings = Settings(shading=settings.shading, shadows=settings.shadows, bounces=settings.bounces)
    for material in scene.materials:
        settings.shaded(material)  # raise an error of the conversion here and not in a worker process
    return Job(scene, size, settings, samples, tolerance, transparent)


def check_accuracy(samples: Any, tolerance: Any) -> tuple[int, float]:
    """Check and return the most samples per pixel and the tolerance. Raises InputError."""
    expected = "a finite number of at least 0 (linear radiance)"
    return integer(samples, "samples", FIRST_SAMPLES, MAX_SAMPLES), number(
        tolerance, "tolerance", 0.0, expected=expected
    )
