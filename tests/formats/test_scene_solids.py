"""Shapes, transforms and parts of scene files: a file has the solids of Python, and mistakes are refused."""

from __future__ import annotations

import random
import warnings
from pathlib import Path

import pytest

import raytracer as rt
from raytracer.app.viewer.orbit import turn_camera, turn_light
from raytracer.core.validation import MAX_LENGTH
from raytracer.formats.part_sections import MAX_PAINTED
from raytracer.formats.scene_file import edit_positions, load, loads
from raytracer.formats.shape_sections import MAX_SQUARES
from raytracer.formats.transforms import MAX_STEPS
from raytracer.scene.solids.kinds import KINDS
from raytracer.scene.solids.solid import Transform

HEAD = """\
[camera]
position = [0, 3, 6]
look_at = [0, 2, 0]
[[lights]]
position = [4, 7, 4]
[materials.red]
kd = [0.64, 0.08, 0.08]
[materials.blue]
kd = [0.1, 0.1, 0.8]
"""
RED, BLUE = rt.Material(kd=(0.64, 0.08, 0.08), name="red"), rt.Material(kd=(0.1, 0.1, 0.8), name="blue")
BOX = rt.Box((-1, 0, -2), (1, 2, 3), RED)
BALL = rt.Sphere((1, 2, 3), 0.5, BLUE)
SHAPES = """\
[shapes.box]
box = { min = [-1, 0, -2], max = [1, 2, 3] }
material = "red"
[shapes.ball]
sphere = { center = [1, 2, 3], radius = 0.5 }
material = "blue"
"""


def load_object(text: str) -> rt.Solid:
    """Return the only object of a scene."""
    (solid,) = loads(HEAD + text).objects
    assert isinstance(solid, rt.Solid)
    return solid


def refusal(text: str) -> str:
    """Return the message of the refusal of a scene, which is one line."""
    with pytest.raises(rt.InputError) as error:
        loads(HEAD + text)
    assert "\n" not in str(error.value)
    return str(error.value)


PRIMITIVES: dict[str, tuple[str, rt.Solid]] = {
    "sphere": ("center = [1, 2, 3], radius = 0.5", rt.Sphere((1, 2, 3), 0.5, RED)),
    "plane": ("normal = [0, 2, 0], offset = 3", rt.Plane((0, 2, 0), 3, RED)),
    "box": ("min = [-1, 0, -2], max = [1, 2, 3]", BOX),
    "cylinder": ("base = [0, 0, 0], top = [0, 2, 1], radius = 0.7", rt.Cylinder((0, 0, 0), (0, 2, 1), 0.7, RED)),
    "cone": (
        "base = [0, 0, 0], top = [0, 2, 1], base_radius = 0.7, top_radius = 0",
        rt.Cone((0, 0, 0), (0, 2, 1), 0.7, 0, RED),
    ),
    "paraboloid": (
        "base = [0, 0, 0], top = [0, 2, 1], radius = 0.7",
        rt.Paraboloid((0, 0, 0), (0, 2, 1), 0.7, RED),
    ),
    "ellipsoid": ("center = [1, 2, 3], radii = [1, 2, 0.5]", rt.Ellipsoid((1, 2, 3), (1, 2, 0.5), RED)),
    "torus": (
        "center = [1, 2, 3], axis = [0, 1, 1], major_radius = 2, minor_radius = 0.5",
        rt.Torus((1, 2, 3), (0, 1, 1), 2, 0.5, RED),
    ),
    "polyhedron": (
        "points = [\n[0, 0, 0], [1, 0, 0],\n[0, 1, 0], [0, 0, 1], # the last\n]",
        rt.Polyhedron(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), RED),
    ),
}


def test_each_kind_of_primitive_has_a_file_and_a_solid_here() -> None:
    assert {*PRIMITIVES} == {*KINDS}


