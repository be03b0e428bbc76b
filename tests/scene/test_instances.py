"""Instances: a solid at many places equals separate solids made by hand at these places."""

import copy
import pickle
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.analysis.numerics.scene_transforms import enlarge_scene, move_scene
from raytracer.ground_truth import ray_tracer
from raytracer.scene.solids.flattening import leaves, simplify
from raytracer.scene.solids.solid import Primitive
from raytracer.scene.warnings import precision_warning
from tests import scenes

BALL = rt.Sphere((0, 0, 0), 1)
RED, BLUE, GREEN, GREY = scenes.COLORS
LENS = (rt.Sphere((-0.5, 0, 0), 1, RED) & rt.Sphere((0.5, 0, 0), 1, BLUE)) - ~rt.Plane((1, 2, 2), 0.5, GREEN)
CAMERA = rt.Camera((0, 0, 5), (0, 0, 0))


def test_a_placed_solid_equals_a_solid_made_by_hand() -> None:
    first, second = rt.Instances(LENS, [[1, 2, 3], [0, 0, -4]], [2, 0.5]).solids()
    # The half-space dot(n, x) <= 0.5 with x = (X - position) / scale is dot(n, X) <= 0.5 scale + dot(n, position). The
    # normals of copies have other lengths.
    assert first == (rt.Sphere((0, 2, 3), 2, RED) & rt.Sphere((2, 2, 3), 2, BLUE)) - ~rt.Plane(
        (0.25, 0.5, 0.5), 12 / 4, GREEN
    )
    a, b = rt.Sphere((-0.25, 0, -4), 0.5, RED), rt.Sphere((0.25, 0, -4), 0.5, BLUE)
    assert second == (a & b) - ~rt.Plane((0.25, 0.5, 0.5), -7.75 / 4, GREEN)


def test_positions_and_scales_accept_any_arrays_and_are_read_only() -> None:
    places = np.arange(6, dtype=np.float32).reshape(2, 3)
    instances = rt.Instances(BALL, places, 2)
    places[0, 0] = 7
    assert len(instances) == 2
    for array, values in ((instances.positions, [[0, 1, 2], [3, 4, 5]]), (instances.scales, [2, 2])):
        assert array.dtype == np.float64 and array.tolist() == values
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(AttributeError):
        instances.scales = 1  # pyright: ignore[reportAttributeAccessIssue]


def test_instances_compare_by_value_and_their_repr_is_valid_python() -> None:
    names = {name: getattr(rt, name) for name in ("Camera", "Instances", "Material", "Plane", "Scene", "Sphere")}
    for scales in (1.0, 0.3, [0.1, 1e-7]):
        instances = rt.Instances(LENS, [[0.1, -0.0, 1 / 3], [4, 5, 6e9]], scales)
        same = [eval(repr(instances), names), copy.deepcopy(instances), pickle.loads(pickle.dumps(instances))]
        assert all(other == instances and hash(other) == hash(instances) for other in same)
        scene = rt.Scene([instances, BALL], [], CAMERA)
        assert eval(repr(scene), names) == scene
    assert "scales" not in repr(rt.Instances(BALL, [[0, 0, 0]]))
    minus, plus = rt.Instances(BALL, [[-0.0, 0, 0]]), rt.Instances(BALL, [[0, 0, 0]])
    assert minus == plus and hash(minus) == hash(plus)
    others = rt.Instances(LENS, [[0, 0, 0]]), rt.Instances(BALL, [[0, 0, 1]]), rt.Instances(BALL, [[0, 0, 0]], 2)
    assert plus not in (*others, BALL, None)


