"""The fastest settings whose picture is no more wrong than asked for, or the best whose picture takes no longer.

Candidates are numbers of samples, adaptive samples, and pictures that are asked for an error. Of the first two many are
rendered at a quarter of the size. How errors and times there compare with those at full size is measured, of one of
each kind, and tells which to try at full size: there the best few are timed in turns, and compared with a picture of
many more samples, by another sequence. Only what that finds counts.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from statistics import median
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.progress import Progress
from raytracer.renderer import Renderer
from raytracer.scene import Scene
from raytracer.settings import ASKED_SAMPLES, Settings

# 1, 2, 3, 4, 6, 8, 12, ... samples.
LADDER = sorted({2**k for k in range(11)} | {3 * 2**k for k in range(9)})
THRESHOLDS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
# With fewer, adaptive samples, of which all pixels get 3, leave out next to nothing.
ADAPTIVE_FROM = 8
# Of the error that is asked for: estimates are on the safe side by up to 1.4 (sampler.py), so less may do.
ASKED_ERRORS = (1.0, 1.15, 1.3)

# The side of the pictures on which candidates are ranked, of the picture's.
_SMALL = 0.25
# Samples of what pictures are compared with, for each of theirs; Roberts' points are off by a fifth as much then, or
# less, which counts as the picture's own error.
_TIMES, _FEWEST, _MOST = 16, 256, 4096
# By how much predictions of errors and of times are taken to be wrong.
_UNSURE_ERROR, _UNSURE_TIME = 1.1, 1.25
# How many are tried at full size at a time, and how often each is timed; those within _CLOSE of the fastest more often.
_FEW, _ROUNDS, _CLOSE, _MORE_ROUNDS = 6, 3, 1.4, 9
# How many times as long as usual a single picture may take.
_ONCE = 2.5
# How often each is timed at the small size.
_SMALL_ROUNDS = 3
# What is not told from 0, in linear radiance.
_LEAST = 1e-7
# The thresholds of adaptive samples that are tried lie between these multiples of the picture's error.
_THRESHOLD = 1.0, 60.0


class Measured(NamedTuple):
    """A picture's cost and error. `seconds`: those of render(), the median; `samples`: a pixel's, on average.

    `least`: the shortest time. What else runs on the machine only adds, so that tells who is faster.
    """

    settings: Settings
    seconds: float
    error: float
    samples: float
    least: float


class Tuned(msgspec.Struct, frozen=True):
    """What was found: the `pick`, or None if nothing meets the target; then `best` comes closest.

    `tried`: how many at full size. `reference`: samples of what they were compared with.
    """

    pick: Measured | None
    best: Measured
    tried: int
    reference: int


def grid(base: Settings) -> list[Settings]:
    """All candidates but those that ask for an error: `base` with numbers of samples, fixed and adaptive."""
    fixed = [msgspec.structs.replace(base, samples=n) for n in LADDER]
    adaptive = [
        msgspec.structs.replace(base, samples=n, adaptive=threshold)
        for n in LADDER
        if n >= ADAPTIVE_FROM
        for threshold in THRESHOLDS
    ]
    return fixed + adaptive


def asked(base: Settings, error: float) -> list[Settings]:
    """Candidates that ask for an error."""
    return [msgspec.structs.replace(base, samples=ASKED_SAMPLES, max_error=share * error) for share in ASKED_ERRORS]


class Stage:
    """Pictures of a scene at one size, and what they are compared with."""

    def __init__(self, renderer: Renderer, scene: Scene, base: Settings, size: tuple[int, int]) -> None:
        self._renderer, self._scene, self._base, self.size = renderer, scene, base, size
        self._reference: NDArray[np.float64] | None = None
        self.samples = 0
        self._shared = base.shadows == "soft" and any(light.radius for light in scene.lights)
        self._known: dict[Settings, Measured] = {}
        self._compiled: set[tuple[bool, bool, bool]] = set()

    def refer(self, samples: int, progress: Progress | None = None) -> None:
        """Compare with a picture for pictures of so many samples."""
        wanted = min(max(_FEWEST, _TIMES * samples), _MOST)
        if wanted > self.samples:
            self.samples = wanted
            settings = msgspec.structs.replace(self._base, samples=wanted, sequence="r2")
            image = self._renderer.render(
                self._scene, self.size, settings, geometry=False, estimates=False, progress=progress
            )
            self._reference = image.radiance.astype(np.float64)
            self._known.clear()

    def measure(self, settings: Settings) -> Measured:
        """Render for the error and one time; before that, where programs are not compiled yet, once for that."""
        if settings not in self._known:
            kind = settings.samples == 1, settings.adaptive is not None, settings.asks
            if kind not in self._compiled:
                self._compiled.add(kind)
                self.seconds(settings)
            begin = time.perf_counter()
            image = self._renderer.render(self._scene, self.size, settings, geometry=False)
            seconds = time.perf_counter() - begin
            samples = image.estimate.samples if image.estimate else float(settings.samples)
            self._known[settings] = Measured(settings, seconds, self._error(image.radiance, samples), samples, seconds)
        return self._known[settings]

    def seconds(self, settings: Settings) -> float:
        """How long a picture takes."""
        begin = time.perf_counter()
        self._renderer.render(self._scene, self.size, settings, geometry=False)
        return time.perf_counter() - begin

    def _error(self, radiance: NDArray[Any], samples: float) -> float:
        if self._reference is None:
            return math.nan
        error = math.sqrt(float(np.mean((radiance - self._reference) ** 2)))
        # Points on lights are the same whatever the sequence: so much of the reference is the picture's own.
        return error / (1.0 - min(0.5, samples / self.samples)) if self._shared else error

    def in_turns(self, candidates: Iterable[Measured], rounds: int) -> list[Measured]:
        """With so many times."""
        found = list(candidates)
        times: list[list[float]] = [[] for _ in found]
        for _ in range(rounds):
            for each, candidate in zip(times, found, strict=True):
                each.append(self.seconds(candidate.settings))
        return [each._replace(seconds=median(own), least=min(own)) for each, own in zip(found, times, strict=True)]


def tune(
    renderer: Renderer,
    scene: Scene,
    size: tuple[int, int],
    base: Settings,
    *,
    max_error: float | None = None,
    time: float | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> Tuned:
    """Search, for a root mean square error in linear radiance or for seconds: one of the two is given.

    `base`: what of the settings stays. `progress` is told, in words, what is measured next.
    """
    small = Stage(renderer, scene, base, tuple(max(16, round(_SMALL * side)) for side in size))  # pyright: ignore[reportArgumentType]
    full = Stage(renderer, scene, base, size)
    ranked = _ranked(small, full, base, max_error, time, progress)
    target = _Target(max_error, time)
    tried: list[Measured] = []
    count = 0
    extra = asked(base, max_error) if max_error is not None else []
    while ranked or extra:
        batch, ranked = extra + ranked[:_FEW], ranked[_FEW:]
        extra = []
        count += len(batch)
        progress(f"{len(batch)} candidates at {size[0]}x{size[1]}")
        found = [full.measure(settings) for settings in batch]
        # What is far from the target needs no second look.
        found = full.in_turns(filter(target.is_near, found), _ROUNDS) or found
        if met := sorted(filter(target.is_met, found), key=target.order):
            progress("the best of them again")
            met = full.in_turns((each for each in met if target.is_close(each, met[0])), _MORE_ROUNDS)
        tried += [*found, *met]
        if met := list(filter(target.is_met, met)):
            pick = min(met, key=target.order)
            return Tuned(pick, pick, count, full.samples)
    return Tuned(None, min(tried, key=target.miss), count, full.samples)


class _Target(NamedTuple):
    """What is asked for, and what of that is best."""

    max_error: float | None
    time: float | None

    def is_met(self, found: Measured) -> bool:
        return found.error <= self.max_error if self.max_error is not None else found.seconds <= (self.time or 0.0)

    def is_near(self, found: Measured) -> bool:
        """Whether it meets the target, but for what a single time is off by."""
        return self.is_met(found) or (self.time is not None and found.seconds <= _ONCE * self.time)

    def order(self, found: Measured) -> tuple[float, float]:
        """Less is better."""
        return (found.least, found.error) if self.max_error is not None else (found.error, found.least)

    def miss(self, found: Measured) -> float:
        """How far it is from the target."""
        return found.error if self.max_error is not None else found.seconds

    def is_close(self, found: Measured, best: Measured) -> bool:
        """Whether times decide between the two."""
        return self.max_error is None or found.least <= _CLOSE * best.least


def _ranked(
    small: Stage,
    full: Stage,
    base: Settings,
    max_error: float | None,
    time: float | None,
    progress: Callable[[str], None],
) -> list[Settings]:
    """Candidates that may well meet the target, the most promising first."""
    first = msgspec.structs.replace(base, samples=4)
    progress(f"numbers of samples at {small.size[0]}x{small.size[1]}")
    small.refer(_MOST // _TIMES)
    full.refer(first.samples)
    scale = _scale(small, full, first)
    start = _first_fixed(small, scale, base, max_error, time)
    progress(f"what pictures are compared with, {_TIMES} times {start.samples} samples")
    full.refer(start.samples * (1 if max_error is not None else 4))
    scales = {False: _scale(small, full, start)}
    error = max_error if max_error is not None else max(scales[False][0] * small.measure(start).error, _LEAST)
    near = [
        settings
        for settings in grid(base)
        if start.samples <= settings.samples <= 8 * start.samples
        and settings.adaptive is not None
        and _THRESHOLD[0] * error <= settings.adaptive <= _THRESHOLD[1] * error
    ]
    if near:
        middle = min(near, key=lambda s: abs(math.log((s.adaptive or error) / (8 * error))) + s.samples / start.samples)
        scales[True] = _scale(small, full, middle)
    k = LADDER.index(start.samples)
    near += [msgspec.structs.replace(base, samples=n) for n in LADDER[max(0, k - 2) : k + 3]]
    progress(f"{len(near)} candidates at {small.size[0]}x{small.size[1]}")
    predicted = []
    for found in small.in_turns([small.measure(settings) for settings in near], _SMALL_ROUNDS):
        settings = found.settings
        by_error, by_time = scales[settings.adaptive is not None]
        predicted.append(
            found._replace(error=by_error * found.error, seconds=by_time * found.least, least=by_time * found.least)
        )
    target = _Target(
        None if max_error is None else _UNSURE_ERROR * max_error, None if time is None else _UNSURE_TIME * time
    )
    met = sorted(filter(target.is_met, predicted), key=target.order)
    rest = sorted((each for each in predicted if not target.is_met(each)), key=target.miss)
    ranked = [each.settings for each in (*met, *rest)]
    # The plain one is among the first: it is the one whose time is known best.
    plain = next((settings for settings in ranked if settings.adaptive is None), None)
    return list(dict.fromkeys((*filter(None, [plain]), *ranked)))


def _scale(small: Stage, full: Stage, settings: Settings) -> tuple[float, float]:
    """Error and time at full size, of those at the small one."""
    [a], [b] = (stage.in_turns([stage.measure(settings)], _SMALL_ROUNDS) for stage in (small, full))
    return (b.error / a.error if a.error else 1.0), b.least / a.least


def _first_fixed(
    small: Stage, scale: tuple[float, float], base: Settings, max_error: float | None, time: float | None
) -> Settings:
    """The fewest samples that are expected to meet an error, or the most within a time."""
    settings = msgspec.structs.replace(base, samples=1)
    for n in LADDER:
        found = small.measure(msgspec.structs.replace(base, samples=n))
        if time is not None and scale[1] * found.seconds > time:
            break
        settings = found.settings
        if max_error is not None and scale[0] * found.error <= max_error:
            break
    return settings
