"""Search for the fastest settings that reach an error, or for the most accurate settings within a time.

Candidates are fixed numbers of samples, adaptive samples, and `max_error`. Many candidates of the first two kinds are
rendered at a quarter of the size. For one candidate of each kind, the ratios of error and time between full size and
small size are measured. With these ratios, the search predicts the candidates at full size, and tries the most
promising ones there: they are timed in turns, and compared with a picture of many more samples in another sequence.
Then the neighbours of the best candidates are tried, until none of them is better. Only measurements at full size
count. Settings do not reach an error if few pixels hold most of it, and the reference may be as wrong in these pixels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sized
from typing import NamedTuple

import msgspec

from raytracer.analysis.tradeoffs.trials import MOST_SAMPLES, REFERENCE_FACTOR, Trial, Trials
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import DEFAULT_SAMPLE_LIMIT
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# The numbers of samples of candidates: 1, 2, 3, 4, 6, 8, 12, ...
LADDER = sorted({2**k for k in range(11)} | {3 * 2**k for k in range(9)})
THRESHOLDS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
# The fewest samples of adaptive candidates. With fewer they skip almost nothing, because all pixels get 3 samples.
ADAPTIVE_FROM = 8
# The `max_error` of candidates, over the requested error. Safety factors of up to 1.4 (stopping_rule.py) end most
# pictures below their `max_error`, so that a larger one may suffice.
ERROR_FACTORS = (1.0, 1.15, 1.3)

# The side of the small pictures that rank candidates, over the side of the full picture.
_SMALL = 0.25
# The assumed uncertainty factors of predicted errors and times.
_UNSURE_ERROR, _UNSURE_TIME = 1.1, 1.25
# The number of candidates of a batch at full size, and the number of times that each is timed. Candidates within the
# factor _CLOSE of the fastest are timed _MORE_ROUNDS times.
_FEW, _ROUNDS, _CLOSE, _MORE_ROUNDS = 6, 3, 1.4, 9
# If the predicted error with the most samples of LADDER exceeds this multiple of the requested error, the search ends.
# Candidates with `max_error` take up to DEFAULT_SAMPLE_LIMIT samples, but the error of even a smooth picture falls only
# as 1 / samples.
_HOPELESS_RATIO = _UNSURE_ERROR * DEFAULT_SAMPLE_LIMIT / LADDER[-1]
# A single picture may take this many times as long as usual.
_SINGLE_TIME_FACTOR = 2.5
# The number of times that each candidate is timed at the small size.
_SMALL_ROUNDS = 3
# The smallest error that differs from 0, in linear radiance.
_LEAST_ERROR = 1e-7
# The range of adaptive thresholds, as multiples of the picture's error.
_THRESHOLD = 1.0, 60.0


class Tuned(msgspec.Struct, frozen=True):
    """The result of a search."""

    pick: Trial | None  # the best trial that reaches the target; None: no trial does
    best: Trial  # the pick, or the closest trial
    measured_count: int  # the number of candidates measured at full size
    reference: int  # the number of samples of the reference
    is_hopeless: bool = False  # whether candidates were skipped because they are not expected to reach the target
    is_complete: bool = True  # False: interrupted by Ctrl-C


def list_candidates(base: Settings) -> list[Settings]:
    """Return all candidates without `max_error`: `base` with fixed and adaptive numbers of samples."""
    fixed = [msgspec.structs.replace(base, samples=n) for n in LADDER]
    adaptive = [
        msgspec.structs.replace(base, samples=n, adaptive=threshold)
        for n in LADDER
        if n >= ADAPTIVE_FROM
        for threshold in THRESHOLDS
    ]
    return fixed + adaptive


def candidates_for_error(base: Settings, error: float) -> list[Settings]:
    """Return the candidates with `max_error`: the requested error, and some larger ones with three digits."""
    errors = (error if share == 1.0 else float(f"{share * error:.3g}") for share in ERROR_FACTORS)
    return [msgspec.structs.replace(base, samples=DEFAULT_SAMPLE_LIMIT, max_error=limit) for limit in errors]


def tune(
    renderer: Renderer,
    scene: Scene,
    size: tuple[int, int],
    base: Settings,
    *,
    max_error: float | None = None,
    time: float | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> Tuned:
    """Search for the best settings. Exactly one of `max_error` and `time` must be set.

    Args:
        renderer, scene, size: the picture
        base: the settings that stay as they are
        max_error: largest root mean square error in linear radiance: find the fastest settings
        time: largest time in seconds: find the most accurate settings
        progress: called with a description of each step before it

    After Ctrl-C, returns the best trial at full size until then; raises KeyboardInterrupt if there is none.
    """
    small = Trials(renderer, scene, base, tuple(max(16, round(_SMALL * side)) for side in size))  # pyright: ignore[reportArgumentType]
    full = Trials(renderer, scene, base, size)
    goal = _Goal(max_error, time)
    try:
        return _search(small, full, base, goal, progress)
    except KeyboardInterrupt:
        if not (known := full.trials()):
            raise
        successes = sorted(filter(goal.is_met, known), key=goal.sort_key)
        best = successes[0] if successes else min(known, key=goal.limited_value)
        return Tuned(best if successes else None, best, len(known), full.samples, is_complete=False)


def _search(small: Trials, full: Trials, base: Settings, goal: _Goal, progress: Callable[[str], None]) -> Tuned:
    ranked, hopeless = _rank_candidates(small, full, base, goal, progress)
    extra = candidates_for_error(base, goal.max_error) if goal.max_error is not None and not hopeless else []
    tried: list[Trial] = []
    count = 0
    while ranked or extra:
        batch, ranked = ranked[:_FEW], ranked[_FEW:]
        candidates = extra + [predicted.settings for predicted in batch]
        extra = []
        count += len(candidates)
        progress(
            f"measuring {_counted(candidates, 'more candidate' if tried else 'candidate')} at {_size_text(full.size)}"
        )
        trials = [full.measure(settings) for settings in candidates]
        # Candidates far from the target are not timed again.
        trials = full.time_in_turns(filter(goal.is_near, trials), _ROUNDS) or trials
        if successes := sorted(filter(goal.is_met, trials), key=goal.sort_key):
            progress(f"timing the best of them {_MORE_ROUNDS} times")
            successes = full.time_in_turns(
                (trial for trial in successes if goal.is_close(trial, successes[0])), _MORE_ROUNDS
            )
        tried += [*trials, *successes]
        if successes := list(filter(goal.is_met, successes)):
            pick, more = _descend(full, successes, goal, progress)
            return Tuned(pick, pick, count + more, full.samples)
        # Scale the other predictions by the best ratio of measured to predicted values in this batch. A ratio above 1
        # rules nothing out, but candidates that reach the target in spite of it are tried first.
        ratio = min(
            (
                goal.limited_value(full.measure(trial.settings)) / max(goal.limited_value(trial), _LEAST_ERROR)
                for trial in batch
            ),
            default=1.0,
        )
        hopeful = [trial for trial in ranked if goal.may_be_met(trial, min(1.0, ratio))]
        hopeful.sort(key=lambda trial: not goal.may_be_met(trial, ratio))
        hopeless, ranked = hopeless or len(hopeful) < len(ranked), hopeful
    return Tuned(None, min(tried, key=goal.limited_value), count, full.samples, is_hopeless=hopeless)


def _descend(full: Trials, met: list[Trial], goal: _Goal, progress: Callable[[str], None]) -> tuple[Trial, int]:
    """Descend from the candidates in `met` to the best one, and return it with the number of new candidates.

    Each step tries the neighbours of the best two candidates, because predictions from small pictures are often wrong
    by a step.
    """
    leading = sorted(met, key=goal.sort_key)[:2]
    count = 0
    while True:
        beside = dict.fromkeys(settings for trial in leading for settings in _neighbours(trial.settings))
        new = [settings for settings in beside if not full.has_trial(settings)]
        if new:
            progress(f"measuring {_counted(new, 'neighbour')} of the best candidates")
        # A single time may be far too long, so that candidates near the target are timed again.
        trials = full.time_in_turns(filter(goal.is_near, map(full.measure, new)), _ROUNDS)
        better = [trial for trial in trials if goal.is_met(trial) and goal.is_close(trial, leading[0])]
        count += len(new)
        if not better:
            return leading[0], count
        trials = full.time_in_turns((*leading, *better), _MORE_ROUNDS)
        leading = sorted(filter(goal.is_met, trials), key=goal.sort_key)[:2] or leading


def _neighbours(settings: Settings) -> list[Settings]:
    """Return the neighbours of a candidate: samples one step up or down, the threshold one step up or down, or both."""
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
    """The requested error or time, and the order of trials."""

    max_error: float | None
    time: float | None

    def is_met(self, trial: Trial) -> bool:
        if self.max_error is not None:
            return trial.error <= self.max_error and not trial.is_uncertain
        return trial.seconds <= (self.time or 0.0)

    def is_near(self, trial: Trial) -> bool:
        """Whether a trial reaches the goal, or may do so because its single time may be too long."""
        return self.is_met(trial) or (self.time is not None and trial.seconds <= _SINGLE_TIME_FACTOR * self.time)

    def sort_key(self, trial: Trial) -> tuple[float, float]:
        """Return the sort key of a trial. Less is better."""
        return (trial.least, trial.error) if self.max_error is not None else (trial.error, trial.least)

    def limited_value(self, trial: Trial) -> float:
        """Return the value of a trial that the goal limits: its error or its time."""
        return trial.error if self.max_error is not None else trial.seconds

    def may_be_met(self, predicted: Trial, share: float = 1.0) -> bool:
        """Whether a prediction, multiplied by `share`, may reach the goal."""
        if self.max_error is not None:
            return share * predicted.error <= _UNSURE_ERROR * self.max_error
        return share * predicted.seconds <= _UNSURE_TIME * (self.time or 0.0)

    def is_close(self, trial: Trial, best: Trial) -> bool:
        """Whether a trial is so close to the best one that it must be timed again."""
        return self.max_error is None or trial.least <= _CLOSE * best.least


def _rank_candidates(
    small: Trials, full: Trials, base: Settings, goal: _Goal, progress: Callable[[str], None]
) -> tuple[list[Trial], bool]:
    """Predict the candidates at full size, and return them with the most promising first.

    Also returns whether no candidate is expected to reach the target: then the list has only the closest one.
    """
    max_error, time = goal.max_error, goal.time
    first = msgspec.structs.replace(base, samples=4)
    progress(f"predicting times and errors from pictures of {_size_text(small.size)}")
    small.draw_reference(MOST_SAMPLES // REFERENCE_FACTOR)
    full.draw_reference(first.samples)
    scale = _measure_ratios(small, full, first)
    start = _first_fixed(small, scale, base, max_error, time)
    predicted = small.measure(start).error * scale[0]
    hopeless = max_error is not None and predicted > _HOPELESS_RATIO * max_error
    progress(f"rendering a reference of {_size_text(full.size)}")
    full.draw_reference(start.samples * (1 if max_error is not None else 4))
    if hopeless:
        return [small.measure(start)._replace(error=predicted)], True
    scales = {False: _measure_ratios(small, full, start)}
    error = max_error if max_error is not None else max(scales[False][0] * small.measure(start).error, _LEAST_ERROR)
    near = [
        settings
        for settings in list_candidates(base)
        if start.samples <= settings.samples <= 8 * start.samples
        and settings.adaptive is not None
        and _THRESHOLD[0] * error <= settings.adaptive <= _THRESHOLD[1] * error
    ]
    if near:
        middle = min(near, key=lambda s: abs(math.log((s.adaptive or error) / (8 * error))) + s.samples / start.samples)
        scales[True] = _measure_ratios(small, full, middle)
    k = LADDER.index(start.samples)
    # Within a time all smaller numbers of samples are candidates, because full pictures may take longer than predicted.
    lowest = max(0, k - 2) if time is None else 0
    near += [msgspec.structs.replace(base, samples=n) for n in LADDER[lowest : k + 3]]
    progress(f"measuring {_counted(near, 'candidate')} at {_size_text(small.size)}, to rank them")
    predictions = []
    for trial in small.time_in_turns([small.measure(settings) for settings in near], _SMALL_ROUNDS):
        settings = trial.settings
        by_error, by_time = scales[settings.adaptive is not None]
        predictions.append(
            trial._replace(error=by_error * trial.error, seconds=by_time * trial.least, least=by_time * trial.least)
        )
    met = sorted(filter(goal.may_be_met, predictions), key=goal.sort_key)
    ranked = met + sorted(
        (prediction for prediction in predictions if not goal.may_be_met(prediction)), key=goal.limited_value
    )
    # The best candidate without adaptive samples comes first, because its prediction is the most reliable.
    plain = [prediction for prediction in ranked if prediction.settings.adaptive is None][:1]
    return plain + [prediction for prediction in ranked if prediction not in plain], False


def _counted(items: Sized, noun: str) -> str:
    return f"{len(items)} {noun}{'' if len(items) == 1 else 's'}"


def _size_text(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"


def _measure_ratios(small: Trials, full: Trials, settings: Settings) -> tuple[float, float]:
    """Measure the ratios of error and time between full size and small size."""
    [a], [b] = (trials.time_in_turns([trials.measure(settings)], _SMALL_ROUNDS) for trials in (small, full))
    return (b.error / a.error if a.error else 1.0), b.least / a.least


def _first_fixed(
    small: Trials, scale: tuple[float, float], base: Settings, max_error: float | None, time: float | None
) -> Settings:
    """Return the fewest samples that are expected to reach an error, or the most that are expected within a time."""
    settings = msgspec.structs.replace(base, samples=1)
    for n in LADDER:
        trial = small.measure(msgspec.structs.replace(base, samples=n))
        if time is not None and scale[1] * trial.seconds > time:
            break
        settings = trial.settings
        if max_error is not None and scale[0] * trial.error <= max_error:
            break
    return settings
