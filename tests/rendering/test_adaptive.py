"""Adaptive sampling: as accurate as all samples, with more samples only where they are needed."""

import re
from pathlib import Path

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.stopping_rule import FIRST
from raytracer.scene.options import Evaluator, Shadows
from raytracer.scene.settings import Settings
from tests import scenes

RECOMMENDED = Settings(samples=16, adaptive=0.01)
SIZE = 320, 180


def assert_same(a: rt.Image, b: rt.Image) -> None:
    assert a.samples is not None and b.samples is not None
    np.testing.assert_array_equal(a.samples, b.samples)
    np.testing.assert_array_equal(a.radiance, b.radiance)


@pytest.mark.gl
@pytest.mark.parametrize("shadows", ["hard", "diluted", "soft"])
def test_the_error_is_within_10_percent_of_the_error_with_all_samples(renderer: Renderer, shadows: Shadows) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), 0.5)
    settings = msgspec.structs.replace(RECOMMENDED, shadows=shadows)

    def radiance(**fields: object) -> np.ndarray:
        return renderer.render(scene, SIZE, msgspec.structs.replace(settings, **fields), geometry=False).radiance

    truth = radiance(samples=256, adaptive=None)
    adaptive, full = (np.sqrt(np.mean((radiance(adaptive=t) - truth) ** 2)) for t in (0.01, None))
    assert adaptive <= 1.1 * full


@pytest.mark.gl
def test_only_pixels_near_edges_get_more_than_the_first_samples(renderer: Renderer) -> None:
    ball = rt.Sphere((0, 0, 0), 1, rt.Material(kd=(1, 0, 0)))
    camera = rt.Camera((0, 0, 5), (0, 0, 0))
    image = renderer.render(rt.Scene([ball], [], camera), (160, 160), RECOMMENDED)
    assert image.material is not None and image.samples is not None
    is_ball = image.material >= 0
    near = np.zeros_like(is_ball)  # an edge within 1 pixel
    near[:, 1:] |= is_ball[:, 1:] != is_ball[:, :-1]
    near[1:] |= is_ball[1:] != is_ball[:-1]
    assert (image.samples[near] > FIRST).all() and (image.samples[near] == 16).mean() > 0.8
    around = np.lib.stride_tricks.sliding_window_view(np.pad(near, 6), (13, 13)).any(axis=(2, 3))
    assert (image.samples[~around] == FIRST).all()


@pytest.mark.gl
def test_a_large_threshold_keeps_the_first_samples_and_a_small_one_takes_all(renderer: Renderer) -> None:
    scene = scenes.random_scene(3)
    # No error reaches the large threshold.
    few = renderer.render(scene, SIZE, Settings(samples=16, adaptive=1e6))
    np.testing.assert_array_equal(few.radiance, renderer.render(scene, SIZE, Settings(samples=FIRST)).radiance)
    many = renderer.render(scene, SIZE, Settings(samples=16, adaptive=1e-30))
    full = renderer.render(scene, SIZE, Settings(samples=16))
    assert many.samples is not None
    every = many.samples == 16
    assert every.mean() > 0.5
    np.testing.assert_array_equal(many.radiance[every], full.radiance[every])


@pytest.mark.gl
def test_edges_between_equally_bright_colours_count_and_edges_within_white_do_not(
    renderer: Renderer,
) -> None:
    def share_above_first(ball: tuple[float, float, float], background: tuple[float, float, float]) -> float:
        material = rt.Material(ka=ball)
        scene = rt.Scene(
            [rt.Sphere((0, 0, 0), 1, material)], [], rt.Camera((0, 0, 5), (0, 0, 0)), background=background
        )
        image = renderer.render(scene, (64, 64), RECOMMENDED)
        assert image.samples is not None
        return float((image.samples > FIRST).mean())

    assert share_above_first((0.7152, 0, 0), (0, 0.2126, 0)) > 0.05
    assert share_above_first((40, 40, 40), (50, 50, 50)) == 0.0
    assert share_above_first((2, 3, 4), (0.5, 50, 60)) > 0.05


