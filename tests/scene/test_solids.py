"""Primitives of all kinds and their maps: support, bounds, faces, walls and text, against the definitions."""

import copy
import functools
import itertools
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.scene.solids.body import Body, Placed
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.kinds import KINDS
from raytracer.scene.solids.solid import Primitive, postfix
from tests.solids import EXAMPLES, inside

Array = np.ndarray[Any, np.dtype[np.float64]]
Vec3 = tuple[float, float, float]


def vec3(values: Any) -> Vec3:
    x, y, z = map(float, values)
    return x, y, z


def polyhedron(points: Any) -> rt.Polyhedron:
    """Return a polyhedron from points of any type."""
    return rt.Polyhedron(points)


CUBE = np.array(list(itertools.product((0.0, 1.0), (0.0, 2.0), (-1.0, 1.0))))
GOLDEN = (1 + math.sqrt(5)) / 2
ICOSAHEDRON = np.array([np.roll((0, a, b), k) for k in range(3) for a in (-1, 1) for b in (-GOLDEN, GOLDEN)])
DODECAHEDRON = np.array(
    [np.roll((0, a, b), k) for k in range(3) for a in (-1 / GOLDEN, 1 / GOLDEN) for b in (-GOLDEN, GOLDEN)]
    + list(itertools.product((-1, 1), repeat=3))
)
SPHERE = rt.Sphere((0.3, -1, 2), 0.7)
BOX = rt.Box((-1, 0, 2), (0.5, 3, 2.5))
CYLINDER = rt.Cylinder((1, 2, 3), (-0.5, 2.5, 1), 0.8)
CONE = rt.Cone((1, 2, 3), (-0.5, 2.5, 1), 0.8, 0.3)
TIP = rt.Cone((0, 0, 0), (0, 3, 0), 0, 1.5)
ELLIPSOID = rt.Ellipsoid((1, 2, 3), (0.5, 2, 0.1))
TORUS = rt.Torus((1, -2, 0.5), (1, 2, -1), 2, 0.5)
POLYHEDRON = polyhedron(ICOSAHEDRON)
SOLIDS = [*EXAMPLES.values(), TIP, TORUS]
by_kind = pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)


def points_around(solid: rt.Solid, count: int = 100_000) -> Array:
    low, high = solid.bounds()
    middle, half = (np.array(low) + high) / 2, (np.array(high) - low) / 2
    return middle + 1.2 * half * np.random.default_rng(1).uniform(-1, 1, (count, 3))


def random_map(seed: int) -> Array:
    """Return a random [A | t] with a condition number up to 100, mirrored or not."""
    rng = np.random.default_rng(seed)
    u, v = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    return np.column_stack((u * 10 ** rng.uniform(-1, 1, 3) @ v, rng.normal(size=3)))


def moved(matrix: Array, x: Array) -> Array:
    return x @ matrix[:, :3].T + matrix[:, 3]


def names() -> dict[str, Any]:
    return dict(vars(rt))


def test_each_kind_is_public_and_registered_by_its_name() -> None:
    assert {name: kind.__name__.lower() for name, kind in KINDS.items()} == {name: name for name in KINDS}
    assert {kind.__name__ for kind in KINDS.values()} <= set(rt.__all__)
    assert {*EXAMPLES, "plane"} == {*KINDS}


@by_kind
def test_slabs_and_wall_hold_the_points_of_the_definition(solid: Body) -> None:
    x = points_around(solid)
    is_inside = np.ones(len(x), bool)
    for normal, low, high in solid.slabs():
        is_inside &= (low <= x @ normal) & (x @ normal <= high)
    if wall := solid.wall():
        l0, l1, l2, l3 = (x @ w[:3] + w[3] for w in wall.forms)
        tube = (np.hypot(l1, l2) - 1) ** 2 + l3**2 <= l0**2
        is_inside &= tube if wall.kind == "torus" else (np.sqrt(l1**2 + l2**2 + l3**2) <= l0)
    exact = inside(solid, x)
    assert 0.02 < np.mean(is_inside) < 0.98
    assert np.array_equal(is_inside[abs(exact) > 1e-12], (exact < 0)[abs(exact) > 1e-12])