@pytest.mark.parametrize("kind", PRIMITIVES)
def test_a_primitive_of_a_file_equals_that_of_python_moved_or_not(kind: str) -> None:
    keys, solid = PRIMITIVES[kind]
    shape = f'[shapes.a]\nmaterial = "red"\n{kind}.dummy = 0\n'.replace(f"{kind}.dummy = 0", f"{kind} = {{ {keys} }}")
    assert load_object(f'{shape}[objects]\no = "a"\n') == solid
    steps = "transform = [{ scale = [1, 2, 1] }, { rotate = [1, 1, 0], degrees = 33 }]\n"
    moved = load_object(f'{shape}{steps}[objects]\no = "a"\n')
    assert moved == solid.scale((1, 2, 1)).rotate((1, 1, 0), 33)
    assert moved.bounds() != solid.bounds()


STEPS: list[tuple[str, rt.Solid]] = [
    ("{ translate = [1, -2, 3] }", BOX.translate((1, -2, 3))),
    ("{ rotate = [0, 3, 4], degrees = 30 }", BOX.rotate((0, 3, 4), 30)),
    ("{ degrees = -90, about = [1, 2, 3], rotate = [0, 1, 0] }", BOX.rotate((0, 1, 0), -90, (1, 2, 3))),
    ("{ scale = 2 }", BOX.scale(2)),
    ("{ scale = 2, about = [1, 2, 3] }", BOX.scale(2, (1, 2, 3))),
    ("{ scale = [1, 2, 0.5] }", BOX.scale((1, 2, 0.5))),
    ("{ mirror = [1, 1, 0] }", BOX.mirror((1, 1, 0))),
    ("{ mirror = [1, 0, 0], about = [5, 0, 0] }", BOX.mirror((1, 0, 0), (5, 0, 0))),
    (
        "{ matrix = [[1, 0.5, 0, 1], [0, 1, 0, 2], [0, 0, 2, 3]] }",
        BOX.transform([[1, 0.5, 0, 1], [0, 1, 0, 2], [0, 0, 2, 3]]),
    ),
    (
        "{ matrix = [[1, 0.5, 0, 1], [0, 1, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]] }",
        BOX.transform([[1, 0.5, 0, 1], [0, 1, 0, 2], [0, 0, 2, 3]]),
    ),
]


@pytest.mark.parametrize(("step", "solid"), STEPS)
def test_a_step_of_a_file_is_the_method_of_python_for_shapes_and_for_parts(step: str, solid: rt.Solid) -> None:
    box = SHAPES[: SHAPES.index("[shapes.ball]")]
    moved = load_object(f'{box}transform = [{step}]\n[objects]\no = "box"\n')
    assert moved == solid and isinstance(moved, Transform)
    part = f'[parts.p]\nsolid = "box"\ntransform = [\n{step}, # here\n]\n'
    assert load_object(f'{box}{part}[objects]\no = "p"\n') == solid


def test_steps_apply_from_first_to_last() -> None:
    steps = "transform = [{ translate = [1, 0, 0] }, { rotate = [0, 0, 1], degrees = 90 }, { scale = 2 }]\n"
    with pytest.warns(UserWarning, match="no object uses the shape box"):
        moved = load_object(SHAPES + steps + '[objects]\no = "ball"\n')
    assert moved == BALL.translate((1, 0, 0)).rotate((0, 0, 1), 90).scale(2)
    # The centre (1, 2, 3) goes to (2, 2, 3), (-2, 2, 3), (-4, 4, 6).
    assert moved.bounds() == ((-5, 3, 5), (-3, 5, 7))
    with pytest.warns(UserWarning, match="no object uses the shape box"):
        assert load_object(SHAPES + 'transform = []\n[objects]\no = "ball"\n') == BALL


def test_parts_are_solids_of_shapes_and_of_other_parts_in_any_order() -> None:
    text = """\
[parts.pair]
solid = "~hole | box"
transform = [{ mirror = [1, 0, 0] }]
[parts.hole]
solid = "box - ball"
material = "blue"
transform = [{ translate = [1, 0, 0] }]
[objects]
o = "pair & (ball | hole)"
"""
    hole = (BOX - BALL).translate((1, 0, 0)).paint(BLUE)
    assert load_object(SHAPES + text) == (~hole | BOX).mirror((1, 0, 0)) & (BALL | hole)


