"""Soft shadows of sphere lights and inverse-square falloff, compared with closed forms and a converged reference."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer import glsl
from raytracer.compiler import packing
from raytracer.core.validation import set_fields
from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.light_rays import light_rays
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Evaluator, Shadows
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import sources

pytestmark = pytest.mark.gl

WHITE = rt.Material(ka=(0, 0, 0), kd=(1, 1, 1), ks=(0, 0, 0))
FLOOR = rt.Plane((0, 1, 0), 0, WHITE)


def soft_settings(samples: int = 256, **fields: object) -> Settings:
    return Settings(samples=samples, shadows="soft", **fields)  # pyright: ignore[reportArgumentType]


def scene_at_point(point: tuple[float, float, float], light: rt.PointLight, *objects: rt.Solid) -> rt.Scene:
    """Return a scene that shows one point of a white floor.

    The radiance of the picture is the irradiance at the point.
    """
    x, y, z = point
    camera = rt.Camera((x - 1, y + 0.4, z + 1), point, vertical_fov=1e-4)
    return rt.Scene([FLOOR, *objects], [light], camera)


def irradiance(renderer: Renderer, scene: rt.Scene, settings: Settings) -> float:
    """Return the mean radiance of 256 pixels, after a comparison with the reference."""
    image = renderer.render(scene, (16, 16), settings)
    truth = ray_tracer.trace(scene, (1, 1), Settings(shadows=settings.shadows), rays=80).radiance[0, 0, 0]
    mean = float(image.radiance[..., 0].mean(dtype=np.float64))
    assert mean == pytest.approx(truth, rel=2e-3, abs=1e-6)
    return mean


def test_light_rays_are_unit_vectors_within_the_cone_that_end_on_the_near_side(renderer: Renderer) -> None:
    rng = np.random.default_rng(4)
    defines = {"SPHERE_LIGHTS": 1, "FALLOFF": 1, "LIGHTS": 3}
    count, u = 20_000, 2.0**-24
    light = np.zeros(count, glsl.dtype("Light", defines))
    light["position"], light["radius"] = rng.normal(size=(count, 3)), 10.0 ** rng.uniform(-12, 6, count)
    P = (light["position"] + rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-9, 9, (count, 1))).astype(np.float32)
    start = np.zeros(1, glsl.dtype("Contact"))
    start["surface"] = 1
    point = (rng.integers(0, 2**24, (count, 2)) * 2.0**-24).astype(np.float32)
    point[:4] = (0, 0), (0, 1 - u), (1 - u, 0), (1 - u, 1 - u)
    ray = glsl.call("lightRay", light, P, start, point, defines=defines, device=renderer.device)
    L, t, n = (ray[name].astype(float) for name in ("L", "distance", "weight"))
    n = ray["end"]["n"].astype(float)
    to_center, r = light["position"].astype(float) - P, light["radius"].astype(float)
    d = np.linalg.norm(to_center, axis=1)
    magnitude = np.abs(P).max(axis=1) + np.abs(light["position"]).max(axis=1) + r
    np.testing.assert_allclose(np.linalg.norm(L, axis=1), 1.0, atol=8 * u)
    assert (np.abs(np.linalg.norm(t[:, None] * L - to_center, axis=1) - r) <= 8 * u * magnitude).all()
    clear = np.abs(d - r) > 8 * u * magnitude
    is_outside, is_inside = clear & (d > r), clear & (d < r)
    assert is_outside.sum() > 2000 and is_inside.sum() > 2000
    slope = np.sum(n * L, axis=1)
    known = clear & (r > 1e-15 * d)
    assert (slope[is_outside & known] < 0.0).all() and (slope[is_inside] >= -8 * u).all()
    np.testing.assert_allclose(np.linalg.norm(n, axis=1)[known & ~is_inside], 1.0, atol=16 * u)
    sine = np.linalg.norm(np.cross(L, to_center), axis=1)[is_outside] / d[is_outside]
    assert (sine <= r[is_outside] / d[is_outside] + 8 * u * magnitude[is_outside] / d[is_outside]).all()
    expected = np.where(d < r, 4.0, 2.0 / (1.0 + np.sqrt(1.0 - (r / np.maximum(d, r)) ** 2)))
    np.testing.assert_allclose(ray["weight"][clear], expected[clear], rtol=1e-3)
    far = is_outside & (d > 2 * r) & (d > 1e-3)  # where the rounding of P is negligible
    np.testing.assert_allclose(ray["weight"][far], expected[far], rtol=4e-7)


@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize(("height", "radius"), [(4.0, 0.5), (4.0, 3.9), (0.2, 1e-3)])
def test_a_sphere_above_the_horizon_lights_like_its_centre(
    renderer: Renderer, height: float, radius: float, precision: int
) -> None:
    light = rt.PointLight((3, height, 0), (0.7, 0.7, 0.7), radius)
    measured = irradiance(renderer, scene_at_point((0, 0, 0), light), soft_settings(precision=precision))
    assert measured == pytest.approx(0.7 * height / math.hypot(3, height), rel=1e-3)


def test_only_the_part_of_a_sphere_above_the_horizon_lights(renderer: Renderer) -> None:
    # The irradiance for a radiance of 1, over pi: the form factor of a sphere for a tilted patch, from Lagarde and de
    # Rousiers 2014, "Moving Frostbite to Physically Based Rendering".
    for height, radius, distance in ((0.5, 1.5, 3.0), (-0.5, 1.5, 3.0), (0.0, 1.0, 2.0)):
        d = math.hypot(height, distance)
        cosine, h = height / d, d / radius
        x = math.sqrt(h * h - 1.0)
        y = -x * cosine / math.sqrt(1.0 - cosine**2)
        side = math.sqrt(1.0 - cosine**2) * math.sqrt(1.0 - y * y)
        expected = ((cosine * math.acos(y) - x * side) / h**2 + math.atan(side / x)) / math.pi * h**2
        light = rt.PointLight((distance, height, 0), radius=radius)
        assert irradiance(renderer, scene_at_point((0, 0, 0), light), soft_settings()) == pytest.approx(
            expected, rel=5e-3
        )


def test_light_within_a_sphere_is_uniform(renderer: Renderer) -> None:
    for place in ((0, 0, 0), (1, -2, 1), (0, 2.999, 0)):
        light = rt.PointLight(place, (0.5, 0.5, 0.5), 3.0)  # pyright: ignore[reportArgumentType]
        assert irradiance(renderer, scene_at_point((0, 0, 0), light), soft_settings()) == pytest.approx(0.5, rel=1e-3)


def test_a_wall_up_to_the_centre_of_a_light_blocks_half_of_it(renderer: Renderer) -> None:
    wall = rt.Plane((-1, 0, 0), 0) & rt.Plane((0, -1, 0), -1)  # x >= 0 and y >= 1
    for radius in (0.01, 1.0):
        scene = scene_at_point((0, 0, 2), rt.PointLight((0, 4, 0), radius=radius), wall)
        image = renderer.render(scene, (16, 16), soft_settings()).radiance.mean()
        assert image == pytest.approx(0.5 * 4 / math.hypot(4, 2), rel=2e-3)


@pytest.mark.parametrize("evaluator", ["cells", "walk", "roth"])
def test_soft_shadows_tend_to_hard_shadows_as_the_radius_tends_to_0(renderer: Renderer, evaluator: Evaluator) -> None:
    cut = rt.Sphere((0, 0, 0), 1.5, scenes.COLORS[0]) - rt.Sphere((1, 1, 1), 1.2, scenes.COLORS[1])
    scene = scenes.lit_scene(cut, rt.Plane((0, 1, 0), -1.5, scenes.COLORS[3]))
    hard = renderer.render(scene, (96, 54), Settings(samples=4, evaluator=evaluator)).radiance
    point = renderer.render(scene, (96, 54), soft_settings(4, evaluator=evaluator)).radiance
    np.testing.assert_array_equal(point, hard)
    assert sources(scene, soft_settings()) == sources(scene), "the shader has no code for sphere lights"
    tiny = renderer.render(
        scenes.with_light_radii(scene, 1e-12), (96, 54), soft_settings(4, evaluator=evaluator)
    ).radiance
    np.testing.assert_allclose(tiny, hard, rtol=1e-6)


def test_a_falloff_without_a_formula_is_magenta_in_a_picture_and_an_error_in_a_reference(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packing, "FALLOFFS", ("none", "new", "inverse_square"))  # number 2 has no formula
    scene = scene_at_point((0, 0, 0), rt.PointLight((0, 2, 0), falloff="inverse_square"))
    red, green, blue = renderer.render(scene, (2, 2), Settings()).radiance[0, 0]
    assert red == blue > 1e6 and green == 0.0
    light = rt.PointLight((0, 2, 0))
    set_fields(light, falloff="new")
    with pytest.raises(AssertionError, match="new"):
        next(light_rays(light, np.ones((1, 3)), np.zeros(1, np.bool_), np.ones((1, 3)), 1))


def test_inverse_square_falloff_divides_by_the_squared_distance(renderer: Renderer) -> None:
    for distance in (0.01, 1.0, 5.0):
        light = rt.PointLight((0, distance, 0), (0.5, 0.5, 0.5), 0.25 * distance, "inverse_square")
        for settings in (Settings(), Settings(shadows="off"), Settings(shadows="diluted"), soft_settings()):
            measured = irradiance(renderer, scene_at_point((0, 0, 0), light), settings)
            assert measured == pytest.approx(0.5 / distance**2, rel=1e-3)
    inside = rt.PointLight((0, 1, 0), (0.5, 0.5, 0.5), 2.0, "inverse_square")
    assert irradiance(renderer, scene_at_point((0, 0, 0), inside), soft_settings()) == pytest.approx(
        0.5 / 2.0**2, rel=1e-3
    )


@pytest.mark.parametrize("height", [0.0, 1e-30, 1e-12, 1e-6, 1e12])
@pytest.mark.parametrize("color", [0.0, 1e-12, 1e12])
def test_lights_at_any_distance_cause_no_overflow(renderer: Renderer, height: float, color: float) -> None:
    bright = WHITE.replace(kd=(1e12,) * 3)
    lights = [
        rt.PointLight((0, height, 0), (color, color, color), radius, "inverse_square") for radius in (0.0, 1e-12, 1e12)
    ]
    camera = rt.Camera((0, 1, 1), (0, 0, 0), vertical_fov=60)
    scene = rt.Scene([rt.Plane((0, 1, 0), 0, bright), rt.Sphere((0, 0, 0), 0.1, bright)], lights, camera)
    for settings in (Settings(), soft_settings(4), soft_settings(4, precision=64)):
        image = renderer.render(scene, (33, 33), settings).radiance
        assert np.isfinite(image).all() and (image >= 0.0).all()


@pytest.mark.parametrize("evaluator", ["cells", "walk", "roth"])
@pytest.mark.parametrize("precision", [32, 64])
def test_a_bulb_around_a_light_does_not_block_it_and_is_lit_inside(
    renderer: Renderer, evaluator: Evaluator, precision: int
) -> None:
    glass = WHITE.replace(ka=(0.25, 0.25, 0.25))
    light, bulb = rt.PointLight((0.1, 1.3, -0.2), radius=0.7), rt.Sphere((0.1, 1.3, -0.2), 0.7, glass)
    settings = soft_settings(16, evaluator=evaluator, precision=precision)
    camera = rt.Camera((1, 3, 5), (0, 1, 0), vertical_fov=50)
    with_bulb = renderer.render(rt.Scene([FLOOR, bulb], [light], camera), (64, 48), settings)
    without = renderer.render(rt.Scene([FLOOR], [light], camera), (64, 48), settings)
    assert with_bulb.material is not None and without.material is not None
    # Pixels at the outline of the bulb are left out, because other samples than the centre may hit it.
    seen = np.pad(with_bulb.material == 1, 1)
    near = np.lib.stride_tricks.sliding_window_view(seen, (3, 3))
    np.testing.assert_array_equal(with_bulb.radiance[~near.any(axis=(2, 3))], without.radiance[~near.any(axis=(2, 3))])
    assert near.all(axis=(2, 3)).sum() > 80
    assert (with_bulb.radiance[near.all(axis=(2, 3))] == 0.25).all(), (
        "the light inside does not reach the outside of the bulb"
    )
    inside = rt.Scene([bulb], [light], rt.Camera((0.3, 1.2, -0.1), (0, 0, 0)))
    image = renderer.render(inside, (16, 16), soft_settings(256, evaluator=evaluator, precision=precision)).radiance
    assert np.abs(image - 1.25).max() < 0.1 and image.mean() == pytest.approx(1.25, rel=1e-3)
    truth = ray_tracer.trace(inside, (4, 4), soft_settings(1), rays=32).radiance
    np.testing.assert_allclose(truth, 1.25, rtol=1e-3)


def penumbra() -> rt.Scene:
    """Return a view of the border of a ball's shadow."""
    camera = rt.Camera((0, 6, 4), (-1, 0, 1.1), vertical_fov=8)
    return rt.Scene([FLOOR, rt.Sphere((0, 2, 0), 0.8, WHITE)], [rt.PointLight((2, 6, 0), radius=1.0)], camera)


