"""What `raytracer tune` picks meets what was asked for, and is what it prints."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from raytracer.cli import main
from raytracer.renderer import Renderer
from raytracer.settings import Settings
from raytracer.trade.tune import LADDER, Measured, Stage, asked, grid, tune
from raytracer.trade_cli import settings_table

from . import scenes

SIZE = (128, 72)


def test_candidates_are_all_different_and_keep_what_is_given() -> None:
    found = grid(Settings(shadows="soft")) + asked(Settings(shadows="soft"), 0.01)
    assert len(set(found)) == len(found) and {settings.shadows for settings in found} == {"soft"}
    assert {settings.samples for settings in found if settings.adaptive is None} >= {*LADDER}


@pytest.mark.gl
def test_the_pick_meets_the_error_against_many_random_samples(renderer: Renderer) -> None:
    scene = scenes.assignment()
    found = tune(renderer, scene, SIZE, Settings(), max_error=0.005)
    assert found.pick and found.pick.error <= 0.005
    picture = renderer.render(scene, SIZE, found.pick.settings).radiance
    # 4096 random samples are off by a 64th of what one is, 0.02 here: squared, less than 1 % of what is measured.
    truth = renderer.render(scene, SIZE, Settings(samples=4096, sequence="random")).radiance
    assert np.sqrt(np.mean((picture.astype(float) - truth) ** 2)) <= 1.05 * 0.005


@pytest.mark.gl
def test_what_the_pick_is_compared_with_is_another_picture_and_an_exact_one_has_no_error(renderer: Renderer) -> None:
    stage = Stage(renderer, scenes.assignment(), Settings(), SIZE)
    stage.refer(4)
    assert stage.samples == 256
    r2 = stage.measure(Settings(samples=256, sequence="r2"))
    assert r2.error < 1e-6 < stage.measure(Settings(samples=64)).error
    assert stage.measure(Settings(samples=4)).error > stage.measure(Settings(samples=16)).error


@pytest.mark.gl
def test_times_are_medians_of_turns(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = Stage(renderer, scenes.assignment(), Settings(), SIZE)
    times = {1: iter((1.0, 9.0, 2.0)), 4: iter((5.0, 3.0, 4.0))}
    order = []

    def seconds(settings: Settings) -> float:
        order.append(settings.samples)
        return next(times[settings.samples])

    monkeypatch.setattr(stage, "seconds", seconds)
    found = stage.in_turns([Measured(Settings(samples=n), 0.0, 0.1, n, 0.0) for n in (1, 4)], 3)
    assert [(each.least, each.seconds) for each in found] == [(1.0, 2.0), (3.0, 4.0)] and order == [1, 4] * 3


def test_the_table_holds_what_is_not_by_default() -> None:
    for settings in (
        Settings(samples=24, adaptive=0.01, shadows="soft"),
        Settings(samples=4096, max_error=0.002, precision=64),
        Settings(samples=6),
    ):
        table = tomllib.loads(settings_table(settings))["settings"]
        if settings.asks:
            assert "samples" not in table, "the default is another one then"
            table["samples"] = settings.samples
        assert Settings(**table) == settings


@pytest.mark.gl
def test_the_command_prints_flags_and_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", str(scenes.ASSIGNMENT), "--max-error", "0.01", "--size", "96x54"]) == 0
    line, table = capsys.readouterr().out.split("\n\n")
    assert line.startswith("--") and "error 0.00" in line
    given = tomllib.loads(table)["settings"]
    assert all(f"--{name.replace('_', '-')} {value:g}" in line for name, value in given.items())


@pytest.mark.gl
def test_what_cannot_be_met_is_status_1_with_the_best_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", str(scenes.ASSIGNMENT), "--time", "1e-6", "--size", "32x18"]) == 1
    assert "nothing meets that; the closest is" in capsys.readouterr().out
