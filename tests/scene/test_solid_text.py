"""Solids of any depth: their repr is valid Python, and they are copied, pickled, compared, hashed and freed."""

import copy
import functools
import gc
import operator
import pickle
import random
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rich.pretty import pretty_repr

import raytracer as rt
from raytracer.scene.materials.models import MODELS
from raytracer.scene.solids import tree
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.solid import postfix

BALL, FLOOR = rt.Sphere((0, 0, 0), 1), rt.Plane((0, 1, 0), 0)
CAMERA = rt.Camera((0, 3, 6), (0, 0, 0))
JOINS: list[Callable[[Any, Any], rt.Solid]] = [operator.or_, operator.and_, operator.sub, lambda a, b: b - ~a]


def names() -> dict[str, Any]:
    return dict(vars(rt))


def left_deep(depth: int) -> rt.Solid:
    return functools.reduce(operator.sub, [BALL] * depth, FLOOR)


def right_deep(depth: int) -> rt.Solid:
    return functools.reduce(lambda solid, leaf: leaf - solid, [BALL] * depth, FLOOR)


def complements(depth: int) -> rt.Solid:
    return functools.reduce(lambda solid, _: ~solid, range(depth), BALL)


def mixed_depth(depth: int) -> rt.Solid:
    rng = random.Random(1)
    solid: rt.Solid = FLOOR
    for i in range(depth):
        leaf = rt.Sphere((rng.random(), 0, 0), 1 + i)
        solid = ~solid if rng.random() < 0.25 else rng.choice(JOINS)(*rng.sample([solid, leaf], 2))
    return solid


def row(count: int) -> rt.Solid:
    return functools.reduce(operator.or_, (rt.Sphere((i, 0, 0), 0.6) for i in range(count)))


def double(times: int) -> rt.Solid:
    """Return a tree of 2^times leaves that shares its sub-trees."""
    return functools.reduce(lambda solid, _: solid | solid, range(times), BALL - FLOOR)


MAKERS = [left_deep, right_deep, complements, mixed_depth, row]
DEEP = [pytest.param(lambda make=make: make(10_000), id=make.__name__) for make in MAKERS]
DEEP.append(pytest.param(lambda: double(200), id="doubled"))


@pytest.mark.parametrize("make", DEEP)
def test_a_deep_tree_equals_its_evaluated_repr_its_pickle_and_its_copies(make: Callable[[], rt.Solid]) -> None:
    solid, again = make(), make()
    assert solid == again and hash(solid) == hash(again) and solid != ~solid
    copies = [eval(repr(solid), names()), copy.deepcopy(solid), copy.copy(solid), solid.replace()]
    copies += [pickle.loads(pickle.dumps(solid, protocol)) for protocol in (0, pickle.HIGHEST_PROTOCOL)]
    for other in copies:
        assert other == solid and hash(other) == hash(solid) and type(other) is type(solid)
    assert pretty_repr(solid).startswith("Solid.from_postfix(")