def penumbra_errors(renderer: Renderer, counts: tuple[int, ...]) -> list[float]:
    """Return the root mean square errors of the penumbra for each number of samples."""
    truth = ray_tracer.trace(penumbra(), (20, 20), Settings(samples=4, shadows="soft"), rays=24).radiance
    assert truth.std() > 0.15, "the picture shows a penumbra"
    images = (renderer.render(penumbra(), (20, 20), soft_settings(count), geometry=False).radiance for count in counts)
    return [float(np.sqrt(np.mean((image - truth) ** 2))) for image in images]


def test_the_error_falls_at_least_with_the_root_of_the_samples(renderer: Renderer) -> None:
    counts = (4, 16, 64, 256)
    rms_errors = penumbra_errors(renderer, counts)
    # The slope is -1/2 for independent points. For stratified points it is -3/4 if an edge crosses the square, because
    # the edge crosses only sqrt(n) of n boxes.
    slope = np.polyfit(np.log(counts), np.log(rms_errors), 1)[0]
    assert slope <= -0.5, rms_errors
    assert rms_errors[-1] < 0.02, rms_errors


def test_tiles_change_no_pixel_of_soft_shadows(renderer: Renderer) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), 0.5)
    for settings in (soft_settings(5), soft_settings(16, adaptive=0.02), soft_settings(5, evaluator="walk")):
        whole = renderer.render(scene, (201, 113), settings, geometry=False)
        tiled = renderer.render(scene, (201, 113), settings, geometry=False, tile=50)
        np.testing.assert_array_equal(whole.radiance, tiled.radiance)


