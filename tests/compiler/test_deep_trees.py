"""Deep, large or numerous trees: the picture follows their definition, in bounded memory, or one line refuses them."""

import functools
import operator
import time
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import program_rows, scene_lists
from raytracer.compiler.glsl.preprocessor import Source
from raytracer.compiler.glsl.shaders import Show
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import compiled, sources
from tests.pictures import assert_lists_agree

pytestmark = pytest.mark.gl

SIZE = (64, 36)
RED, BLUE, GREEN, GREY = scenes.COLORS
BALL = rt.Sphere((0, 0, 0), 1, RED)


def complements(solid: rt.Solid, count: int) -> rt.Solid:
    for _ in range(count):
        solid = ~solid
    return solid


def shallow_union(solids: list[rt.Solid]) -> rt.Solid:
    """Return the union of the solids, as a shallow tree."""
    while len(solids) > 1:
        solids = [functools.reduce(operator.or_, solids[i : i + 2]) for i in range(0, len(solids), 2)]
    return solids[0]


def alternate(count: int, rng: np.random.Generator, spread: float = 1.0, planes: bool = False) -> rt.Solid:
    """Return a | b - c | d - ..., in which each operator is deeper than the next."""
    places, sizes = rng.uniform(-spread, spread, (count, 3)).tolist(), rng.uniform(0.2, 0.8, count).tolist()
    solid: rt.Solid = rt.Sphere(places[0], sizes[0], RED)
    for i in range(1, count):
        primitive = rt.Plane if planes and i % 5 == 3 else rt.Sphere
        leaf = primitive(places[i], sizes[i], scenes.COLORS[i % 4])
        solid = solid - leaf if i % 2 else solid | leaf
    return solid


@pytest.mark.parametrize("evaluator", ["cells", "walk", "roth"])
def test_pairs_of_complements_cancel_before_compilation(renderer: Renderer, evaluator: str) -> None:
    settings = Settings(evaluator=evaluator)  # pyright: ignore[reportArgumentType]
    for count in (10_000, 10_001):
        deep = complements(BALL, count)
        short = ~BALL if count % 2 else BALL
        one, other = (
            renderer.render(scenes.lit_scene(solid, eye=(0, 0, 4)), SIZE, settings) for solid in (deep, short)
        )
        np.testing.assert_array_equal(one.radiance, other.radiance)
        assert deep != short and eval(repr(deep), dict(vars(rt))) == deep  # the solid itself keeps its complements
    assert roth_loops(scenes.lit_scene(complements(BALL, 10_000))) == 1
    assert compiled(scenes.lit_scene(complements(BALL, 10_000))).has_plane_only_cells


def test_too_large_trees_are_refused_within_a_minute() -> None:
    shared: rt.Solid = BALL
    for _ in range(15):
        shared = shared | shared
    begin = time.monotonic()
    with pytest.raises(rt.InputError, match="at most 1048576 primitives, got at least"):
        scenes.lit_scene(*[shared] * 100_000)
    with pytest.raises(rt.InputError, match="at most 65536 primitives in one object"):
        scenes.lit_scene(complements(functools.reduce(lambda a, _: a - a, range(60), shared), 3))
    with pytest.raises(rt.InputError, match="at most 262144 primitives and operators in one object"):
        scenes.lit_scene(complements(BALL, 300_000))
    assert time.monotonic() - begin < 60.0  # without the limits, hours


def test_no_shader_nests_12_parentheses_for_any_tree() -> None:
    def deepest(source: Source) -> int:
        depth = deepest_so_far = 0
        for character in source.text:
            depth += (character == "(") - (character == ")")
            deepest_so_far = max(deepest_so_far, depth)
        return deepest_so_far

    rng = np.random.default_rng(1)
    deep: rt.Solid = BALL
    for i in range(511):
        sphere = rt.Sphere(rng.uniform(-1, 1, 3).tolist(), 1.0)
        deep = sphere - ~deep if i % 3 else ~(~sphere | deep)
    many = [rt.Sphere((i, 0, 0), 1) for i in range(512)]
    for scene in (
        scenes.lit_scene(deep),
        scenes.lit_scene(*many),
        scenes.lit_scene(functools.reduce(lambda a, b: b - a, many)),
    ):
        for source in sources(scene, Settings(evaluator="walk")).values():
            assert deepest(source.fragment) < 12


@pytest.mark.parametrize("planes", [False, True])
def test_deep_trees_look_the_same_with_candidate_lists(renderer: Renderer, planes: bool) -> None:
    rng = np.random.default_rng(2)
    for count, spread in ((40, 1.0), (100, 3.0)):
        scene = scenes.lit_scene(alternate(count, rng, spread, planes), BALL, eye=(0.3, 0.5, 6))
        assert_lists_agree(renderer, scene, SIZE, shadows="diluted")


