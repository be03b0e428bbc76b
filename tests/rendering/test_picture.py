"""Pictures of the GPU agree with the float64 reference."""

from typing import get_args

import numpy as np
import pytest

import raytracer as rt
from raytracer.analysis.pixel_doubt import PixelDoubt, find_pixel_doubt
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import Evaluator, Shadows
from raytracer.scene.settings import Settings
from tests import scenes
from tests.pictures import assert_agrees, assert_agrees_with_truth

pytestmark = pytest.mark.gl


@pytest.fixture(scope="module")
def assignment() -> tuple[Image, PixelDoubt]:
    """The reference of the assignment at 1280x720, and its doubtful pixels.

    Both take long, and serve all evaluators.
    """
    scene, size = scenes.assignment(), (1280, 720)
    return ray_tracer.trace(scene, size, Settings(shadows="off")), find_pixel_doubt(scene, size, 32)


@pytest.mark.parametrize("evaluator", get_args(Evaluator))
def test_the_assignment_agrees_with_the_reference(
    renderer: Renderer, assignment: tuple[Image, PixelDoubt], evaluator: Evaluator
) -> None:
    image = renderer.render(scenes.assignment(), (1280, 720), Settings(evaluator=evaluator, shadows="off"))
    assert_agrees(image, *assignment)
    assert np.isfinite(image.radiance).all() and (image.radiance >= 0).all()


@pytest.mark.parametrize("seed", [*range(24), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(24, 200))])
def test_a_random_scene_agrees_with_the_reference(renderer: Renderer, seed: int) -> None:
    assert_agrees_with_truth(renderer, scenes.random_scene(seed), (128, 72), Settings(shadows="off"))


# The random scenes whose programs for the evaluator `roth` compile in a few seconds.
SMALL = [seed for seed in range(200) if roth_loops(scenes.random_scene(seed)) <= 7]


@pytest.mark.parametrize("seed", SMALL[:16])
def test_all_evaluators_make_the_same_picture(renderer: Renderer, seed: int) -> None:
    scene = scenes.random_scene(seed)
    cells, *others = (
        renderer.render(scene, (128, 72), Settings(shadows="diluted", evaluator=evaluator))
        for evaluator in get_args(Evaluator)
    )
    for other in others:
        for name in ("radiance", "depth", "normal", "material"):
            np.testing.assert_array_equal(getattr(other, name), getattr(cells, name), err_msg=name)


@pytest.mark.parametrize(
    ("shading", "shadows"),
    [(None, "hard"), ("phong", "diluted"), ("blinn", "hard"), ("blinn", "off")],
)
def test_the_assignment_with_16_samples_agrees_with_the_reference_to_2_of_255(
    renderer: Renderer, shading: Shading | None, shadows: Shadows
) -> None:
    settings = Settings(samples=16, shading=shading, shadows=shadows)
    image = renderer.render(scenes.assignment(), (320, 180), settings)
    truth = ray_tracer.trace(scenes.assignment(), (320, 180), settings)
    assert np.abs(image.srgb8().astype(int) - truth.srgb8()).max() <= 2


def test_a_scene_with_several_lights_and_both_models_agrees_with_the_reference(renderer: Renderer) -> None:
    shiny = rt.Material(kd=(0.2, 0.5, 0.7), ks=(0.9, 0.8, 0.7), h=100, model="blinn")
    dull = rt.Material(kd=(0.7, 0.5, 0.2), ks=(0.1, 0.1, 0.1), h=0)
    scene = scenes.lit_scene(
        rt.Sphere((-1, 0, 0), 1, shiny), rt.Sphere((1, 0, 0), 1, dull), rt.Plane((0, 1, 0), -1.5, shiny)
    )
    for shadows in ("hard", "diluted"):
        settings = Settings(shadows=shadows, samples=4)
        image, truth = renderer.render(scene, (160, 90), settings), ray_tracer.trace(scene, (160, 90), settings)
        # Rounding may move a sample across an edge, which changes the pixel by up to 1/4. A few such pixels are
        # allowed.
        wrong = np.abs(image.radiance - truth.radiance).max(axis=2) > 1e-4
        assert wrong.mean() < 5e-4


