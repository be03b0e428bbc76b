"""Rotations of instances: quaternions and matrices of a user, and the copies that they turn."""

import copy
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.scene.solids import affine
from raytracer.scene.solids.flattening import leaves

BOX = rt.Box((-1, -2, -3), (1, 2, 3))
HERE = [[0, 0, 0]]
RNG = np.random.default_rng(3)


def rotated(rotation: Any) -> np.ndarray:
    """Return the matrix (3, 3) that instances store for one rotation."""
    stored = rt.Instances(BOX, HERE, rotations=[rotation]).rotations
    assert stored is not None and stored.dtype == np.float64 and not stored.flags.writeable
    return stored[0]


def test_a_quaternion_is_the_rotation_around_its_axis_by_twice_its_angle() -> None:
    for axis in RNG.normal(size=(20, 3)):
        degrees = RNG.uniform(-360, 360)
        half = math.radians(degrees) / 2
        quaternion = np.append(math.cos(half), math.sin(half) * axis / np.linalg.norm(axis))
        expected = np.array(affine.rotation(tuple(axis.tolist()), degrees))[:, :3]
        for length in (1.0, -0.3, 1e-300, 1e300):
            np.testing.assert_allclose(rotated(quaternion * length), expected, atol=1e-15)


def test_rotations_by_90_and_120_and_180_degrees_are_exact() -> None:
    assert rotated([3, 0, 0, 0]).tolist() == np.eye(3).tolist()
    assert rotated([0.7, 0, 0, 0.7]).tolist() == [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert rotated([1, 1, 1, 1]).tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    assert rotated([0, 0, 5, 0]).tolist() == [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]


def test_a_matrix_keeps_its_bits_and_one_of_float32_becomes_the_nearest_rotation() -> None:
    exact = np.array([affine.rotation((1, 2, 3), degrees) for degrees in range(0, 360, 10)])[:, :, :3]
    places = np.zeros((len(exact), 3))
    assert np.array_equal(rt.Instances(BOX, places, rotations=exact).rotations, exact)  # pyright: ignore
    rough = rt.Instances(BOX, places, rotations=exact.astype(np.float32)).rotations
    assert rough is not None
    np.testing.assert_allclose(rough, exact, atol=1e-7)
    np.testing.assert_allclose(rough.swapaxes(1, 2) @ rough, np.broadcast_to(np.eye(3), rough.shape), atol=2e-15)


def test_rotated_instances_compare_by_value_and_their_repr_is_valid_python() -> None:
    names = {name: getattr(rt, name) for name in ("Box", "Instances", "Material")}
    quaternions = RNG.normal(size=(5, 4))
    rotations = rt.Instances(BOX, np.zeros((5, 3)), 2, quaternions)
    again = [eval(repr(rotations), names), copy.deepcopy(rotations), pickle.loads(pickle.dumps(rotations))]
    again += [rotations.replace(scales=2), rt.Instances(BOX, np.zeros((5, 3)), 2, -quaternions)]
    assert all(other == rotations and hash(other) == hash(rotations) for other in again)
    plain = rt.Instances(BOX, np.zeros((5, 3)), 2)
    assert plain != rotations and rotations.replace(rotations=None) == plain and "rotations" not in repr(plain)


def test_a_copy_maps_each_point_to_its_position_plus_its_rotated_and_scaled_place() -> None:
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    solid = rt.Sphere((1, 0, 0), 0.5) | rt.Plane((1, 0, 0), 4)
    (sphere, plane), *_ = map(leaves, rt.Instances(solid, [[10, 20, 30]], 2, [turn]).solids())
    assert sphere == rt.Sphere((10, 22, 30), 1)
    assert isinstance(plane, rt.Plane) and plane.unit() == ((0, 1, 0), 28)


wrong: Any = rt.Instances  # untyped, for arguments of wrong types
NAN = float("nan")
ROW = "expected finite numbers: a quaternion w, x, y, z, or a matrix, 3 rows of 3, got"
COUNT = r"rotations: expected 2 quaternions, an array \(2, 4\), or as many matrices, \(2, 3, 3\): one per position, got"


@pytest.mark.parametrize(
    ("rotations", "message"),
    [
        ("none", "rotations: expected numbers, got 'none'"),
        ([1, 0, 0, 0], f"{COUNT} an array of shape \\(4,\\)"),
        ([[1, 0, 0, 0]], f"{COUNT} an array of shape \\(1, 4\\)"),
        (np.zeros((2, 3)), f"{COUNT} an array of shape \\(2, 3\\)"),
        ([[1, 0, 0, 0], [1, 0, 0]], rf"rotations\[1\]: {ROW}.*"),
        ([[1, 0, 0, 0], [1, 0, 0, 0, 0]], rf"rotations\[1\]: {ROW} \[1, 0, 0, 0, 0\]"),
        ([[1, 0, 0, 0], [1, 0, "0", 0]], rf"rotations\[1\]: {ROW} '0'"),
        ([[1, 0, 0, 0], [1, 0, NAN, 0]], rf"rotations\[1\]: {ROW} nan"),
        ([np.eye(3).tolist(), [[1, 0, 0], [0, 1, 0], [0, 0]]], rf"rotations\[1\]: {ROW} \[0, 0\]"),
        ([[1, 0, 0, 0], np.eye(3).tolist()], "rotations: expected numbers, in rows of one length"),
        (
            [[1, 0, 0, 0], [0, 0, 0, 0]],
            r"rotations\[1\]: expected a quaternion w, x, y, z of any length but 0, such as",
        ),
        (np.array([np.eye(3), 2 * np.eye(3)]), r"rotations\[1\]: expected a rotation matrix R, with R\^T R equal to"),
        (np.array([np.eye(3), 1e200 * np.eye(3)]), r"rotations\[1\]: expected a rotation matrix R, with R\^T R equal"),
        (
            np.array([np.eye(3), -np.eye(3)]),
            r"rotations\[1\]: expected a rotation matrix, determinant 1, got a mirror image, determinant -1",
        ),
    ],
)
def test_an_error_about_a_wrong_rotation_names_its_row(rotations: Any, message: str) -> None:
    with pytest.raises(rt.InputError, match=f"^{message}"):
        wrong(BOX, [[0, 0, 0], [9, 9, 9]], 1, rotations)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rt.Instances(BOX, [*HERE, [0, 0, 1e12 - 3]]), None),
        (lambda: rt.Instances(BOX, [*HERE, [0, 0, 1e12]]), r"positions\[1\]: expected moved solids within .* scale 1$"),
        (lambda: rt.Instances(BOX, [*HERE, [1e12 - 2, 0, 0]], 1, [[1, 0, 0, 0]] * 2), None),
        (
            lambda: rt.Instances(BOX, [*HERE, [1e12 - 2, 0, 0]], 1, [[1, 0, 0, 0], [1, 0, 1, 0]]),
            r"positions\[1\]: expected moved solids within .* scale 1$",
        ),
        (lambda: rt.Instances(BOX, HERE, 1e-13), r"positions\[0\]: expected moved solids 1e-12 or more wide, got"),
        (lambda: rt.Instances(BOX, HERE, 1e300), r"positions\[0\]: expected "),
        (
            lambda: rt.Instances(rt.Plane((1, 0, 0), 9e11), HERE * 2, [1, 1.2], [[1, 0, 0, 0]] * 2),
            r"positions\[1\]: expected placed centers and offsets within",
        ),
    ],
)
def test_a_copy_beyond_the_limits_of_lengths_is_refused(make: Callable[[], Any], message: str | None) -> None:
    if message is None:
        assert len(make()) == 2
    else:
        with pytest.raises(rt.InputError, match=f"^{message}"):
            make()