@pytest.mark.parametrize("bounded", [False, True])
def test_instances_of_trees_with_half_spaces_look_the_same_with_candidate_lists(
    renderer: Renderer, bounded: bool
) -> None:
    rng = np.random.default_rng(3)
    tree = alternate(7, rng, planes=True)
    if not bounded:  # all cells list a corner of three half-spaces
        tree = tree | (rt.Plane((1, 0, 0), -2) & rt.Plane((0, 1, 0), -2, BLUE) & rt.Plane((0, 0, 1), -2, RED))
    many = rt.Instances(tree, rng.uniform(-3, 3, (6, 3)), rng.uniform(0.3, 0.6, 6))
    other = rt.Instances(alternate(6, rng), rng.uniform(-3, 3, (4, 3)), 0.5)
    scene = scenes.lit_scene(many, other, many.solid, rt.Plane((0, 1, 0), -2.5, GREY), eye=(0.3, 0.5, 6))
    assert_lists_agree(renderer, scene, SIZE, shadows="diluted")


@pytest.mark.parametrize("count", [13, 40])
def test_half_spaces_alone_look_the_same_with_candidate_lists(renderer: Renderer, count: int) -> None:
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(count, 3))
    planes = [rt.Plane(n, -float(d), RED) for n, d in zip(normals.tolist(), rng.uniform(1, 9, count), strict=True)]
    assert_lists_agree(renderer, scenes.lit_scene(*planes, eye=(0, 0, 0.5)), SIZE)


@pytest.mark.parametrize("shadows", ["hard", "soft"])
def test_coarser_direction_cells_around_the_lights_give_the_same_picture(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, shadows: str
) -> None:
    rng = np.random.default_rng(5)
    objects = [alternate(200, rng, 2.0), rt.Instances(alternate(3, rng), rng.uniform(-3, 3, (50, 3)), 0.3)]
    objects.append(rt.Instances(alternate(9, rng, planes=True) & BALL, rng.uniform(-3, 3, (20, 3)), 0.5))
    lights = [rt.PointLight((x, 5, 3), radius=0.5) for x in (-4, 0, 4)]
    scene = rt.Scene([*objects, rt.Plane((0, 1, 0), -2.5, GREY)], lights, rt.Camera((0.3, 0.5, 6), (0, 0, 0)))
    settings = Settings(shadows=shadows)  # pyright: ignore[reportArgumentType]
    fine = renderer.render(scene, SIZE, settings)
    monkeypatch.setattr(scene_lists, "_MAX_LISTED", 20_000)
    coarse = Renderer(renderer.device).render(scene, SIZE, settings)
    np.testing.assert_array_equal(fine.radiance, coarse.radiance)
    monkeypatch.setattr(program_rows, "MAX_LISTED", 1000)
    monkeypatch.setattr(scene_lists, "_MAX_LISTED", 1000)
    with pytest.raises(rt.InputError, match=r"objects: expected at most 1000 pairs .* fewer lights"):
        Renderer(renderer.device).render(scene, SIZE, settings)


def test_too_many_spheres_times_lights_are_refused(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene_lists, "_MAX_SEEN", 100)
    scene = scenes.lit_scene(rt.Instances(BALL, np.zeros((60, 3))), eye=(0, 0, 6))
    scene = msgspec.structs.replace(scene, lights=[rt.PointLight((4, 7, 4))] * 2)
    with pytest.raises(
        rt.InputError, match=r"objects: expected at most 100 spheres times lights, got 60 x 2, .* no sha"
    ):
        renderer.render(scene, SIZE, Settings())
    renderer.render(scene, SIZE, Settings(shadows="off"))


def row_of_shells(count: int) -> rt.Scene:
    """Return spheres along the line of sight, each minus a larger sphere: rays pass all of them and hit none."""
    less, more = (shallow_union([rt.Sphere((0, 0, -3.0 * i), r) for i in range(count)]) for r in (1.0, 1.1))
    return rt.Scene([less - more], [], rt.Camera((0, 0, 6), (0, 0, 0), vertical_fov=10))


def test_rays_that_take_more_steps_than_the_driver_allows_are_refused(
    renderer: Renderer, has_round_limit: bool
) -> None:
    # llvmpipe ends every loop after 65,535 rounds. Pictures then showed surfaces that do not exist.
    scene = row_of_shells(150)
    image = renderer.render(scene, SIZE, Settings())
    np.testing.assert_array_equal(
        image.radiance, np.broadcast_to(np.array(scene.background, np.float32), image.radiance.shape)
    )
    if has_round_limit:
        for geometry in (False, True):
            with pytest.raises(rt.InputError, match=r"at most 65535 steps .* remedies are fewer primitives"):
                renderer.render(row_of_shells(400), SIZE, Settings(), geometry=geometry)
        balls = rt.Scene([*row_of_shells(400).objects, *[rt.Sphere((0, 0, -5), 0.1)] * 9], [], row_of_shells(1).camera)
        with pytest.raises(rt.InputError, match="at most 65535 steps"):  # even if other spheres are drawn over the row
            renderer.render(balls, SIZE, Settings())
        lit = msgspec.structs.replace(row_of_shells(150), lights=[rt.PointLight((0, 0, 9))] * 100)
        lit = msgspec.structs.replace(lit, objects=[*lit.objects, rt.Sphere((0, 0, -1000), 100)])
        with pytest.raises(rt.InputError, match="at most 65535 steps"):  # the limit counts all rays of a pixel together
            renderer.render(lit, SIZE, Settings())