@pytest.mark.parametrize("seed", range(40))
def test_the_shadows_of_random_scenes_agree_with_the_reference(renderer: Renderer, seed: int) -> None:
    settings = Settings(shadows="diluted")
    image = renderer.render(scenes.random_scene(seed), (96, 54), settings)
    truth = ray_tracer.trace(scenes.random_scene(seed), (96, 54), settings)
    # Rounding may change only shadow rays that graze an occluder, in none or a few pixels.
    wrong = np.abs(image.radiance - truth.radiance).max(axis=2) > 1e-4
    assert wrong.sum() <= 3


@pytest.mark.parametrize("scale", [1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9])
def test_a_scene_of_any_size_looks_the_same(renderer: Renderer, scale: float) -> None:
    def scaled(v: tuple[float, float, float]) -> tuple[float, float, float]:
        return (v[0] * scale, v[1] * scale, v[2] * scale)

    lens = rt.Sphere(scaled((-1, 2, 0)), 1.5 * scale, scenes.COLORS[0]) & rt.Sphere(scaled((1, 2, 0)), 1.5 * scale)
    solid = lens - rt.Sphere(scaled((0, 2.8, 0.3)), 0.8 * scale, scenes.COLORS[2])
    camera = rt.Camera(scaled((0, 3, 6)), scaled((0, 2, 0)))
    scene = rt.Scene([solid, rt.Plane((0, 1, 0), 0)], [rt.PointLight(scaled((4, 7, 4)))], camera)
    assert_agrees_with_truth(renderer, scene, (160, 90), Settings())
    image, truth = renderer.render(scene, (160, 90), Settings()), ray_tracer.trace(scene, (160, 90))
    assert (np.abs(image.radiance - truth.radiance).max(axis=2) > 1e-4).sum() <= 1


@pytest.mark.parametrize("radius", [1e3, 1e6, 1e7, 1e9])
def test_a_ball_on_a_huge_sphere_casts_the_correct_shadow(renderer: Renderer, radius: float) -> None:
    # The camera is low above the huge sphere: a hit point computed from its centre would have a large error.
    objects = rt.Sphere((0, -radius, 0), radius), rt.Sphere((0, 1, 0), 1, scenes.COLORS[0])
    scene = rt.Scene(objects, [rt.PointLight((4, 7, 4))], rt.Camera((0, 2, 6), (0, 1, 0)))
    image, truth = renderer.render(scene, (96, 64), Settings()), ray_tracer.trace(scene, (96, 64))
    doubt = find_pixel_doubt(scene, (96, 64))
    wrong = np.abs(image.radiance - truth.radiance).max(axis=2) > 1e-2
    assert (wrong & ~doubt.doubtful & ~doubt.unlit).sum() == 0


def test_half_spaces_that_share_a_plane_do_not_shade_each_other(renderer: Renderer) -> None:
    # The ground as a half-space, and as the complement of the upside-down half-space.
    up, down = rt.Plane((1, 5, 2), 3), rt.Plane((-3, -15, -6), -9)
    for solid in (up | ~down, up & ~down, ~down - (up - rt.Sphere((0, 0, 0), 9))):
        scene = scenes.lit_scene(solid, eye=(0, 4, 8))
        image, truth = renderer.render(scene, (96, 54), Settings()), ray_tracer.trace(scene, (96, 54))
        assert (np.abs(image.radiance - truth.radiance).max(axis=2) > 1e-4).sum() <= 1
    alone = renderer.render(scenes.lit_scene(up, eye=(0, 4, 8)), (96, 54), Settings())
    both = renderer.render(scenes.lit_scene(up | ~down, eye=(0, 4, 8)), (96, 54), Settings())
    np.testing.assert_array_equal(both.radiance, alone.radiance)


