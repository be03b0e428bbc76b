"""The stated error of a picture, compared with closed forms of single pixels and with converged pictures."""

from __future__ import annotations

import math
import time

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

import raytracer as rt
from raytracer.formats.estimate import FEW_PIXELS, Estimate
from raytracer.ground_truth import ray_tracer
from raytracer.rendering import replicate
from raytracer.rendering.estimator import FACTOR
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Shadows
from raytracer.scene.sequences import sample_points
from raytracer.scene.settings import Settings
from tests import scenes
from tests.edges import SIZE, random_strips

Array = NDArray[np.float64]


def samples(count: int) -> Array:
    """Return the places of the first samples in each pixel, from the pixel's centre [count, pixels, 2]."""
    return np.array([sample_points(k, SIZE, samples=count).reshape(-1, 2) for k in range(count)]) - 0.5


@pytest.mark.parametrize("thickness", [0.02, 0.1, 0.3, 2.0])
def test_the_last_movement_estimates_the_error_of_edges_and_lines_within_30_percent(thickness: float) -> None:
    inside, exact = random_strips(np.random.default_rng(1), thickness)
    points = samples(64)
    for n in (2, 4, 8, 16, 32, 64):
        hit = inside(points[:n])
        error = np.sqrt(np.mean((hit.mean(axis=0) - exact) ** 2))
        moved = np.sqrt(np.mean((hit.mean(axis=0) - hit[: n // 2].mean(axis=0)) ** 2))
        assert 0.7 < math.sqrt(FACTOR) * moved / error < 1.3, n


def hit_share(radius: float, count: int) -> float:
    """Return the share of randomly placed discs that at least one sample hits. `radius`: in pixels."""
    rng = np.random.default_rng(2)
    centers = rng.uniform(2, SIZE[0] - 2, (20_000, 2))
    pixels = centers.astype(int)
    is_hit = np.zeros(len(centers), bool)
    for k in range(count):
        points = sample_points(k, SIZE, samples=count) + np.stack(np.meshgrid(*map(np.arange, SIZE)), axis=-1)
        for dx, dy in np.ndindex(3, 3):
            near = points[pixels[:, 1] + dy - 1, pixels[:, 0] + dx - 1]
            is_hit |= np.linalg.norm(near - centers, axis=1) < radius
    return float(is_hit.mean())


@pytest.mark.parametrize("count", [4, 16, 64])
def test_samples_miss_a_third_of_discs_as_wide_as_their_spacing_and_none_twice_as_wide(count: int) -> None:
    spacing = Estimate(count, 0.0).spacing
    assert 0.62 < hit_share(spacing / 2, count) < 0.72
    assert hit_share(spacing, count) > 0.999
    assert 0.15 < hit_share(spacing / 4, count) < 0.25


def rms(difference: Array) -> float:
    return float(np.sqrt(np.mean(difference**2)))


def render_converged(renderer: Renderer, scene: rt.Scene, shadows: Shadows = "hard") -> Array:
    """Return the converged radiance of a scene, from samples that are independent of the error estimate."""
    settings = Settings(samples=256, shadows=shadows, sequence="r2")
    return renderer.render(scene, (320, 180), settings, geometry=False, estimates=False).radiance.astype(float)


@pytest.mark.gl
@pytest.mark.parametrize("shadows", ["hard", "soft"])
def test_the_estimate_is_within_25_percent_of_the_true_error(renderer: Renderer, shadows: Shadows) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), 0.5)
    truth = render_converged(renderer, scene, shadows)
    for samples in (4, 8, 16, 24, 32):
        image = renderer.render(scene, (320, 180), Settings(samples=samples, shadows=shadows))
        assert image.estimate and image.estimate.rmse and image.error is not None
        error = rms(image.radiance - truth)
        assert image.estimate.rmse == pytest.approx(error, rel=0.25), samples
        # The root mean square of the pixels' errors is the picture's error, and large errors are stated where they
        # occur.
        assert rms(image.error) == pytest.approx(image.estimate.rmse, rel=0.2)
        pixel_errors = np.sqrt(np.mean((image.radiance - truth) ** 2, axis=2))
        assert (pixel_errors <= 3.0 * image.error + 2.0 * error).mean() > 0.99


@pytest.mark.gl
def test_the_float64_reference_agrees_on_the_error(renderer: Renderer) -> None:
    scene, size = scenes.random_scene(5), (96, 54)
    truth = ray_tracer.trace(scene, size, Settings(samples=100, sequence="grid")).radiance
    image = renderer.render(scene, size, Settings(samples=16))
    assert image.estimate and image.estimate.rmse == pytest.approx(rms(image.radiance - truth), rel=0.35)


@pytest.mark.gl
@pytest.mark.parametrize("seed", [3, 7])
def test_the_true_error_is_at_most_the_requested_error(renderer: Renderer, seed: int) -> None:
    scene = scenes.random_scene(seed)
    truth = render_converged(renderer, scene)
    for error in (0.01, 0.003):
        image = renderer.render(scene, (320, 180), Settings(samples=4096, max_error=error))
        assert image.estimate and image.estimate.rmse and image.estimate.rmse <= error
        assert rms(image.radiance - truth) <= 1.1 * error
        assert image.samples is not None and image.samples.max() < 256


@pytest.mark.gl
def test_an_error_in_few_pixels_is_a_lower_bound(renderer: Renderer) -> None:
    for scene, few in ((scenes.glint(), True), (scenes.assignment(), False)):
        estimate = renderer.render(scene, (160, 90), Settings(samples=16)).estimate
        assert estimate and estimate.rmse and math.isfinite(estimate.rmse)
        assert (estimate.uncertain, "at least" in str(estimate), "about" in str(estimate)) == (few, few, not few)
        assert estimate.reached is None, "no error was requested"


@pytest.mark.gl
def test_an_uncertain_or_unknown_error_is_not_reached(renderer: Renderer) -> None:
    for scene, known in ((scenes.glint(), False), (scenes.assignment(), True)):
        estimate = renderer.render(scene, (160, 90), Settings(samples=32, max_error=0.5)).estimate
        assert estimate and estimate.rmse and estimate.reached is known
        assert (estimate.samples < 8) == known, "evidence from few pixels does not end a picture"
    assert Estimate(8, 0.0, 0.1, 0.3, (0, 0), FEW_PIXELS, max_error=0.5).reached is False
    assert Estimate(1, 0.0, unknown="1 sample a pixel", max_error=0.5).reached is False


@pytest.mark.gl
def test_a_picture_without_error_states_an_error_of_0(renderer: Renderer) -> None:
    camera = rt.Camera((0, 0, 5), (0, 0, 0))
    flat = rt.Scene([rt.Plane((0, 0, 1), 0, rt.Material(ka=(0.3, 0.3, 0.3)))], [], camera)
    for settings in (Settings(samples=4), Settings(samples=64, max_error=1e-6), Settings(samples=16, adaptive=0.01)):
        image = renderer.render(flat, (64, 48), settings)
        assert image.estimate and image.estimate.rmse is not None and image.estimate.rmse < 1e-6
        assert image.estimate.samples <= 8


@pytest.mark.gl
@pytest.mark.parametrize(
    ("settings", "why"),
    [
        (Settings(), "1 sample"),
        (Settings(samples=16, sequence="grid"), "grid"),
        (Settings(samples=16, sequence="r2"), "r2"),
    ],
)
def test_an_unknown_error_has_a_reason(renderer: Renderer, settings: Settings, why: str) -> None:
    image = renderer.render(scenes.assignment(), (64, 36), settings)
    assert image.estimate and image.estimate.rmse is None and why in str(image.estimate)
    assert image.error is not None and np.isnan(image.error).all()
    assert why in image.metadata["Error"]


@pytest.mark.gl
@pytest.mark.parametrize("tile", [64, 96])
def test_tiles_have_the_estimate_of_the_whole_picture(renderer: Renderer, tile: int) -> None:
    for settings in (Settings(samples=16), Settings(samples=16, adaptive=0.02), Settings(samples=600)):
        whole, parts = (renderer.render(scenes.assignment(), (200, 120), settings, tile=t) for t in (2048, tile))
        assert whole.estimate and parts.estimate and whole.estimate.rmse
        assert parts.estimate.rmse == pytest.approx(whole.estimate.rmse, rel=1e-5)
        assert parts.estimate.worst_at == whole.estimate.worst_at
        np.testing.assert_array_equal(parts.radiance, whole.radiance)


@pytest.mark.gl
@pytest.mark.parametrize(
    ("size", "settings"),
    [
        ((200, 120), Settings(samples=4096, max_error=0.002)),
        ((201, 113), Settings(samples=4096, max_error=0.004, shadows="soft")),
        ((121, 73), Settings(samples=600, max_error=1e-4, shadows="soft")),  # several sums of 256 samples
        ((200, 120), Settings(samples=16, time=60.0)),
        ((200, 120), Settings(samples=300, time=60.0, sequence="r2")),  # without error measurements
    ],
)
def test_the_stopping_rule_does_not_depend_on_tiles(
    renderer: Renderer, size: tuple[int, int], settings: Settings
) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), 0.5)
    whole, *others = (renderer.render(scene, size, settings, tile=tile) for tile in (2048, 96, 64))
    for parts in others:
        for name in ("radiance", "samples", "error"):
            np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
        assert parts.estimate and whole.estimate
        assert msgspec.structs.replace(parts.estimate, seconds=0) == msgspec.structs.replace(whole.estimate, seconds=0)