@pytest.mark.gl
@pytest.mark.parametrize("evaluator", ["cells", "walk"])
@pytest.mark.parametrize("tile", [16, 50, 64])
def test_tiles_change_no_pixel(renderer: Renderer, evaluator: Evaluator, tile: int) -> None:
    settings = Settings(samples=40, adaptive=0.03, evaluator=evaluator)
    whole = renderer.render(scenes.assignment(), (201, 113), settings, geometry=False)
    assert_same(renderer.render(scenes.assignment(), (201, 113), settings, geometry=False, tile=tile), whole)


@pytest.mark.gl
def test_adaptive_sampling_works_with_candidate_lists(renderer: Renderer) -> None:
    rng = np.random.default_rng(1)
    balls = [rt.Sphere(tuple(rng.uniform(-2, 2, 3)), 0.3, scenes.COLORS[i % 4]) for i in range(60)]
    scene = scenes.lit_scene(*balls, rt.Plane((0, 1, 0), -2.5))
    settings = Settings(samples=16, adaptive=1e-30)
    image, full = (renderer.render(scene, (201, 113), s) for s in (settings, Settings(samples=16)))
    assert image.samples is not None
    every = image.samples == 16
    assert every.mean() > 0.3
    np.testing.assert_array_equal(image.radiance[every], full.radiance[every])
    assert_same(renderer.render(scene, (201, 113), settings, tile=40), image)


@pytest.mark.gl
def test_repeated_renderings_are_identical(renderer: Renderer) -> None:
    first = renderer.render(scenes.assignment(), (160, 90), RECOMMENDED)
    renderer.render(scenes.random_scene(3), (64, 64), RECOMMENDED)
    assert_same(renderer.render(scenes.assignment(), (160, 90), RECOMMENDED), first)


@pytest.mark.gl
def test_blocks_also_stop_after_the_first_sum_of_256_samples(renderer: Renderer) -> None:
    settings = Settings(samples=1500, adaptive=0.02)
    image = renderer.render(scenes.assignment(), (48, 27), settings)
    full = renderer.render(scenes.assignment(), (48, 27), Settings(samples=1500))
    assert image.samples is not None
    assert set(np.unique(image.samples)) <= {3, 8, 16, 32, 64, 128, 256, 512, 1024, 1500}
    assert (image.samples > 256).any() and (image.samples == FIRST).any()
    assert np.sqrt(np.mean((image.radiance - full.radiance) ** 2)) < 0.02


@pytest.mark.gl
def test_progress_ends_with_its_total(renderer: Renderer) -> None:
    calls: list[tuple[int, int]] = []
    renderer.render(scenes.assignment(), (64, 36), RECOMMENDED, progress=lambda *at: calls.append(at), tile=32)
    assert calls == sorted(calls)
    assert {total for _, total in calls} == {4 * 16}
    assert calls[-1] == (64, 64)


@pytest.mark.gl
def test_progress_towards_an_error_predicts_the_number_of_samples(renderer: Renderer) -> None:
    calls: list[tuple[int, int]] = []
    settings = Settings(samples=4096, max_error=0.004)
    image = renderer.render(scenes.assignment(), (64, 36), settings, progress=lambda *at: calls.append(at))
    assert image.samples is not None
    most = int(image.samples.max())
    assert most >= 8
    # The estimate after half of the samples predicts the end within a factor of 3; the limit would be 4096.
    assert [total for done, total in calls if done == most // 2 and most / 3 < total < 3 * most]


@pytest.mark.gl
def test_the_command_line_stores_the_setting_and_the_samples_in_the_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = "--size", "64x36", "--samples", "16", "--adaptive", "0.01"
    assert main(["render", "assignment", "-o", str(tmp_path / "a.png"), *options]) == 0
    assert b"adaptive=0.01" in (tmp_path / "a.png").read_bytes()
    assert re.search("3 to 16 samples per pixel, [0-9.]+ on average", capsys.readouterr().out)
    assert main(["render", "assignment", "-o", str(tmp_path / "a.npz"), *options]) == 0
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["samples"].shape == (36, 64)


@pytest.mark.parametrize("wrong", ["0", "-1", "nan", "inf"])
def test_an_invalid_threshold_is_refused(wrong: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(rt.InputError, match="adaptive: expected a finite number above 0"):
        Settings(adaptive=float(wrong))
    assert main(["render", "assignment", "-o", str(tmp_path / "a.png"), f"--adaptive={wrong}"]) == 2
    assert "adaptive" in capsys.readouterr().err
