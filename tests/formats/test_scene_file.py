"""Scene files: a valid file loads; an invalid file is refused in one line with the place of the mistake."""

import contextlib
import io
import random
import re
import shutil
import warnings
from pathlib import Path

import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.app.viewer.orbit import scale_camera, turn_camera, turn_light
from raytracer.formats.scene_file import companion_paths, edit_positions, examples, load, loads
from raytracer.scene.solids.kinds import KINDS
from tests import scenes
from tests.scenes import GOOD


def test_the_assignment_file_has_the_scene_of_the_course_assignment() -> None:
    scene = scenes.assignment()
    red, blue, green, grey = scene.materials
    assert [m.name for m in scene.materials] == ["red", "blue", "green", "grey"]
    lens = rt.Sphere((-1, 2, 0), 1.5, red) & rt.Sphere((1, 2, 0), 1.5, red)
    solid = (lens | rt.Sphere((0, 2.7, -0.3), 0.8, blue)) - rt.Sphere((0, 2.8, 0.3), 0.8, green)
    assert scene.objects == (solid, rt.Plane((0, 1, 0), 0.0, grey))
    assert scene.name == "assignment" and scene.lights == (rt.PointLight((4, 7, 4), radius=0.4),)


def test_an_example_loads_by_its_bare_name() -> None:
    assert "assignment" in examples() and load("assignment") == scenes.assignment()


def test_a_shape_that_no_object_uses_is_a_warning() -> None:
    with pytest.warns(UserWarning, match="no object uses the shape b"):
        loads(GOOD.replace('"a - b"', '"a"'))


def test_two_materials_with_equal_numbers_stay_separate() -> None:
    text = GOOD.replace("[shapes.b]", "[materials.twin]\nkd = [0.64, 0.08, 0.08]\n[shapes.b]")
    assert [m.name for m in loads(text).materials] == ["red", "twin"]


