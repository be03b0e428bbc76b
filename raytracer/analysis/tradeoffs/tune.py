"""The fastest settings whose picture is no more wrong than asked for, or the best whose picture takes no longer.

Candidates are numbers of samples, adaptive samples, and pictures that are asked for an error. Of the first two many are
rendered at a quarter of the size. How errors and times there compare with those at full size is measured, of one of
each kind, and tells which to try at full size: there the best few are timed in turns, and compared with a picture of
many more samples, by another sequence. Then those beside the best are tried, until none of these is better. Only what
is found at full size counts. Settings do not meet an error that few pixels hold, where the reference may be as wrong
in these pixels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from raytracer.analysis.tradeoffs.trials import MOST, TIMES, Trial, Trials
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import ASKED_SAMPLES

# 1, 2, 3, 4, 6, 8, 12, ... samples.
LADDER = sorted({2**k for k in range(11)} | {3 * 2**k for k in range(9)})
THRESHOLDS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
# With fewer, adaptive samples, of which all pixels get 3, leave out next to nothing.
ADAPTIVE_FROM = 8
# Of the error that is asked for: estimates are on the safe side by up to 1.4 (estimator.py), so less may do.
ASKED_ERRORS = (1.0, 1.15, 1.3)

# The side of the pictures on which candidates are ranked, of the picture's.
_SMALL = 0.25
# By how much predictions of errors and of times are taken to be wrong.
_UNSURE_ERROR, _UNSURE_TIME = 1.1, 1.25
# How many are tried at full size at a time, and how often each is timed; those within _CLOSE of the fastest more often.
_FEW, _ROUNDS, _CLOSE, _MORE_ROUNDS = 6, 3, 1.4, 9
# How far below what the most samples of LADDER leave an error may lie that more samples are tried for: that of smooth
# pictures falls as their number grows.
_HOPELESS = _UNSURE_ERROR * ASKED_SAMPLES / LADDER[-1]
# How many times as long as usual a single picture may take.
_ONCE = 2.5
# How often each is timed at the small size.
_SMALL_ROUNDS = 3
# What is not told from 0, in linear radiance.
_LEAST = 1e-7
# The thresholds of adaptive samples that are tried lie between these multiples of the picture's error.
_THRESHOLD = 1.0, 60.0


class Tuned(msgspec.Struct, frozen=True):
    """The result of a search: the `pick`, or None if nothing meets the target; then `best` comes closest.

    `tried`: how many at full size. `reference`: samples of what they were compared with. `hopeless`: others were not
    tried, as what was measured tells that they miss it, too. `complete` unless it was interrupted.
    """

    pick: Trial | None
    best: Trial
    tried: int
    reference: int
    hopeless: bool = False
    complete: bool = True


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
    """Candidates that ask for an error: for that one, and for some others in few digits."""
    errors = (error if share == 1.0 else float(f"{share * error:.3g}") for share in ASKED_ERRORS)
    return [msgspec.structs.replace(base, samples=ASKED_SAMPLES, max_error=each) for each in errors]


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
    Ctrl-C ends it with the best of what was measured at full size by then; raises KeyboardInterrupt if nothing was.
    """
    small = Trials(renderer, scene, base, tuple(max(16, round(_SMALL * side)) for side in size))  # pyright: ignore[reportArgumentType]
    full = Trials(renderer, scene, base, size)
    goal = _Goal(max_error, time)
    try:
        return _search(small, full, base, goal, progress)
    except KeyboardInterrupt:
        if not (known := full.known()):
            raise
        met = sorted(filter(goal.is_met, known), key=goal.order)
        best = met[0] if met else min(known, key=goal.miss)
        return Tuned(best if met else None, best, len(known), full.samples, complete=False)


def _search(small: Trials, full: Trials, base: Settings, goal: _Goal, progress: Callable[[str], None]) -> Tuned:
    ranked, hopeless = _ranked(small, full, base, goal, progress)
    extra = asked(base, goal.max_error) if goal.max_error is not None and not hopeless else []
    tried: list[Trial] = []
    count = 0
    while ranked or extra:
        batch, ranked = ranked[:_FEW], ranked[_FEW:]
        candidates = extra + [predicted.settings for predicted in batch]
        extra = []
        count += len(candidates)
        progress(f"{len(candidates)} candidates at {full.size[0]}x{full.size[1]}")
        trials = [full.measure(settings) for settings in candidates]
        # What is far from the target needs no second look.
        trials = full.in_turns(filter(goal.is_near, trials), _ROUNDS) or trials
        if met := sorted(filter(goal.is_met, trials), key=goal.order):
            progress("the best of them again")
            met = full.in_turns((each for each in met if goal.is_close(each, met[0])), _MORE_ROUNDS)
        tried += [*trials, *met]
        if met := list(filter(goal.is_met, met)):
            pick, more = _descended(full, met, goal, progress)
            return Tuned(pick, pick, count + more, full.samples)
        # By as much less than was predicted as the luckiest of these are the others taken to miss it.
        ratios = (goal.miss(full.measure(each.settings)) / max(goal.miss(each), _LEAST) for each in batch)
        luck = min(1.0, *ratios)
        hopeful = [each for each in ranked if goal.may_be_met(each, luck)]
        hopeless, ranked = hopeless or len(hopeful) < len(ranked), hopeful
    return Tuned(None, min(tried, key=goal.miss), count, full.samples, hopeless=hopeless)


