"""Jobs: all that decides a converged picture (converged.py), as one value."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from raytracer.core.validation import check_size, number, whole
from raytracer.scene.options import MAX_SAMPLES
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Samples of a pixel in the first round, in which all pixels are: each of its 4 sets then has 2 x 2 boxes.
FIRST_SAMPLES = 16
# In linear radiance, of a pixel. Pictures that users ask for have a root mean square error of 2e-3 or so: a converged
# picture that is off by a quarter of that makes an error that is measured against the picture wrong by 3 %.
TOLERANCE = 5e-4
# At most of a pixel. One that an edge from 0 to 1 cuts is then still off by 4e-3, but few are: the assignment at
# 160x90 is off by 3e-4 in all, a picture of 16 samples by 3.5e-3.
SAMPLES = 1024
# The share of pixels that are expected to go on after the first round.
_GOING_ON = 0.1


class Job(msgspec.Struct, frozen=True):
    """A scene to trace at `size` (width, height), and how accurately: see `converged.trace_converged`.

    Of `settings` only shading, shadows and bounces differ from the defaults.
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings
    samples: int = SAMPLES
    tolerance: float = TOLERANCE

    @property
    def most_samples(self) -> int:
        """The most samples of a pixel: FIRST_SAMPLES, doubled as often as `samples` allows."""
        return FIRST_SAMPLES << int(math.log2(self.samples / FIRST_SAMPLES))

    @property
    def expected_samples(self) -> float:
        """The mean number of samples of a pixel, as expected before anything is traced."""
        return FIRST_SAMPLES + _GOING_ON * (self.most_samples - FIRST_SAMPLES)


def make_job(scene: Scene, size: tuple[int, int], settings: Settings, samples: int, tolerance: float) -> Job:
    """Check all values, and drop the settings that change no converged picture. Raises InputError."""
    size = check_size(size)
    samples, tolerance = check_accuracy(samples, tolerance)
    settings = Settings(shading=settings.shading, shadows=settings.shadows, bounces=settings.bounces)
    for material in scene.materials:
        settings.shaded(material)  # a model that cannot shade a material is an error here, not in another process
    return Job(scene, size, settings, samples, tolerance)


def check_accuracy(samples: Any, tolerance: Any) -> tuple[int, float]:
    """Return both as a job has them. Raises InputError."""
    expected = "a finite number of at least 0 (linear radiance)"
    return whole(samples, "samples", FIRST_SAMPLES, MAX_SAMPLES), number(tolerance, "tolerance", 0.0, expected=expected)