@by_kind
@pytest.mark.parametrize("seed", range(3))
def test_bounds_and_corners_hold_all_points_under_a_map_and_the_bounds_are_tight(solid: Body, seed: int) -> None:
    matrix = random_map(seed)
    x = points_around(solid)
    held = moved(matrix, x[inside(solid, x) < 0])
    copy = solid.transform(matrix)
    low, high = copy.bounds()
    assert (low <= held).all() and (held <= high).all()
    # The definition has a point next to each side of the box. The closed forms below are exact.
    for i, sign in itertools.product(range(3), (-1, 1)):
        direction = sign * matrix[i, :3]
        side = sign * float((high if sign > 0 else low)[i] - matrix[i, 3])
        assert side == pytest.approx(solid.support(vec3(direction)), abs=1e-12)
        assert side == pytest.approx(farthest(solid, direction), abs=1e-3 * (high[i] - low[i]))
    for normal, below, above in polyhedron(moved(matrix, np.array(solid.corners()))).slabs():
        heights = held @ normal
        assert below - 1e-12 <= heights.min() and heights.max() <= above + 1e-12


def farthest(solid: Primitive, direction: Array) -> float:
    """Return the largest dot(direction, x) of points x of a solid, from the definition alone: a random search."""
    rng = np.random.default_rng(2)
    x = points_around(solid)
    x = x[inside(solid, x) <= 0]
    best = x[np.argmax(x @ direction)]
    step = float(np.max(np.ptp(x, axis=0))) / 4
    for _ in range(400):
        trial = best + step * rng.normal(size=(500, 3))
        trial = trial[(inside(solid, trial) <= 0) & (trial @ direction > best @ direction)]
        step, best = (step, trial[np.argmax(trial @ direction)]) if len(trial) else (step * 0.8, best)
    return float(best @ direction)


SUPPORTS: list[tuple[Primitive, Vec3, float]] = [
    (BOX, (1, -1, 2), 0.5 + 0 + 5),
    (rt.Cylinder((0, 0, 0), (0, 2, 0), 3), (3, 4, 4), 5 * 3 + 8),
    (rt.Cone((0, 0, 0), (0, 2, 0), 3, 1), (3, 1, 4), 15),
    (rt.Cone((0, 0, 0), (0, 20, 0), 3, 1), (3, 1, 4), 25),
    (ELLIPSOID, (2, 0, 0), 2 + 1),
    (rt.Ellipsoid((1, 0, 0), (3, 4, 1)), (1, 1, 0), 1 + 5),
    (rt.Torus((1, 0, 0), (0, 0, -7), 3, 1), (3, 4, 12), 3 + 15 + 13),
    (polyhedron(CUBE), (1, 2, 3), 1 + 4 + 3),
    (rt.Paraboloid((0, 0, 0), (0, 4, 0), 2), (3, 0, 4), 10),
    (rt.Paraboloid((0, 0, 0), (0, 4, 0), 2), (3, 4, 4), 4 * 4 + 25 / 16),  # where the slope is 5 / 4
    (rt.Paraboloid((0, 0, 0), (0, 4, 0), 2), (0, -1, 0), 0),
]


@pytest.mark.parametrize(("solid", "direction", "expected"), SUPPORTS)
def test_the_support_is_the_closed_form(solid: Primitive, direction: Vec3, expected: float) -> None:
    assert solid.support(direction) == pytest.approx(expected, rel=1e-15)


@by_kind
def test_points_of_the_surface_touch_it_and_others_do_not(solid: Primitive) -> None:
    # Points of the surface: bisection between a point inside and points outside, in float64.
    x = points_around(solid, 1000)
    e = inside(solid, x)
    out, within = x[e > 1e-3], np.repeat(x[[np.argmin(e)]], np.count_nonzero(e > 1e-3), axis=0)
    for _ in range(60):
        middle = (out + within) / 2
        is_out = (inside(solid, middle) > 0)[:, None]
        out, within = np.where(is_out, middle, out), np.where(is_out, within, middle)
    assert all(solid.touches(vec3(p)) for p in out.tolist())
    assert not any(solid.touches(vec3(p)) for p in x[abs(e) > 1e-3].tolist())
    matrix = random_map(4)
    copy = postfix(solid.transform(matrix))[0]
    assert isinstance(copy, Placed)
    assert all(copy.touches(vec3(p)) for p in moved(matrix, out).tolist())
    assert not any(copy.touches(vec3(p)) for p in moved(matrix, x[abs(e) > 1e-3]).tolist())


