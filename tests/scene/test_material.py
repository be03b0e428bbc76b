"""Materials: parameters of the models, errors, published materials, and the shading override."""

from __future__ import annotations

import copy
import math
import pickle
import re
from typing import Any, get_args

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.glsl.materials import material_text
from raytracer.compiler.material_layout import make_layout
from raytracer.formats.scene_file import loads
from raytracer.scene.materials.convert import convert_material
from raytracer.scene.materials.models import MODELS, SHADINGS, Shading
from raytracer.scene.settings import Settings
from tests import scenes


def test_a_material_has_the_parameters_and_defaults_of_its_model() -> None:
    ggx = rt.Material("ggx", alpha=0.1, f0=0.5)
    assert ggx.alpha == 0.1 and ggx.f0 == (0.5, 0.5, 0.5) and ggx.masking == "correlated" and ggx.ka == (0, 0, 0)
    assert rt.Material().kd == (0.8, 0.8, 0.8) and rt.Material().model == "phong"
    with pytest.raises(AttributeError, match="of the model ggx has no kd"):
        _ = ggx.kd
    with pytest.raises(AttributeError, match="frozen"):
        ggx.alpha = 0.2


def test_materials_compare_by_value() -> None:
    a = rt.Material("lafortune", lobes=[{"cx": -1, "cz": (1, 1, 0.9), "n": 20}], name="b")
    for b in (eval(repr(a), dict(vars(rt))), pickle.loads(pickle.dumps(a)), copy.deepcopy(a), a.replace()):
        assert a == b and hash(a) == hash(b)
    assert a != a.replace(name="c") and a != a.replace(rho=0.3) and a.replace(rho=0.3).rho == (0.3, 0.3, 0.3)


