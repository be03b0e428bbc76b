"""Ideal mirrors: reflection rays compared with float64, and shader code that only scenes with mirrors have."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import fragment

SIZE = (160, 120)
RED = rt.Material(kd=(0.7, 0.1, 0.1))
DARK = rt.Material("mirror", f0=(0.9, 0.8, 0.7))


def mirror_scene(*more: rt.Solid) -> rt.Scene:
    """Return a scene of mirrors and other objects on a ground, under two lights."""
    objects = [
        rt.Sphere((-1, 0, 0), 1, DARK) - rt.Sphere((-0.6, 0.6, 0.7), 0.6, RED),
        rt.Sphere((1.2, 0, 0.3), 1, rt.Material("mirror", fresnel="conductor")),
        rt.Plane((0, 1, 0), -1, rt.Material(kd=0.5)),
        rt.Sphere((0, 0.2, 2), 0.4, rt.Material("mirror", fresnel="dielectric", ka=(0.0, 0.1, 0.2))),
        *more,
    ]
    lights = [rt.PointLight((3, 5, 4)), rt.PointLight((-3, 5, 4), (0.3, 0.3, 0.3))]
    return rt.Scene(objects, lights, rt.Camera((0, 1.5, 5), (0, 0, 0), vertical_fov=50))


@pytest.mark.gl
@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        Settings(evaluator="walk", shadows="diluted"),
        Settings(evaluator="roth", shadows="off"),
        Settings(evaluator="roth"),
        Settings(precision=64),
        Settings(bounces=1, shadows="off"),
        Settings(bounces=0),
    ],
    ids=str,
)
def test_pictures_with_mirrors_agree_with_float64(renderer: Renderer, settings: Settings) -> None:
    if settings.precision not in renderer.device.limits.precisions:
        pytest.skip("this driver has no doubles")
    image = renderer.render(mirror_scene(), SIZE, settings)
    expected = ray_tracer.trace(mirror_scene(), SIZE, settings).radiance
    difference = np.abs(image.radiance - expected).max(axis=2)
    assert np.isfinite(image.radiance).all()
    # A curved mirror shrinks outlines, so rounding moves them further relative to their size.
    assert (difference > 1e-4).mean() <= 1e-4 and np.median(difference) < 1e-6


@pytest.mark.gl
def test_a_mirrored_ground_shows_the_ball_above_it_upside_down(renderer: Renderer) -> None:
    ground = rt.Plane((0, 1, 0), 0, rt.Material("mirror", f0=1))
    ball = rt.Sphere((0, 1.5, 0), 0.5, rt.Material(ka=(1, 0, 0), kd=0, ks=0))
    # With the camera in the plane of the ground, the picture is symmetric.
    scene = rt.Scene([ground, ball], [], rt.Camera((0, 1e-6, 8), (0, 1e-6, 0), vertical_fov=40), background=(0, 0, 0))
    red = renderer.render(scene, (120, 120), Settings()).radiance[..., 0]
    np.testing.assert_allclose(red, red[::-1], atol=1e-6)
    assert 0.02 < red.mean() < 0.2


@pytest.mark.gl
def test_facing_mirrors_reflect_as_often_as_there_are_bounces(renderer: Renderer) -> None:
    # Two mirrors of reflectance 1/2, of which one emits light: every two bounces add a term of 1/2 + 1/8 + ...
    glow = rt.Plane((0, 0, -1), -4, rt.Material("mirror", f0=0.5, le=1))
    other = rt.Plane((0, 0, 1), -4, rt.Material("mirror", f0=0.5))
    scene = rt.Scene([glow, other], [], rt.Camera((0, 0, 0), (0, 0, -1), vertical_fov=1e-3), background=(0, 0, 0))
    for bounces, expected in ((0, 0.0), (1, 0.5), (2, 0.5), (3, 0.625), (9, 0.5 / 0.75 * (1 - 0.25**5))):
        radiance = renderer.render(scene, (3, 3), Settings(bounces=bounces)).radiance
        np.testing.assert_allclose(radiance, expected, rtol=1e-5)


@pytest.mark.gl
def test_cells_and_walk_draw_the_same_mirrors(renderer: Renderer) -> None:
    many = [rt.Sphere((0.7 * (i % 5) - 1.4, 0.4 * (i // 5), -2.0), 0.15, RED) for i in range(15)]
    tree = scenes.random_tree(np.random.default_rng(1), 13)
    for scene in (
        mirror_scene(),
        mirror_scene(*many),
        mirror_scene(rt.Plane((1, 0, 0), -3, DARK)),
        mirror_scene(*many[:3], tree),
    ):
        a, b = (renderer.render(scene, SIZE, Settings(evaluator=e)).radiance for e in ("cells", "walk"))
        np.testing.assert_array_equal(a, b)


@pytest.mark.gl
def test_mirrors_show_soft_shadows_of_few_and_of_many_objects(renderer: Renderer) -> None:
    many = [rt.Sphere((0.7 * (i % 5) - 1.4, 0.4 * (i // 5), -2.0), 0.15, RED) for i in range(15)]
    lamp = [rt.PointLight((3, 5, 4), radius=0.8)]
    few, more = (msgspec.structs.replace(scene, lights=lamp) for scene in (mirror_scene(), mirror_scene(*many)))
    for scene in (few, more):
        a, b = (renderer.render(scene, SIZE, Settings(evaluator=e, shadows="soft")).radiance for e in ("cells", "walk"))
        np.testing.assert_array_equal(a, b)
    # In this small picture the means differ by 0.0005, relatively; without shadows they would differ by 0.08.
    radiance = renderer.render(more, (80, 60), Settings(shadows="soft", samples=64)).radiance
    expected = ray_tracer.trace(more, (80, 60), Settings(shadows="soft", samples=4), rays=4).radiance
    assert abs(radiance.mean() / expected.mean() - 1) < 5e-3


def test_only_scenes_with_mirrors_have_reflection_rays() -> None:
    scene = mirror_scene()
    words = ("radianceByMirrors(int", "vec3 mirrored(")
    assert all(word in fragment(scene, "picture") for word in words)
    for other in (Settings(shading="phong"), Settings(bounces=0)):
        text = fragment(scene, "picture", other)
        assert not any(word in text for word in words)
    dull = [msgspec.structs.replace(ball, material=RED) for ball in scene.objects if isinstance(ball, rt.Sphere)]
    text = fragment(msgspec.structs.replace(scene, objects=dull, materials=()), "picture")
    assert not any(word in text for word in words)


@pytest.mark.parametrize("bounces", [-1, 65, 1.5, True])
def test_bounces_outside_the_range_are_refused(bounces: object) -> None:
    with pytest.raises(rt.InputError, match="bounces: expected a whole number in"):
        rt.Settings(bounces=bounces)  # pyright: ignore[reportArgumentType]