END = 'one = "a - b"'
# Mistakes: the text to replace, its replacement, and a part of the error line.
BAD = [
    ("background", "backgroud", "unknown key `backgroud` (known: camera"),
    ("[objects]", "[object]", "unknown key `object` (known: camera"),
    ("kd = ", 'name = "rot"\nkd = ', "materials.red: unknown key `name` (known: model, ka, kd, ks, h, le)"),
    ("look_at = [0, 2, 0]", "look_at = [0, 2, 0]\nzoom = 2", "camera: unknown key `zoom`"),
    ("kd = ", "diffuse = ", "materials.red: unknown key `diffuse`"),
    ("radius = 1.5", "radius = 1.5, hole = 1", "shapes.a.sphere: unknown key `hole` (known: center, radius)"),
    ("position = [0, 3, 6]", 'position = "here"', "camera.position: expected 3 numbers within +-1e+12, got 'here'"),
    ("position = [0, 3, 6]", "position = [0, 3]", "camera.position"),
    ("radius = 1.5", "radius = true", "shapes.a.sphere.radius"),
    ("radius = 1.5", "radius = 0", "shapes.a.sphere.radius: expected a number above 0"),
    ("radius = 1.5", "radius = -1.5", "shapes.a.sphere.radius: expected a number above 0"),
    ("radius = 1.5", "radius = nan", "shapes.a.sphere.radius"),
    ("radius = 1.5", "radius = inf", "shapes.a.sphere.radius"),
    ("radius = 1.5", "radius = 1e300", "shapes.a.sphere.radius"),
    ("radius = 1.5", "radius = 1" + "0" * 400, "shapes.a.sphere.radius"),
    ("radius = 1.5", "radius = 1" + "0" * 5000, "digits"),
    ("-1.0, 2.0, 0.0", "-1.0, nan, 0.0", "shapes.a.sphere.center"),
    ("kd = [0.64, 0.08", "kd = [0.64, -0.08", "materials.red.kd"),
    ("kd = ", "h = -1\nkd = ", "materials.red.h"),
    ("kd = ", 'model = "gouraud"\nkd = ', "materials.red.model"),
    ("position = [4.0", "color = [1, 1, -1]\nposition = [4.0", "lights[0].color"),
    ("position = [4.0", "position = [inf", "lights[0].position"),
    ("normal = [0, 1, 0]", "normal = [0, 0, 0]", "shapes.b.plane.normal"),
    ("look_at = [0, 2, 0]", "look_at = [0, 2, 0]\nvertical_fov = 180", "camera.vertical_fov"),
    ("look_at = [0, 2, 0]", "look_at = [0, 2, 0]\nvertical_fov = 0", "camera.vertical_fov"),
    ("look_at = [0, 2, 0]", "look_at = [0, 3, 6]", "camera.look_at"),
    ("look_at = [0, 2, 0]", "look_at = [0, 9, 6]", "camera.up"),
    (
        "look_at = [0, 2, 0]",
        'look_at = [0, 2, 0]\nprojection = "flat"',
        "camera.projection: expected one of perspective,",
    ),
    ("look_at = [0, 2, 0]", "look_at = [0, 2, 0]\nheight = 3", "camera.height: expected no height without projection"),
    (
        "look_at = [0, 2, 0]",
        'look_at = [0, 2, 0]\nprojection = "orthographic"',
        "camera.height: missing; expected the picture's",
    ),
    (
        "look_at = [0, 2, 0]",
        'look_at = [0, 2, 0]\nprojection = "orthographic"\nheight = 3\nvertical_fov = 30',
        "camera.vertical_fov: expected no vertical_fov with an orthographic projection",
    ),
    ('[objects]\none = "a - b"', "", "missing key `objects`"),
    ('one = "a - b"', "", "objects: expected at least one"),
    ('material = "red"', 'material = "rot"', "shapes.a.material"),
    ('"a - b"', '"a - c"', 'objects.one: expected the name of a shape or a part, got "c"'),
    ('"a - b"', '"a - one"', 'objects.one: expected the name of a shape or a part, got "one" (an object'),
    ('"a - b"', '"a b"', "objects.one: column 3"),
    ('"a - b"', '""', "objects.one: column 1"),
    ('"a - b"', '"(a"', "objects.one: column 3"),
    ('"a - b"', '"a + b"', "objects.one: column 3"),
    ('"a - b"', '"' + "(" * 10_000 + "a" + ")" * 10_000 + '"', "objects.one: column 201"),
    ('"a - b"', '"' + "~" * 10_000 + 'a"', "objects.one: column 201"),
    ('"a - b"', '"a' + " | a" * 250_000 + '"', "objects.one: expected an expression of at most"),
    ('"a - b"', '"a' + " | a" * 100_000 + '"', "objects.one: expected at most 65536 primitives in one object"),
    (
        '"a - b"',
        "\"__import__('os').system('true')\"",
        'objects.one: expected the name of a shape or a part, got "__import__"',
    ),
    ('"a - b"', '"vec3(1.0); } void main() {"', 'objects.one: expected the name of a shape or a part, got "vec3"'),
    ('"a - b"', "3", "objects.one: expected a string"),
    ("background", "a." * 70_000 + "a", "keys of at most 32 parts"),
    (
        "[shapes.a]",
        "[shapes.a]\nplane = { normal = [0, 1, 0], offset = 0 }",
        f"shapes.a: expected one of {', '.join(KINDS)}, got plane and sphere",
    ),
    (
        "sphere = { center = [-1.0, 2.0, 0.0], radius = 1.5 }",
        "",
        f"shapes.a: expected one of {', '.join(KINDS)}, got none of them",
    ),
    ("[shapes.a]", '[shapes."a b"]', 'shapes."a b": expected a name of letters, digits and "_"'),
    ("[[lights]]", "[lights]", "lights: expected a list, got a table"),
    (
        "[[lights]]",
        "[[lights]]\nradius = -1",
        "lights[0].radius: expected 0, for a point, or a number in [1e-12, 1e+12]",
    ),
    (
        "[[lights]]",
        '[[lights]]\nradius = "1"',
        "lights[0].radius: expected 0, for a point, or a number in [1e-12, 1e+12]",
    ),
    ("[[lights]]", '[[lights]]\nfalloff = "linear"', "lights[0].falloff: expected 'none' or 'inverse_square', got"),
    ("[[lights]]", "[[lights]]\nfalloff = 2", "lights[0].falloff: expected 'none' or 'inverse_square', got 2"),
    ("[[lights]]", "[[lights]]\nsize = 1", "lights[0]: unknown key `size` (known: position, color, radius, falloff)"),
    (
        END,
        f"{END}\n[instances.two]\npositions = [[0, 0, 0]]",
        "instances.two: expected the name of an object (known: one)",
    ),
    (END, f"{END}\n[instances]\none = 3", "instances.one: expected a table, got a number"),
    (END, f"{END}\n[instances.one]\nposition = []", "instances.one: unknown key `position` (known: positions, scales"),
    (END, f"{END}\n[instances.one]\nscales = 2", "instances.one: expected one of positions or file, got neither"),
    (END, f'{END}\n[instances.one]\nfile = "a.csv"\npositions = []', "expected one of positions or file, got both"),
    (END, f'{END}\n[instances.one]\nfile = "a.csv"\nscales = 2', "instances.one.scales: expected scales in 'a.csv'"),
    (END, f"{END}\n[instances.one]\npositions = []", "instances.one.positions: expected at least one point"),
    (END, f'{END}\n[instances.one]\npositions = "here"', "instances.one.positions: expected numbers, got 'here'"),
    (END, f"{END}\n[instances.one]\npositions = [[0, 0, 0],\n[0, 1]]", "instances.one.positions[1]: expected"),
    (END, f"{END}\n[instances.one]\npositions = [[0, true, 0]]", "instances.one.positions[0]: expected 3 numbers"),
    (END, f"{END}\n[instances.one]\npositions = [[0, nan, 0]]", "instances.one.positions[0]: expected 3 numbers"),
    (
        END,
        f"{END}\n[instances.one]\npositions = [[0, 0, 0]]\nscales = [1, 2]",
        "instances.one.scales: expected one numb",
    ),
    (
        END,
        f"{END}\n[instances.one]\npositions = [[0, 0, 0]]\nscales = [-1]",
        "instances.one.scales[0]: expected a numb",
    ),
    (
        END,
        f'{END}\n[instances.one]\npositions = [[0, 0, 0]]\nscales = "2"',
        "instances.one.scales: expected numbers, got '2'",
    ),
    (
        END,
        f"{END}\n[instances.one]\npositions = [[0, 0, 0]]\nrotations = [[1, 0, 0, 0], [1, 0, 0, 0]]",
        "instances.one.rotations: expected 1 quaternions, an array (1, 4), or as many matrices, (1, 3, 3)",
    ),
    (
        END,
        f"{END}\n[instances.one]\npositions = [[0, 0, 0]]\nrotations = [[1, 0, 0, '0']]",
        "instances.one.rotations[0]: expected finite numbers: a quaternion w, x, y, z, or a matrix, 3 rows of 3,",
    ),
    (
        END,
        f"{END}\n[instances.one]\nfile = 'a.csv'\nrotations = [[1, 0, 0, 0]]",
        "instances.one.rotations: expected rotations in 'a.csv' only",
    ),
    (END, f"{END}\n[instances.one]\nfile = 1", "instances.one.file: expected a string, got 1"),
    (
        END,
        f'{END}\n[instances.one]\nfile = "a.csv"',
        "instances.one.file: a.csv: expected a file beside the scene file: No",
    ),
    (
        END,
        f'{END}\n[instances.one]\nfile = "../a.csv"',
        "instances.one.file: expected the plain name of a .csv or .npz",
    ),
    (END, f"{END}\n[settings]\nsample = 3", "settings: unknown key `sample` (known: samples, "),
    (END, f"{END}\n[settings]\nsamples = 1.5", "settings.samples: expected a whole number in [1, 65536], got 1.5"),
    (END, f"{END}\n[settings]\nsamples = true", "settings.samples: expected a whole number in [1, 65536], got True"),
    (
        END,
        f"{END}\n[settings]\nmax_error = 0",
        "settings.max_error: expected a finite number above 0 (linear radiance)",
    ),
    (END, f"{END}\n[settings]\ntime = nan", "settings.time: expected a finite number above 0 (seconds), got nan"),
    (END, f'{END}\n[settings]\ntime = "1"', "settings.time: expected a finite number above 0 (seconds), got '1'"),
    (END, f"{END}\n[settings]\ntime = 1\nadaptive = 1", "settings.adaptive: cannot be combined with max_error or time"),
    (END, f"{END}\n[settings]\nshading = 3", "settings.shading: expected one of "),
    (END, f"{END}\n[settings]\nprecision = 64.0", "settings.precision: expected one of 32, 64, got 64.0"),
    (END, f"{END}\n[settings]\nprecision = 16", "settings.precision: expected one of 32, 64, got 16"),
    (END, f'{END}\n[settings]\nquality = "best"', "settings.quality: expected one of draft, normal, high, reference"),
    (END, f"{END}\n[settings]\nquality = []", "settings.quality: expected one of draft, normal, high, reference"),
    (END, f"{END}\n[settings]\nsize = [1280, 0]", "settings.size: expected [width, height] in whole pixels in [1, "),
    (END, f'{END}\n[settings]\nsize = "1280x720"', "settings.size: expected [width, height] in whole pixels in [1, "),
    (END, f"{END}\n[[settings]]\nsamples = 3", "settings: expected a table, got a list"),
    ("background", "settings = 3\nbackground", "settings: expected a table, got a number"),
    ("[objects]", "[objects", "expected TOML"),
    ("background = ", "background = " + "[" * 5000, "expected TOML"),
]