@pytest.mark.gl
def test_a_tiled_picture_is_not_much_better_than_the_requested_error(renderer: Renderer) -> None:
    scene, size, goal = scenes.assignment(), (320, 180), 0.002
    truth = renderer.render(scene, size, Settings(samples=2048), geometry=False).radiance
    image = renderer.render(scene, size, Settings(samples=4096, max_error=goal), geometry=False, tile=64)
    # Decisions begin at 2 samples. From one decision to the next, the error at most halves.
    assert 0.5 * goal < np.sqrt(np.mean((image.radiance - truth) ** 2)) <= goal


@pytest.mark.gl
def test_the_first_limit_of_error_time_and_samples_ends_the_picture(renderer: Renderer) -> None:
    scene, size = scenes.assignment(), (160, 90)
    settings = Settings(samples=4096, max_error=1e-9, time=0.05)
    image = renderer.render(scene, size, settings)
    assert image.estimate and image.estimate.samples < 4096  # the number depends on how busy the machine is
    image = renderer.render(scene, size, msgspec.structs.replace(settings, samples=6, time=60.0))
    assert image.samples is not None and set(np.unique(image.samples)) == {6}
    image = renderer.render(scene, size, msgspec.structs.replace(settings, max_error=0.05, time=60.0))
    assert image.samples is not None and image.samples.max() <= 4


