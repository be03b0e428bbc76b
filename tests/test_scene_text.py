"""The text of a scene file: messages find their line, and moving the camera keeps the rest as it is."""

import pytest

import raytracer as rt
from raytracer.scene_file import loads
from raytracer.scene_text import line_of, line_of_error, moved
from raytracer.turntable import turn_camera, turn_light

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


@pytest.mark.parametrize(
    "edit",
    [
        ("", ""),
        ("[[lights]]\nposition = [4.0, 7.0, 4.0]\ncolor = [1.0, 1.0, 1.0]", "lights.0"),
        ("[camera]\nposition = [0.0, 3.0, 6.0]\n", "[camera]\nposition = [\n  0, # left\n  3.0, 6 ]\n"),
        ("\n", "\r\n"),
    ],
)
def test_the_text_of_a_moved_scene_loads_as_that_scene_and_keeps_all_else(edit: tuple[str, str]) -> None:
    text = scenes.ASSIGNMENT.read_text()
    if edit[1] == "lights.0":  # lights as an array of inline tables
        text = "lights = [{ position = [4, 7, 4] }, { position = [0, 9, 0] }] # two\n" + text.replace(edit[0], "", 1)
    else:
        text = text.replace(*edit)
    scene = loads(text)
    assert moved(text, scene) == text
    turned = turn_light(turn_camera(scene, 0.3, 0.1), len(scene.lights) - 1, 1.0, -0.2)
    again = moved(text, turned)
    assert loads(again) == turned != scene
    for comment in ("# Ia", "# the solid half-space dot(n, x) <= offset", "# two" if "# two" in text else "#"):
        assert comment in again
    assert sum(a != b for a, b in zip(text.split(), again.split(), strict=False)) > 0
