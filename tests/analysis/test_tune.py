"""`raytracer tune`: the pick meets the target, and the printed flags and table reproduce the pick."""

from __future__ import annotations

import argparse
import math
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from raytracer.analysis.tradeoffs import tune as tune_module
from raytracer.analysis.tradeoffs.trials import Trial, Trials
from raytracer.analysis.tradeoffs.tune import LADDER, candidates_for_error, list_candidates, tune
from raytracer.app.cli import main
from raytracer.app.options import add_settings, chosen_settings
from raytracer.formats.scene_file import load_settings, parse_document
from raytracer.formats.settings_section import section_text
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes

SIZE = (128, 72)


@pytest.fixture
def few_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time each candidate only once, for tests that compare pictures and need no exact times."""
    for name in ("_ROUNDS", "_MORE_ROUNDS", "_SMALL_ROUNDS"):
        monkeypatch.setattr(tune_module, name, 1)


def test_candidates_are_all_different_and_keep_the_callers_settings() -> None:
    candidates = list_candidates(Settings(shadows="soft")) + candidates_for_error(Settings(shadows="soft"), 0.01)
    assert len(set(candidates)) == len(candidates) and {settings.shadows for settings in candidates} == {"soft"}
    assert {settings.samples for settings in candidates if settings.adaptive is None} >= {*LADDER}


@pytest.mark.slow
@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
def test_the_pick_meets_the_error_against_many_random_samples(renderer: Renderer) -> None:
    scene = scenes.assignment()
    result = tune(renderer, scene, SIZE, Settings(), max_error=0.005)
    assert result.pick and result.pick.error <= 0.005
    picture = renderer.render(scene, SIZE, result.pick.settings).radiance
    # The error of 4096 random samples is 1/64 of the error of one sample, which is 0.02 here. Squared, it is less than
    # 1 % of the measured mean square.
    truth = renderer.render(scene, SIZE, Settings(samples=4096, sequence="random")).radiance
    assert np.sqrt(np.mean((picture.astype(float) - truth) ** 2)) <= 1.05 * 0.005


def test_the_search_continues_around_the_best_candidate_until_no_neighbour_is_better() -> None:
    class KnownTrials(Trials):
        """Trials with known errors and times: half the threshold takes half a sample more."""

        def __init__(self) -> None:
            self._known = {}

        def measure(self, settings: Settings) -> Trial:
            assert settings.adaptive is not None
            seconds = settings.samples - math.log2(settings.adaptive) / 2.0
            error = 1.0 / settings.samples + settings.adaptive
            self._known[settings] = Trial(settings, seconds, error, settings.samples, seconds)
            return self._known[settings]

        def time_in_turns(self, candidates: Iterable[Trial], rounds: int) -> list[Trial]:
            return list(candidates)

    target, trials = tune_module._Goal(0.05, None), KnownTrials()
    start = trials.measure(Settings(samples=64, adaptive=0.001))
    pick, count = tune_module._descend(trials, [start], target, lambda progress: None)
    met = filter(
        target.is_met, (KnownTrials().measure(s) for s in list_candidates(Settings()) if s.adaptive is not None)
    )
    assert pick == min(met, key=target.sort_key) and pick.settings == Settings(samples=24, adaptive=0.005)
    assert count < 40


def test_the_search_falls_back_to_fewer_samples_if_all_predictions_are_too_fast(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class SlowingTrials(Trials):
        """Trials of a machine that is 5 times as slow from the third measurement of times on."""

        def __init__(self, *arguments: Any) -> None:
            self.size, self.samples, self._turns, self._is_full = arguments[3], 256, 0, arguments[3] == SIZE
            self._known = {}

        def draw_reference(self, samples: int, progress: object = None) -> None:
            pass

        def measure(self, settings: Settings) -> Trial:
            seconds = 0.001 * settings.samples * (5.0 if self._turns >= 2 and self._is_full else 1.0)
            self._known[settings] = Trial(settings, seconds, 1.0 / settings.samples, settings.samples, seconds)
            return self._known[settings]

        def time_in_turns(self, candidates: Iterable[Trial], rounds: int) -> list[Trial]:
            self._turns += 1
            return [self.measure(trial.settings) for trial in candidates]

    monkeypatch.setattr(tune_module, "Trials", SlowingTrials)
    pick = tune(cast("Renderer", None), scenes.assignment(), SIZE, Settings(), time=0.0129).pick
    assert pick and pick.settings == Settings(samples=2)


@pytest.mark.gl
def test_the_reference_uses_another_sequence_and_an_identical_picture_has_no_error(renderer: Renderer) -> None:
    trials = Trials(renderer, scenes.assignment(), Settings(), SIZE)
    trials.draw_reference(4)
    assert trials.samples == 256
    r2 = trials.measure(Settings(samples=256, sequence="r2"))
    assert r2.error < 1e-6 < trials.measure(Settings(samples=64)).error
    assert trials.measure(Settings(samples=4)).error > trials.measure(Settings(samples=16)).error


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
def test_no_settings_meet_a_target_if_few_pixels_hold_the_error_and_the_reference_is_uncertain(
    renderer: Renderer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    metal = scenes.GLINT.replace(
        "alpha = 0.001", "alpha = 0.05"
    )  # few pixels hold the error, but the reference is right
    for text, is_certain in ((scenes.GLINT, False), (metal, True)):
        trials = Trials(renderer, parse_document(tmp_path / "a.toml", text).scene, Settings(), (80, 45))
        trials.draw_reference(16)
        trial = trials.measure(Settings(samples=16))
        assert trial.is_uncertain is not is_certain and trial.error > 0.0
        assert tune_module._Goal(trial.error, None).is_met(trial) == is_certain
    file = tmp_path / "glint.toml"
    file.write_text(scenes.GLINT)
    assert main(["tune", str(file), "--max-error", "0.5", "--size", "80x45"]) == 1
    says = capsys.readouterr().out
    assert "reaches the target" in says and ", error at least " in says


@pytest.mark.gl
def test_times_are_medians_over_interleaved_rounds(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    trials = Trials(renderer, scenes.assignment(), Settings(), SIZE)
    times = {1: iter((1.0, 9.0, 2.0)), 4: iter((5.0, 3.0, 4.0))}
    order = []

    def seconds(settings: Settings) -> float:
        order.append(settings.samples)
        return next(times[settings.samples])

    monkeypatch.setattr(trials, "seconds", seconds)
    timed = trials.time_in_turns([Trial(Settings(samples=n), 0.0, 0.1, n, 0.0) for n in (1, 4)], 3)
    assert [(trial.least, trial.seconds) for trial in timed] == [(1.0, 2.0), (3.0, 4.0)] and order == [1, 4] * 3


def test_the_printed_table_holds_only_settings_that_differ_from_the_defaults() -> None:
    for settings in (
        Settings(samples=24, adaptive=0.01, shadows="soft"),
        Settings(samples=4096, max_error=0.002, precision=64),
        Settings(samples=6),
    ):
        table = tomllib.loads(section_text(settings))["settings"]
        assert Settings(**table) == settings


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
def test_the_printed_flags_and_the_printed_table_both_reproduce_the_measured_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.toml"
    file_settings = 'size = [96, 54]\nsamples = 24\nadaptive = 0.01\nsequence = "r2"\nshadows = "off"\nbounces = 3\n'
    file.write_text(f"{scenes.ASSIGNMENT.read_text()}\n[settings]\n{file_settings}")
    results = []
    search = tune_module.tune

    def recording_search(*arguments, **options):
        results.append(search(*arguments, **options))
        return results[-1]

    monkeypatch.setattr(tune_module, "tune", recording_search)
    assert main(["tune", str(file), "--max-error", "0.01", "--shadows", "diluted"]) == 0
    line, table = capsys.readouterr().out.split("\n\n")
    measured = results[0].pick.settings
    assert (measured.shadows, measured.bounces) == ("diluted", 3) and "at 96x54" in line
    parser = argparse.ArgumentParser()
    add_settings(parser, 1, adaptive=True)
    flags = chosen_settings(parser.parse_args(line.partition(":")[0].split()))
    assert (parse_document(file, file.read_text()).section.settings | flags).resolve() == measured
    file.write_text(f"{scenes.ASSIGNMENT.read_text()}\n{table}")
    assert load_settings(file) == measured and parse_document(file, file.read_text()).section.size == (96, 54)


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
@pytest.mark.parametrize("target", [("--time", "1e-6"), ("--max-error", "1e-9")])
def test_an_unreachable_target_is_status_1_and_names_the_closest_settings_after_few_trials(
    target: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tune", str(scenes.ASSIGNMENT), *target, "--size", "32x18"]) == 1
    said = re.match(r"none of (\d+) candidates reaches the target(.*); closest: --samples", capsys.readouterr().out)
    assert said and int(said[1]) <= 6
    assert said[2] == (", and no other is likely to" if target[0] == "--max-error" else "")


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
@pytest.mark.parametrize("measured", [0, 3])
def test_ctrl_c_prints_the_best_of_the_settings_measured_by_then(
    measured: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    measure, count = Trials.measure, 0

    def interrupted(trials: Trials, settings: Settings) -> Trial:
        nonlocal count
        if trials.size == (32, 18):
            count += 1
            if count > measured:
                raise KeyboardInterrupt
        return measure(trials, settings)

    monkeypatch.setattr(Trials, "measure", interrupted)
    assert main(["tune", str(scenes.ASSIGNMENT), "--max-error", "0.5", "--size", "32x18"]) == 130
    said = capsys.readouterr()
    if measured:
        assert re.match(r"interrupted: the best of \d measured candidates:\n--(samples|max-error) \d", said.out)
        assert "[settings]" in said.out
    else:
        assert "interrupted before a picture of the full size was measured" in said.err and not said.out