def test_a_part_has_instances_by_an_object() -> None:
    part = '[parts.p]\nsolid = "ball - ball"\n[objects]\no = "p"\n[instances.o]\npositions = [[0, 0, 0], [1, 2, 3]]\n'
    shapes = SHAPES[SHAPES.index("[shapes.ball]") :]
    (objects,) = loads(HEAD + shapes + part).objects
    assert objects == rt.Instances(BALL - BALL, [[0, 0, 0], [1, 2, 3]])


def test_a_warning_names_the_shapes_and_parts_that_no_object_uses() -> None:
    parts = '[parts.used]\nsolid = "ball"\n[parts.p]\nsolid = "q"\n[parts.q]\nsolid = "box"\n'
    with pytest.warns(UserWarning, match=r"^no object uses the shape box and the parts p, q$"):
        loads(f'{HEAD}{SHAPES}{parts}[objects]\no = "used"\n')
    with pytest.warns(UserWarning, match=r"^no object uses the part q$"):
        loads(f'{HEAD}{SHAPES}[parts.q]\nsolid = "box"\n[objects]\no = "ball - box"\n')


def shape(transform: str, kind: str = "box = { min = [0, 0, 0], max = [1, 1, 1] }") -> str:
    return f'[shapes.a]\nmaterial = "red"\n{kind}\ntransform = {transform}\n[objects]\no = "a"\n'


def parts(*tables: str) -> str:
    texts = "".join(f"[parts.{table}\n" for table in tables)
    return f'{SHAPES}{texts}[objects]\no = "box - ball"\n'


