"""The arrays of a scene's surfaces hold the same values as its solids."""

import math
import pickle

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.compiled_scene import compile as compile_scene
from raytracer.compiler.surfaces import make_surfaces, powers, touched_surfaces
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.sphere import Sphere
from tests import scenes
from tests.compiled import compiled


def check_order(scene: Scene) -> None:
    all_leaves = [leaf for solid in scene.solids() for leaf in leaves(solid)]
    spheres = [leaf for leaf in all_leaves if isinstance(leaf, Sphere)]
    expected = [*spheres, *(leaf for leaf in all_leaves if not isinstance(leaf, Sphere))]
    surfaces = make_surfaces(scene)
    assert surfaces.size == len(expected)
    np.testing.assert_array_equal(surfaces.centers, np.array([s.center for s in spheres]).reshape(-1, 3))
    np.testing.assert_array_equal(surfaces.radii, [s.radius for s in spheres])
    units = [plane.unit() for plane in expected[len(spheres) :] if isinstance(plane, rt.Plane)]
    np.testing.assert_array_equal(surfaces.normals, np.array([normal for normal, _ in units]).reshape(-1, 3))
    np.testing.assert_array_equal(surfaces.offsets, [offset for _, offset in units])
    assert [scene.materials[i] for i in surfaces.material] == [leaf.material for leaf in expected]


def test_the_arrays_are_in_the_order_of_the_surfaces_in_the_shaders() -> None:
    red, blue, green, grey = scenes.COLORS
    floor, wall = rt.Plane((0, 2, 0), -1, grey), rt.Plane((1, 0, 1), 3, red)
    ball, other = rt.Sphere((1, 2, 3), 0.5, blue), rt.Sphere((-1, 0, 2), 2, green)
    cut = (ball & wall) - other
    many = rt.Instances(other - (floor | ball), [(0, 0, 0), (4, 0, 1), (9, 9, 9)], [1, 0.25, 3])
    balls = rt.Instances(ball, [(0, 1, 0), (2, 3, 4)], 0.5)
    check_order(scenes.assignment())
    check_order(scenes.lit_scene(floor))
    check_order(scenes.lit_scene(ball))
    check_order(scenes.lit_scene(floor, cut, ~other))
    check_order(scenes.lit_scene(many))
    check_order(scenes.lit_scene(floor, cut, many, other, balls, wall))
    for seed in range(20):
        check_order(scenes.random_scene(seed))


def test_parts_are_shared_while_only_lights_and_the_camera_change() -> None:
    scene = scenes.lit_scene(rt.Sphere((0, 0, 0), 1, scenes.COLORS[0]), rt.Plane((0, 1, 0), 0))
    first = compiled(scene)
    moved = msgspec.structs.replace(scene, lights=[], camera=rt.Camera((1, 2, 3), (0, 0, 0)))
    second = compile_scene(moved, first.options, first)
    assert second.surfaces is first.surfaces and second.batches is first.batches
    assert second.materials is first.materials and second.layout is first.layout and second.scene is moved
    shaded = compile_scene(scene, Settings(shading="blinn").compile_options, first)
    assert shaded.surfaces is first.surfaces and shaded.layout.models == ["blinn"]
    recolored = scenes.lit_scene(rt.Sphere((0, 0, 0), 1, scenes.COLORS[1]), rt.Plane((0, 1, 0), 0))
    third = compile_scene(recolored, first.options, first)
    assert [recolored.materials[i] for i in third.surfaces.material] == [scenes.COLORS[1], rt.Material()]
    reordered = msgspec.structs.replace(scene, materials=[scenes.COLORS[2], *scene.materials])
    fourth = compile_scene(reordered, first.options, first)
    assert [reordered.materials[i] for i in fourth.surfaces.material] == [scenes.COLORS[0], rt.Material()]


def test_a_copy_of_a_scene_shares_the_parts_of_the_scene() -> None:
    first = compiled(scenes.assignment())
    copy = pickle.loads(pickle.dumps(first.scene)).replace(camera=rt.Camera((1, 2, 3), (0, 0, 0)))
    assert copy.objects is not first.scene.objects
    second = compile_scene(copy, first.options, first)
    assert second.scene == copy and second.scene.objects is first.scene.objects
    assert second.surfaces is first.surfaces and second.batches is first.batches
    other = compile_scene(scenes.lit_scene(rt.Sphere((0, 0, 0), 2)), first.options, first)
    assert other.surfaces is not first.surfaces and other.batches is not first.batches


