"""Paths of values in scene files: a changed document equals the file with the value written into it."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.formats.scene_file import SceneDocument, find_scene, parse_document, read_document
from raytracer.formats.scene_paths import parse_path, replace_value
from tests.scenes import GOOD


def document(text: str = GOOD) -> SceneDocument:
    return parse_document(Path("good.toml"), text)


@pytest.mark.parametrize(
    ("path", "value", "old", "new"),
    [
        ("camera.position", (0, 4, 6), "position = [0, 3, 6]", "position = [0, 4, 6]"),
        ("camera.position.1", 4.5, "position = [0, 3, 6]", "position = [0, 4.5, 6]"),
        ("shapes.a.sphere.radius", 1.25, "radius = 1.5", "radius = 1.25"),
        ("camera.vertical_fov", 30, "look_at = [0, 2, 0]", "look_at = [0, 2, 0]\nvertical_fov = 30"),
        ("objects.one", "b - a", '"a - b"', '"b - a"'),
        ("materials.'red'.kd", 0.25, "kd = ", "kd = 0.25 # "),
    ],
)
def test_a_changed_document_has_the_scene_of_the_changed_text(path: str, value: Any, old: str, new: str) -> None:
    changed = document().change({path: value})
    assert changed.scene == document(GOOD.replace(old, new, 1)).scene != document().scene


def test_the_tables_of_the_file_stay_as_they_are() -> None:
    tables = {"camera": {"position": [0, 3, 6]}, "lights": [{"radius": 1}]}
    changed = replace_value(tables, parse_path("lights.0.radius"), 2)
    assert changed == {"camera": {"position": [0, 3, 6]}, "lights": [{"radius": 2}]}
    assert tables["lights"] == [{"radius": 1}] and changed["camera"] is tables["camera"]


def test_settings_can_be_changed_in_a_file_without_settings() -> None:
    assert document().change({"settings.samples": 9}).section.settings.resolve().samples == 9


def test_a_scene_shares_the_objects_that_do_not_depend_on_the_changed_values() -> None:
    many = read_document(find_scene("many"))
    assert many.change({"lights.0.position": (1, 2, 3)}).scene.objects is many.scene.objects


def test_a_companion_file_is_not_read_again_for_a_changed_solid(tmp_path: Path) -> None:
    for suffix in (".toml", ".csv"):
        shutil.copy(find_scene("many").with_suffix(suffix), tmp_path)
    many = read_document(tmp_path / "many.toml")
    (tmp_path / "many.csv").unlink()
    before, moved = many.scene.objects[0], many.change({"shapes.a.sphere.radius": 0.75}).scene.objects[0]
    assert isinstance(before, rt.Instances) and isinstance(moved, rt.Instances) and moved.solid != before.solid
    assert np.array_equal(moved.positions, before.positions) and np.array_equal(moved.scales, before.scales)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("", 1, "expected a path such as"),
        ("lights..0", 1, "expected a path such as"),
        ("a." * 20 + "b", 1, "expected a path such as"),
        ("light.0.radius", 1, 'got light (known: camera, .*; did you mean "lights"?'),
        ("animation.frames", 1, "expected a path that begins with a table of the scene, got animation"),
        ("lights.1.radius", 1, "expected an index in [0, 0] after lights, got 1"),
        ("lights.-1.radius", 1, "expected an index in [0, 0] after lights, got '-1'"),
        ("lights.0.raidus", 1, 'lights[0]: unknown key `raidus` .*; did you mean "radius"?'),
        ("shapes.c.sphere.radius", 1, "in shapes is no 'c' (known: a, b"),
        ("shapes.a.sphere", 1, "shapes.a.sphere is a table (known: center, radius)"),
        ("lights", 1, "lights is a list of tables or lists"),
        ("camera.position.x", 1, "expected an index in [0, 2] after camera.position, got 'x'"),
        ("shapes.a.sphere.radius.0", 1, "shapes.a.sphere.radius as the end of the path"),
        ("shapes.a.sphere.radius", -1, "shapes.a.sphere.radius: expected a number above 0"),
        ("shapes.a.sphere.radius", "one", "expected numbers for shapes.a.sphere.radius, got 'one'"),
        ("objects.one", 1, "expected a text for objects.one, got 1"),
        ("settings.sample", 1, 'settings: unknown key `sample` .*; did you mean "samples"?'),
    ],
)
def test_a_wrong_path_is_refused_in_one_line_that_names_the_file(path: str, value: Any, message: str) -> None:
    with pytest.raises(rt.InputError) as caught:
        document().change({path: value})
    pattern = re.escape(message).replace(r"\.\*", ".*")
    assert re.match(rf"good\.toml(:\d+)?: .*{pattern}", str(caught.value)), caught.value
    assert "\n" not in str(caught.value)
