"""Plane-only cells: brute force confirms each, and pictures drawn by cells equal pictures by the walk, bit for bit."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.analysis.numerics.scene_transforms import enlarge_scene, move_scene
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.meshes import cell_blocks
from raytracer.ground_truth.intersection import Tracer
from raytracer.ground_truth.ray_tracer import camera_origins, camera_rays
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from tests import scenes
from tests.compiled import cell_masks, compiled
from tests.pictures import assert_cells_agree
from tests.scenes import BALL, FLOOR, LAMP, SUN, random_light, still_life, with_lights

SIZE = (160, 90)


@pytest.mark.gl
@pytest.mark.parametrize("size", [(1280, 720), (321, 181), (17, 5), (16, 16), (5, 200), (1, 1)])
def test_the_assignment_looks_the_same_by_cells_in_any_size(renderer: Renderer, size: tuple[int, int]) -> None:
    assert_cells_agree(renderer, scenes.assignment(), size)


@pytest.mark.gl
@pytest.mark.parametrize("shadows", ["off", "hard", "diluted"])
@pytest.mark.parametrize("shading", [None, "phong", "blinn"])
def test_the_assignment_looks_the_same_by_cells_with_any_setting(
    renderer: Renderer, shadows: str, shading: str | None
) -> None:
    settings = Settings(samples=3, shadows=shadows, shading=shading)  # pyright: ignore[reportArgumentType]
    assert_cells_agree(renderer, scenes.assignment(), SIZE, settings)


@pytest.mark.gl
def test_the_assignment_looks_the_same_by_cells_in_doubles_and_in_tiles(renderer: Renderer) -> None:
    for tile in (48, 37):
        assert_cells_agree(renderer, scenes.assignment(), (201, 113), Settings(samples=3), tile=tile)
    if 64 in renderer.device.limits.precisions:
        assert_cells_agree(renderer, scenes.assignment(), SIZE, Settings(samples=2, precision=64))


# Seeds of scenes with few primitives, which compile fast, and without unbounded objects, so with plane-only cells.
SEEDS = [11, 14, 21, 30, 35, 54]


@pytest.mark.gl
@pytest.mark.parametrize("lights", range(4))
@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_scene_looks_the_same_by_cells(renderer: Renderer, seed: int, lights: int) -> None:
    scene = scenes.random_scene(seed)
    rng = np.random.default_rng((seed, lights))
    assert compiled(scene).has_plane_only_cells
    for k in range(4):
        scene = with_lights(scene, *(random_light(rng, -0.5, 1.5) for _ in range(lights)))
        shadows = "diluted" if k % 2 else "hard"
        assert_cells_agree(renderer, scene, (128, 72), Settings(shadows=shadows, samples=1 + 2 * (k % 3 == 0)))


@pytest.mark.gl
def test_lights_at_any_place_give_the_same_picture_by_cells(renderer: Renderer) -> None:
    places = [
        (0, -2, 0), (1, -1e-3, 1), (0.3, 0, 0.2), (5, 0, 5), (0, 1, 0), (0, 1.2, -0.2), (-1, 1, 0), (0.7, 2, 0.6),
        (-1.001, 1, 0), (0, 2.05, 0), (0, 3, 6), (0, 1e-3, 3), (0, 1e-3, 0), (3, 1e3, 1), (6e5, 8e5, 1e5), (1e6, 1, 0),
    ]  # fmt: skip
    for place in places:
        assert_cells_agree(renderer, still_life(lights=[rt.PointLight(place)]))
        assert_cells_agree(renderer, still_life(lights=[SUN, rt.PointLight(place)]))


@pytest.mark.gl
def test_cameras_at_any_place_give_the_same_picture_by_cells(renderer: Renderer) -> None:
    eyes = [
        (0.2, 0, 4), (0, 1e-6, 4), (0, -1e-6, 4), (0, -3, 4), (0, 0.9, 0.1), (0.7, 1.7, 0.6), (0, 1.0, 1.0),
        (0, 1.5, 1.2), (3, 200, 1), (1e3, 2, 0), (1e6, 10, 0), (1e5, 1e5, 1e5), (0, -1e6, 3),
    ]  # fmt: skip
    for eye in eyes:
        for at in ((0.1, 0.8, 0.2), (2.0, 0.0, -30.0)):
            distance = np.linalg.norm(np.subtract(eye, at))
            assert_cells_agree(renderer, still_life(lights=[SUN, LAMP], eye=eye, at=at))
            close = float(np.degrees(2.0 * np.arctan(4.0 / distance)))
            assert_cells_agree(renderer, still_life(lights=[SUN, LAMP], eye=eye, at=at, fov=close))


@pytest.mark.gl
@pytest.mark.parametrize("distance", [1e3, 1e5, 6e5])
def test_a_sphere_near_its_light_looks_the_same_by_cells_from_afar(renderer: Renderer, distance: float) -> None:
    # Rounding in view space moves the sphere near the light by up to its own size, and so moves its shadow far.
    rng = np.random.default_rng(int(distance))
    for _ in range(12):
        height, near = 10.0 ** rng.uniform(1.0, 2.3), 10.0 ** rng.uniform(-3, -1)
        below = np.array((rng.normal(), -1.5, rng.normal()))
        below /= np.linalg.norm(below)
        ball = rt.Sphere(tuple(below * near + (0, height, 0)), near * rng.uniform(0.1, 0.8), scenes.COLORS[0])
        at = below * height / -below[1] + (0, height, 0)
        back = np.array((rng.normal(), 1.0, rng.normal()))
        eye = at + back / np.linalg.norm(back) * distance
        fov = float(np.degrees(2.0 * np.arctan(1.5 * height / distance)))
        camera = rt.Camera(tuple(eye.tolist()), tuple(at.tolist()), vertical_fov=min(fov, 120.0))
        assert_cells_agree(renderer, rt.Scene([ball, FLOOR], [rt.PointLight((0, height, 0))], camera), (320, 180))


@pytest.mark.gl
@pytest.mark.parametrize("fov", [1e-4, 1e-2, 1.0, 60.0, 150.0, 179.0, 179.9])
def test_any_field_of_view_gives_the_same_picture_by_cells(renderer: Renderer, fov: float) -> None:
    # The camera looks at an outline, at the ground's horizon, at the edge of the shadow, or at the background.
    for at in ((0.0, 1.0, 0.0), (-0.951, 1.01, 0.31), (0.0, 3.0, -1e6), (-1.2, 0.0, -1.0), (1.0, 9.0, -3.0)):
        assert_cells_agree(renderer, still_life(lights=[SUN, LAMP], at=at, fov=fov))


@pytest.mark.gl
@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_a_scene_of_any_scale_at_any_place_looks_the_same_by_cells(renderer: Renderer, scale: float) -> None:
    scene = enlarge_scene(still_life(lights=[SUN, LAMP]), scale)
    assert_cells_agree(renderer, scene)
    assert_cells_agree(renderer, move_scene(scene, (0.61e6 * scale, 0.37e6 * scale, -0.7e6 * scale)))


@pytest.mark.gl
def test_several_half_spaces_shade_each_other_the_same_way_by_cells(renderer: Renderer) -> None:
    wall, slope = rt.Plane((0, 0, 1), -3, scenes.COLORS[1]), rt.Plane((-1, 0.2, 0.1), -4, scenes.COLORS[2])
    twin, ceiling = rt.Plane((0, -2, 0), 0, scenes.COLORS[0]), rt.Plane((0, -1, 0), -6, scenes.COLORS[3])
    behind, third = rt.PointLight((-1, 2, -5)), rt.PointLight((1, 5, -6))
    for planes in ((wall,), (wall, slope), (wall, slope, ceiling), (twin,)):
        for lights in ((SUN,), (LAMP, behind), (SUN, LAMP, third)):
            for eye in ((0, 3, 6), (2.0, 1.0, -2.9), (0, 0.05, 3)):
                assert_cells_agree(
                    renderer, still_life(*planes, lights=lights, eye=eye), SIZE, Settings(shadows="diluted")
                )


@pytest.mark.gl
def test_scenes_without_spheres_or_without_half_spaces_look_the_same_by_cells(renderer: Renderer) -> None:
    camera = rt.Camera((0, 1, 5), (0, 0.5, 0))
    for objects in (
        [FLOOR],
        [BALL],
        [FLOOR & rt.Plane((1, 0, 0), 0.5)],
        [~BALL],
        [rt.Instances(rt.Sphere((0, 0, 0), 0.3), [(x, 0.3, z) for x in range(3) for z in range(3)]), FLOOR],
    ):
        for lights in ([], [SUN], [SUN, LAMP]):
            assert_cells_agree(renderer, rt.Scene(objects, lights, camera))


def test_a_scene_may_have_plane_only_cells_unless_an_object_is_unbounded() -> None:
    a, b = rt.Sphere((0, 0, 0), 1), rt.Sphere((1, 0, 0), 1)
    bounded: list[Solid] = [FLOOR, a, a | b, a - b, a & ~b, FLOOR & a, a - FLOOR, (a | b) - ~FLOOR]
    unbounded: list[Solid] = [~a, a | FLOOR, FLOOR - a, ~a & ~b, FLOOR & rt.Plane((1, 0, 0), 0), ~FLOOR]
    for solid in bounded:
        assert compiled(scenes.lit_scene(a, solid)).has_plane_only_cells
        assert not compiled(scenes.lit_scene(a, solid), Settings(evaluator="walk")).has_plane_only_cells
    for solid in unbounded:
        assert not compiled(scenes.lit_scene(a, solid)).has_plane_only_cells


def test_most_cells_of_the_assignment_are_plane_only() -> None:
    plane_only, empty = cell_masks(scenes.assignment(), (1280, 720))
    assert plane_only.shape == empty.shape == (45, 80)
    assert plane_only.mean() >= 0.85
    assert not (empty & ~plane_only).any() and 0.1 < empty.mean() < 0.5
    lit, _ = cell_masks(scenes.assignment(), (1280, 720), Settings(shadows="off"))
    assert (lit | ~plane_only).all(), "every plane-only cell stays plane-only without shadows"


def test_blocks_cover_each_cell_once_and_merge_equal_runs_of_successive_rows() -> None:
    rng = np.random.default_rng(1)
    for mask in (rng.random((9, 14)) < 0.5, np.ones((3, 4), bool), np.zeros((3, 4), bool)):
        again = np.zeros_like(mask)
        for column, row, columns, rows in cell_blocks(mask):
            covered = again[row : row + rows, column : column + columns]
            assert covered.size == columns * rows > 0 and not covered.any()
            covered[:] = True
        np.testing.assert_array_equal(again, mask)
    steps = np.array([[1, 1, 0, 1], [1, 1, 0, 1], [1, 1, 1, 0]], bool)
    assert cell_blocks(steps).tolist() == [[0, 0, 2, 2], [0, 2, 3, 1], [3, 0, 1, 2]]


def assert_plane_only(scene: rt.Scene, size: tuple[int, int]) -> float:
    """Check plane-only and empty cells by brute force in float64; return the share of plane-only cells."""
    plane_only, empty = cell_masks(scene, size)
    tracer = Tracer(scene)
    trees = scene.solids()
    owner = [tree for tree in trees for _ in leaves(tree)]
    single = np.array([isinstance(tree, Plane) for tree in owner] + [True])  # the last entry is the background
    others = [tree for tree in trees if not isinstance(tree, Plane)]
    row, column = np.indices((size[1], size[0]))
    cell = (size[1] - 1 - row.ravel()) // CELL, column.ravel() // CELL  # rows of cells count from the bottom
    for point in ((0.5, 0.5), (0.0, 0.0), (0.999, 0.999), (0.0, 0.999), (0.999, 0.0)):
        rd = camera_rays(scene.camera, size, point).reshape(-1, 3)
        ro = camera_origins(scene.camera, size, point).reshape(-1, 3)
        is_plane_only = plane_only[cell]
        t, surface = tracer.first(ro, rd)
        assert single[surface][is_plane_only].all(), "only half-spaces or the background are visible"
        assert (surface[empty[cell]] == -1).all(), "only the background is visible"
        if not others:
            continue
        for plane in set(np.unique(surface[is_plane_only])) - {-1}:
            # A half-space alone never blocks light from a point on its surface, so any blocker is another object.
            here = is_plane_only & (surface == plane)
            alone = Tracer(msgspec.structs.replace(scene, objects=[*others, owner[plane]]))
            P = ro[here] + t[here, None] * rd[here]
            n = np.broadcast_to(owner[plane].unit()[0], P.shape)
            start = np.full(len(P), len(alone.leaves) - 1, np.int32)
            for light in scene.lights:
                if owner[plane].touches(light.position):  # a light in the plane does not light the plane
                    continue
                toward = np.subtract(light.position, scene.camera.position) - P
                distance = np.linalg.norm(toward, axis=1)
                toward /= distance[:, None]
                blocked_at, _ = alone.first(P, toward, start, n, light, distance)
                # A face that faces away from the light is dark, however many objects are between.
                faces = np.sum(toward * n, axis=1) * np.sum(-rd[here] * n, axis=1) > 0.0
                assert not (faces & (blocked_at < distance)).any(), "no other object casts a shadow"
    return float(plane_only.mean())


@pytest.mark.parametrize("seed", range(72))
def test_a_plane_only_cell_has_no_other_object_and_no_shadow_of_another_object(seed: int) -> None:
    # The last cameras are orthographic.
    rng = np.random.default_rng((3, seed))
    trees: list[Solid] = []
    while len(trees) < 1 + seed % 3:
        tree = scenes.random_tree(rng, int(rng.integers(1, 5)))
        place, scale = rng.normal(size=3) * 2.0, 10.0 ** rng.uniform(-1.5, 0.5)
        placed = next(iter(rt.Instances(tree, [tuple(place.tolist())], scale).solids()))
        if compiled(scenes.lit_scene(placed)).has_plane_only_cells:
            trees.append(placed)
    planes = [rt.Plane((0, 1, 0), float(rng.uniform(-4, 0)))]
    planes += [rt.Plane(tuple(rng.normal(size=3).tolist()), float(rng.uniform(-6, 0))) for _ in range(seed % 2)]
    eye = rng.normal(size=3)
    eye *= 10.0 ** rng.uniform(-0.5, 1.5) / np.linalg.norm(eye)
    eye[1] = abs(eye[1]) if rng.random() < 0.8 else eye[1]
    fov = float(rng.choice([2.0, 20.0, 60.0, 60.0, 110.0, 170.0]))
    camera = rt.Camera(tuple(eye.tolist()), tuple(rng.normal(size=3).tolist()), vertical_fov=fov)
    if seed >= 60:
        camera = camera.replace(projection="orthographic", height=10.0 ** rng.uniform(-0.5, 1.5))
    lights = [random_light(rng, -0.5, 1.5) for _ in range(2)]
    assert_plane_only(rt.Scene([*trees, *planes], lights, camera), (96, 64))


@pytest.mark.parametrize("seed", range(12))
def test_lights_in_behind_and_near_half_spaces_cast_no_shadow_on_plane_only_cells(seed: int) -> None:
    rng = np.random.default_rng((4, seed))
    planes = [rt.Plane((0, 1, 0), 0.0), rt.Plane((0, 0, 1), -6.0)]
    balls = [rt.Sphere(tuple(p), 0.5) for p in rng.uniform((-3, 0.2, -5), (3, 3, 2), (4, 3)).tolist()]
    heights = [0.0, -1e-9, 1e-9, -1e-3, 1e-3, -2.0, 2.0]
    lights = [rt.PointLight((float(rng.uniform(-4, 4)), float(rng.choice(heights)), float(rng.uniform(-7, 4))))]
    lights.append(rt.PointLight((float(rng.uniform(-4, 4)), float(rng.uniform(0, 4)), -6.0)))
    camera = rt.Camera((0, 3, 8), (float(rng.uniform(-2, 2)), 0.5, 0))
    assert_plane_only(rt.Scene([*balls, *planes], lights, camera), (160, 96))


@pytest.mark.gl
def test_lights_in_behind_and_near_half_spaces_give_the_same_picture_by_cells(renderer: Renderer) -> None:
    for height in (0.0, -1e-6, 1e-6, -1e-3, 1e-3, -1.0):
        lights = [rt.PointLight((x, height, z)) for x, z in ((3.0, 1.0), (-2.0, 2.0), (0.5, -3.0))]
        for planes in ((), (rt.Plane((0, 0, 1), -3, scenes.COLORS[1]),), (rt.Plane((0, -1, 0), 0, scenes.COLORS[1]),)):
            assert_cells_agree(renderer, still_life(*planes, lights=lights))
            assert_cells_agree(renderer, still_life(*planes, lights=lights, eye=(0, -0.5, 4)))


def test_a_light_on_the_floor_casts_no_shadow_on_the_floor() -> None:
    size, places = (640, 360), ((3.0, 0.0, 2.0), (-4.0, 0.0, 1.0))
    on_floor, _ = cell_masks(still_life(lights=[rt.PointLight(place) for place in places]), size)
    none, _ = cell_masks(still_life(lights=[]), size)
    above, _ = cell_masks(still_life(lights=[rt.PointLight((x, 1.0, z)) for x, _, z in places]), size)
    np.testing.assert_array_equal(on_floor, none)
    assert above.sum() < none.sum()


def test_brute_force_reports_cells_that_are_not_plane_only(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = still_life()
    assert assert_plane_only(scene, (160, 96)) > 0.4
    none = np.zeros((6, 10), bool)
    without_shadows, _ = cell_masks(scene, (160, 96), Settings(shadows="off"))
    monkeypatch.setattr("tests.compiler.test_culling.cell_masks", lambda *_: (~none, none))
    with pytest.raises(AssertionError, match="only half-spaces"):
        assert_plane_only(scene, (160, 96))
    monkeypatch.setattr("tests.compiler.test_culling.cell_masks", lambda *_: (without_shadows, none))
    with pytest.raises(AssertionError, match="casts a shadow"):
        assert_plane_only(scene, (160, 96))


def test_a_cell_that_shows_a_sphere_is_not_plane_only_in_any_view() -> None:
    rng = np.random.default_rng(5)
    sizes = [(1, 1), (2, 3), (16, 9), (40, 30), (1, 300), (300, 1), (33, 17), (5, 90), (64, 64)]
    shown = 0
    for _ in range(1500):
        at, toward, beside = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(3, 3)))
        size = sizes[rng.integers(len(sizes))]
        fov = float(rng.choice([10.0 ** rng.uniform(-3, 2), rng.uniform(120, 179.9), 179.9]))
        camera = rt.Camera((0, 0, 0), tuple(at.tolist()), vertical_fov=fov)
        rays = np.concatenate(
            [camera_rays(camera, size, point).reshape(-1, 3) for point in ((0.5, 0.5), (0.0, 0.0), (0.999, 0.999))]
        )
        if rng.random() < 0.5:  # aim the sphere at a ray of the picture or of its edge
            toward = rays[rng.integers(len(rays))]
            toward = toward / np.linalg.norm(toward)
        radius = float(rng.choice([10.0 ** rng.uniform(-7, 0), 1.0 - 10.0 ** rng.uniform(-6, -0.3)]))
        if fov < 100.0:
            radius = min(radius, np.radians(fov) / size[1] * 10.0 ** rng.uniform(-1, 3))
        center = toward + beside * radius * rng.choice([0.0, 0.9, 1.0])
        scene = rt.Scene([rt.Sphere(tuple(center.tolist()), radius)], [], camera)
        plane_only, _ = cell_masks(scene, size, Settings(shadows="off"))
        passed = np.linalg.norm(np.cross(center, rays), axis=1) / np.linalg.norm(rays, axis=1)
        hit = ((passed < radius) & (rays @ center > 0.0)) | (np.linalg.norm(center) < radius)
        row, column = np.indices((size[1], size[0]))
        is_plane_only = plane_only[(size[1] - 1 - row.ravel()) // CELL, column.ravel() // CELL]
        assert not (hit & np.tile(is_plane_only, 3)).any()
        shown += hit.any() and not hit.all()
    assert shown > 300
