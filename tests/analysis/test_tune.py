"""What `raytracer tune` picks meets what was asked for, and is what it prints."""

from __future__ import annotations

import argparse
import math
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from raytracer.analysis.tradeoffs import tune as tune_module
from raytracer.analysis.tradeoffs.trials import Trial, Trials
from raytracer.analysis.tradeoffs.tune import LADDER, asked, grid, tune
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
    """For tests of which pictures are compared: no time is to be known well."""
    for name in ("_ROUNDS", "_MORE_ROUNDS", "_SMALL_ROUNDS"):
        monkeypatch.setattr(tune_module, name, 1)


def test_candidates_are_all_different_and_keep_what_is_given() -> None:
    found = grid(Settings(shadows="soft")) + asked(Settings(shadows="soft"), 0.01)
    assert len(set(found)) == len(found) and {settings.shadows for settings in found} == {"soft"}
    assert {settings.samples for settings in found if settings.adaptive is None} >= {*LADDER}


@pytest.mark.slow
@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
def test_the_pick_meets_the_error_against_many_random_samples(renderer: Renderer) -> None:
    scene = scenes.assignment()
    found = tune(renderer, scene, SIZE, Settings(), max_error=0.005)
    assert found.pick and found.pick.error <= 0.005
    picture = renderer.render(scene, SIZE, found.pick.settings).radiance
    # 4096 random samples are off by a 64th of what one is, 0.02 here: squared, less than 1 % of what is measured.
    truth = renderer.render(scene, SIZE, Settings(samples=4096, sequence="random")).radiance
    assert np.sqrt(np.mean((picture.astype(float) - truth) ** 2)) <= 1.05 * 0.005


def test_the_search_goes_on_beside_the_best_until_none_is_better() -> None:
    class Known(Trials):
        """A scene whose errors and times are known: half a sample more where the threshold is half of what it was."""

        def __init__(self) -> None:
            self._known = {}

        def measure(self, settings: Settings) -> Trial:
            assert settings.adaptive is not None
            seconds = settings.samples - math.log2(settings.adaptive) / 2.0
            error = 1.0 / settings.samples + settings.adaptive
            self._known[settings] = Trial(settings, seconds, error, settings.samples, seconds)
            return self._known[settings]

        def in_turns(self, candidates: Iterable[Trial], rounds: int) -> list[Trial]:
            return list(candidates)

    target, stage = tune_module._Goal(0.05, None), Known()
    start = stage.measure(Settings(samples=64, adaptive=0.001))
    pick, count = tune_module._descended(stage, [start], target, lambda what: None)
    met = filter(target.is_met, (Known().measure(s) for s in grid(Settings()) if s.adaptive is not None))
    assert pick == min(met, key=target.order) and pick.settings == Settings(samples=24, adaptive=0.005)
    assert count < 40


@pytest.mark.gl
def test_what_the_pick_is_compared_with_is_another_picture_and_an_exact_one_has_no_error(renderer: Renderer) -> None:
    stage = Trials(renderer, scenes.assignment(), Settings(), SIZE)
    stage.refer(4)
    assert stage.samples == 256
    r2 = stage.measure(Settings(samples=256, sequence="r2"))
    assert r2.error < 1e-6 < stage.measure(Settings(samples=64)).error
    assert stage.measure(Settings(samples=4)).error > stage.measure(Settings(samples=16)).error


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
def test_no_settings_meet_an_error_that_few_pixels_hold_where_the_reference_is_as_wrong(
    renderer: Renderer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    metal = scenes.GLINT.replace(
        "alpha = 0.001", "alpha = 0.05"
    )  # few pixels hold the error, but the reference is right
    for text, known in ((scenes.GLINT, False), (metal, True)):
        stage = Trials(renderer, parse_document(tmp_path / "a.toml", text).scene, Settings(), (80, 45))
        stage.refer(16)
        trial = stage.measure(Settings(samples=16))
        assert trial.uncertain is not known and trial.error > 0.0
        assert tune_module._Goal(trial.error, None).is_met(trial) == known
    file = tmp_path / "glint.toml"
    file.write_text(scenes.GLINT)
    assert main(["tune", str(file), "--max-error", "0.5", "--size", "80x45"]) == 1
    says = capsys.readouterr().out
    assert "reaches the target" in says and ", error at least " in says


@pytest.mark.gl
def test_times_are_medians_of_turns(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = Trials(renderer, scenes.assignment(), Settings(), SIZE)
    times = {1: iter((1.0, 9.0, 2.0)), 4: iter((5.0, 3.0, 4.0))}
    order = []

    def seconds(settings: Settings) -> float:
        order.append(settings.samples)
        return next(times[settings.samples])

    monkeypatch.setattr(stage, "seconds", seconds)
    found = stage.in_turns([Trial(Settings(samples=n), 0.0, 0.1, n, 0.0) for n in (1, 4)], 3)
    assert [(each.least, each.seconds) for each in found] == [(1.0, 2.0), (3.0, 4.0)] and order == [1, 4] * 3


def test_the_table_holds_what_is_not_by_default() -> None:
    for settings in (
        Settings(samples=24, adaptive=0.01, shadows="soft"),
        Settings(samples=4096, max_error=0.002, precision=64),
        Settings(samples=6),
    ):
        table = tomllib.loads(section_text(settings))["settings"]
        if settings.sampling.has_stopping_rule:
            assert "samples" not in table, "the default is another one then"
            table["samples"] = settings.samples
        assert Settings(**table) == settings


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
def test_what_the_command_prints_makes_what_it_measured_as_flags_over_the_file_and_as_its_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.toml"
    of_file = 'size = [96, 54]\nsamples = 24\nadaptive = 0.01\nsequence = "r2"\nshadows = "off"\nbounces = 3\n'
    file.write_text(f"{scenes.ASSIGNMENT.read_text()}\n[settings]\n{of_file}")
    found = []
    search = tune_module.tune

    def seen(*arguments, **options):
        found.append(search(*arguments, **options))
        return found[-1]

    monkeypatch.setattr(tune_module, "tune", seen)
    assert main(["tune", str(file), "--max-error", "0.01", "--shadows", "diluted"]) == 0
    line, table = capsys.readouterr().out.split("\n\n")
    measured = found[0].pick.settings
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
def test_what_cannot_be_met_is_status_1_with_the_closest_and_no_search_through_all(
    target: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tune", str(scenes.ASSIGNMENT), *target, "--size", "32x18"]) == 1
    said = re.match(r"none of (\d+) candidates reaches the target(.*); closest: --samples", capsys.readouterr().out)
    assert said and int(said[1]) <= 6
    assert said[2] == (", and no other is likely to" if target[0] == "--max-error" else "")


@pytest.mark.gl
@pytest.mark.usefixtures("few_rounds")
@pytest.mark.parametrize("measured", [0, 3])
def test_ctrl_c_prints_the_best_of_what_was_measured(
    measured: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    measure, count = Trials.measure, 0

    def interrupted(stage: Trials, settings: Settings) -> Trial:
        nonlocal count
        if stage.size == (32, 18):
            count += 1
            if count > measured:
                raise KeyboardInterrupt
        return measure(stage, settings)

    monkeypatch.setattr(Trials, "measure", interrupted)
    assert main(["tune", str(scenes.ASSIGNMENT), "--max-error", "0.5", "--size", "32x18"]) == 130
    said = capsys.readouterr()
    if measured:
        assert re.match(r"interrupted: the best of \d measured candidates:\n--(samples|max-error) \d", said.out)
        assert "[settings]" in said.out
    else:
        assert "interrupted before a picture of the full size was measured" in said.err and not said.out
