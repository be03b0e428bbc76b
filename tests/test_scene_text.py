"""The text of a scene file: messages find their line."""

import pytest

import raytracer as rt
from raytracer.scene_file import loads
from raytracer.scene_text import line_of, line_of_error

from . import scenes

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
"""


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("ambient", 1),
        ("camera", 2),
        ("camera.position", 3),
        ("camera.look_at", 2),
        ("lights[0].position", 5),
        ("lights[1]", 6),
        ("lights[1].color", 8),
        ("lights[2].color", None),
        ("materials.dark red.h", 11),
        ("shapes.a.sphere.radius", 13),
        ("shapes.ab", None),
        ("objects", None),
    ],
)
def test_a_key_is_found_on_its_line_or_on_that_of_what_holds_it(key: str, line: int | None) -> None:
    assert line_of(TEXT, key) == line
    assert line_of_error(TEXT, f"{key}: expected something else: that") == line


def test_an_error_of_toml_or_of_a_key_that_is_not_known_has_its_line() -> None:
    for new in ("h = = 32.0", "haze = 32.0"):
        text = scenes.ASSIGNMENT.read_text().replace("h = 32.0", new, 1)
        with pytest.raises(rt.InputError) as error:
            loads(text)
        assert line_of_error(text, str(error.value)) == text[: text.index(new)].count("\n") + 1
    text = 'a = "'
    with pytest.raises(rt.InputError) as error:
        loads(text)
    assert line_of_error(text, str(error.value)) == 1