@pytest.mark.gl
def test_a_picture_with_a_time_limit_ends(renderer: Renderer) -> None:
    scene, size = scenes.assignment(), (320, 180)
    renderer.render(scene, size, Settings(samples=8, max_error=1e-9), geometry=False)  # compiles
    begin = time.perf_counter()
    image = renderer.render(scene, size, Settings(samples=65536, time=0.5), geometry=False)
    took = time.perf_counter() - begin
    # The test asserts only that the picture ends, and not at once, because the machine may be busy.
    assert image.estimate and 2 <= image.estimate.samples < 65536
    assert 0.1 < image.estimate.seconds <= took < 5.0


@pytest.mark.gl
@pytest.mark.parametrize("size", [(1, 1), (5, 3), (17, 9)])
def test_pictures_smaller_than_a_cell_may_have_a_time_limit(renderer: Renderer, size: tuple[int, int]) -> None:
    timed = renderer.render(scenes.assignment(), size, Settings(samples=4, time=60.0))
    plain = renderer.render(scenes.assignment(), size, Settings(samples=4))
    np.testing.assert_array_equal(timed.radiance, plain.radiance)
    assert timed.error is not None and np.isfinite(timed.error).all()


@pytest.mark.gl
def test_samples_after_a_measurement_leave_time_for_the_next_measurement(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replicate, "replicate_seconds", lambda *_: 100.0)
    settings = Settings(samples=64, max_error=0.5, time=1000.0)
    # The first measurement is at 2 samples, and its estimate is uncertain.
    estimate = renderer.render(scenes.glint(), (160, 90), settings).estimate
    assert estimate and estimate.reached is False and 2 < estimate.samples < 10


@pytest.mark.gl
def test_a_pass_begins_only_if_there_is_time_for_it(renderer: Renderer) -> None:
    settings = Settings(samples=4096, time=1e-9)
    image = renderer.render(scenes.assignment(), (100, 60), settings, tile=64)
    assert image.samples is not None and (image.samples == 1).all()
    assert image.estimate and "only 1 sample in some pixels" in str(image.estimate)