def split_light(
    objects: Sequence[rt.Solid | rt.Instances], light: rt.PointLight, count: int, camera: rt.Camera
) -> rt.Scene:
    """Return a scene whose `light` is split into `count` weaker lights at the same place."""
    part = msgspec.structs.replace(light, color=tuple(c / count for c in light.color))
    return rt.Scene(objects, [part] * count, camera)


ABOVE, AHEAD = rt.Camera((0, 3, 4), (0, 0, 0), vertical_fov=60), rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=60)
FACETS = rt.Material(model="diffuse_microfacet", nodes=4096)
MIRROR = rt.Material(model="mirror", f0=(1, 1, 1))
NESTED = functools.reduce(operator.or_, [rt.Sphere((0.01 * i, 0, 0), 1 - 0.02 * i) for i in range(13)])
CORRIDOR = [rt.Plane((0, 0, 1), -1, MIRROR), ~rt.Plane((0, 0, 1), 1, MIRROR), ~rt.Plane((1, 0, 0), 60, GREY)]
EMPTY_OBJECTS = [rt.Sphere((0, 1 + 0.01 * i, 0), 0.3) - rt.Sphere((0, 1 + 0.01 * i, 0), 0.31) for i in range(1000)]


@pytest.mark.parametrize(
    ("objects", "few", "many", "camera", "settings"),
    [
        pytest.param([rt.Sphere((0, 0, 0), 1, FACETS)], 10, 200, AHEAD, {}, id="facets"),
        pytest.param([rt.Plane((0, 1, 0), 0, FACETS)], 10, 200, ABOVE, {}, id="facets of a half-space"),
        pytest.param([NESTED], 20, 1300, AHEAD, {"evaluator": "roth"}, id="filters"),
        pytest.param([*EMPTY_OBJECTS, rt.Plane((0, 1, 0), 0, GREY)], 2, 60, ABOVE, {}, id="empty objects"),
        pytest.param(
            CORRIDOR, 20, 1300, rt.Camera((0, 0, 0.3), (1, 0, 1.2), vertical_fov=5), {"bounces": 64}, id="mirrors"
        ),
    ],
)
def test_loops_of_every_kind_that_the_driver_cuts_short_are_refused(
    renderer: Renderer,
    objects: list[rt.Solid],
    few: int,
    many: int,
    camera: rt.Camera,
    settings: dict[str, Any],
    has_round_limit: bool,
) -> None:
    light = rt.PointLight((0, 30, 0))
    one, several = (
        renderer.render(split_light(objects, light, count, camera), (16, 9), Settings(**settings)).radiance
        for count in (1, few)
    )
    assert one.max() > 0.1
    np.testing.assert_allclose(several, one, rtol=1e-4)
    if has_round_limit:
        with pytest.raises(rt.InputError, match="at most 65535 steps"):
            renderer.render(split_light(objects, light, many, camera), (16, 9), Settings(**settings))


@pytest.mark.parametrize("show", ["picture", "normal", "depth", "material"])
def test_the_progressive_picture_refuses_loops_that_the_driver_cuts_short(
    renderer: Renderer, show: Show, has_round_limit: bool
) -> None:
    picture = ProgressivePicture(renderer.device, 1e9)
    with renderer.device.context:
        if has_round_limit:
            with pytest.raises(rt.InputError, match="at most 65535 steps"):
                picture.start(row_of_shells(400), Settings(), show, SIZE, moving=False)
                picture.step()
        picture.close()


def test_more_lights_without_shadows_take_more_steps(renderer: Renderer, has_round_limit: bool) -> None:
    facets = rt.Instances(rt.Sphere((0, 0, 0), 1, FACETS), [(0, 0, -3.0 * i) for i in range(20)])
    one, many = (split_light([facets], rt.PointLight((0, 30, 0)), count, AHEAD) for count in (1, 200))
    settings = Settings(shadows="off")
    picture = ProgressivePicture(renderer.device, 1e9)
    with renderer.device.context:
        picture.start(one, settings, "picture", SIZE, moving=False)
        picture.step()
        if has_round_limit:
            with pytest.raises(rt.InputError, match="at most 65535 steps"):
                picture.start(many, settings, "picture", SIZE, moving=False)
                picture.step()
        picture.close()


@pytest.mark.slow
def test_a_scene_may_have_many_spheres_and_many_lights(renderer: Renderer) -> None:
    spheres = rt.Instances(BALL, np.random.default_rng(1).uniform(-3, 3, (100_000, 3)), 0.02)
    scene = split_light([spheres], rt.PointLight((4, 7, 4)), 43, AHEAD)
    assert renderer.render(scene, (16, 9), Settings(), geometry=False).radiance.max() > 0.1