KNOWN = "known: translate, rotate, scale, mirror, matrix, degrees, about"
ONE_OF = "expected one of translate, rotate, scale, mirror, matrix, got"
BAD = [
    (shape("3"), "shapes.a.transform: expected a list, got a number"),
    (shape("{ scale = 2 }"), "shapes.a.transform: expected a list, got a table"),
    (shape("[{ scale = 2 }, 3]"), "shapes.a.transform[1]: expected a table, got a number"),
    (shape("[{}]"), f"shapes.a.transform[0]: {ONE_OF} none of them"),
    (shape("[{ degrees = 3 }]"), f"shapes.a.transform[0]: {ONE_OF} none of them"),
    (shape("[{ scale = 2, translate = [1, 2, 3] }]"), f"shapes.a.transform[0]: {ONE_OF} translate and scale"),
    (
        shape("[{ rotat = [0, 1, 0] }]"),
        f'shapes.a.transform[0]: unknown key `rotat` ({KNOWN}); did you mean "rotate"?',
    ),
    (shape("[{ rotate = [0, 1, 0] }]"), "shapes.a.transform[0]: missing key `degrees`"),
    (
        shape("[{ translate = [0, 1, 0], about = [0, 0, 0] }]"),
        "shapes.a.transform[0]: unknown key `about` (known: translate)",
    ),
    (
        shape("[{ scale = 2, degrees = 3 }]"),
        "shapes.a.transform[0]: unknown key `degrees` (known: scale, about)",
    ),
    (
        shape("[{ translate = [0, 1] }]"),
        "shapes.a.transform[0].translate: expected 3 numbers within +-1e+12, got [0, 1]",
    ),
    (
        shape("[{ scale = 2 }, { rotate = [0, 0, 0], degrees = 3 }]"),
        "shapes.a.transform[1].rotate: expected a vector that is not 0, got [0, 0, 0]",
    ),
    (
        shape("[{ rotate = [0, 0, 1], degrees = nan }]"),
        "shapes.a.transform[0].degrees: expected a finite number, got nan",
    ),
    (
        shape('[{ rotate = [0, 0, 1], degrees = "3" }]'),
        "shapes.a.transform[0].degrees: expected a finite number, got '3'",
    ),
    (
        shape("[{ rotate = [0, 0, 1], degrees = 3, about = 1 }]"),
        "shapes.a.transform[0].about: expected 3 numbers within +-1e+12, got 1",
    ),
    (
        shape("[{ scale = 0 }]"),
        "shapes.a.transform[0].scale: expected 3 numbers, or one for all, in [1e-12, 1e+12], got 0",
    ),
    (
        shape("[{ scale = [1, -1, 1] }]"),
        "shapes.a.transform[0].scale: expected 3 numbers, or one for all, in [1e-12, 1e+12], got -1",
    ),
    (shape("[{ mirror = 1 }]"), "shapes.a.transform[0].mirror: expected 3 numbers within +-1e+12, not all 0, got 1"),
    (
        shape("[{ matrix = [[1, 0, 0, 0], [0, 1, 0, 0]] }]"),
        "shapes.a.transform[0].matrix: expected 3 or 4 rows of 4 numbers within +-1e+12, "
        "got [[1, 0, 0, 0], [0, 1, 0, 0]]",
    ),
    (
        shape("[{ matrix = [[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0]] }]"),
        "shapes.a.transform[0].matrix: expected a map that can be inverted, got a matrix that is singular to float64",
    ),
    (
        shape("[{ scale = 1e12 }, { scale = 1e12 }]"),
        "shapes.a.transform[1]: expected a map with numbers within +-1e+12 after each step, got 1e+24",
    ),
    (
        shape("[{ scale = [1, 1e-9, 1] }, { scale = [1, 1e-9, 1] }]"),
        "shapes.a.transform[1]: expected a map that can be inverted, got a matrix that is singular to float64",
    ),
    (
        shape("[{ scale = 4e11 }, { translate = [8e11, 0, 0] }]"),
        "shapes.a.transform: expected moved solids within +-1e+12, "
        "got one from [800000000000.0, 0.0, 0.0] to [1200000000000.0, 400000000000.0, 400000000000.0]",
    ),
    (
        shape("[{ scale = 2 }]", "sphere = { center = [0, 0, 0], radius = 6e11 }"),
        "shapes.a.transform: expected moved balls with a radius in [1e-12, 1e+12] and a centre within +-1e+12, got the "
        "radius 1200000000000.0 around [0.0, 0.0, 0.0]",
    ),
    (
        shape(f"[{'{ scale = 1 }, ' * (MAX_STEPS + 1)}]"),
        "shapes.a.transform: expected at most 64 steps, got 65; one matrix stands for any number",
    ),
    (
        shape("[]", "boks = { min = [0, 0, 0], max = [1, 1, 1] }"),
        f"shapes.a: unknown key `boks` (known: material, transform, {', '.join(KINDS)})",
    ),
    (
        shape("[]", "box = { min = [0, 0, 0], max = [1, 0, 1] }"),
        "shapes.a.box.max: expected 3 numbers above those of min, [0.0, 0.0, 0.0], by 1e-12 or more, "
        "got [1.0, 0.0, 1.0]",
    ),
    (shape("[]", "box = { min = [0, 0, 0] }"), "shapes.a.box: missing key `max`"),
    (
        shape("[]", "polyhedron = { points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1]] }"),
        "shapes.a.polyhedron.points[3]: expected 3 numbers within +-1e+12, got [0, 1]",
    ),
    (parts("p]"), "parts.p: missing key `solid`"),
    (parts("p]\nsolid = 3"), "parts.p.solid: expected a string, an expression over shapes and parts, got 3"),
    (
        parts('p]\nsold = "box"'),
        'parts.p: unknown key `sold` (known: solid, transform, material); did you mean "solid"?',
    ),
    (
        parts('p]\nsolid = "bax"'),
        'parts.p.solid: expected the name of a shape or a part, got "bax" (known: box, ball); did you mean "box"?',
    ),
    (
        parts('p]\nsolid = "o"'),
        'parts.p.solid: expected the name of a shape or a part, got "o" (an object; only shapes and parts can be '
        "named)",
    ),
    (parts('p]\nsolid = "box ball"'), "parts.p.solid: column 5: expected an operator or \")\", got 'ball'"),
    (
        parts('p]\nsolid = "box"\nmaterial = "rot"'),
        "parts.p.material: expected the name of a material, got 'rot' (known: red, blue)",
    ),
    (
        parts('p]\nsolid = "ball"\ntransform = [{ translate = [1e12, 0, 0] }]').replace("box - ball", "box - p"),
        "parts.p: expected moved balls with a radius in [1e-12, 1e+12] and a centre within +-1e+12, got the radius 0.5 "
        "around [1000000000001.0, 2.0, 3.0]",
    ),
    (
        parts('p]\nsolid = "box"\ntransform = [{ scale = 0 }]'),
        "parts.p.transform[0].scale: expected 3 numbers, or one for all, in [1e-12, 1e+12], got 0",
    ),
    (parts('box]\nsolid = "ball"'), "parts.box: expected another name: a shape has this one"),
    (
        parts('"a b"]\nsolid = "ball"'),
        'parts."a b": expected a name of letters, digits and "_" that does not begin with a digit',
    ),
    (parts('p]\nsolid = "box | p"'), "parts.p.solid: expected parts without a cycle, got p -> p"),
    (
        parts('x]\nsolid = "c"', 'b]\nsolid = "box - a"', 'a]\nsolid = "c"', 'c]\nsolid = "ball | b"'),
        "parts.b.solid: expected parts without a cycle, got b -> a -> c -> b",
    ),
    (
        parts(*(f'p{i}]\nsolid = "p{(i + 1) % 20}"' for i in range(20))),
        "parts.p0.solid: expected parts without a cycle, got p0 -> p1 -> p2 -> p3 -> p4 -> p5 -> p6 -> p7 -> ... -> p0",
    ),
    ("parts = 3\n" + HEAD[:0], "parts: expected a table, got a number"),
    (f'{SHAPES}[parts]\np = "box"\n[objects]\no = "p"\n', "parts.p: expected a table, got a string"),
    (
        f"{SHAPES}[objects]\no = 3\n",
        "objects.o: expected a string, an expression over shapes and parts, got 3",
    ),
    (f"objects = 3\n{SHAPES}", "objects: expected a table, got a number"),
]


