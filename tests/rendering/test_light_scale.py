"""Scaling the light of a scene by a power of two scales the stated error of its picture by the same factor."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.light_scale import light_scale
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.settings import Settings
from raytracer.scene.solids.flattening import with_leaves
from tests import scenes
from tests.compiled import frame

SIZE = (96, 54)
LAMP = rt.PointLight((-3, 5, 4), (0.5, 0.4, 0.3), radius=0.5)
NEAR_LAMP = rt.PointLight((0.5, 2.4, 2), (0.8, 0.6, 0.4), falloff="inverse_square")
SHINING = rt.Material(model="lafortune", le=(0.1, 0.2, 0.15))
MANY = [rt.Sphere((0.7 * (i % 9) - 2.8, 0.3 + i // 9, 0), 0.3, scenes.COLORS[i % 4]) for i in range(27)]


def scale_light(scene: rt.Scene, times: float, surfaces: float = 1.0) -> rt.Scene:
    """Return the scene with all light multiplied by `times`, and all reflectance by `surfaces`."""

    def scale_material(material: rt.Material) -> rt.Material:
        factors = {name: surfaces for name in ("ka", "kd", "ks")} | {"le": times * surfaces}
        changed = {name: factor for name, factor in factors.items() if name in material.parameters}
        return material.replace(
            **{name: tuple(f * c for c in material.parameters[name]) for name, f in changed.items()}
        )

    def scale_color(color: tuple[float, float, float], by: float) -> tuple[float, ...]:
        return tuple(by * channel for channel in color)

    return msgspec.structs.replace(
        scene,
        objects=[
            with_leaves(solid, lambda leaf: msgspec.structs.replace(leaf, material=scale_material(leaf.material)))
            for solid in scene.solids()
        ],
        lights=[msgspec.structs.replace(light, color=scale_color(light.color, times)) for light in scene.lights],
        ambient=scale_color(scene.ambient, times),
        background=scale_color(scene.background, times * surfaces),
        materials=(),
    )


# Scenes with all sources of light: lamps of both falloffs, ambient, background, and emission in all material layouts.
SCENES = {
    "few": scenes.still_life(lights=[LAMP, NEAR_LAMP]),
    "many": scenes.still_life(*MANY, lights=[scenes.SUN]),
    "shining": scenes.still_life(rt.Sphere((-1.5, 1, 1), 0.5, SHINING), lights=[scenes.SUN]),
    "shining alone": scenes.still_life(rt.Sphere((-1.5, 1, 1), 0.5, rt.Material(le=(0.1, 0.2, 0.3))), lights=[]),
    "mirror": scenes.still_life(rt.Sphere((-1.5, 1, 1), 0.8, rt.Material(model="mirror"))),
}
# Dim scenes, without channels of 1 or more, which are displayed as 1 and have no error for a threshold.
DIM = {name: scale_light(scene, 0.25) for name, scene in SCENES.items()}
# A scene lit only by lamps, because emission and background are at most 1e12.
BLACK = msgspec.structs.replace(SCENES["few"], lights=[scenes.SUN, LAMP], background=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("brightest", [1e-35, 1e-20, 1e-8, 1.0, 3.0, 1e8, 1e12, 1e30, 3e38])
def test_squares_of_scaled_light_fit_into_float32(brightest: float) -> None:
    scale = light_scale(frame(scale_light(SCENES["few"], min(brightest, 1.0)), SIZE), brightest)
    assert np.frexp(scale)[0] == 0.5
    assert (1e-3 * brightest * scale) ** 2 > np.finfo(np.float32).tiny and (1e3 * brightest * scale) ** 2 < 1e30
    assert scale == 1.0 or not 1e-8 <= brightest <= 1e8


def test_a_picture_without_light_has_the_scale_1() -> None:
    few = frame(SCENES["few"], SIZE)
    assert light_scale(few, 0.0) == light_scale(few, float("inf")) == 1.0


@pytest.mark.parametrize("brightest", [1e-35, 1e-12])
def test_the_scale_of_a_dark_scene_causes_no_overflow(brightest: float) -> None:
    bulb, polished = rt.Sphere((0, 0, 1), 1, rt.Material(le=(1e12,) * 3)), rt.Material(ks=(1e6,) * 3)
    for scene, most in (
        (scenes.lit_scene(bulb), 1e12),
        (scenes.still_life(lights=[NEAR_LAMP]), 1e24),
        (scenes.lit_scene(rt.Sphere((0, 0, 0), 1, polished)), 1e6),
    ):
        scale = light_scale(frame(scene, SIZE), brightest)
        assert 1.0 < scale <= np.finfo(np.float32).max / 256 / most


def assert_times(image: rt.Image, other: rt.Image, power: int) -> None:
    """Check that `other` has exactly 2^power times the radiance and the errors of `image`, with the same samples."""
    times = 2.0**power
    np.testing.assert_array_equal(other.radiance, image.radiance * np.float32(times))
    assert (other.samples is None) == (image.samples is None)
    if image.samples is not None and other.samples is not None:
        np.testing.assert_array_equal(other.samples, image.samples)
    assert image.error is not None and other.error is not None and image.error.max() > 0.0
    np.testing.assert_array_equal(other.error, image.error * np.float32(times))
    a, b = image.estimate, other.estimate
    assert a and b and a.rmse and a.worst and a.rmse > 0.0
    assert (b.rmse, b.worst, b.worst_at) == (times * a.rmse, times * a.worst, a.worst_at)


@pytest.mark.gl
@pytest.mark.parametrize("name", DIM)
def test_the_error_of_a_dark_picture_scales_with_its_light(renderer: Renderer, name: str) -> None:
    settings = Settings(samples=8, shadows="soft")
    image = renderer.render(DIM[name], SIZE, settings)
    for power in (-40, -60, -90):
        assert_times(image, renderer.render(scale_light(DIM[name], 2.0**power), SIZE, settings), power)
    assert_times(image, renderer.render(DIM[name], SIZE, settings), 0)


@pytest.mark.gl
def test_the_error_of_a_bright_picture_scales_with_its_light(renderer: Renderer) -> None:
    for settings in (Settings(samples=8, shadows="soft"), Settings(samples=300)):
        image = renderer.render(BLACK, SIZE, settings)
        for light, surfaces in ((30, 10), (30, 30), (37, 37), (-30, 20)):
            other = renderer.render(scale_light(BLACK, 2.0**light, 2.0**surfaces), SIZE, settings)
            assert_times(image, other, light + surfaces)


def settings_with(key: str, value: float) -> Settings:
    return msgspec.structs.replace(Settings(samples=64), **{key: value})


@pytest.mark.gl
def test_thresholds_and_goals_scale_with_the_light(renderer: Renderer) -> None:
    scene = DIM["few"]
    for key, value in (("adaptive", 0.002), ("max_error", 0.0002)):
        image = renderer.render(scene, SIZE, settings_with(key, value))
        assert image.samples is not None and len(np.unique(image.samples)) > 1
        for power in (-40, -60):
            settings = settings_with(key, 2.0**power * value)
            assert_times(image, renderer.render(scale_light(scene, 2.0**power), SIZE, settings), power)
    # All of this picture is above 1, and displayed as 1.
    bright = scale_light(BLACK, 2.0**30, 2.0**10)
    for key, value, more in (("adaptive", 0.01, 1.0), ("max_error", 1e9, 2.0**20)):
        image = renderer.render(bright, SIZE, settings_with(key, value))
        other = renderer.render(scale_light(bright, 1.0, 2.0**20), SIZE, settings_with(key, more * value))
        assert_times(image, other, 20)


@pytest.mark.gl
def test_tiles_of_different_brightness_have_the_estimate_of_the_whole_picture(renderer: Renderer) -> None:
    # A picture whose left half is bright and whose right half is nearly black.
    balls = [rt.Sphere((x, 0, 0), 1, rt.Material(le=(le, le, le))) for x, le in ((-2, 1e11), (2, 1e-15))]
    scene = rt.Scene(balls, [], rt.Camera((0, 0, 8), (0, 0, 0)), background=(0, 0, 0))
    whole, parts = (renderer.render(scene, (128, 64), Settings(samples=16), tile=tile) for tile in (2048, 64))
    np.testing.assert_array_equal(parts.radiance, whole.radiance)
    assert parts.error is not None and (parts.error[:, 64:].max() > 0.0)
    assert whole.estimate and parts.estimate and parts.estimate.rmse == pytest.approx(whole.estimate.rmse)


@pytest.mark.gl
@pytest.mark.parametrize("ambient", [1e-25, 1e-3])
def test_very_bright_light_that_the_first_sample_misses_has_a_finite_error(
    renderer: Renderer, ambient: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Emission is at most 1e12, so the light of 1e24 comes from ambient reflection.
    speck = rt.Sphere((0.0298, 0.046, 1), 0.02, rt.Material(ka=(1e12, 1e12, 1e12)))
    wall = rt.Plane((0, 0, 1), 0, rt.Material(ka=(ambient * 1e-12,) * 3))
    scene = rt.Scene([speck, wall], [], rt.Camera((0, 0, 5), (0, 0, 0)), ambient=(1e12, 1e12, 1e12))
    scales: set[float] = set()
    original = TileRenderer.draw

    def record_scale(self: TileRenderer, *arguments: Any, light_scale: float = 1.0, **others: Any) -> None:
        scales.add(light_scale)
        original(self, *arguments, light_scale=light_scale, **others)

    monkeypatch.setattr(TileRenderer, "draw", record_scale)
    for settings in (Settings(samples=64), Settings(samples=48)):
        image = renderer.render(scene, SIZE, settings)
        assert min(scales) == 1.0 and (max(scales) > 1.0) == (ambient < 1e-9), "the first sample misses the speck"
        mean, error = image.radiance.astype(float), image.error
        assert mean.max() > 1e20 and error is not None and np.isfinite(error).all()
        # The error of the brightest pixel is neither negligible nor larger than its radiance.
        place = np.unravel_index(mean[..., 0].argmax(), mean.shape[:2])
        assert 0.01 * mean.max() < error[place] <= 1.001 * mean.max()
        estimate = image.estimate
        assert estimate and estimate.rmse and estimate.worst
        rms = np.sqrt(np.mean(mean**2))
        assert 1e-3 * rms < estimate.rmse < 2.0 * rms and np.isfinite(estimate.worst)


@pytest.mark.gl
def test_very_bright_light_does_not_change_the_samples_elsewhere(renderer: Renderer) -> None:
    # Parts of the scene are above 1, and displayed as 1.
    lights = [msgspec.structs.replace(scenes.SUN, color=(3.0, 3.0, 3.0))]
    images: list[rt.Image] = []
    for le in (8.0, 1e12):
        lamp = rt.Sphere((-2.6, 3.2, 0), 0.6, rt.Material(kd=(0, 0, 0), ks=(0, 0, 0), ka=(0, 0, 0), le=(le, le, le)))
        scene = msgspec.structs.replace(scenes.still_life(lamp, lights=lights), background=(1.5, 1.5, 1.5))
        images.append(renderer.render(scene, SIZE, Settings(samples=64, adaptive=0.05)))
    rows, columns = np.nonzero(images[1].radiance[..., 0] > 1e3)
    away = np.ones(SIZE[::-1], bool)
    away[max(0, rows.min() - 8) : rows.max() + 9, max(0, columns.min() - 8) : columns.max() + 9] = False
    usual, bright = (image.samples[away] for image in images if image.samples is not None)
    np.testing.assert_array_equal(bright, usual)
    assert {3, 64} <= set(np.unique(usual))


@pytest.mark.gl
def test_light_close_to_a_lamp_is_clamped_to_1e12(renderer: Renderer) -> None:
    # The camera is 1e-6 from the ground and the lamp 1e-7, so that I / distance^2 is 1e14.
    ground = rt.Plane((0, 0, 1), 0, rt.Material(ka=(0, 0, 0), kd=(1, 1, 1), ks=(0, 0, 0)))
    lamp = rt.PointLight((0, 0, 1e-7), falloff="inverse_square")
    scene = rt.Scene([ground], [lamp], rt.Camera((0, 0, 1e-6), (0, 0, 0)))
    image = renderer.render(scene, SIZE, Settings(samples=4))
    truth = ray_tracer.trace(scene, SIZE, Settings(samples=4, sequence="grid")).radiance
    assert image.radiance.max() == pytest.approx(truth.max(), rel=0.02) and 0.9e12 < truth.max() <= 1e12


@pytest.mark.gl
def test_the_error_in_the_window_scales_with_the_light(renderer: Renderer) -> None:
    scene = DIM["few"]
    pictures: list[tuple[np.ndarray, float]] = []
    picture = ProgressivePicture(renderer.device, 1e9)
    with renderer.device.turn():
        for power in (0, -60, 0):
            picture.start(scale_light(scene, 2.0**power), Settings(samples=8), "picture", SIZE, moving=False)
            while not picture.is_done:
                picture.step()
            estimate = picture.estimate()
            assert estimate and estimate.rmse
            pictures.append((picture.image({}).radiance / np.float32(2.0**power), estimate.rmse / 2.0**power))
        picture.close()
    for radiance, rmse in pictures[1:]:
        np.testing.assert_array_equal(radiance, pictures[0][0])
        assert rmse == pictures[0][1] > 0.0


@pytest.mark.gl
def test_a_requested_error_is_reached_where_squares_would_overflow(renderer: Renderer) -> None:
    ball = rt.Sphere((0, 0, 0), 1, rt.Material(kd=(1e9, 1e9, 1e9)))
    scene = rt.Scene([ball], [rt.PointLight((3, 4, 5), (1e12, 1e12, 1e12))], rt.Camera((0, 1, 5), (0, 0, 0)))
    settings = Settings(samples=256, max_error=1e18)
    image = renderer.render(scene, SIZE, settings)
    assert image.estimate and image.estimate.rmse and image.error is not None
    assert 0.0 < image.estimate.rmse <= 1e18 and np.isfinite(image.error).all() and image.error.max() > 0.0
    truth = renderer.render(scene, SIZE, Settings(samples=1024, sequence="r2"), geometry=False, estimates=False)
    assert np.sqrt(np.mean((image.radiance - truth.radiance.astype(float)) ** 2)) <= 1.1e18
