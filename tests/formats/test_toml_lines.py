"""Lines of a scene file: errors name the line of their key."""

import pickle
import random
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import raytracer as rt
from raytracer.core.validation import Keys
from raytracer.formats.scene_file import loads
from raytracer.formats.toml_lines import find_line
from tests import scenes

TEXT = """\
ambient = [1, 1, 1]
[camera] # not [materials.red]
position = [0, 3, 6]
[[lights]]
position = [1, 2, 3]
[[lights]]
position = [4, 5, 6]
color = [1,
  1, 2]
[ materials . "dark red" ]
h = 3
[shapes.a]
sphere = { center = [-1,
  2, 0], radius = 1.5 }
[materials."a: b"]
note = \"\"\"
[shapes.b]
h = "4\"\"\"
h = 4
[materials."\\u0061\\".c"]
ks.x = [ { a = 1, "b ]" = [ 1,
  2, # ] ,
  ] }, '# [',
  { a = 2.5, d = 1979-05-27T07:32:00Z },
]
[[lights.sub]]
a = 1
[[lights.sub]]
b = 1
"""


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        (("ambient",), 1),
        (("camera",), 2),
        (("camera", "position"), 3),
        (("camera", "look_at"), 2),
        (("lights", 0, "position"), 5),
        (("lights", 1), 6),
        (("lights", 1, "color"), 8),
        (("lights", 1, "color", 2), 9),
        (("lights", 2, "color"), None),
        (("materials", "dark red", "h"), 11),
        (("shapes", "a", "sphere", "radius"), 14),
        (("shapes", "ab"), None),
        (("objects",), None),
        (("materials", "a: b", "h"), 19),
        (("materials", "a: b", "kd"), 15),
        (("materials", 'a".c', "ks", "x", 0, "b ]", 1), 22),
        (("materials", 'a".c', "ks", "x", 2, "a"), 24),
        (("lights", 1, "sub", 1, "b"), 29),
        ((), None),
    ],
)
def test_find_line_returns_the_line_of_a_key_or_of_the_table_that_lacks_it(keys: Keys, line: int | None) -> None:
    assert find_line(TEXT, keys) == line
    assert find_line(TEXT.replace("\n", "\r\n"), keys) == line


class Writer:
    """A writer of random TOML, in which every number is the number of its own line."""

    NAMES = ("a", "b-1", '"c.d"', "'e\\f'", '"\\u0067\\"]"', '"h = 1 # {"', "3")

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.line = 1

    def text(self) -> str:
        lines = [self.entries("", 3)]
        for table in "AB":
            for _ in range(self.random.randint(1, 3)):
                lines += [
                    self.end(f"[[{table}]]"),
                    self.entries("", 3),
                    self.end(f"[{table} . x]"),
                    self.entries("", 2),
                ]
        lines += [self.end("['A B'.\"y\"]"), self.entries("", 4)]
        return "".join(lines)

    def entries(self, indent: str, most: int) -> str:
        names = self.random.sample(self.NAMES, self.random.randint(1, most))
        return "".join(
            f"{indent}{name}{self.random.choice(('', '.k', ' . k . l'))} = {self.value(3)}{self.end()}"
            for name in names
        )

    def value(self, depth: int) -> str:
        kind = self.random.choice(("number", "text", "list", "table")) if depth else "number"
        if kind == "text":  # a list of multi-line strings, with a number after them
            self.line += 2
            return f'[\'\'\'[x]\n]\'\'\', """\\""" = {{\n""", {self.line}]'
        if kind == "list":
            parts = (f"{self.value(depth - 1)}{self.random.choice((',', ', # ], ' + chr(10)))}" for _ in range(3))
            text = "["
            for part in parts:
                text += part
                self.line += part.endswith("\n")
            return text + "]"
        if kind == "table":
            names = self.random.sample(self.NAMES, 2)
            return "{ " + ", ".join(f"{name} = {self.value(depth - 1)}" for name in names) + " }"
        return str(self.line)

    def end(self, text: str = "") -> str:
        self.line += 1
        return text + self.random.choice(("", " # [z]", "  ")) + "\n"


def numbers_in(value: Any, keys: Keys = ()) -> Iterator[tuple[Keys, int]]:
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers_in(part, (*keys, key))
    elif isinstance(value, int):
        yield keys, value


@pytest.mark.slow
def test_find_line_returns_the_line_of_every_number_of_random_texts() -> None:
    for seed in range(300):
        text = Writer(seed).text()
        for keys, line in numbers_in(tomllib.loads(text)):
            assert find_line(text, keys) == line, (seed, keys, text)


def test_the_error_of_wrong_toml_or_of_an_unknown_key_has_its_line(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    for new in ("h = = 32.0", "haze = 32.0"):
        text = scenes.ASSIGNMENT.read_text().replace("h = 32.0", new, 1)
        file.write_text(text)
        with pytest.raises(rt.InputError) as error:
            rt.load(file)
        assert error.value.line == text[: text.index(new)].count("\n") + 1
    file.write_text('\n\na = "')
    with pytest.raises(rt.InputError) as error:
        rt.load(file)
    assert error.value.line == 3


@pytest.mark.parametrize("name", ["a: b", "unknown key `x` (known", "a.b", '"', "\\", "]", "é", "", "a'b", "\x1b[2J"])
def test_an_error_has_the_path_of_its_keys_whatever_their_names(tmp_path: Path, name: str) -> None:
    quoted = '"' + name.replace("\\", "\\\\").replace('"', '\\"').replace("\x1b", "\\u001b") + '"'
    text = scenes.ASSIGNMENT.read_text() + f"[materials.{quoted}]\nh = 1\nkd = 1.5e300\n"
    file = tmp_path / "scene.toml"
    file.write_text(text)
    with pytest.raises(rt.InputError) as error:
        rt.load(file)
    refusal = error.value
    assert (refusal.file, refusal.line, refusal.keys) == (str(file), text.count("\n"), ("materials", name, "kd"))
    assert str(refusal).endswith(f": {refusal.reason}") and str(refusal).isprintable()
    unpickled = pickle.loads(pickle.dumps(refusal))
    assert (str(unpickled), unpickled.keys, unpickled.line) == (str(refusal), refusal.keys, refusal.line)


def test_an_error_has_the_path_of_the_innermost_value() -> None:
    text = scenes.ASSIGNMENT.read_text() + '[materials.m]\nmodel = "lafortune"\nlobes = [{ cx = 1, cz = 1, n = -1 }]\n'
    with pytest.raises(rt.InputError) as error:
        loads(text)
    assert error.value.keys == ("materials", "m", "lobes", 0, "n")
    assert (error.value.file, error.value.line) == (None, None)
