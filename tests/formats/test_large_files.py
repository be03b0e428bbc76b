"""Files of the largest allowed size are read or refused within bounds of memory and time."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import raytracer as rt
from raytracer.formats.scene_file import MAX_BYTES, loads
from raytracer.formats.toml_text import parse_toml
from tests import scenes

# The memory limit. Python and NumPy alone take a few hundred MiB.
MEBIBYTES = 1400
# The time limit, many times the usual time, so that no busy machine fails. Without the bounds under test, a file would
# take minutes.
SECONDS = 60

HEAD = """\
[camera]
position = [0, 3, 6]
look_at = [0, 2, 0]
[materials.m]
kd = [0.6, 0.1, 0.1]
"""
SHAPE = '[shapes]\na = { material = "m", sphere = { center = [0, 0, 0], radius = 1 } }\n'
OBJECT = f"{HEAD}{SHAPE}[objects]\no = 'a'\n"

LOAD = """
import resource, sys, warnings
import raytracer as rt
warnings.simplefilter("ignore")
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]) << 20,) * 2)
try:
    scene = rt.load(sys.argv[1])
except rt.InputError as error:
    print(error)
else:
    print(f"read: {len(scene.objects)} objects, {len(scene.lights)} lights")
"""


def fill_file(piece: Callable[[int], str], head: str = "", tail: str = "") -> str:
    """Return `piece(0)`, `piece(1)`, ... between `head` and `tail`, as many as fit into the largest scene file."""
    parts, room = [], MAX_BYTES - len(head) - len(tail)
    for i in itertools.count():
        parts.append(piece(i))
        room -= len(parts[-1])
        if room < 0:
            return "".join((head, *parts[:-1], tail))
    raise AssertionError


def boxes() -> str:
    """Return a scene file of 14,000 boxes: each the intersection of one plane of its own and five shared planes."""
    normals = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
    sides = "".join(
        f"[shapes.s{k}]\nmaterial = 'm'\nplane = {{ normal = {list(n)}, offset = 1 }}\n" for k, n in enumerate(normals)
    )
    shapes = "".join(
        f"[shapes.box_{i}]\nmaterial = 'm'\nplane = {{ normal = [1, 0, 0], offset = -{i}.25 }} # {'-' * 120}\n"
        for i in range(14_000)
    )
    objects = "".join(f"o{i} = 'box_{i} & s1 & s2 & s3 & s4 & s5'\n" for i in range(14_000))
    return f"{HEAD}{sides}{shapes}[objects]\n{objects}"


def planes() -> str:
    """Return a scene file of boxes with six planes each, in the shortest form."""

    def box(i: int) -> str:
        return "".join(f"{side}{i}={{material='m',plane={{normal=[1,0,0],offset={i}}}}}\n" for side in "abcdef")

    return f"{HEAD}[shapes]\n{''.join(map(box, range(11_000)))}[objects]\n" + "".join(
        f"o{i}='{'&'.join(f'{side}{i}' for side in 'abcdef')}'\n" for i in range(11_000)
    )


SCENES: dict[str, tuple[Callable[[], str], str]] = {
    "boxes": (boxes, "read: 14000 objects"),
    "planes": (planes, "read: 11000 objects"),
    "lights": (lambda: fill_file(lambda i: "[[lights]]\nposition=[4,7,4]\n", OBJECT), "read: 1 objects, 1"),
    "places": (
        lambda: fill_file(lambda i: "[0,0,0],", f"{OBJECT}[instances.o]\npositions=[", "]\n"),
        "read: 1 objects",
    ),
    "objects": (lambda: fill_file(lambda i: f"{i}='a'\n", f"{HEAD}{SHAPE}[objects]\n"), "read: "),
    # tomllib takes quadratic time for a key whose quoted parts hold an escaped quote every 28 parts.
    "escaped": (lambda: ".".join(['"\\"".' + ".".join("a" * 28)] * 800) + " = 1", "at most 32 parts"),
    "escaped header": (lambda: f"[{'.'.join(['a', chr(34) * 2, chr(39) * 2] * 20_000)}]\n", "at most 32 parts"),
    "inline": (lambda: "a = { b = 1, " + ' . "#\\"" '.join("a" * 20_000) + " = 1 }", "at most 32 parts"),
    "after strings": (lambda: 'a = """"\\""""""\nb = \'\'\'""""\'\'\'\n' + "a." * 70_000 + "a = 1", "at most 32 parts"),
    "headers": (lambda: fill_file(lambda i: f"[{i}]\n"), "at most 262144 tables, got about"),
    "deep headers": (lambda: fill_file(lambda i: f"[{i}{'.a' * 31}]\n"), "at most 262144 tables"),
    "headers, keys": (lambda: fill_file(lambda i: f"[{i}]\na.a=1\n"), "at most 262144 tables"),
    "dotted": (lambda: fill_file(lambda i: f"{i}{'.a' * 31}=1\n"), "at most 262144 tables"),
    "long header": (lambda: fill_file(lambda i: f"{i}.a=1\n", f"[{'.'.join('b' * 32)}]\n"), "unknown key `b`"),
    "tables": (lambda: fill_file(lambda i: f"{i}={{}}\n"), "at most 262144 tables"),
    "brackets": (lambda: fill_file(lambda i: "[" * 200 + "]" * 200 + ",", "a=[", "]\n"), "at most 32 brackets"),
    "braces": (lambda: fill_file(lambda i: "{a=" * 90 + "1" + "}" * 90 + ",", "a=[", "]\n"), "at most 32 brackets"),
    "numbers": (lambda: fill_file(lambda i: "1,", "a=[", "]\n"), "unknown key `a`"),
    "lists": (lambda: fill_file(lambda i: "[],", "a=[", "]\n"), "unknown key `a`"),
    "digits": (lambda: fill_file(lambda i: "1" * 1000, "a = "), "numbers of thousands of digits"),
    "hexadecimal": (lambda: fill_file(lambda i: "f" * 1000, "a = 0x"), "unknown key `a`"),
    "fraction": (lambda: fill_file(lambda i: "1" * 1000, "a = 0."), "unknown key `a`"),
    "a key": (lambda: fill_file(lambda i: "x" * 1000, OBJECT, "=1\n"), 'objects."xxx'),
    "a string": (lambda: fill_file(lambda i: "x" * 1000, "a = '"), "expected TOML: "),
    "a text": (lambda: fill_file(lambda i: "x" * 1000, 'a = """'), "expected TOML: "),
    "a comment": (lambda: fill_file(lambda i: "x" * 1000, "a = 1 #"), "unknown key `a`"),
    "quotes": (lambda: fill_file(lambda i: "\"'", "a = "), "expected TOML: "),
    "backslashes": (lambda: fill_file(lambda i: "\\", 'a = """'), "expected TOML: "),
    "a line": (
        lambda: fill_file(lambda i: "a.b ", f"{HEAD}{SHAPE}[objects]\no = 'b' #"),
        "expected the name of a shape",
    ),
    "no line": (
        lambda: fill_file(lambda i: "#\n", f"{HEAD}{SHAPE}[objects]\no = 'b'\n"),
        "expected the name of a shape",
    ),
    "expressions": (
        lambda: fill_file(lambda i: f"o{i}='{'a|' * 1000}a'\n", f"{HEAD}{SHAPE}[objects]\n"),
        "at most 1048576 operators in all",
    ),
    "complements": (
        lambda: fill_file(lambda i: f"o{i}='{('~' * 199 + 'a-') * 1000}a'\n", f"{HEAD}{SHAPE}[objects]\n"),
        "at most 1048576 operators in all",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_file_of_any_content_is_read_or_refused_within_bounds(tmp_path: Path, name: str) -> None:
    make, message = SCENES[name]
    path = tmp_path / "scene.toml"
    path.write_text(make())
    command = [sys.executable, "-c", LOAD, str(path), str(MEBIBYTES)]
    ended = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=SECONDS)
    assert ended.returncode == 0, ended.stderr
    assert message in ended.stdout and ended.stdout.count("\n") == 1 and len(ended.stdout) < 1200