@pytest.mark.parametrize(("text", "message"), BAD, ids=[message[:60] for _, message in BAD])
def test_a_mistake_in_a_shape_or_a_part_is_refused_in_one_line(text: str, message: str) -> None:
    if text.startswith(("parts = ", "objects = ")):  # a key of the top level
        key, _, rest = text.partition("\n")
        rest = rest or f'{SHAPES}[objects]\no = "box"\n'
        with pytest.raises(rt.InputError) as error:
            loads(f"{key}\n{HEAD}{rest}")
        assert str(error.value) == message
    else:
        assert refusal(text) == message


FAR = f"transform = [{{ translate = [{0.9 * MAX_LENGTH}, 0, 0] }}]"


@pytest.mark.parametrize(
    ("tables", "where"),
    [
        (
            f'[parts.p]\nsolid = "near"\n{FAR}\n[parts.near]\nsolid = "box"\n{FAR}\n[objects]\no = "ball - p"\n',
            "parts.p",
        ),
        (f'[parts.p]\nsolid = "box"\n{FAR}\n[parts.q]\nsolid = "p"\n{FAR}\n[objects]\no = "q"\n', "parts.q"),
        (f'[parts.p]\nsolid = "ball"\n{FAR}\n[parts.q]\nsolid = "p | box"\n{FAR}\n[objects]\no = "q"\n', "parts.q"),
    ],
)
def test_a_part_that_its_transform_moves_too_far_is_named(tables: str, where: str) -> None:
    for instances in ("", "[instances.o]\npositions = [[0, 0, 0]]\n"):
        message = refusal(f"{SHAPES}{tables}{instances}")
        assert message.startswith(f"{where}") and "within +-1e+12" in message