def test_equal_surfaces_have_equal_numbers_whatever_they_are_made_from() -> None:
    flipped = rt.Cylinder(CYLINDER.top, CYLINDER.base, 0.8)
    assert (flipped.wall(), flipped.slabs()) == (CYLINDER.wall(), CYLINDER.slabs())
    upside_down = rt.Cone(CONE.top, CONE.base, 0.3, 0.8)
    assert (upside_down.wall(), upside_down.slabs()) == (CONE.wall(), CONE.slabs())
    base, top = np.array(CONE.base), np.array(CONE.top)
    for k in (-0.7, 0.3):
        ends = vec3(base + k * (top - base)), vec3(top + 1.3 * (base - top))
        for other, solid in (
            (rt.Cylinder(*ends, 0.8), CYLINDER),
            (rt.Cone(*ends, 0.8 - 0.5 * k, 0.3 + 0.5 * 1.3), CONE),
        ):
            assert np.allclose(np.array(other.wall().forms), np.array(solid.wall().forms), rtol=0, atol=1e-14)
    long, short = rt.Cylinder((1, 0.1, 3), (1, 7, 3), 0.3), rt.Cylinder((1, 0.3, 3), (1, -0.7, 3), 0.3)
    assert long.wall() == short.wall() == rt.Cone((1, 2, 3), (1, 3, 3), 0.3, 0.3).wall()
    assert polyhedron(CUBE).slabs() == rt.Box((0, 0, -1), (1, 2, 1)).slabs()
    dishes = [rt.Paraboloid(vec3(top + k * k * (base - top)), vec3(top), 0.8 * k) for k in (0.3, 1.0, 1.7)]
    for dish in dishes:
        assert np.allclose(np.array(dish.wall().forms), np.array(dishes[0].wall().forms), rtol=0, atol=1e-14)
    # Rounding next to an axis changes neither the frame nor the sign.
    tilted = rt.Cylinder((1, 0, 3), (1 - 1e-16, 1, 3 + 4e-16), 0.3)
    assert np.allclose(np.array(tilted.wall().forms), np.array(long.wall().forms), rtol=0, atol=1e-14)


def test_a_ball_made_by_a_map_is_a_sphere() -> None:
    assert postfix(rt.Ellipsoid((1, 2, 3), (2, 2, 2))) == [rt.Sphere((1, 2, 3), 2)]
    assert postfix(rt.Ellipsoid((1, 2, 3), (2, 1, 4)).scale((2, 4, 1))) == [rt.Sphere((2, 8, 3), 4)]
    [turned] = postfix(SPHERE.rotate((1, 2, 3), 40).mirror((1, 1, 0)).scale(3))
    assert isinstance(turned, rt.Sphere) and turned.radius == pytest.approx(2.1)
    assert isinstance(postfix(SPHERE.scale((1, 1, 1.001)))[0], Placed)


def test_a_torus_is_the_union_of_its_first_and_second_interval() -> None:
    first, second, union = postfix(TORUS.translate((1, 0, 0)) & BOX)[:3]
    assert isinstance(first, Placed) and isinstance(second, Placed) and union == first | second
    assert (first.part, second.part, first.shape) == (0, 1, TORUS)


# --- Hulls


def turned(points: Array, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return points @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T * 10 ** rng.uniform(-3, 3) + rng.normal(size=3)


def prism(sides: int) -> Array:
    angles = np.arange(sides) / sides * 2 * np.pi
    return np.array([(math.cos(a), math.sin(a), z) for a in angles for z in (0.0, 1.0)])


HULLS = {
    "tetrahedron": (np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]), 4),
    "box": (CUBE, 6),
    "box with points on its faces and edges": (np.array(list(itertools.product(np.linspace(0, 1, 7), repeat=3))), 6),
    "equal points": (np.concatenate((CUBE, CUBE, CUBE[:3])), 6),
    "icosahedron": (ICOSAHEDRON, 20),
    "dodecahedron": (DODECAHEDRON, 12),
    "prism": (prism(100), 102),
}


@pytest.mark.parametrize(("points", "count"), HULLS.values(), ids=HULLS)
def test_a_polyhedron_has_one_plane_for_each_face(points: Array, count: int) -> None:
    for corners in (points, points[::-1], *(turned(points, seed) for seed in range(4))):
        slabs = polyhedron(corners).slabs()
        assert sum(1 + math.isfinite(low) for _, low, _ in slabs) == count
        for normal, low, high in slabs:
            heights = corners @ normal
            size = np.abs(corners).max()
            assert math.hypot(*normal) == pytest.approx(1, rel=1e-15)
            assert low - 1e-15 * size <= heights.min() and heights.max() <= high + 1e-15 * size
            assert np.sum(heights > high - 1e-14 * size) >= 3


def test_the_hull_of_random_points_is_that_of_all_supporting_planes() -> None:
    points = np.random.default_rng(3).normal(size=(40, 3))
    expected = set()
    for a, b, c in itertools.combinations(points, 3):
        normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        for n in (normal, -normal):
            if ((points - a) @ n <= 1e-12).all():
                expected.add((*n.round(9), round(float(a @ n), 9)))
    assert {(*np.round(n, 9), round(high, 9)) for n, _, high in polyhedron(points).slabs()} == expected


