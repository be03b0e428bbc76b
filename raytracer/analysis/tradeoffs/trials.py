"""Trials: pictures of a scene with various settings, their times, and their errors against a reference on the GPU."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from statistics import median
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.core.progress import Progress
from raytracer.formats.estimate import is_dominated_by_few
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SampleSequence
from raytracer.scene.settings import Settings

# The samples of a reference: over the samples of the pictures, at least, and at most. A reference with 16 times as many
# of Roberts' points has a fifth of a picture's error, or less, which counts as the picture's own error.
REFERENCE_FACTOR, LEAST_SAMPLES, MOST_SAMPLES = 16, 256, 4096
# An error that few pixels hold is uncertain below this multiple of the reference's own error. At 3 times, the reference
# adds 5 % to it.
_RESOLVED = 3.0


class Trial(NamedTuple):
    """The settings of a picture, with its time and error.

    The shortest time decides which settings are faster, because other work on the machine only adds time.
    """

    settings: Settings
    seconds: float  # the median time of render()
    error: float  # root mean square error in linear radiance
    samples: float  # the mean number of samples per pixel
    least: float  # the shortest time of render()
    is_uncertain: bool = False  # few pixels hold most of the error, and the reference may be wrong in these pixels


class Trials:
    """The trials of a scene at one size, and their reference."""

    def __init__(self, renderer: Renderer, scene: Scene, base: Settings, size: tuple[int, int]) -> None:
        self._renderer, self._scene, self._base, self.size = renderer, scene, base, size
        self._reference: NDArray[np.float64] | None = None
        self._reference_error: float | None = None
        self.samples = 0
        self._shared = base.shadows == "soft" and any(light.radius for light in scene.lights)
        self._known: dict[Settings, Trial] = {}
        self._compiled: set[tuple[bool, bool, bool]] = set()

    def draw_reference(self, samples: int, progress: Progress | None = None) -> None:
        """Draw a reference for pictures with this number of `samples`, unless the present reference suffices."""
        needed = min(max(LEAST_SAMPLES, REFERENCE_FACTOR * samples), MOST_SAMPLES)
        if needed > self.samples:
            self.samples = needed
            self._reference = self._converged("r2", progress)
            self._reference_error = None
            self._known.clear()

    def _converged(self, sequence: SampleSequence, progress: Progress | None = None) -> NDArray[np.float64]:
        """Draw a picture with as many samples as the reference has."""
        settings = msgspec.structs.replace(self._base, samples=self.samples, sequence=sequence)
        image = self._renderer.render(
            self._scene, self.size, settings, geometry=False, estimates=False, progress=progress
        )
        return image.radiance.astype(np.float64)

    def measure(self, settings: Settings) -> Trial:
        """Render a picture and measure its error and time. If programs are not compiled yet, render once before."""
        if settings not in self._known:
            kind = settings.samples == 1, settings.adaptive is not None, settings.sampling.has_stopping_rule
            if kind not in self._compiled:
                self._compiled.add(kind)
                self.seconds(settings)
            begin = time.perf_counter()
            image = self._renderer.render(self._scene, self.size, settings, geometry=False)
            seconds = time.perf_counter() - begin
            samples = image.estimate.samples if image.estimate else float(settings.samples)
            error, uncertain = self._error(image.radiance, samples)
            self._known[settings] = Trial(settings, seconds, error, samples, seconds, uncertain)
        return self._known[settings]

    def trials(self) -> list[Trial]:
        """Return all trials against the present reference, each with a single time."""
        return [trial for trial in self._known.values() if not math.isnan(trial.error)]

    def has_trial(self, settings: Settings) -> bool:
        """Whether these settings have a trial against the present reference."""
        return settings in self._known

    def seconds(self, settings: Settings) -> float:
        """Render a picture and return the duration in seconds."""
        begin = time.perf_counter()
        self._renderer.render(self._scene, self.size, settings, geometry=False)
        return time.perf_counter() - begin

    def _error(self, radiance: NDArray[Any], samples: float) -> tuple[float, bool]:
        """Return a picture's error against the reference, and whether the error is uncertain."""
        if self._reference is None:
            return math.nan, False
        squares = np.sum((radiance - self._reference) ** 2, axis=2)
        error = math.sqrt(float(squares.mean()) / 3.0)
        uncertain = is_dominated_by_few(squares) and error < _RESOLVED * self._measure_reference_error(self._reference)
        # All sequences share the points on lights, so the picture's own points are a part of the reference.
        return error / (1.0 - min(0.5, samples / self.samples)) if self._shared else error, uncertain

    def _measure_reference_error(self, reference: NDArray[np.float64]) -> float:
        """Return the error of the reference, from its difference to a picture with another sequence."""
        if self._reference_error is None:
            other = self._converged("sobol")
            self._reference_error = math.sqrt(float(np.mean((reference - other) ** 2)) / 2.0)
        return self._reference_error

    def time_in_turns(self, candidates: Iterable[Trial], rounds: int) -> list[Trial]:
        """Measure the times of candidates again, in `rounds` rounds in which they take turns."""
        trials = list(candidates)
        times: list[list[float]] = [[] for _ in trials]
        for _ in range(rounds):
            for item, candidate in zip(times, trials, strict=True):
                item.append(self.seconds(candidate.settings))
        return [item._replace(seconds=median(own), least=min(own)) for item, own in zip(trials, times, strict=True)]