def test_the_mean_of_many_samples_has_no_drift(renderer: Renderer) -> None:
    ball = rt.Sphere((0, 0, 9), 1)
    scene = rt.Scene([ball], [], rt.Camera((0, 0, 5), (0, 0, 0)), background=(0.7, 0.1, 0.3))
    image = renderer.render(scene, (2, 2), Settings(samples=5000))
    np.testing.assert_allclose(image.radiance, np.broadcast_to((0.7, 0.1, 0.3), (2, 2, 3)), rtol=3e-6)


def test_a_scene_without_lights_shows_its_ambient_and_background(renderer: Renderer) -> None:
    ball = rt.Sphere((0, 0, 0), 1, rt.Material(ka=(0.1, 0.2, 0.3)))
    camera = rt.Camera((0, 0, 5), (0, 0, 0))
    scene = rt.Scene([ball], [], camera, ambient=(2, 1, 1), background=(0.25, 0.5, 1))
    image = renderer.render(scene, (31, 31), Settings())
    np.testing.assert_allclose(image.radiance[15, 15], (0.2, 0.2, 0.3), rtol=1e-6)
    np.testing.assert_array_equal(image.radiance[0, 0], (0.25, 0.5, 1))


def test_a_picture_in_tiles_equals_the_picture_in_one_piece(renderer: Renderer) -> None:
    whole = renderer.render(scenes.assignment(), (201, 113), Settings(samples=3))
    tiled = renderer.render(scenes.assignment(), (201, 113), Settings(samples=3), tile=64)
    for name in ("radiance", "depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(tiled, name), getattr(whole, name), err_msg=name)


def test_repeated_renderings_are_identical(renderer: Renderer) -> None:
    first = renderer.render(scenes.assignment(), (160, 90), Settings(samples=5))
    renderer.render(scenes.random_scene(3), (64, 64), Settings(samples=2))
    again = renderer.render(scenes.assignment(), (160, 90), Settings(samples=5))
    np.testing.assert_array_equal(first.radiance, again.radiance)


def test_only_another_structure_compiles_programs(renderer: Renderer) -> None:
    fresh = Renderer(Device(renderer.device.context))

    def programs_for(scene: rt.Scene) -> int:
        before = len(fresh.device._programs)
        assert fresh.render(scene, (8, 8), Settings()).depth is not None
        return len(fresh.device._programs) - before

    ball, other = rt.Sphere((0, 0, 0), 1), rt.Sphere((0.5, 0, 0), 1)
    programs_for(scenes.lit_scene(ball - other))
    moved = rt.Sphere((0.5, 1, 2), 3, rt.Material(kd=(1, 0, 0), h=5))
    assert programs_for(scenes.lit_scene(moved - ball, eye=(1, 2, 9))) == 0
    # One program for the picture, and one for its geometry. Without half-spaces there is none for plane-only cells.
    assert programs_for(scenes.lit_scene(~(ball | ~other | ball) & other)) == 2


def test_the_depth_of_the_ground_is_correct_up_to_the_horizon_of_a_tilted_camera(renderer: Renderer) -> None:
    ground = rt.Plane((0.1, 1, 0.05), 0.0)
    camera = rt.Camera((3, 2, 6), (0, 1.7, 0), up=(0.4, 1, 0.1), vertical_fov=50)
    assert_agrees_with_truth(renderer, rt.Scene([ground], [], camera), (640, 360), Settings())


def test_trees_may_share_leaves_and_sub_trees(renderer: Renderer) -> None:
    a, b = rt.Sphere((-0.5, 0, 0), 1, scenes.COLORS[0]), rt.Sphere((0.5, 0, 0), 1, scenes.COLORS[1])
    lens = a & b
    assert_agrees_with_truth(
        renderer,
        scenes.lit_scene((a - lens) | (lens - rt.Sphere((0, 0, 0), 0.5, scenes.COLORS[2]))),
        (96, 54),
        Settings(),
    )