def test_dots_and_brackets_in_strings_and_comments_do_not_count() -> None:
    dots, opened = ".".join("a" * 50), "[{" * 50
    text = f"""\
a = "{dots} \\" {opened}" # " {dots}{opened}
b = '{dots}\\' # ' {opened}
c = \"\"\"{opened}"" \\\"\"\"
{dots}\"\"\"\"\" # {dots}
d = '''{opened}''
{dots}''''' # {opened}
"#.'[" . '"' = 1
"""
    document = parse_toml(text)
    assert [*document] == ["a", "b", "c", "d", "#.'["] and document["c"].endswith(f'{dots}""')
    assert parse_toml(".".join("a" * 32) + " = 1") and parse_toml(f"a = {'[' * 32}1.5{']' * 32}")
    for wrong in (".".join("a" * 33) + " = 1", f"a = {'[' * 33}1.5{']' * 33}"):
        with pytest.raises(rt.InputError, match="at most 32"):
            parse_toml(f"{text}{wrong}")


def test_a_shape_with_dotted_keys_is_no_mistake() -> None:
    text = f"{OBJECT}[shapes.b]\nmaterial = 'm'\nsphere.center = [0, 0, 0]\nsphere.radius = 1\n"
    with pytest.warns(UserWarning, match="no object uses the shape b"):
        assert len(loads(text).objects) == 1


MOVE = """
import resource, sys
from raytracer.formats.scene_file import edit_positions, loads
from raytracer.app.viewer.orbit import turn_camera, turn_light
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]) << 20,) * 2)
text = open(sys.argv[1]).read()
scene = turn_light(turn_camera(loads(text), 0.3, 0.1), 1999, 0.1, 0.1)
print(loads(edit_positions(text, scene)) == scene)
"""


def test_the_lights_and_the_camera_of_the_largest_file_are_moved_within_bounds(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    lights = "[[lights]]\nposition = [4, 7, 4] # here\n" * 2000
    path.write_text(fill_file(lambda i: f"# [camera] {i}\n", f"{OBJECT}{lights}"))
    command = [sys.executable, "-c", MOVE, str(path), str(MEBIBYTES)]
    ended = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=SECONDS)
    assert ended.stdout == "True\n", ended.stderr