def _descended(full: Trials, met: list[Trial], goal: _Goal, progress: Callable[[str], None]) -> tuple[Trial, int]:
    """The best candidate that is reached from those that meet the target by steps to better ones beside the best two,
    and how many were tried: what is predicted of small pictures is often wrong by a step.
    """
    leading = sorted(met, key=goal.order)[:2]
    count = 0
    while True:
        beside = dict.fromkeys(settings for each in leading for settings in _beside(each.settings))
        new = [settings for settings in beside if not full.knows(settings)]
        if new:
            progress(f"{len(new)} candidates beside the best")
        # A single time may be far too long.
        trials = full.in_turns(filter(goal.is_near, map(full.measure, new)), _ROUNDS)
        better = [each for each in trials if goal.is_met(each) and goal.is_close(each, leading[0])]
        count += len(new)
        if not better:
            return leading[0], count
        trials = full.in_turns((*leading, *better), _MORE_ROUNDS)
        leading = sorted(filter(goal.is_met, trials), key=goal.order)[:2] or leading


def _beside(settings: Settings) -> list[Settings]:
    """Candidates with a step more or fewer samples, a threshold a step away, or both."""
    if settings.sampling.has_stopping_rule:
        return []
    k = LADDER.index(settings.samples)
    thresholds: list[float | None] = [None]
    if settings.adaptive is not None:
        i = THRESHOLDS.index(settings.adaptive)
        thresholds = list(THRESHOLDS[max(0, i - 1) : i + 2])
    return [
        msgspec.structs.replace(settings, samples=n, adaptive=threshold)
        for n in LADDER[max(0, k - 1) : k + 2]
        if settings.adaptive is None or n >= ADAPTIVE_FROM
        for threshold in thresholds
    ]


class _Goal(NamedTuple):
    """The error or the time that is asked for, and which trials are better."""

    max_error: float | None
    time: float | None

    def is_met(self, trial: Trial) -> bool:
        if self.max_error is not None:
            return trial.error <= self.max_error and not trial.uncertain
        return trial.seconds <= (self.time or 0.0)

    def is_near(self, trial: Trial) -> bool:
        """Whether a trial meets the goal, but for what a single time is off by."""
        return self.is_met(trial) or (self.time is not None and trial.seconds <= _ONCE * self.time)

    def order(self, trial: Trial) -> tuple[float, float]:
        """Less is better."""
        return (trial.least, trial.error) if self.max_error is not None else (trial.error, trial.least)

    def miss(self, trial: Trial) -> float:
        """How far a trial is from the goal."""
        return trial.error if self.max_error is not None else trial.seconds

    def may_be_met(self, predicted: Trial, share: float = 1.0) -> bool:
        """Whether a prediction may meet the goal, where that share of what is predicted is true."""
        if self.max_error is not None:
            return share * predicted.error <= _UNSURE_ERROR * self.max_error
        return share * predicted.seconds <= _UNSURE_TIME * (self.time or 0.0)

    def is_close(self, trial: Trial, best: Trial) -> bool:
        """Whether times decide between the two."""
        return self.max_error is None or trial.least <= _CLOSE * best.least


def _ranked(
    small: Trials, full: Trials, base: Settings, goal: _Goal, progress: Callable[[str], None]
) -> tuple[list[Trial], bool]:
    """The candidates that may well meet the target, as predicted for the full size, the most promising first.

    And whether there is no hope: then there is but the best of them.
    """
    max_error, time = goal.max_error, goal.time
    first = msgspec.structs.replace(base, samples=4)
    progress(f"numbers of samples at {small.size[0]}x{small.size[1]}")
    small.refer(MOST // TIMES)
    full.refer(first.samples)
    scale = _scale(small, full, first)
    start = _first_fixed(small, scale, base, max_error, time)
    predicted = small.measure(start).error * scale[0]
    hopeless = max_error is not None and predicted > _HOPELESS * max_error
    progress(f"what pictures are compared with, {TIMES} times {start.samples} samples")
    full.refer(start.samples * (1 if max_error is not None else 4))
    if hopeless:
        return [small.measure(start)._replace(error=predicted)], True
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
    predictions = []
    for trial in small.in_turns([small.measure(settings) for settings in near], _SMALL_ROUNDS):
        settings = trial.settings
        by_error, by_time = scales[settings.adaptive is not None]
        predictions.append(
            trial._replace(error=by_error * trial.error, seconds=by_time * trial.least, least=by_time * trial.least)
        )
    met = sorted(filter(goal.may_be_met, predictions), key=goal.order)
    ranked = met + sorted((each for each in predictions if not goal.may_be_met(each)), key=goal.miss)
    # The plain one is among the first: it is the one whose time is known best.
    plain = [each for each in ranked if each.settings.adaptive is None][:1]
    return plain + [each for each in ranked if each not in plain], False


def _scale(small: Trials, full: Trials, settings: Settings) -> tuple[float, float]:
    """Error and time at full size, of those at the small one."""
    [a], [b] = (trials.in_turns([trials.measure(settings)], _SMALL_ROUNDS) for trials in (small, full))
    return (b.error / a.error if a.error else 1.0), b.least / a.least


def _first_fixed(
    small: Trials, scale: tuple[float, float], base: Settings, max_error: float | None, time: float | None
) -> Settings:
    """The fewest samples that are expected to meet an error, or the most within a time."""
    settings = msgspec.structs.replace(base, samples=1)
    for n in LADDER:
        trial = small.measure(msgspec.structs.replace(base, samples=n))
        if time is not None and scale[1] * trial.seconds > time:
            break
        settings = trial.settings
        if max_error is not None and scale[0] * trial.error <= max_error:
            break
    return settings