def test_the_hull_of_4096_points_has_the_faces_of_a_triangulation() -> None:
    points = np.random.default_rng(4).normal(size=(4096, 3))
    on_sphere = points / np.linalg.norm(points, axis=1)[:, None]
    assert len(polyhedron(on_sphere).slabs()) == 2 * 4096 - 4  # Euler


# --- Maps


def test_a_tree_of_moved_solids_has_its_maps_applied_from_the_inside_to_the_outside() -> None:
    tree = (BOX.rotate((0, 0, 1), 30).scale((1, 2, 3)) - CYLINDER).translate((1, 2, 3)) | TORUS.mirror((1, 1, 1))
    turn = np.array([(math.cos(math.pi / 6), -0.5, 0), (0.5, math.cos(math.pi / 6), 0), (0, 0, 1)])
    corner = np.array((1, 2, 3)) * (turn @ BOX.max) + (1, 2, 3)
    box, cylinder, first, _ = (leaf for leaf in leaves(tree) if isinstance(leaf, Placed))
    assert [type(node).__name__ for node in postfix(tree)] == [
        *("Placed", "Placed", "Difference", "Placed", "Placed", "Union", "Union")
    ]
    assert box.corners()[7] == pytest.approx(corner, rel=1e-15)
    assert cylinder.corners()[0] == pytest.approx(np.add(CYLINDER.corners()[0], (1, 2, 3)), rel=1e-15)
    normal = np.ones(3) / math.sqrt(3)
    center = np.array(TORUS.center) - 2 * (normal @ TORUS.center) * normal
    assert np.mean(first.corners(), axis=0) == pytest.approx(center, rel=1e-14)


TURNS: list[Callable[[rt.Solid], rt.Solid]] = [
    lambda solid: functools.reduce(lambda s, _: s.rotate((0, 0, 2), 90, about=(1, 2, 3)), range(4), solid),
    lambda solid: solid.rotate((0, 3, 0), 270).rotate((0, 1, 0), 90 + 360 * 10**9),
    lambda solid: solid.mirror((1, 0, 0), about=(0.5, 0, 0)).mirror((-2, 0, 0), about=(0.5, 7, 0)),
    lambda solid: solid.scale(4).scale(0.25).translate((1, 2, 3)).translate((-1, -2, -3)),
    lambda solid: solid.transform(np.eye(4)).transform(np.eye(3, 4)),
]


@pytest.mark.parametrize("turn", TURNS)
def test_maps_that_undo_each_other_are_undone_exactly(turn: Callable[[rt.Solid], rt.Solid]) -> None:
    assert leaves(turn(BOX)) == leaves(BOX) and leaves(turn(SPHERE)) == [SPHERE]


def test_a_quarter_turn_of_a_box_is_a_box() -> None:
    assert BOX.rotate((0, 0, 1), 90).bounds() == ((-3, -1, 2), (0, 0.5, 2.5))
    assert BOX.mirror((0, 5, 0), about=(0, 1, 0)).bounds() == ((-1, -1, 2), (0.5, 2, 2.5))
    assert BOX.rotate((1, 1, 1), 120).bounds().max == pytest.approx((2.5, 0.5, 3), rel=1e-15)


def test_the_bounds_of_a_tree_are_those_of_its_operands() -> None:
    a, b = rt.Box((0, 0, 0), (2, 2, 2)), rt.Box((1, 1, 1), (3, 3, 3))
    assert (a | b).bounds() == ((0, 0, 0), (3, 3, 3)) and (a & b).bounds() == ((1, 1, 1), (2, 2, 2))
    assert (a - b).bounds() == (b & a | a).bounds() == a.bounds() == (a & ~b).bounds()
    assert (a & rt.Plane((0, 2, 0), 1)).bounds() == ((0, 0, 0), (2, 0.5, 2))


def test_solids_and_trees_of_them_equal_their_evaluated_repr_pickle_and_copies() -> None:
    red = rt.Material(kd=(1, 0, 0))
    tree = functools.reduce(lambda a, b: (a | ~b.rotate((1, 2, 3), 40)).scale((1, 2, 3)), SOLIDS)
    for solid in (*SOLIDS, *(s.replace(material=red) for s in SOLIDS), tree, (~TORUS).translate((1, 2, 3))):
        others = [eval(repr(solid), names()), pickle.loads(pickle.dumps(solid)), copy.deepcopy(solid)]
        for other in others:
            assert other == solid and hash(other) == hash(solid) and postfix(other) == postfix(solid)
    assert BOX.translate((1, 0, 0)) == BOX.translate((1, 0, 0)) != BOX.translate((1, 0, 1)) != BOX


