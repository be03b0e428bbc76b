"""Scenes in Python: they are frozen, checked when they are made, and have a repr that is valid Python."""

import dataclasses
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.formats.csg_expression import parse
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.solid import postfix
from tests import scenes

NAN, INFINITY = float("nan"), float("inf")
CAMERA = rt.Camera((0, 0, 5), (0, 0, 0))


def test_a_repr_is_valid_python() -> None:
    names = {name: getattr(rt, name) for name in ("Camera", "Material", "Plane", "PointLight", "Scene", "Sphere")}
    assert eval(repr(scenes.assignment()), names) == scenes.assignment()
    tree = ~(rt.Sphere((1, 2, 3), 4) - (rt.Plane((0, 1, 0), 0) | ~rt.Sphere((0, 0, 0), 1)))
    assert eval(repr(tree), names) == tree
    for camera in (rt.Camera((0, 2, 5), (0, 0, 0), projection="orthographic", height=2.5), CAMERA):
        for same in (eval(repr(camera), names), pickle.loads(pickle.dumps(camera)), camera.replace()):
            assert same == camera and hash(same) == hash(camera)


def test_operators_have_the_precedence_of_python() -> None:
    a, b, c = (rt.Sphere((k, 0, 0), 1) for k in range(3))
    assert a | b & c == rt.Union(a, rt.Intersection(b, c))
    assert a - b - c == rt.Difference(rt.Difference(a, b), c)
    assert ~a & b == rt.Intersection(rt.Complement(a), b)
    assert a | b != b | a and hash(a | b) == hash(rt.Union(a, b))
    assert leaves((a | b) - ~c) == [a, b, c]


@pytest.mark.parametrize(
    "text", ["a", "~~a", "a-b-c", "a|b&c", "a - (b | ~c)", "~(a | b) & c", "a&b-c|a", "((a))", "~a-~b", " a |\n b"]
)
def test_an_expression_makes_the_same_tree_as_in_python(text: str) -> None:
    names = {name: rt.Sphere((k, 0, 0), 1) for k, name in enumerate("abc")}
    assert parse(text, names) == eval(text.strip().replace("\n", " "), dict(names))


def test_scenes_are_immutable() -> None:
    for item, name in ((scenes.assignment(), "objects"), (rt.Sphere((0, 0, 0), 1), "radius"), (CAMERA, "up")):
        with pytest.raises((AttributeError, dataclasses.FrozenInstanceError)):
            setattr(item, name, None)


def test_numpy_numbers_and_arrays_are_accepted() -> None:
    sphere = rt.Sphere(np.zeros(3), np.float32(0.5))  # pyright: ignore[reportArgumentType]
    assert sphere == rt.Sphere((0, 0, 0), 0.5) and type(sphere.radius) is float


def test_trees_may_be_deeper_than_the_stack_of_python() -> None:
    a = rt.Sphere((0, 0, 0), 1)
    tree: rt.Solid = a
    for _ in range(5_000):
        tree = tree - a
    assert len(postfix(tree)) == 10_001
    assert tree == rt.Difference(tree.a, a)  # pyright: ignore[reportAttributeAccessIssue]
    assert len(repr(tree)) > 10_000 and isinstance(hash(tree), int)


def test_a_tree_that_doubles_200_times_is_refused() -> None:
    tree: rt.Solid = rt.Sphere((0, 0, 0), 1)
    for _ in range(200):
        tree = tree | tree
    with pytest.raises(rt.InputError, match="at most 65536 primitives"):
        rt.Scene([tree], [], CAMERA)