@pytest.mark.parametrize("make", [left_deep, right_deep, complements, mixed_depth, row])
def test_a_scene_of_deep_trees_equals_its_evaluated_repr_its_pickle_and_its_copies(
    make: Callable[[int], rt.Solid],
) -> None:
    solid = make(5_000)
    scene = rt.Scene([solid, rt.Instances(solid, [[0, 0, 0]])], [rt.PointLight((4, 7, 4))], CAMERA)
    for other in (eval(repr(scene), names()), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert other == scene and hash(other) == hash(scene)


@pytest.mark.parametrize("depth", [tree.MAX_NESTING - 1, tree.MAX_NESTING])
@pytest.mark.parametrize("make", [left_deep, right_deep, complements])
def test_python_parses_the_repr_of_trees_at_the_nesting_limit(make: Callable[[int], rt.Solid], depth: int) -> None:
    solid = make(depth)
    assert ("from_postfix" in repr(solid)) == (depth >= tree.MAX_NESTING)
    text = repr(rt.Scene([rt.Instances(solid, [[0, 0, 0]])], [], CAMERA))
    # The tree is also valid within expressions that are nested as deep again.
    for _ in range(tree.MAX_NESTING):
        text = f"[{text}][0]"
    [instances] = eval(text, names()).objects
    assert instances.solid == solid


def test_the_repr_of_a_small_tree_has_operators() -> None:
    assert repr((BALL | FLOOR) - ~BALL & BALL) == f"((({BALL} | {FLOOR}) - ~{BALL}) & {BALL})"


def test_shared_sub_trees_stay_shared_and_small() -> None:
    solid = double(16)
    assert len(pickle.dumps(solid)) < 1000 and len(repr(solid)) < 1000
    others: list[Any] = [eval(repr(solid), names()), copy.deepcopy(solid), pickle.loads(pickle.dumps(solid))]
    for other in others:
        assert other == solid and other.a is other.b and len(tree.list_distinct(other)) == 19
    # Trees are equal whether or not they share sub-trees.
    apart = (BALL - FLOOR) | (rt.Sphere((0, 0, 0), 1) - rt.Plane((0, 1, 0), 0))
    assert double(1) == apart and hash(double(1)) == hash(apart)


def test_trees_with_any_difference_are_not_equal() -> None:
    solid, other = row(2000), row(1999) | rt.Sphere((1999, 0, 0), 0.7)
    assert solid != other and left_deep(50) != right_deep(50) and (BALL | FLOOR) != (FLOOR | BALL) != (FLOOR & BALL)
    assert BALL != ~BALL and ~BALL != BALL and ~~BALL != BALL


def test_a_postfix_list_makes_the_tree_it_describes() -> None:
    a, b, c = BALL, FLOOR, rt.Sphere((1, 0, 0), 2)
    make = rt.Solid.from_postfix
    assert make([a]) is a and make((a, b, "|", c, "-", "~")) == ~((a | b) - c)
    assert make(iter([a | b, 0, c, "&", "-"])) == (a | b) - ((a | b) & c)
    assert make([a, b, "|", np.int64(2), "-"]) == (a | b) - (a | b)  # pyright: ignore[reportArgumentType]


WRONG_ITEMS: list[Any] = [
    [],
    [BALL, FLOOR],
    ["|"],
    [BALL, "|"],
    [BALL, FLOOR, "+"],
    [BALL, 1],
    [BALL, -1],
    [BALL, True],
    [BALL, None, "|"],
    [[BALL], "~"],
    [BALL, 0.0, "|"],
    "a",
    None,
    7,
]


@pytest.mark.parametrize("items", WRONG_ITEMS, ids=repr)
def test_a_postfix_list_that_makes_no_single_solid_is_refused(items: Any) -> None:
    with pytest.raises(rt.InputError, match=r"^items(\[\d\])?: expected"):
        rt.Solid.from_postfix(items)


@pytest.mark.parametrize("make", [left_deep, right_deep, complements])
def test_deep_trees_are_freed_without_recursion(make: Callable[[int], rt.Solid]) -> None:
    solid = make(60_000)
    before = sys.getrefcount(BALL)
    del solid
    gc.collect()
    assert make is complements or sys.getrefcount(BALL) < before - 59_000


@pytest.mark.parametrize("seed", range(20))
def test_any_scene_equals_its_evaluated_repr(seed: int) -> None:
    rng = random.Random(seed)
    labels = ["", "red", 'it\'s "red"', "\n\t\\", "}{", "日本 \u202e", "\x01\x1b[31m", "#", "'''", '"""']

    def length() -> float:
        return rng.choice([0.0, -0.0, 5e-324, 1e12, -1e12, 0.1, 1 / 3, rng.uniform(-9, 9), 2.0**-1074 * rng.random()])

    def place() -> Any:
        return length(), length(), length()

    def radius() -> float:
        return rng.choice([1e-12, 1e12, 0.1 + 0.2, rng.uniform(0.1, 3)])

    def material() -> rt.Material:
        parameters: dict[str, Any] = {
            "ka": (rng.random(), 1e12, 5e-324),
            "le": rng.choice([0, 0.1, (1e12, 0.0, 1e-300)]),
        }
        model = rng.choice([name for name in MODELS if name not in ("lafortune", "merl")])
        if rng.random() < 0.3:
            model, parameters["lobes"] = (
                "lafortune",
                [rt.Lobe(-0.5, (0.1, 0.2, 1 / 3), 7, scale=0.25), rt.Lobe(1, 1, 0)],
            )
        return rt.Material(model, name=rng.choice(labels), **parameters)

    def leaf() -> rt.Solid:
        return rt.Sphere(place(), radius(), material()) if rng.random() < 0.7 else rt.Plane((1, 2, 3), length())

    def solid(depth: int) -> rt.Solid:
        return functools.reduce(lambda tree, join: join(tree, leaf()), rng.choices(JOINS, k=depth), leaf())

    near = rt.Sphere((0.1, -0.2, 1 / 3), 0.7, material()) - rt.Plane((1e-12, 1e12, -1e-300), 1e-300)
    copies = rt.Instances(near, [[0.1, -0.0, 1e11], [1 / 3, 5e-324, -1e11]], rng.choice([1, 0.3, [1e-3, 1 / 3]]))
    lights = [
        rt.PointLight(
            place(), (0.0, 1e12, 5e-324), rng.choice([0, 1e-12, 1e12]), rng.choice(["none", "inverse_square"])
        )
        for _ in range(rng.randrange(3))
    ]
    scene = rt.Scene(
        [copies, solid(3), *(solid(rng.choice([0, 10, 60])) for _ in range(2))],
        lights,
        rt.Camera((1e12, 5e-324, 0.1), (0.1, 0.2, 0.3), (-0.0, 1e-300, 1e12), rng.choice([1e-3, 179.9])),
        ambient=(0, 1e12, 1 / 3),
        background=(5e-324, 0, 1),
        materials=[material(), material()],
        name=rng.choice(labels),
    )
    others = [eval(repr(scene), names()), pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene), copy.copy(scene)]
    for other in others:
        assert other == scene and hash(other) == hash(scene)
        assert other.materials == scene.materials


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        (BALL, ((0.0, 0.0, 0.0), -1.0, rt.Material())),
        (FLOOR, ((0.0, 0.0, 0.0), 0.0, rt.Material())),
        (CAMERA, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))),
        (rt.PointLight((0, 0, 0)), ((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))),
        (rt.Settings(), (0,)),
        (rt.Instances(BALL, [[0, 0, 0]]), (BALL, [[0, 0, 0]], 0.0)),
        (BALL | FLOOR, ([BALL, "|"],)),
        (rt.Scene([BALL], [], CAMERA), ((), (), CAMERA)),
        (rt.Image(np.zeros((1, 1, 3), np.float32)), (np.zeros(3),)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_values_from_a_pickle_are_checked(good: Any, bad: tuple[Any, ...]) -> None:
    class Forged:
        def __reduce__(self) -> tuple[Any, ...]:
            return good.__reduce__()[0], bad

    with pytest.raises(rt.InputError):
        pickle.loads(pickle.dumps(Forged()))


def test_a_postfix_list_with_references_repeats_the_sub_tree() -> None:
    solid = rt.Solid.from_postfix([BALL, FLOOR, "|", 2, "&"])
    assert [type(node).__name__ for node in postfix(solid)] == [
        *("Sphere", "Plane", "Union") * 2,
        "Intersection",
    ]
    assert leaves(solid) == [BALL, FLOOR] * 2