def test_a_light_touches_the_first_surface_whose_touches_method_is_true() -> None:
    rng = np.random.default_rng(7)
    balls = [rt.Sphere(tuple(rng.normal(size=3).tolist()), 10.0 ** rng.uniform(-2, 1)) for _ in range(30)]
    normals = [*rng.normal(size=(30, 3)).tolist(), *np.eye(3).tolist()]
    planes = [rt.Plane(tuple(normal), 10.0 ** rng.uniform(-3, 3)) for normal in normals]
    surfaces = make_surfaces(scenes.lit_scene(*balls, *planes))
    ordered = [*balls, *planes]
    places = [np.add(b.center, np.array(n) / np.linalg.norm(n) * b.radius) for b in balls for n in normals]
    places += [np.array(p.unit()[0]) * p.unit()[1] + np.cross(p.normal, rng.normal(size=3)) for p in planes * 20]
    places += [*rng.normal(size=(50, 3)), *(np.array(b.center) for b in balls)]
    points = [rt.PointLight(tuple(place.tolist())) for place in places]
    touched = touched_surfaces(surfaces, points)
    for point, surface in zip(points, touched, strict=True):
        assert surface == next((i for i, other in enumerate(ordered) if other.touches(point.position)), None)
    assert sum(surface is not None for surface in touched) > 500
    bulbs = [rt.PointLight(point.position, radius=float(rng.choice([b.radius for b in balls]))) for point in points]
    for bulb, surface in zip(bulbs, touched_surfaces(surfaces, bulbs), strict=True):
        assert surface == next((i for i, b in enumerate(balls) if bulb.is_bulb(b)), None)
    own = [rt.PointLight(ball.center, radius=ball.radius) for ball in balls]
    assert touched_surfaces(surfaces, own) == list(range(len(balls)))


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1e3, 1e9])
def test_a_light_touches_the_same_surface_at_any_scale(scale: float) -> None:
    rng = np.random.default_rng(8)
    centers, radii = scale * rng.normal(size=(200, 3)), scale * rng.uniform(0.1, 2.0, 200)
    balls = [rt.Sphere(tuple(c), r) for c, r in zip(centers.tolist(), radii.tolist(), strict=True)]
    lights = [rt.PointLight((x + r, y, z)) for (x, y, z), r in zip(centers.tolist(), radii.tolist(), strict=True)]
    lights += [rt.PointLight(ball.center, radius=ball.radius) for ball in balls]
    touched = touched_surfaces(make_surfaces(scenes.lit_scene(*balls)), lights)
    expected = [next(i for i, b in enumerate(balls) if b.touches(light.position)) for light in lights[:200]]
    assert touched == [*expected, *range(200)]


def check_powers(spheres: list[rt.Sphere], point: tuple[float, float, float]) -> None:
    computed = powers(np.array([s.center for s in spheres]), np.array([s.radius for s in spheres]), point)
    exact = np.array([s.power(point) for s in spheres])
    # Sphere.power() is exact to its last bit. The function under test sums nine parts, so it may err by two bits.
    assert (np.abs(computed - exact) <= 2.0 * np.spacing(np.abs(exact))).all()


def test_powers_of_arrays_equal_the_powers_of_the_spheres() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        point = tuple((rng.normal(size=3) * 10.0 ** rng.uniform(-6, 9)).tolist())
        spheres = [
            rt.Sphere(tuple((rng.normal(size=3) * 10.0 ** rng.uniform(-6, 9)).tolist()), 10.0 ** rng.uniform(-6, 9))
            for _ in range(40)
        ]
        check_powers(spheres, point)


def test_powers_of_points_almost_on_a_huge_sphere_are_precise() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        point = rng.normal(size=3) * 10.0 ** rng.uniform(-3, 3)
        radius = 10.0 ** rng.uniform(3, 12)
        toward = rng.normal(size=3)
        height = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-6, 3)
        center = point + toward / np.linalg.norm(toward) * min(radius + height, 1e12)
        check_powers([rt.Sphere(tuple(center.tolist()), radius)], tuple(point.tolist()))


def test_the_power_of_a_point_on_an_axis_is_exact() -> None:
    # The point is 1e-3 above a sphere of radius 2^33, whose square in float64 has no bit left for 1e-3.
    radius = 2.0**33
    (power,) = powers(np.array([(0.0, -radius, 0.0)]), np.array([radius]), (0.0, 2.0**-10, 0.0))
    assert power == 2.0**24 + 2.0**-20
    (on,) = powers(np.array([(0.0, -radius, 0.0)]), np.array([radius]), (0.0, 0.0, 0.0))
    assert on == 0.0 and not math.copysign(1.0, on) < 0.0