wrong: Any = rt.Instances  # untyped, for arguments of wrong types
NAN, INFINITY = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: wrong("ball", [[0, 0, 0]]), r"solid: expected a solid, got 'ball'"),
        (lambda: wrong(BALL, []), r"positions: expected at least one point, as an array \(N, 3\)"),
        (lambda: wrong(BALL, [1, 2, 3]), r"positions: .* got an array of shape \(3,\)"),
        (lambda: wrong(BALL, np.zeros((2, 4))), r"positions: .* got an array of shape \(2, 4\)"),
        (lambda: wrong(BALL, None), r"positions: expected numbers, got None"),
        (lambda: wrong(BALL, [[0, 0, 0], [0, 0]]), r"positions\[1\]: expected 3 numbers within .*, got \[0, 0\]"),
        (lambda: wrong(BALL, [[0, 0, 0], [0, "1", 0]]), r"positions\[1\]: expected 3 numbers .*, got '1'"),
        (
            lambda: wrong(BALL, [[0, 0, 0], [0, NAN, 0]]),
            r"positions\[1\]: expected 3 numbers within \+-1e\+12, got nan",
        ),
        (lambda: wrong(BALL, [[0, 0, 0], [0, 0, 2e12]]), r"positions\[1\]: expected 3 numbers"),
        (lambda: wrong(BALL, [[0, 0, 10**400]]), r"positions\[0\]: expected 3 numbers"),
        (lambda: wrong(BALL, [[0, 0, 0]], 0), r"scales\[0\]: expected a number above 0, got 0"),
        (lambda: wrong(BALL, [[0, 0, 0]] * 3, [1, 2, INFINITY]), r"scales\[2\]: expected a number above 0, got inf"),
        (lambda: wrong(BALL, [[0, 0, 0]] * 3, [1, 2]), r"scales: expected one number, or 3, one per position"),
        (lambda: wrong(BALL, [[0, 0, 0]], "big"), r"scales: expected numbers, got 'big'"),
        (lambda: wrong(BALL, [[0, 0, 0]], True), r"scales: expected numbers, got True"),
        (
            lambda: wrong(BALL, [[0, 0, 0]] * 2, [1, 1e-13]),
            r"scales\[1\]: expected radii times scale in \[1e-12, 1e\+12\]",
        ),
        (lambda: wrong(BALL, [[0, 0, 0]] * 2, [1, 1e308]), r"scales\[1\]: expected radii times scale"),
        (lambda: wrong(LENS, [[0, 0, 0], [-1e12, 0, 0]], 3), r"positions\[1\]: expected placed centers and offsets"),
        (lambda: wrong(rt.Plane((1, 1, 1), 0), [[7e11] * 3]), r"positions\[0\]: expected placed centers and offsets"),
        (lambda: wrong(rt.Plane((0, 1, 0), 1), [[0, 0, 0]], 1e308), r"positions\[0\]: .* with the scale 1e\+308"),
        (
            lambda: wrong(BALL, np.zeros((1048577, 3))),
            r"positions: expected at most 1048576 primitives, got 1048577 x 1",
        ),
        (lambda: rt.Scene([wrong(LENS, np.zeros((200_000, 3)))] * 2, [], CAMERA), r"objects: .* got 1200000"),
    ],
)
def test_an_error_about_a_wrong_instance_names_its_row(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(rt.InputError, match=f"^{message}"):
        make()


def test_a_scene_counts_its_surfaces_and_materials_through_instances() -> None:
    instances = rt.Instances(LENS, [[0, 0, 0], [3, 0, 0]])
    scene = rt.Scene([rt.Sphere((9, 9, 9), 1, GREEN), instances, BALL], [], CAMERA)
    assert scene.solids() == (scene.objects[0], *instances.solids(), BALL)
    assert scene.materials == (GREEN, RED, BLUE, BALL.material)


def test_a_picture_of_instances_equals_the_picture_of_solids_made_by_hand() -> None:
    lens = (rt.Sphere((0.4, 0, 0), 1, RED) & rt.Sphere((-0.4, 0, 0), 1, BLUE)) - rt.Sphere((0, 0.5, 0.6), 0.7, GREEN)
    floor = rt.Plane((0, 1, 0), -1, GREY)
    places, scales = [(-1.0, 0.0, 0.0), (1.0, 0.3, -1.0), (0.2, -0.5, 1.5)], [1.0, 0.8, 0.4]
    by_hand: list[rt.Solid] = []
    for (x, y, z), s in zip(places, scales, strict=True):
        a, b = rt.Sphere((x + 0.4 * s, y, z), s, RED), rt.Sphere((x - 0.4 * s, y, z), s, BLUE)
        by_hand.append((a & b) - rt.Sphere((x, y + 0.5 * s, z + 0.6 * s), 0.7 * s, GREEN))
    pictures = [
        ray_tracer.trace(scenes.lit_scene(*objects), (48, 36), rt.Settings(shadows="diluted"))
        for objects in ((rt.Instances(lens, places, scales), floor), (*by_hand, floor))
    ]
    one, other = pictures
    assert one.material is not None and len(np.unique(one.material)) == 5
    assert one.depth is not None and other.depth is not None
    np.testing.assert_array_equal(one.material, other.material)
    np.testing.assert_allclose(one.depth, other.depth, rtol=1e-13)
    np.testing.assert_allclose(one.radiance, other.radiance, rtol=1e-12)


def flattened(scene: rt.Scene) -> list[rt.Solid | type[rt.Solid]]:
    """Return the leaves and the operators of all solids, in postfix order."""
    nodes = [node for solid in scene.solids() for node in simplify(solid)]
    return [node if isinstance(node, Primitive) else type(node) for node in nodes]


def test_instances_are_moved_and_enlarged_like_plain_solids() -> None:
    for rotations in (None, [[1, 0, 0, 1], [1, 1, -1, 1]]):
        scene = rt.Scene([rt.Instances(LENS, [[1, 2, 4], [0, 0, -4]], [2, 0.5], rotations)], [], CAMERA)
        plain = rt.Scene(scene.solids(), [], CAMERA)
        # Powers of two, small whole numbers and exact rotations, so that nothing is rounded.
        assert flattened(enlarge_scene(scene, 4.0)) == flattened(enlarge_scene(plain, 4.0))
        away = 16.0, 0.0, -2.0
        assert flattened(move_scene(scene, away)) == flattened(move_scene(plain, away))


def test_instances_have_the_precision_warnings_of_plain_solids() -> None:
    for places, scales in (([[0, 0, 0], [1e5, 0, 0]], 1), ([[0, 0, 0]], 1e-5), ([[0, 0, 5]], 1e7), ([[0, 0, 0]], 1)):
        scene = rt.Scene([rt.Instances(LENS, places, scales), rt.Plane((0, 1, 0), 0)], [], CAMERA)
        plain = rt.Scene(scene.solids(), [], CAMERA)
        assert precision_warning(scene, rt.Settings()) == precision_warning(plain, rt.Settings())
    half_spaces = rt.Scene([rt.Instances(rt.Plane((0, 1, 0), 0), [[0, 0, 0]])], [], CAMERA)
    assert precision_warning(half_spaces, rt.Settings()) is None


def test_a_scene_of_a_hundred_thousand_instances_is_made_and_checked_within_half_a_second() -> None:
    places = np.random.default_rng(1).uniform(-10, 10, (100_000, 3))
    begin = time.process_time()
    scene = rt.Scene([rt.Instances(LENS, places, 0.1)], [], CAMERA)
    assert scene == rt.Scene([rt.Instances(LENS, places, 0.1)], [], CAMERA)
    precision_warning(scene, rt.Settings())
    # One Python call for each instance would take more than 1 s.
    assert time.process_time() - begin < 0.5
    assert sum(len(leaves(o.solid)) * len(o) for o in scene.objects if isinstance(o, rt.Instances)) == 300_000
