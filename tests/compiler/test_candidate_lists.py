"""Pictures with candidate lists per cell equal the pictures of the walk, which tests all primitives."""

from __future__ import annotations

import functools
import operator

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.compiler import scene_lists
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import compiled, sources
from tests.pictures import assert_lists_agree
from tests.scenes import lens

pytestmark = pytest.mark.gl

SIZE = (128, 72)
RED, BLUE, GREEN, GREY = scenes.COLORS
FLOOR = rt.Plane((0, 1, 0), -2.5, GREY)


@pytest.mark.parametrize("seed", range(12))
def test_random_trees_look_the_same_with_candidate_lists(renderer: Renderer, always_listed: None, seed: int) -> None:
    assert_lists_agree(
        renderer, scenes.random_scene(seed), shadows="diluted" if seed % 2 else "hard", samples=1 + seed % 2
    )


def test_the_walk_distinguishes_more_than_80_objects(renderer: Renderer) -> None:
    # llvmpipe allows 80 levels of nested `else`: with 100 objects in one chain, it confused the last ones.
    balls = [rt.Sphere((i % 10 - 4.5, i // 10 - 4.5, 0), 0.4, scenes.COLORS[i % 3]) for i in range(100)]
    assert_lists_agree(renderer, scenes.lit_scene(*balls, eye=(0, 0, 12)), (64, 64), shadows="off")


def test_several_shapes_and_programs_look_the_same_with_candidate_lists(
    renderer: Renderer, always_listed: None
) -> None:
    ball, half = rt.Sphere((1.2, 0.5, 1), 0.8, GREEN), rt.Plane((1, 1, 0), 0.3, BLUE)
    objects = [lens(0, 0, 0), lens(-2, 0.4, -1, 0.7), ball, rt.Sphere((0, 2, 0), 0.5), FLOOR]
    objects += [rt.Sphere((-1, -1, 1), 0.9, RED) & half, ~rt.Sphere((0, 0, 0), 30, BLUE), rt.Plane((0, 0, -1), 9, RED)]
    for shadows in ("off", "hard", "diluted"):
        assert_lists_agree(renderer, scenes.lit_scene(*objects, eye=(0.5, 1, 6)), shadows=shadows)
    assert_lists_agree(renderer, scenes.lit_scene(*objects[:4], eye=(0.5, 1, 6)), shading="blinn")
    assert_lists_agree(renderer, scenes.lit_scene(*objects[4:], eye=(0.5, 1, 6)))


def test_a_box_among_balls_leaves_the_balls_their_geometry(renderer: Renderer) -> None:
    balls = [rt.Sphere((i * 1.5 - 9, 0, 0), 1, scenes.COLORS[i % 3]) for i in range(13)]
    assert_lists_agree(renderer, scenes.lit_scene(*balls, rt.Box((-1, 1, -1), (1, 2, 1), GREY), eye=(0, 1, 19)))


def turned(solid: rt.Solid, count: int, seed: int) -> list[rt.Solid]:
    """Return copies of a solid in random places and directions."""
    rng = np.random.default_rng(seed)
    places, axes, angles = (
        rng.uniform(-2, 2, (count, 3)).tolist(),
        rng.normal(size=(count, 3)),
        rng.uniform(0, 360, count),
    )
    return [
        solid.rotate(axis, angle).translate(place)
        for place, axis, angle in zip(places, axes.tolist(), angles.tolist(), strict=True)
    ]


BOX, BORE = rt.Box((-0.4, -0.3, -0.2), (0.4, 0.3, 0.2), RED), rt.Cylinder((0, 0, -1), (0, 0, 1), 0.2, BLUE)
CONE, RING = rt.Cone((0, -0.4, 0), (0, 0.4, 0), 0.3, 0.0, GREEN), rt.Torus((0, 0, 0), (0, 0, 1), 0.4, 0.15, BLUE)
_CORNERS = (0.4, 0.0, 0.0), (-0.4, 0.0, 0.1), (0.0, 0.5, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 0.6), (0.1, 0.0, -0.3)
GEM = rt.Polyhedron(_CORNERS, GREY)
# The objects have one structure, several that share their trees, several trees, or spheres and bodies in one tree.
SHAPES_OF_BODIES = {
    "bored boxes": turned(BOX - BORE, 12, 1),
    "tori": turned(RING, 10, 2),
    "unlike bodies of one tree": [*turned(BOX - BORE, 4, 3), *turned(CONE & BOX, 4, 4), *turned(GEM - RING, 4, 5)],
    "trees of one to four leaves": [
        *turned(BOX, 3, 6),
        *turned(CONE | BORE, 3, 7),
        *turned((BOX - BORE) & (CONE | GEM), 3, 8),
        *turned(rt.Sphere((0, 0, 0.3), 0.5, RED) & BOX - rt.Sphere((0.4, 0, 0), 0.3), 3, 9),
    ],
    "tori that other objects cut": [*turned(RING & BOX, 5, 10), *turned(BOX - RING, 5, 11)],
}


@pytest.mark.parametrize("case", SHAPES_OF_BODIES)
def test_shapes_of_bodies_look_the_same_with_candidate_lists(
    renderer: Renderer, always_listed: None, case: str
) -> None:
    scene = scenes.lit_scene(*SHAPES_OF_BODIES[case], FLOOR, eye=(0.5, 1, 6))
    assert compiled(scene).batches.shapes and not compiled(scene).batches.programs
    assert_lists_agree(renderer, scene)
    assert_lists_agree(renderer, scene, shadows="diluted")


@pytest.mark.parametrize("eye", [(0.1, 0.2, 0.0), (0.0, 0.0, 0.9), (0.0, 0.0, 400.0)])
def test_bodies_around_the_camera_and_far_away_look_the_same_with_candidate_lists(
    renderer: Renderer, always_listed: None, eye: tuple[float, float, float]
) -> None:
    objects = [*SHAPES_OF_BODIES["bored boxes"], *SHAPES_OF_BODIES["tori"]]
    assert_lists_agree(renderer, scenes.lit_scene(*objects, FLOOR, eye=eye))


def test_the_first_of_several_coincident_objects_is_visible(renderer: Renderer, always_listed: None) -> None:
    a, a2, floor = rt.Sphere((0, 0, 0), 1, RED), rt.Sphere((0, 0, 0), 1, BLUE), rt.Plane((0, 1, 0), -2.5, RED)
    cut = rt.Sphere((0, 0, 0), 1, GREEN) & rt.Plane((0, 0, 1), 2)
    joined = rt.Sphere((0, 0, 0), 1, GREY) | rt.Sphere((3, 0, 0), 1, GREY)
    for first in range(4):
        solids = [a, a2, cut, joined]
        solids = [*solids[first:], *solids[:first]]
        assert_lists_agree(renderer, scenes.lit_scene(*solids, FLOOR, floor))
        assert_lists_agree(renderer, scenes.lit_scene(floor, *solids, FLOOR))


@pytest.mark.parametrize("scale", [1e-5, 1.0, 1e5])
def test_any_camera_and_light_give_the_same_picture_with_candidate_lists(
    renderer: Renderer, always_listed: None, scale: float
) -> None:
    objects = [lens(0, 0, 0, scale), lens(1.5 * scale, scale, -2 * scale, 0.3 * scale)]
    objects += [rt.Plane((0, 1, 0), -2 * scale, GREY), rt.Sphere((0, -1e4 * scale, 0), 9997 * scale, BLUE)]
    places = [(0.1, 0, 5), (0, 0, 0.2), (0, 0, 0.95), (-1, -2, 4), (0, 1, 900), (0.3, 40, 0.2), (0, 0.7, 1e-3)]
    for place in places:
        eye = tuple(scale * c for c in place)
        for light in ((4, 7, 4), (0, 0, 0.3), (1, -2, 1), (0.4, 1.2, -2), (1e4, 2e4, 0)):
            x, y, z = light
            lights = [rt.PointLight((scale * x, scale * y, scale * z)), rt.PointLight((0, 9 * scale, scale))]
            camera = rt.Camera(eye, (0.1 * scale, 0, -scale), vertical_fov=70)  # pyright: ignore[reportArgumentType]
            assert_lists_agree(renderer, rt.Scene(objects, lights, camera), (64, 36), shadows="diluted")


def test_objects_too_large_for_an_opengl_point_look_the_same_with_candidate_lists(
    renderer: Renderer, always_listed: None
) -> None:
    objects = [lens(0, 0, 0, 3), lens(-1.5, 1.5, 2, 0.3), FLOOR, lens(2, 0, 1)]
    assert_lists_agree(renderer, scenes.lit_scene(*objects, eye=(0, 0, 6)), (640, 360))


def test_a_chain_and_a_balanced_tree_of_many_holes_give_the_same_picture(renderer: Renderer) -> None:
    rng = np.random.default_rng(3)
    places = rng.normal(size=(300, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    bites = [rt.Sphere(tuple(p), r, GREEN) for p, r in zip(places.tolist(), rng.uniform(0.05, 0.15, 300), strict=True)]
    ball = rt.Sphere((0, 0, 0), 1, RED)
    chain = functools.reduce(operator.sub, bites, ball)
    while len(bites) > 1:
        bites = [functools.reduce(operator.or_, bites[i : i + 2]) for i in range(0, len(bites), 2)]
    scene = scenes.lit_scene(chain, eye=(0, 0, 3))
    one = renderer.render(scene, SIZE, Settings())
    other = renderer.render(scenes.lit_scene(ball - bites[0], eye=(0, 0, 3)), SIZE, Settings())
    np.testing.assert_array_equal(one.radiance, other.radiance)
    truth = ray_tracer.trace(scene, (32, 18), Settings(shadows="off"))
    small = renderer.render(scene, (32, 18), Settings(shadows="off"))
    assert truth.material is not None and small.material is not None
    assert (small.material == truth.material).mean() > 0.99 and len(np.unique(truth.material)) == 3


@pytest.mark.parametrize(("distance", "radius"), [(1e4, 2e-4), (1e4, 1e-3), (1e4, 3e-3), (1e2, 1e-6), (1e2, 1e-4)])
def test_spheres_whose_two_roots_round_to_one_number_look_the_same_with_candidate_lists(
    renderer: Renderer, distance: float, radius: float
) -> None:
    rng = np.random.default_rng(1)
    places = [(x, y, -distance) for x, y in (radius * rng.uniform(-8, 8, (20, 2))).tolist()]
    union = functools.reduce(operator.or_, [rt.Sphere(place, radius, RED) for place in places])
    fov = float(np.degrees(40 * radius / distance))
    camera = rt.Camera((0, 0, 0), (0, 0, -1), vertical_fov=fov)
    assert_lists_agree(renderer, rt.Scene([union], [rt.PointLight((4, 7, 4))], camera), (96, 64))


def test_a_ray_may_hit_more_leaves_of_a_chain_than_the_shader_keeps(renderer: Renderer, always_listed: None) -> None:
    # Spheres in a row: each touches, overlaps or equals its neighbour, and their order in the tree is shuffled.
    row = [rt.Sphere((0.05 * (i % 3), 0, 2 - 0.2 * (i * 7 % 20)), 0.25, (RED, BLUE)[i % 2]) for i in range(20)]
    row += [rt.Sphere((0, 0, -2.5), 0.3, GREEN), rt.Sphere((0, 0, -2.5), 0.3, BLUE), rt.Plane((0, 0, -1), 1.7, GREY)]
    ball = rt.Sphere((0, 0, 0), 2.5, RED)
    for solid in (
        functools.reduce(operator.sub, row, ball),
        ~functools.reduce(operator.or_, row[:-1]),
        functools.reduce(operator.and_, [rt.Sphere((0, 0, 0.1 * i), 2, (RED, BLUE)[i % 2]) for i in range(18)]),
    ):
        assert compiled(scenes.lit_scene(solid)).batches.programs[0].pruner.is_chain
        for eye in ((0.1, 0.3, 5), (0.01, 0.02, 0.3), (0.5, 0.2, 2.2)):
            assert_lists_agree(renderer, scenes.lit_scene(solid, eye=eye), (64, 36), shadows="diluted")


def test_many_instances_agree_with_the_reference(renderer: Renderer) -> None:
    rng = np.random.default_rng(1)
    many = rt.Instances(lens(0, 0, 0), rng.uniform((-4, -2, -6), (4, 3, 1), (40, 3)), rng.uniform(0.2, 0.6, 40))
    scene = scenes.lit_scene(many, FLOOR, eye=(0, 1, 6))
    image, truth = renderer.render(scene, (96, 54), Settings()), ray_tracer.trace(scene, (96, 54), Settings())
    assert image.material is not None and truth.material is not None
    resolved = find_pixel_doubt(scene, (96, 54))
    certain = ~resolved.doubtful
    assert resolved.doubtful.mean() < 0.01
    np.testing.assert_array_equal(image.material[certain], truth.material[certain])
    certain &= ~resolved.unlit
    np.testing.assert_allclose(image.radiance[certain], truth.radiance[certain], atol=1e-4)
    plain = msgspec.structs.replace(scene, objects=scene.solids())
    np.testing.assert_array_equal(renderer.render(plain, (96, 54), Settings()).radiance, image.radiance)


@pytest.mark.parametrize("grid", [1, 3, 24, 256])
@pytest.mark.parametrize("shadows", ["hard", "soft"])
def test_twenty_lights_with_direction_cells_of_any_grid_give_the_same_picture(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, grid: int, shadows: str
) -> None:
    monkeypatch.setattr(scene_lists, "GRIDS", (grid, 1))
    monkeypatch.setattr(scene_lists, "_LEAST_CELLS", 20 * 2 * grid**2)
    rng = np.random.default_rng(grid)
    many = rt.Instances(lens(0, 0, 0), rng.uniform((-4, -2, -6), (4, 3, 1), (30, 3)), rng.uniform(0.1, 0.6, 30))
    balls = rt.Instances(rt.Sphere((0, 0, 0), 0.1, BLUE), rng.uniform((-4, -2.4, -6), (4, 3, 1), (60, 3)))
    places = rng.uniform((-5, -2.5, -6), (5, 4, 3), (20, 3))
    places[::3, 1] = -2.5  # lights on the floor
    places[1::6] *= 50.0
    lights = [rt.PointLight(tuple(p), (0.2, 0.2, 0.2), radius=0.05 * (k % 3)) for k, p in enumerate(places.tolist())]
    scene = rt.Scene([many, balls, FLOOR], lights, rt.Camera((0, 1, 6), (0, 0, 0)))
    assert_lists_agree(renderer, scene, (96, 54), shadows=shadows, samples=1 if shadows == "hard" else 2)


def test_scenes_that_differ_only_in_numbers_share_their_shader_text(renderer: Renderer) -> None:
    rng = np.random.default_rng(2)

    def many(count: int) -> rt.Scene:
        return scenes.lit_scene(rt.Instances(lens(0, 0, 0), rng.uniform(-3, 3, (count, 3)), 0.2), FLOOR)

    assert sources(many(10)) == sources(many(2000))
    one, other = (scenes.lit_scene(functools.reduce(operator.sub, [lens(x, 0, 0) for x in range(9)])) for _ in range(2))
    assert sources(one) == sources(other)


def test_frequent_small_trees_are_shapes_and_other_trees_are_programs() -> None:
    scene = scenes.lit_scene(lens(0, 0, 0), lens(1, 0, 0), FLOOR, lens(0, 0, 0) & FLOOR, ~lens(0, 0, 0))
    batches = compiled(scene).batches
    assert [len(batch.first) for batch in batches.shapes] == [2]
    assert [batch.order for batch in batches.programs] == [3, 4] and batches.planes == [12]


def crowd() -> rt.Instances:
    """Return more small lenses with a bite taken out than llvmpipe can loop over, in a box above the ground."""
    places = np.random.default_rng(5).uniform((-10, 0.2, -20), (10, 6, 2), (90_000, 3))
    lens = rt.Sphere((-0.016, 0, 0), 0.04, RED) & rt.Sphere((0.016, 0, 0), 0.04, RED)
    return rt.Instances(lens - rt.Sphere((0, 0.032, 0), 0.028, RED), places)


@pytest.mark.slow
def test_a_horizon_behind_many_objects_does_not_change_their_shadows(renderer: Renderer) -> None:
    # The ground blocks no ray from above it to the light. Rays from the horizon start beyond the light's reach.
    lights, camera = [rt.PointLight((4, 12, 8))], rt.Camera((0, 3, 6), (0, 2.95, 0), vertical_fov=4)
    alone = renderer.render(rt.Scene([crowd()], lights, camera), (320, 64), Settings())
    over = renderer.render(rt.Scene([crowd(), rt.Plane((0, 1, 0), 0)], lights, camera), (320, 64), Settings())
    assert alone.material is not None and over.material is not None and over.depth is not None
    both = (alone.material == 0) & (over.material == 0)
    assert both.sum() > 10_000 and np.isfinite(over.depth).any() and over.depth[np.isfinite(over.depth)].max() > 20_000
    np.testing.assert_array_equal(over.radiance[both], alone.radiance[both])


def test_mirrors_among_more_objects_than_the_driver_can_loop_over_are_refused(
    renderer: Renderer, has_round_limit: bool
) -> None:
    if not has_round_limit:
        pytest.skip("this driver does not limit the rounds of a loop")
    ground = rt.Plane((0, 1, 0), 0, rt.Material("mirror"))
    scene = rt.Scene([crowd(), ground], [rt.PointLight((4, 12, 8))], rt.Camera((0, 3, 6), (0, 2, 0)))
    with pytest.raises(rt.InputError, match="expected pixels whose rays take at most 65535 steps"):
        renderer.render(scene, (32, 18), Settings())
