"""Unknown names: the message suggests a similar name."""

from pathlib import Path
from typing import Any

import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.core.suggest import did_you_mean, find_nearest
from raytracer.formats.image_files import load_picture
from raytracer.formats.scene_file import loads
from raytracer.scene.materials.models import MODELS


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("phnog", "phong"),
        ("GGX", "ggx"),
        ("cook-torrance", "cook_torrance"),
        ("oren nayar", "oren_nayar"),
        ("wood", None),
        ("", None),
        ("p" * 1_000_000, None),
    ],
)
def test_a_misspelt_name_has_one_suggestion_and_an_unrelated_name_has_none(name: str, near: str | None) -> None:
    assert find_nearest(name, MODELS) == near
    assert did_you_mean(name, MODELS) == (f'; did you mean "{near}"?' if near else "")


def test_three_of_five_letters_in_common_are_too_few_for_a_suggestion() -> None:
    assert find_nearest("name", ["camera"]) is None
    for name, near in (("asignment", "assignment"), ("sfot", "soft"), ("kdd", "kd"), ("fov", "vertical_fov")):
        assert find_nearest(name, [near]) == near


GOOD = """\
[camera]
position = [0, 3, 6]
look_at = [0, 2, 0]
[[lights]]
position = [4, 7, 4]
[materials.red]
kd = 0.5
[materials.gold]
model = "ggx"
fresnel = "conductor"
[shapes.ball]
sphere = { center = [0, 2, 0], radius = 1 }
material = "red"
[objects]
thing = "ball"
[instances.thing]
positions = [[0, 0, 0]]
[settings]
quality = "draft"
shadows = "soft"
"""


@pytest.mark.parametrize(
    ("old", "new", "near"),
    [
        ("[objects]", "[object]", "objects"),
        ("look_at", "lookat", "look_at"),
        ("[[lights]]\nposition", "[[lights]]\npositon", "position"),
        ("kd", "KD", "kd"),
        ('"ggx"', '"gxx"', "ggx"),
        ('"conductor"', '"conducter"', "conductor"),
        ("sphere", "shpere", "sphere"),
        ("radius", "radus", "radius"),
        ('material = "red"', 'material = "rde"', "red"),
        ('material = "red"', 'material = "lafortune/cley"', "clay"),
        ('material = "red"', 'material = "lafortun/clay"', "lafortune"),
        ('"ball"', '"bal"', "ball"),
        ("[instances.thing]", "[instances.thingy]", "thing"),
        ("positions", "position", "positions"),
        ('"draft"', '"drafts"', "draft"),
        ('"soft"', '"sotf"', "soft"),
        ("shadows", "shadow", "shadows"),
        ('shadows = "soft"', 'shading = "phnog"', "phong"),
    ],
)
def test_the_error_of_a_misspelt_name_in_a_scene_file_suggests_the_right_one(old: str, new: str, near: str) -> None:
    assert old in GOOD
    with pytest.raises(rt.InputError) as error:
        loads(GOOD.replace(old, new, 1))
    assert str(error.value).endswith(f'; did you mean "{near}"?')


def test_the_error_of_a_misspelt_file_or_example_suggests_the_right_one(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(GOOD)
    for path, near in (
        (tmp_path / "scen.toml", "scene.toml"),
        ("asignment", "assignment"),
        ("Assignment", "assignment"),
        (tmp_path / "nowhere" / "assignmen.toml", "assignment"),
    ):
        with pytest.raises(rt.InputError) as error:
            rt.load(path)
        assert str(error.value).endswith(f'; did you mean "{near}"?')
    with pytest.raises(rt.InputError, match=r'; did you mean "scene.png"\?$'):
        (tmp_path / "scene.png").write_bytes(b"")
        load_picture(tmp_path / "scen.png")
    with pytest.raises(rt.InputError) as error:
        (tmp_path / "picture.npz").mkdir()
        load_picture(tmp_path / "pictures.npz")
    assert "did you mean" not in str(error.value), "a folder is no picture"
    (tmp_path / "places.csv").write_text("x,y,z\n0,0,0\n")
    (tmp_path / "scene.toml").write_text(GOOD.replace("positions = [[0, 0, 0]]", 'file = "place.csv"'))
    with pytest.raises(rt.InputError, match=r'; did you mean "places.csv"\?$'):
        rt.load(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        (
            "merl",
            "expected a model without a file, got 'merl'; merl needs a file, which only a material can name: "
            'model = "merl", file = "brass.binary"',
        ),
        ("phog", "expected a reflectance model, got 'phog'; did you mean \"phong\"?"),
        ("q", "expected one of "),
        ("none", "expected a reflectance model, got 'none'; the materials keep their models without this setting"),
    ],
)
def test_a_wrong_shading_has_the_same_message_everywhere(
    name: Any, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(rt.InputError) as error:
        rt.Settings(shading=name)
    assert str(error.value).startswith(f"shading: {reason}")
    file = tmp_path / "a.toml"
    file.write_text(f'{GOOD.partition("[settings]")[0]}[settings]\nshading = "{name}"\n')
    with pytest.raises(rt.InputError) as error:
        rt.load_settings(file)
    assert f"settings.shading: {reason}" in str(error.value)
    assert name == "none" or main(["render", str(file), "-o", "a.png", "--shading", name]) == 2
    assert name == "none" or f"argument --shading: {reason}" in capsys.readouterr().err


def test_many_and_long_names_are_compared_in_bounded_time() -> None:
    names = [f"{i:064d}" for i in range(200_000)]
    assert find_nearest("x" * 64, names) is None