@pytest.mark.parametrize(
    ("without", "keys", "line_has"),
    [
        ("[objects]", ("objects",), None),
        ("look_at", ("camera", "look_at"), "[camera]"),
        ("material =", ("shapes", "a", "material"), "[shapes.a]"),
    ],
)
def test_the_error_of_a_missing_key_has_the_path_of_the_key_and_the_line_of_its_table(
    tmp_path: Path, without: str, keys: tuple[str, ...], line_has: str | None
) -> None:
    lines = """\
[camera]
position = [0, 3, 6]
look_at = [0, 2, 0]
[shapes.a]
sphere = { center = [0, 0, 0], radius = 1 }
material = "m"
[materials.m]
[objects]
""".splitlines()
    lines = [line for line in lines if not line.startswith(without)]
    file = tmp_path / "scene.toml"
    file.write_text("\n".join(lines))
    with pytest.raises(rt.InputError) as error:
        load(file)
    assert error.value.keys == keys and error.value.reason == f"missing key `{keys[-1]}`"
    line = next((i for i, line in enumerate(lines, 1) if line_has and line.startswith(line_has)), None)
    assert error.value.line == line


def test_the_settings_of_a_file_are_not_part_of_its_scene(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(GOOD)
    plain = load(file)
    assert rt.load_settings(file) == rt.Settings()
    file.write_text(GOOD + '[settings]\nmax_error = 0.01\nshadows = "soft"\nsize = [8, 8]\n')
    assert load(file) == plain
    assert rt.load_settings(file) == rt.Settings(samples=4096, max_error=0.01, shadows="soft")
    file.write_text(GOOD + '[settings]\nquality = "normal"\nsamples = 9\n')
    assert rt.load_settings(file) == rt.Settings(samples=9, max_error=rt.quality("normal").max_error)
    assert rt.load_settings("assignment") == rt.Settings()
    file.write_text(GOOD + "[settings]\nbounces = 99\n")
    for read in (load, rt.load_settings):
        with pytest.raises(rt.InputError, match=rf"^{file}:{GOOD.count(chr(10)) + 2}: settings.bounces: expected"):
            read(file)


def render_status(path: Path, *options: str) -> tuple[int, str]:
    """Render `path`; return the exit status and standard error."""
    errors = io.StringIO()
    with contextlib.redirect_stderr(errors):
        status = main(["render", str(path), "-o", str(path.with_suffix(".png")), "--size", "8x8", *options])
    return status, errors.getvalue()


@pytest.mark.parametrize(("old", "new", "message"), BAD, ids=[message[:40] for _, _, message in BAD])
def test_an_invalid_scene_file_is_refused_in_one_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    path = tmp_path / "scene.toml"
    path.write_text(GOOD.replace(old, new, 1))
    status, errors = render_status(path)
    assert status == 2
    match = re.match(rf"raytracer: {path}:(\d*):? ", errors)
    assert match and errors.count("\n") == 1 and len(errors) < 400
    assert message in errors
    # A missing key, or a table that is wrong as a whole, is reported on the line of the table.
    if match[1] and not message.startswith(("camera.up", "camera.height: missing", "objects: ", "shapes.a: ")):
        first = GOOD[: GOOD.index(old)].count("\n") + 1
        assert first <= int(match[1]) <= first + new.count("\n")
    assert list(tmp_path.iterdir()) == [path], "nothing written"


def test_a_scene_beyond_the_limits_of_the_driver_or_the_evaluator_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(GOOD + "[[lights]]\nposition = [1, 2, 3]\n" * 5000)
    status, errors = render_status(path)
    assert status == 2 and "lights (this driver's uniform block), got 5001" in errors
    path.write_text(GOOD.replace('"a - b"', '"a' + " - a" * 30 + '"'))
    status, errors = render_status(path, "--evaluator", "roth")
    assert status == 2 and "loops for roth" in errors and "the other evaluators have no such limit" in errors
    path.write_text(GOOD.replace('"a - b"', '"a - b' + " | a" * 511 + '"'))
    for option in (("--evaluator", "walk"), ("--precision", "64")):
        status, errors = render_status(path, *option)
        assert status == 2 and "expected at most 512 primitives for" in errors and "got 513" in errors
    assert render_status(path)[0] == 0


@pytest.mark.parametrize("data", [b"\xff\xfe", b"\x00" * 100, b""])
def test_bytes_that_are_not_a_scene_are_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(data)
    status, errors = render_status(path)
    assert status == 2 and errors.count("\n") == 1


def test_a_control_character_in_a_name_does_not_reach_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(GOOD.replace("[shapes.a]", '[shapes."\\u001b[2J\\n"]'))
    status, errors = render_status(path)
    assert status == 2 and errors.count("\n") == 1 and "\x1b" not in errors


@pytest.mark.slow
def test_two_thousand_mutated_scene_files_end_in_status_0_or_2(tmp_path: Path) -> None:
    rng = random.Random(2)
    path = tmp_path / "scene.toml"
    pieces = ["[", "]", "{", "}", "=", '"', "-", "1e999", "nan", "0", "-1", "a", "~", "|", "(", ")", "\n", "[objects]"]
    # The pipe elbow without its settings, which ask for soft shadows.
    elbow = scenes.ASSIGNMENT.with_stem("elbow").read_text().partition('shadows = "soft"')[0]
    texts = scenes.ASSIGNMENT.read_text(), elbow, scenes.ASSIGNMENT.with_stem("turntable").read_text()
    statuses = []
    for k in range(2000):
        characters = list(texts[k % 3])
        for _ in range(rng.choice((1, 1, 1, 2, 5))):
            i = rng.randrange(len(characters))
            match rng.randrange(4):
                case 0:
                    characters[i] = chr(rng.choice((rng.randrange(32, 127), rng.randrange(0x110000 - 0x800))))
                case 1:
                    del characters[i : i + rng.choice((1, 3, 40))]
                case 2:
                    characters.insert(i, rng.choice(pieces))
                case 3:
                    characters[i:i] = characters[i : i + rng.randrange(60)]
        path.write_text("".join(characters), encoding="utf-8", errors="replace")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            status, errors = render_status(path)
        assert status in (0, 2), errors
        picture = path.with_suffix(".png")
        assert picture.exists() == (status == 0)
        picture.unlink(missing_ok=True)
        lines = [line for line in errors.splitlines() if not line.startswith("raytracer: warning: ")]
        assert len(lines) == (status == 2) and all(line.startswith(f"raytracer: {path}:") for line in lines)
        statuses.append(status)
    assert 100 < statuses.count(0) < 1900


LAYOUTS = [
    GOOD[: GOOD.index("[materials")],
    """camera = { position = [0, 3, 6], look_at = [0, 2, 0] }
lights = [{ position = [1, 2, 3] }, { position = [2, 3, 4] }] # two
""",
    """camera.position = [0, 3, 6]
"camera"."look_at" = [0, 2, 0]
[[lights]]
position = [1, 2, 3] # a comment
""",
    """[ camera ] # another
"position" = [ 0, 3, 6, ] # a third
look_at = [0, 2, 0]
[[lights]]
color = [1,1,2]
position = [1, 2, 3]
""",
]


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_edited_text_loads_as_the_moved_scene_and_keeps_all_other_lines(layout: str, end: str) -> None:
    text = (layout + GOOD[GOOD.index("[materials") :]).replace("\n", end)
    scene = loads(text)
    assert edit_positions(text, scene) == text
    turned = turn_light(turn_camera(scene, 0.3, 0.1), len(scene.lights) - 1, 1.0, -0.2)
    again = edit_positions(text, turned)
    assert loads(again) == turned != scene
    lines = list(zip(text.split(end), again.split(end), strict=True))
    assert all(before == after or "position" in before for before, after in lines)


def test_instances_of_a_file_equal_instances_of_python_and_stay_when_lights_move(tmp_path: Path) -> None:
    text = GOOD + "[instances.one]\npositions = [[1, 2, 3], [0, 0, 0]] # two\nscales = [1, 0.5]\n"
    scene, (solid,) = loads(text), loads(GOOD).objects
    assert isinstance(solid, rt.Solid)
    assert scene.objects == (rt.Instances(solid, [[1, 2, 3], [0, 0, 0]], [1, 0.5]),)
    turned = turn_light(scene, 0, 1.0, -0.2)
    assert loads(edit_positions(text, turned)) == turned != scene
    one_scale = loads(text.replace("[1, 0.5]", "2"))
    assert one_scale.objects == (rt.Instances(solid, [[1, 2, 3], [0, 0, 0]], 2),)
    quaternions = [[1, 0, 0, 0], [0.5, -0.5, 0.5, 2]]
    matrices = [[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[1, 0, 0], [0, -1, 0], [0, 0, -1]]]
    for rotations in (quaternions, matrices):
        rotated = loads(f"{text}rotations = {rotations}\n")
        assert rotated.objects == (rt.Instances(solid, [[1, 2, 3], [0, 0, 0]], [1, 0.5], rotations),)

    in_file = GOOD + '[instances.one]\nfile = "places.csv"\n'
    (tmp_path / "places.csv").write_text("x,y,z,scale\n1,2,3,1\n0,0,0,0.5\n")
    (tmp_path / "scene.toml").write_text(in_file)
    assert load(tmp_path / "scene.toml") == scene
    (tmp_path / "scene.toml").write_text(edit_positions(in_file, turned, tmp_path))
    assert load(tmp_path / "scene.toml") == turned
    with pytest.raises(rt.InputError, match=r"^instances.one.file: expected positions: .* load\(\) the scene's file"):
        loads(in_file)


def test_the_example_many_has_a_thousand_instances_over_the_ground() -> None:
    lens, ground = load("many").objects
    assert isinstance(lens, rt.Instances) and len(lens) == 1000 and isinstance(ground, rt.Plane)


def test_every_example_is_written_back_with_moved_lights_and_camera(tmp_path: Path) -> None:
    for name, path in examples().items():
        scene = load(path)
        turned = turn_light(turn_camera(scene, 0.3, 0.1), 0, 1.0, -0.2)
        (tmp_path / path.name).write_text(edit_positions(path.read_text(), turned, path.parent))
        for companion in companion_paths(path, path.read_text()):
            shutil.copy(companion, tmp_path)
        assert load(tmp_path / path.name) == turned != scene, name


def test_a_text_without_the_moved_light_is_refused() -> None:
    other = loads(GOOD.replace("[[lights]]\nposition = [4.0, 7.0, 4.0]", ""))
    with pytest.raises(RuntimeError, match="TOML layout"):
        edit_positions(GOOD, other)


def test_a_file_without_a_camera_frames_its_objects_and_gets_the_camera_that_is_moved() -> None:
    text = GOOD.replace("[camera]\nposition = [0, 3, 6]\nlook_at = [0, 2, 0]\n", "")
    assert text != GOOD
    scene = loads(text)
    assert scene.camera == rt.Camera.framing(scene)
    lit = turn_light(scene, 0, 1.0, -0.2)
    assert "[camera]" not in edit_positions(text, lit)
    moved = turn_camera(lit, 0.3, 0.1)
    edited = edit_positions(text, moved)
    assert edited.count("[camera]") == 1 and loads(edited).camera == moved.camera
    windows = edit_positions(text.replace("\n", "\r\n"), moved)
    assert windows == edited.replace("\n", "\r\n"), "the table has the line ends of the file"


def test_the_height_of_a_moved_orthographic_camera_is_written() -> None:
    text = GOOD.replace("look_at = [0, 2, 0]", 'look_at = [0, 2, 0]\nprojection = "orthographic"\nheight = 4 # high')
    moved = scale_camera(turn_camera(loads(text), 0.3, 0.1), 0.5)
    edited = edit_positions(text, moved)
    assert "height = 2.0 # high" in edited and loads(edited).camera == moved.camera