@pytest.mark.parametrize("more", ["", 'material = "red"\n', "transform = [{ rotate = [0, 0, 1], degrees = 3 }]\n"])
def test_parts_that_double_sixty_times_are_refused_before_they_are_written_out(more: str) -> None:
    doubled = "".join(f'[parts.p{i}]\nsolid = "p{i + 1} | p{i + 1}"\n{more}' for i in range(60))
    text = f'{SHAPES}{doubled}[parts.p60]\nsolid = "ball"\n'
    assert refusal(f'{text}[objects]\no = "box - p0"\n') == "parts.p0: expected at most 65536 primitives in one object"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        message = refusal(f'{text}[objects]\no = "{" | ".join(f"p{i}" for i in range(44, 50))}"\n')
    assert message == "objects.o: expected at most 65536 primitives in one object"
    # Sharing keeps a doubled part small as long as no object uses it.
    with pytest.warns(UserWarning, match="no object uses "):
        assert load_object(f'{text}[objects]\no = "box - ball"\n') == BOX - BALL


def test_objects_that_are_too_large_together_are_refused_as_a_whole() -> None:
    doubled = "".join(f'[parts.p{i}]\nsolid = "p{i + 1} | p{i + 1}"\n' for i in range(16))
    objects = "".join(f'o{i} = "p0"\n' for i in range(40))
    message = refusal(f'{SHAPES}{doubled}[parts.p16]\nsolid = "box"\n[objects]\nx = "ball"\n{objects}')
    assert message.startswith("objects: expected at most 1048576 primitives, got ")


def test_operators_of_parts_count() -> None:
    long = "box" + " - ball" * 60_000
    text = "".join(f'[parts.p{i}]\nsolid = "{long}"\n' for i in range(18))
    expected = "objects: expected at most 1048576 operators in objects and parts, got 1080001"
    assert refusal(f'{SHAPES}{text}[objects]\no = "box - ball"\n') == expected


def test_painted_copies_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    from raytracer.formats import part_sections

    monkeypatch.setattr(part_sections, "MAX_PAINTED", 1000)
    chain = "".join(f'[parts.p{i}]\nsolid = "p{i + 1} - box"\nmaterial = "red"\n' for i in range(60))
    message = refusal(f'{SHAPES}{chain}[parts.p60]\nsolid = "ball"\n[objects]\no = "p0"\n')
    assert "expected at most 1000 primitives and operators in all parts with a material, got 10" in message
    assert MAX_PAINTED > 1000


def test_the_points_of_all_polyhedra_are_bounded_before_any_hull_is_made() -> None:
    most = "[[0, 0, 0], " + "[1, 0, 0], " * 4095 + "]"
    shapes = "".join(f'[shapes.s{i}]\nmaterial = "red"\npolyhedron = {{ points = {most} }}\n' for i in range(5))
    message = refusal(f'{shapes}[objects]\no = "s0"\n')
    assert message.startswith("shapes.s4.polyhedron.points: expected polyhedra whose squared numbers of points have a")
    assert message.endswith(f"sum of at most {MAX_SQUARES}, got {MAX_SQUARES * 5 // 4} up to here")


LINES = """\
[shapes.a]
material = "red"
torus = { center = [0, 0, 0], axis = [0, 1, 0], major_radius = 2, minor_radius = 1 }
transform = [
  { translate = [1, 2, 3] }, # { rotate = [0] },
  { rotate = [0, 1, 0], degrees = 30, about = [
    1, 2,
    3] },
  { matrix = [
    [1, 0, 0, 0],
    [0, 1, 0, 0],
    [0, 0, 1, 0],
  ] }, { scale = [1, 2, 1], about = [0, 0, 0] }
]
[parts.p]
solid = "a"
transform = [{ scale = 2 },
  { scale = 3 }]
[objects]
o = "p"
"""