@pytest.mark.parametrize(
    ("model", "parameters", "message"),
    [
        ("ggx", {"kd": 1}, "kd: the model ggx has no such parameter .known: ka, alpha"),
        ("ggx", {"alpha": 0}, r"alpha: expected a number in \[0.0001, 1\], got 0"),
        ("ggx", {"alpha": "0.1"}, "alpha: expected a number"),
        ("ggx", {"alpha": True}, "alpha"),
        ("ggx", {"ior": 1.5}, "ior: expected only with fresnel = \"dielectric\", got 'schlick'"),
        ("ggx", {"f0": (0, 0, 1.5)}, r"f0: expected 3 numbers, or one for all, in \[0, 1\], got 1.5"),
        ("ggx", {"f0": (0, 1)}, "f0: expected 3 numbers"),
        ("ggx", {"masking": "some"}, "masking: expected one of correlated, separable"),
        ("diffuse_microfacet", {"nodes": 1.5}, r"nodes: expected a whole number in \[40, 4096\], got 1.5"),
        ("split", {"smith": "exact"}, "smith: expected only with distribution"),
        ("lafortune", {"lobes": "clay"}, "lobes: expected at most 16 lobes"),
        ("lafortune", {"lobes": [{"cx": 1}]}, r"lobes\[0\]: expected cx, cz, n"),
        ("lafortune", {"lobes": [rt.Lobe(1, 1, 1), {"cx": 1, "cz": 1, "n": -1}]}, r"lobes\[1\].n: expected"),
        ("lafortune", {"lobes": [{"cx": 100, "cz": 1, "n": 1e6}]}, r"lobes\[0\]: expected scale max"),
        ("lafortune", {"lobes": [rt.Lobe(1, 1, 1)] * 17}, "at most 16"),
        ("lafortune", {"tangent": (0, 0, 0)}, "tangent: expected a vector that is not 0"),
        ("merl", {}, "file: missing"),
        ("merl", {"file": "nowhere.binary"}, "file: nowhere.binary: expected a readable"),
        ("plastic", {}, "model: expected one of phong, blinn, lambert"),
        (3, {}, "model: expected one of"),
        ("phong", {"name": 3}, "name: expected a string"),
    ],
)
def test_an_error_about_a_wrong_parameter_names_it(model: str, parameters: dict[str, object], message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.Material(model, **parameters)  # pyright: ignore[reportArgumentType]


def test_a_scene_file_makes_the_same_materials_and_its_errors_name_the_key() -> None:
    text = scenes.ASSIGNMENT.read_text()
    start, end = text.index("[materials.red]"), text.index("[materials.blue]")

    def with_red(lines: str) -> rt.Scene:
        return loads(f"{text[:start]}[materials.red]\n{lines}\n\n{text[end:]}")

    red = with_red('model = "ggx"\nalpha = 0.2\nf0 = [1, 0.5, 0.25]').materials[0]
    assert red == rt.Material("ggx", alpha=0.2, f0=(1, 0.5, 0.25), name="red")
    for lines, message in (
        ('model = "ggx"\nalpha = 2', r"materials.red.alpha: expected a number in \[0.0001, 1\]"),
        ('model = "ggx"\nkd = [1, 1, 1]', r"materials.red: unknown key `kd` \(known: model, ka, alpha"),
        ('model = "gxx"', "materials.red.model: expected one of phong"),
        ('model = "merl"\nfile = "../x.binary"', "materials.red.file: expected the plain name of a .binary file"),
        ('model = "merl"\nfile = "x.binary"', "materials.red.file: .*load"),
    ):
        with pytest.raises(rt.InputError, match=message):
            with_red(lines)


def test_a_published_material_is_made_only_once() -> None:
    assert rt.published("lafortune/clay") is rt.published("lafortune/clay")


def test_published_materials_are_available_by_name() -> None:
    clay = rt.published("lafortune/clay")
    assert clay.model == "lafortune" and len(clay.lobes) == 3 and clay.rho == (0.383626, 0.260749, 0.274207)
    text = scenes.ASSIGNMENT.read_text().replace('material = "grey"', 'material = "lafortune/clay"')
    scene = loads(text)
    assert clay in scene.materials
    for name, message in (
        ("lafortune/cla", "lafortune .such as"),
        ("clay", "got 'clay'"),
        ("../a/b", "got"),
    ):
        with pytest.raises(rt.InputError, match=message):
            loads(text.replace("lafortune/clay", name))
        with pytest.raises(rt.InputError, match="expected a"):
            rt.published(name)


def test_the_shading_override_reaches_every_model_from_every_model() -> None:
    assert get_args(Shading) == SHADINGS == tuple(MODELS)[:-1], "all but merl, which needs a file"
    for source in SHADINGS:
        for target in SHADINGS:
            material = Settings(shading=target).shaded(rt.Material(source, name="a"))
            assert material.model == target and material.name == "a"
            assert target != source or material == rt.Material(source, name="a")
    for material in (rt.published("lafortune/clay"), rt.published("conductors/gold"), rt.published("ngan/teflon")):
        for target in SHADINGS:
            convert_material(material, target)


def test_the_shading_override_keeps_common_parameters() -> None:
    gold = rt.published("conductors/gold")
    beckmann = convert_material(gold, "beckmann")
    assert (beckmann.alpha, beckmann.n, beckmann.k) == (gold.alpha, gold.n, gold.k)
    plastic = rt.Material(kd=(0.25, 0.125, 0.1), ks=0.5, h=100)
    # Blinn's exponent is 2 / alpha^2 - 2 (Walter et al. 2007).
    assert 2 / convert_material(plastic, "ggx").alpha ** 2 - 2 == pytest.approx(4 * 100, rel=1e-12)
    assert convert_material(convert_material(plastic, "ggx"), "phong").h == pytest.approx(100)
    assert convert_material(rt.Material("cook_torrance", ks=0.5, f0=(0.9, 0.6, 0.4)), "ggx").f0 == (0.45, 0.3, 0.2)
    assert convert_material(rt.Material("split", rho=(0.9, 0.5, 0.3), metalness=1), "phong").ks == (0.9, 0.5, 0.3)


def test_the_shading_override_keeps_the_brightness_of_diffuse_materials() -> None:
    # In the lecture's models kd is an albedo over pi.
    plastic = rt.Material(kd=(0.25, 0.125, 0.1))
    assert convert_material(plastic, "lambert").rho == pytest.approx((0.25 * math.pi, 0.125 * math.pi, 0.1 * math.pi))
    assert convert_material(rt.Material("lambert", rho=0.5), "phong").kd == pytest.approx((0.5 / math.pi,) * 3)
    assert convert_material(rt.Material(kd=(4, 1, 0)), "lambert").rho == (1, 0.25, 0), (
        "the hue is kept when the brightness is clamped"
    )


def test_the_shading_override_keeps_the_colour_of_metals() -> None:
    gold = rt.published("conductors/gold")
    n, k = np.array(gold.n), np.array(gold.k)
    normal = tuple((((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)).tolist())
    for model, name in (("phong", "ks"), ("lambert", "rho"), ("split", "f0"), ("strauss", "color")):
        assert convert_material(gold, model).get(name) == pytest.approx(normal), model


def test_struct_material_has_only_the_members_of_the_models_in_use() -> None:
    def members(*materials: rt.Material) -> set[str]:
        body = material_text(make_layout(materials)).partition("struct Material {")[2].partition("}")[0]
        return {line.split()[1].rstrip(";") for line in body.strip().splitlines()}

    assert members(rt.Material("lambert")) == {"rho", "number"}, "no ka: the model of the lecture has it"
    assert members(rt.Material("lambert"), rt.Material("ggx")) == {"rho", "number", "model", "f0", "alpha"}
    assert members(rt.Material("ggx"), rt.Material("ggx", fresnel="conductor")) == {
        *("alpha", "f0", "n", "extinction", "fresnel", "number")
    }
    assert members(rt.Material("lambert", le=1)) == {"rho", "le", "number"}, "le only if a material emits light"
    assert members(rt.Material()) == {"ka", "kd", "ks", "h", "number"}
    assert make_layout([rt.Material()]).texels == 3


@pytest.mark.parametrize("model", SHADINGS)
def test_the_default_ka_is_a_share_of_the_diffuse_colour_in_python_and_in_scene_files(model: str) -> None:
    """0.15/0.8 of kd in the lecture's models, rounded to 15 digits; 0 in all others."""
    is_lecture = model in ("phong", "blinn")
    parameters: dict[str, Any] = {"kd": (0.8, 0.1, 0.64)} if is_lecture else {}
    material = rt.Material(model, **parameters)
    assert material.ka == ((0.15, 0.01875, 0.12) if is_lecture else (0, 0, 0))
    lines = f'model = "{model}"\n' + ("kd = [0.8, 0.1, 0.64]" if is_lecture else "")
    text = re.sub(r"(?s)(?<=\[materials.red\]\n).*?(?=\n\[)", lines, scenes.ASSIGNMENT.read_text())
    assert loads(text).materials[0] == material.replace(name="red")


def test_a_ka_with_its_default_follows_the_colour_and_a_chosen_one_stays() -> None:
    red = rt.Material(kd=(0.8, 0.1, 0.1))
    chosen = red.replace(ka=0.3)
    assert red.replace(kd=0.64).ka == (0.12,) * 3 and chosen.replace(kd=0.64).ka == (0.3,) * 3
    assert red.replace(model="blinn", kd=0.1).ka == (0.01875,) * 3
    assert rt.Material("ggx").replace(model="phong") == rt.Material()
    assert repr(red) == "Material(kd=(0.8, 0.1, 0.1))", "a default is left out"
    for material in (red, chosen):
        for same in (eval(repr(material), dict(vars(rt))), pickle.loads(pickle.dumps(material)), copy.copy(material)):
            assert same == material and same.replace(kd=0.2) == material.replace(kd=0.2)
    assert convert_material(red, "lambert").ka == red.ka, "--shading keeps the ambient light of the picture"


@pytest.mark.parametrize("name", ["kda", 3])
def test_an_unknown_parameter_has_no_default(name: Any) -> None:
    with pytest.raises(rt.InputError, match="name: expected one of ka, kd, ks, h, le"):
        rt.Material().has_default(name)


def test_replacing_a_choice_drops_the_parameters_of_the_old_choice() -> None:
    ggx = rt.Material("ggx", f0=0.5, alpha=0.1)
    assert ggx.replace(fresnel="conductor") == rt.Material("ggx", alpha=0.1, fresnel="conductor")
    assert ggx.replace(fresnel="dielectric", ior=1.25).ior == 1.25


@pytest.mark.parametrize("model", ['["x"]', "{ a = 1 }", "3", '"nope"\nself = 1', '"nope"\nname = "x"'])
def test_the_error_about_a_wrong_model_in_a_scene_file_is_one_line(model: str) -> None:
    text = scenes.ASSIGNMENT.read_text().replace("[materials.red]", f"[materials.red]\nmodel = {model}", 1)
    text = text.replace('model = "phong"', "", 1) if '\nmodel = "phong"' in text else text
    with pytest.raises(rt.InputError, match=r"materials.red.model: expected one of phong"):
        loads(text)
