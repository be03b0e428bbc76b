"""The arrays of instances hold the bits of solids under Transform, one by one."""

import time

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.surfaces import Surfaces, make_surfaces

CAMERA = rt.Camera((0, 0, 9), (0, 0, 0))
RED, BLUE, GREEN = (rt.Material(kd=kd) for kd in ((0.8, 0.2, 0.2), (0.2, 0.3, 0.8), (0.2, 0.7, 0.3)))
BOX = rt.Box((-0.7, -0.5, -0.6), (0.7, 0.5, 0.6), RED)
BALL = rt.Sphere((0.1, 0.2, -0.3), 0.8, BLUE)
CYLINDER = rt.Cylinder((0, -0.8, 0.1), (0.2, 0.8, 0), 0.6, GREEN)
CONE = rt.Cone((0, -0.8, 0), (0.1, 0.8, 0), 0.8, 0.1, GREEN)
SOLIDS: dict[str, rt.Solid] = {
    "box": BOX,
    "sphere": BALL,
    "cylinder": CYLINDER,
    "cone": CONE,
    "ellipsoid": rt.Ellipsoid((0.3, 0, 0), (1, 0.6, 0.8), RED),
    "torus": rt.Torus((0, 0.1, 0), (0, 1, 0.2), 0.7, 0.3, RED),
    "polyhedron": rt.Polyhedron(((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1.2)), RED),
    "half-space": rt.Plane((0.3, -1.7, 0.4), 0.6, BLUE),
    "tree": (BOX & BALL) - CYLINDER.rotate((1, 2, 3), 40).scale((1, 2, 0.5)),
}
NAMES = "corners", "centers", "radii", "starts", "normals", "low", "high", "kinds", "walls", "forms", "parts"


def surfaces_of(*objects: rt.Solid | rt.Instances) -> Surfaces:
    return make_surfaces(rt.Scene(objects, [], CAMERA))


def assert_same_bits(one: Surfaces, other: Surfaces) -> None:
    for name in NAMES:
        np.testing.assert_array_equal(getattr(one.bodies, name), getattr(other.bodies, name), name)
    for name in ("centers", "radii", "normals", "offsets", "material"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)


@pytest.mark.parametrize("kind", SOLIDS)
def test_copies_have_the_bits_of_solids_under_transform(kind: str) -> None:
    rng = np.random.default_rng(4)
    solid = SOLIDS[kind]
    places, scales, turns = rng.normal(size=(50, 3)), rng.uniform(0.1, 4, 50), rng.normal(size=(50, 4))
    copies = rt.Instances(solid, places, scales, turns)
    one_by_one = [solid.transform(matrix) for matrix in copies.maps()]
    assert_same_bits(surfaces_of(copies), surfaces_of(*one_by_one))
    assert_same_bits(surfaces_of(copies), surfaces_of(*copies.solids()))


def test_a_quaternion_of_no_rotation_gives_the_bits_of_no_rotations() -> None:
    rng = np.random.default_rng(5)
    solid = ((BOX - CONE) | BALL) - rt.Plane((1, 2, 3), -4)
    places, scales = rng.normal(size=(50, 3)), rng.uniform(0.1, 4, 50)
    turned = rt.Instances(solid, places, scales, [[1, 0, 0, 0]] * 50)
    assert_same_bits(surfaces_of(rt.Instances(solid, places, scales)), surfaces_of(turned))


def test_faces_of_neighbouring_copies_and_of_single_objects_have_equal_bits() -> None:
    box = rt.Box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    rng = np.random.default_rng(6)
    # A row of boxes along x, each turned by 0, 90 or 180 degrees around some axis.
    quarters = np.array([[1, 0, 0, 0], [1, 1, 0, 0], [1, 0, -1, 0], [1, 0, 0, 1], [0, 1, 1, 0]])
    turns = quarters[rng.integers(5, size=20)]
    row = rt.Instances(box, np.column_stack([np.arange(20.0), np.zeros((20, 2))]), 1, turns)
    single = [rt.Box((19.5, -0.5, -0.5), (20.5, 0.5, 0.5)), rt.Plane((0, 2, 0), -1), rt.Plane((-3, 0, 0), 1.5)]
    surfaces = surfaces_of(row, *single)
    bodies = surfaces.bodies
    planes = np.concatenate(
        [
            np.column_stack([bodies.normals, bodies.low]),
            np.column_stack([bodies.normals, bodies.high]),
            np.column_stack([surfaces.normals, surfaces.offsets]),
        ]
    )
    planes *= np.sign(planes[np.arange(len(planes)), np.argmax(planes[:, :3] != 0, axis=1)])[:, None]
    # 22 faces across x, two across y, and two across z.
    assert len(np.unique(planes, axis=0)) == 26


def test_a_face_of_a_rotated_box_has_the_bits_of_the_rotated_half_space() -> None:
    rng = np.random.default_rng(7)
    for axis, degrees, place in zip(
        rng.normal(size=(50, 3)), rng.uniform(0, 360, 50), rng.normal(size=(50, 3)), strict=True
    ):
        box, plane = rt.Box((-1, -2, -3), (1, 2, 3)), rt.Plane((0, 1, 0), 2)
        surfaces = surfaces_of(*(solid.rotate(axis, degrees).translate(place) for solid in (box, plane)))
        np.testing.assert_array_equal(surfaces.bodies.normals[1], surfaces.normals[0])
        assert surfaces.bodies.high[1] == surfaces.offsets[0]


def test_twenty_thousand_rotated_copies_of_two_bodies_are_placed_within_a_second() -> None:
    rng = np.random.default_rng(8)
    solid = rt.Box((-1, -1, -1), (1, 1, 1)) - rt.Cylinder((0, -2, 0), (0, 2, 0), 0.5)
    begin = time.process_time()
    surfaces = surfaces_of(rt.Instances(solid, rng.normal(size=(20_000, 3)), 1, rng.normal(size=(20_000, 4))))
    # One Python call for each copy would take 3 s.
    assert time.process_time() - begin < 1.0
    assert surfaces.size == 40_000
