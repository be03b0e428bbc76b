"""Trials: pictures of a scene by several settings, with their times, and errors against one of many more samples."""

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
from raytracer.formats.estimate import rests_on_few
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SampleSequence
from raytracer.scene.settings import Settings

# Samples of what pictures are compared with, for each of theirs; Roberts' points are off by a fifth as much then, or
# less, which counts as the picture's own error.
TIMES, FEWEST, MOST = 16, 256, 4096
# An error that few pixels hold is uncertain if it is less than so many times the reference's own: at 3 times, that adds
# 5 % to it.
_RESOLVED = 3.0


class Trial(NamedTuple):
    """A picture's settings, cost and error. `seconds`: those of render(), the median; `samples`: a pixel's, on average.

    `least`: the shortest time. What else runs on the machine only adds, so that tells who is faster. `uncertain`: few
    pixels hold most of the error, and the reference is not known to be right in them.
    """

    settings: Settings
    seconds: float
    error: float
    samples: float
    least: float
    uncertain: bool = False


class Trials:
    """The trials of a scene at one size, and the reference that their pictures are compared with."""

    def __init__(self, renderer: Renderer, scene: Scene, base: Settings, size: tuple[int, int]) -> None:
        self._renderer, self._scene, self._base, self.size = renderer, scene, base, size
        self._reference: NDArray[np.float64] | None = None
        self._reference_error: float | None = None
        self.samples = 0
        self._shared = base.shadows == "soft" and any(light.radius for light in scene.lights)
        self._known: dict[Settings, Trial] = {}
        self._compiled: set[tuple[bool, bool, bool]] = set()

    def refer(self, samples: int, progress: Progress | None = None) -> None:
        """Draw a reference for pictures of so many samples, unless the present one will do."""
        wanted = min(max(FEWEST, TIMES * samples), MOST)
        if wanted > self.samples:
            self.samples = wanted
            self._reference = self._converged("r2", progress)
            self._reference_error = None
            self._known.clear()

    def _converged(self, sequence: SampleSequence, progress: Progress | None = None) -> NDArray[np.float64]:
        """A picture of as many samples as the reference has."""
        settings = msgspec.structs.replace(self._base, samples=self.samples, sequence=sequence)
        image = self._renderer.render(
            self._scene, self.size, settings, geometry=False, estimates=False, progress=progress
        )
        return image.radiance.astype(np.float64)

    def measure(self, settings: Settings) -> Trial:
        """Render for the error and one time; before that, where programs are not compiled yet, once for that."""
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

    def known(self) -> list[Trial]:
        """All trials against the present reference, by one time each."""
        return [trial for trial in self._known.values() if not math.isnan(trial.error)]

    def knows(self, settings: Settings) -> bool:
        """Whether there is a trial of these settings against the present reference."""
        return settings in self._known

    def seconds(self, settings: Settings) -> float:
        """Measure how long a picture takes."""
        begin = time.perf_counter()
        self._renderer.render(self._scene, self.size, settings, geometry=False)
        return time.perf_counter() - begin

    def _error(self, radiance: NDArray[Any], samples: float) -> tuple[float, bool]:
        """A picture's error by the reference, and whether it is uncertain."""
        if self._reference is None:
            return math.nan, False
        squares = np.sum((radiance - self._reference) ** 2, axis=2)
        error = math.sqrt(float(squares.mean()) / 3.0)
        uncertain = rests_on_few(squares) and error < _RESOLVED * self._doubt(self._reference)
        # Points on lights are the same whatever the sequence: so much of the reference is the picture's own.
        return error / (1.0 - min(0.5, samples / self.samples)) if self._shared else error, uncertain

    def _doubt(self, reference: NDArray[np.float64]) -> float:
        """The error of the reference, by its difference from a picture of another sequence."""
        if self._reference_error is None:
            other = self._converged("sobol")
            self._reference_error = math.sqrt(float(np.mean((reference - other) ** 2)) / 2.0)
        return self._reference_error

    def in_turns(self, candidates: Iterable[Trial], rounds: int) -> list[Trial]:
        """Measure the times of candidates again, in so many rounds."""
        trials = list(candidates)
        times: list[list[float]] = [[] for _ in trials]
        for _ in range(rounds):
            for each, candidate in zip(times, trials, strict=True):
                each.append(self.seconds(candidate.settings))
        return [each._replace(seconds=median(own), least=min(own)) for each, own in zip(trials, times, strict=True)]