@pytest.mark.parametrize(
    ("old", "new", "keys", "line_has"),
    [
        ("translate = [1", "translate = [nan", ("shapes", "a", "transform", 0, "translate"), "{ translate"),
        ("{ translate = [1, 2, 3] }, #", "3, #", ("shapes", "a", "transform", 0), "  3, #"),
        ("degrees = 30", "degrees = inf", ("shapes", "a", "transform", 1, "degrees"), "{ rotate = [0, 1"),
        (", degrees = 30", "", ("shapes", "a", "transform", 1, "degrees"), "{ rotate = [0, 1"),
        ("    3] }", "    nan] }", ("shapes", "a", "transform", 1, "about"), "about = ["),
        ("[0, 0, 1, 0],", "[0, 0, 0, 0],", ("shapes", "a", "transform", 2, "matrix"), "{ matrix"),
        ("scale = [1, 2, 1]", "scale = [1, 0, 1]", ("shapes", "a", "transform", 3, "scale"), "scale = [1, 0"),
        ("scale = [1, 2, 1]", "shear = [1, 0, 1]", ("shapes", "a", "transform", 3, "shear"), "shear"),
        ("major_radius = 2", "major_radius = 1", ("shapes", "a", "torus", "minor_radius"), "torus"),
        ("{ scale = 3 }", "{ scale = -3 }", ("parts", "p", "transform", 1, "scale"), "scale = -3"),
        ('solid = "a"', 'solid = "b"', ("parts", "p", "solid"), 'solid = "b"'),
    ],
)
def test_an_error_has_the_line_of_its_key_in_lists_over_several_lines(
    tmp_path: Path, old: str, new: str, keys: tuple[str | int, ...], line_has: str
) -> None:
    assert old in LINES
    text = HEAD + LINES.replace(old, new, 1)
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(rt.InputError) as error:
        load(path)
    assert error.value.keys == keys
    assert error.value.line is not None and line_has in text.splitlines()[error.value.line - 1]


def test_a_moved_light_or_camera_leaves_all_other_lines_of_a_file_with_transforms_and_parts() -> None:
    for end in ("\n", "\r\n"):
        text = (HEAD + LINES).replace("\n", end)
        scene = loads(text)
        assert edit_positions(text, scene) == text
        turned = turn_light(turn_camera(scene, 0.3, 0.1), 0, 1.0, -0.2)
        edited = edit_positions(text, turned)
        changed = [
            (before, after) for before, after in zip(text.split(end), edited.split(end), strict=True) if before != after
        ]
        assert [before for before, _ in changed] == ["position = [0, 3, 6]", "position = [4, 7, 4]"]
        assert loads(edited) == turned != scene


# A part that is mirrored and painted.
PART = """\
[parts.q]
solid = "~p & box"
transform = [{ mirror = [1, 0, 0], about = [1, 2, 3] }]
material = "blue"
[objects]
second = "q | p"
"""


def test_two_thousand_mutated_files_with_transforms_and_parts_are_read_or_refused() -> None:
    rng = random.Random(3)
    pieces = ["[", "]", "{", "}", "=", '"', "-", "1e999", "1e-200", "nan", "0", "-1", "a", "p", "~", "|", ",", "\n"]
    shapes = "".join(
        f'[shapes.{kind}]\nmaterial = "red"\n{kind} = {{ {keys} }}\n' for kind, (keys, _) in PRIMITIVES.items()
    )
    text = HEAD + shapes + LINES.replace('"a"', f'"a - {" | ".join(PRIMITIVES)}"').replace("[objects]", PART)
    text += (
        "[instances.o]\npositions = [[0, 1, 2], [3, 4, 5]]\nscales = 2\nrotations = [[1, 0, 0, 0], [0.5, 1, 2, -3]]\n"
    )
    start = len(HEAD)
    count = 0
    for _ in range(2000):
        characters = list(text)
        for _ in range(rng.choice((1, 1, 1, 2, 5))):
            i = rng.randrange(start, len(characters))
            match rng.randrange(4):
                case 0:
                    characters[i] = chr(rng.randrange(32, 127))
                case 1:
                    del characters[i : i + rng.choice((1, 3, 40))]
                case 2:
                    characters.insert(i, rng.choice(pieces))
                case _:
                    characters[i:i] = characters[i : i + rng.randrange(60)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                loads("".join(characters))
                count += 1
            except rt.InputError as error:
                assert "\n" not in str(error) and len(str(error)) < 400
    assert 50 < count < 1900