def test_ten_thousand_nested_maps_and_operators_do_not_recurse() -> None:
    def nested(turn: float) -> rt.Solid:
        return functools.reduce(lambda s, _: ~s.rotate((0, 0, 1), turn), range(10_000), BOX)

    solid = nested(90)
    assert solid == nested(90) != nested(-90) and hash(solid) == hash(nested(90))
    assert eval(repr(solid), names()) == pickle.loads(pickle.dumps(solid)) == solid
    assert functools.reduce(lambda s, _: s.rotate((0, 0, 1), 90), range(10_000), BOX).bounds() == BOX.bounds()


# --- Wrong values

ORIGIN = (0, 0, 0)
WRONG: dict[str, Callable[[], Any]] = {
    "max: expected 3 numbers above": lambda: rt.Box((0, 0, 0), (1, 0, 1)),
    "top: expected a point 1e-12 or more from base": lambda: rt.Cylinder((1, 0, 0), (1, 0, 1e-13), 1),
    "base: expected 3 numbers within": lambda: rt.Cylinder((1, 0, 2e12), ORIGIN, 1),
    "radius: expected a number above 0": lambda: rt.Cylinder(ORIGIN, (0, 0, 1), 0),
    "top_radius: expected a radius above 0 at base or at top": lambda: rt.Cone(ORIGIN, (0, 0, 1), 0, 0),
    "base_radius: expected 0, or a number": lambda: rt.Cone(ORIGIN, (0, 0, 1), 1e-13, 1),
    "top_radius: expected 0, or a number": lambda: rt.Cone(ORIGIN, (0, 0, 1), 1, -1),
    "radii: expected 3 numbers above 0": lambda: rt.Ellipsoid(ORIGIN, (1, 2, 0)),
    "radius: expected a radius with radius^2 / height": lambda: rt.Paraboloid(ORIGIN, (0, 0, 1), 1e7),
    "axis: expected a vector that is not 0": lambda: rt.Torus(ORIGIN, ORIGIN, 2, 1),
    "minor_radius: expected a number below major_radius, 2": lambda: rt.Torus(ORIGIN, (0, 0, 1), 2, 2),
    "points: expected 4 to 4096 points, got 3": lambda: polyhedron(CUBE[:3]),
    "points: expected 4 to 4096 points": lambda: polyhedron(np.zeros((4097, 3))),
    "points: expected 4 to 4096": lambda: polyhedron(7),
    "points[3]: expected 3 numbers": lambda: polyhedron([ORIGIN, ORIGIN, ORIGIN, (1, 2, math.nan)]),
    "points: expected points 1e-12 or more off": lambda: polyhedron(turned(CUBE * (1, 1, 0), 1)),
    "points: expected points": lambda: polyhedron(np.ones((5, 3))),
    "material: expected a Material": lambda: rt.Torus(ORIGIN, (0, 0, 1), 2, 1, 3),  # pyright: ignore
    "transform: expected a map that can be inverted": lambda: BOX.scale((1, 1e-12, 10)),
    "matrix: expected a map that can be": lambda: BOX.transform(
        [[0.1, 0.2, 0.3, 0], [0.2, 0.4, 0.6, 0], [0.3, 0.6, 0.9, 0]]
    ),
    "matrix: expected a map": lambda: BOX.transform(np.zeros((3, 4))),
    "matrix: expected 3 or 4 rows of 4": lambda: BOX.transform(np.eye(3)),
    "matrix: expected 0, 0, 0, 1": lambda: BOX.transform(np.ones((4, 4))),
    "transform: expected a map with numbers within": lambda: BOX.scale(1e7).scale(1e7),
    "transform: expected moved solids within": lambda: postfix(BOX.scale(1e12)),
    "transform: expected moved solids 1e-12 or more wide": lambda: postfix(BOX.scale(1e-12)),
    "axis: expected a vector": lambda: BOX.rotate(ORIGIN, 3),
    "degrees: expected a finite number": lambda: BOX.rotate((1, 0, 0), math.inf),
    "factor: expected 3 numbers, or one": lambda: BOX.scale((1, 0, 1)),
    "normal: expected a vector": lambda: BOX.mirror(ORIGIN),
    "offset: expected 3 numbers": lambda: BOX.translate(3),
}


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_value_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(rt.InputError) as caught:
        WRONG[text]()
    assert str(caught.value).startswith(text) and "\n" not in str(caught.value) and len(str(caught.value)) < 200