def test_adaptive_sampling_takes_more_samples_in_a_penumbra(renderer: Renderer) -> None:
    camera = msgspec.structs.replace(penumbra().camera, vertical_fov=30.0)
    scene = msgspec.structs.replace(penumbra(), camera=camera)
    free = msgspec.structs.replace(scene, objects=[FLOOR])

    def radiance(scene: rt.Scene, samples: int) -> np.ndarray:
        return renderer.render(scene, (96, 96), soft_settings(samples), geometry=False).radiance

    image, truth = renderer.render(scene, (96, 96), soft_settings(64, adaptive=0.02)), radiance(scene, 1024)
    assert image.samples is not None and image.material is not None
    share = np.where(image.material == 0, truth[..., 0] / radiance(free, 64)[..., 0], 0.0)
    half_lit, lit = image.samples[(share > 0.3) & (share < 0.7)], image.samples[share > 0.999]
    assert len(half_lit) > 500 and len(lit) > 500
    assert half_lit.mean() > 3.0 * lit.mean() and image.samples.mean() < 0.7 * 64
    assert np.sqrt(np.mean((image.radiance - truth) ** 2)) < 0.02


@pytest.mark.parametrize("shadows", ["off", "hard", "diluted"])
@pytest.mark.parametrize("evaluator", ["cells", "walk", "roth"])
def test_a_radius_does_not_change_other_kinds_of_shadows(
    renderer: Renderer, shadows: Shadows, evaluator: Evaluator
) -> None:
    own, point = scenes.assignment(), scenes.with_light_radii(scenes.assignment(), 0.0)
    assert own.lights[0].radius > 0.0, "the light of the example has a radius"
    for precision in (32, 64):
        settings = Settings(samples=3, shadows=shadows, evaluator=evaluator, precision=precision)
        a, b = (renderer.render(scene, (96, 54), settings).radiance for scene in (own, point))
        np.testing.assert_array_equal(a, b)