wrong: Any = rt  # untyped, for arguments of wrong types


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: wrong.Sphere((0, 0, 0), 0), "radius: expected a number above 0"),
        (lambda: wrong.Sphere((0, 0, 0), -1), "radius: expected a number above 0"),
        (lambda: wrong.Sphere((0, 0, 0), NAN), "radius"),
        (lambda: wrong.Sphere((0, 0, 0), "1"), "radius"),
        (lambda: wrong.Sphere((0, 0, 0), True), "radius"),
        (lambda: wrong.Sphere((0, 0), 1), "center: expected 3 numbers"),
        (lambda: wrong.Sphere((0, 0, INFINITY), 1), "center"),
        (lambda: wrong.Sphere((0, 0, 10**400), 1), "center"),
        (lambda: wrong.Sphere("abc", 1), "center"),
        (lambda: wrong.Sphere((0, 0, 0), 1, "red"), "material: expected a Material"),
        (lambda: wrong.Plane((0, 0, 0), 1), "normal: expected a vector that is not 0"),
        (lambda: wrong.Plane((0, 1e-8, 0), 1e6), "offset"),
        (lambda: wrong.Material(kd=(-0.1, 0, 0)), "kd"),
        (lambda: wrong.Material(h=-1), "h"),
        (lambda: wrong.Material(model="gouraud"), "model: expected one of phong, blinn"),
        (lambda: wrong.PointLight((0, 0, 0), (0, -1, 0)), "color"),
        (lambda: wrong.PointLight((0, 0, 0), radius=-1), "radius: expected 0, for a point, or a number in"),
        (lambda: wrong.PointLight((0, 0, 0), radius=1e-13), "radius: expected 0, for a point, or a number in"),
        (lambda: wrong.PointLight((0, 0, 0), radius=1e13), "radius"),
        (lambda: wrong.PointLight((0, 0, 0), radius=NAN), "radius"),
        (lambda: wrong.PointLight((0, 0, 0), falloff="linear"), "falloff: expected 'none' or 'inverse_square', got"),
        (lambda: wrong.PointLight((0, 0, 0), falloff=None), "falloff"),
        (lambda: wrong.Camera((0, 0, 0), (0, 0, 0)), "look_at"),
        (lambda: wrong.Camera((0, 0, 0), (0, 2, 0)), "up: expected a direction not parallel to the view"),
        (lambda: wrong.Camera((0, 0, 0), (0, 0, 1), up=(0, 0, 0)), "up"),
        (lambda: wrong.Camera((0, 0, 0), (0, 0, 1), vertical_fov=180), "vertical_fov"),
        (lambda: wrong.Camera((0, 0, 0), (0, 0, 1), vertical_fov=0), "vertical_fov"),
        (lambda: wrong.Scene([], [], CAMERA), "objects: expected at least one"),
        (lambda: wrong.Scene(["ball"], [], CAMERA), "objects: expected solids"),
        (lambda: wrong.Scene([rt.Sphere((0, 0, 0), 1)], [], "front"), "camera: expected a Camera, got"),
        (lambda: wrong.Scene([rt.Sphere((0, 0, 0), 1)], [None], CAMERA), "lights"),
        (lambda: wrong.Scene([rt.Sphere((0, 0, 0), 1)], [], CAMERA, background=(0, 0, NAN)), "background"),
        (lambda: wrong.Union(rt.Sphere((0, 0, 0), 1), 3), "b: expected a solid"),
        (lambda: wrong.Settings(samples=0), "samples"),
        (lambda: wrong.Settings(samples=1.5), "samples"),
        (lambda: wrong.Settings(shadows="sharp"), "shadows: expected one of off, hard, diluted, soft"),
    ],
)
def test_an_error_about_a_wrong_value_names_it(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        make()


def test_materials_are_numbered_in_the_order_of_the_list_and_then_of_the_objects() -> None:
    red, blue, green = (rt.Material(name=name) for name in ("red", "blue", "green"))
    solid = rt.Sphere((0, 0, 0), 1, green) | rt.Sphere((0, 0, 0), 2, blue)
    assert rt.Scene([solid], [], CAMERA, materials=[red, blue]).materials == (red, blue, green)


def test_the_axes_of_a_camera_are_orthonormal_and_right_handed() -> None:
    axes = np.array(rt.Camera((1, 2, 3), (-2, 0.5, 1), up=(0.3, 5, 0)).axes())
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    right, up, forward = axes
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-15)
    assert math.isclose(forward @ (np.array((-2, 0.5, 1)) - (1, 2, 3)), np.linalg.norm((3, 1.5, 2)))


def test_the_shading_override_keeps_the_size_of_highlights() -> None:
    settings = rt.Settings(shading="blinn")
    assert settings.shaded(rt.Material(h=32)) == rt.Material(h=128, model="blinn")
    assert settings.shaded(rt.Material(h=32, model="blinn")) == rt.Material(h=32, model="blinn")
    assert rt.Settings(shading="phong").shaded(rt.Material(h=32, model="blinn")) == rt.Material(h=8)
    assert rt.Settings().shaded(rt.Material(h=7)) == rt.Material(h=7)


def test_scenes_that_differ_in_the_camera_share_objects_and_materials() -> None:
    scene = scenes.assignment()
    moved = scene.replace(camera=CAMERA, name="moved")
    assert moved.objects is scene.objects and moved.materials == scene.materials
    copy = pickle.loads(pickle.dumps(scene))
    assert copy == scene and copy.materials == scene.materials
    assert b"SceneObjects" not in pickle.dumps(scene)
