"""The bench of reflectance models: correct measurements, marks for unresolved results, and checks of expectations."""

from __future__ import annotations

import functools
import json
import math
import re
import runpy
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import raytracer as rt
from raytracer.analysis.figures import new_figure
from raytracer.analysis.reflectance import expectations, gallery, plots, properties, tables
from raytracer.analysis.reflectance.expectations import (
    EXPECTATIONS,
    NOT_RECIPROCAL,
    Expectation,
    find_expectation,
)
from raytracer.analysis.reflectance.quadrature import (
    NORMAL,
    Fineness,
    facing_rule,
    halfway_rule,
    polar_rule,
    union_rule,
)
from raytracer.analysis.reflectance.tried_parameters import tried_parameters
from raytracer.analysis.reflectance.verification import Verification, _differences, verify, verify_all
from raytracer.app.cli import main
from raytracer.app.commands.material_arguments import parse_parameters as parsed
from raytracer.core.validation import InputError
from raytracer.formats.material_library import published
from raytracer.gpu.device import shared_device
from raytracer.ground_truth import reflectance
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from tests import scenes
from tests.processes import run_for_output

FINE = Fineness(6, 16)
MEASURED = properties.COMPLETE


@functools.cache
def verifications(model: str) -> list[Verification]:
    return verify_all([model])


def albedo(material: Material, *cosines: float) -> list[float]:
    albedos = properties.measure_material(material, [math.degrees(math.acos(c)) for c in cosines]).albedos
    assert all(a.resolved for a in albedos)
    return [a.value for a in albedos]


# Expectations.


@pytest.mark.gl
@pytest.mark.parametrize("model", MEASURED)
def test_every_model_meets_its_expectations_at_the_ends_of_its_parameter_ranges(model: str) -> None:
    checks = verifications(model)
    assert len(checks) > 1 and all(check.expectation for check in checks)
    assert [f"{check.parameters}: {check.differences}" for check in checks if check.differences] == []


def test_every_model_but_merl_has_expectations_and_each_expectation_has_a_reason() -> None:
    assert [model for model in MODELS if model not in MEASURED] == ["merl"]
    assert {expectation.model for expectation in EXPECTATIONS} == set(MEASURED)
    assert all(expectation.why for expectation in EXPECTATIONS)
    for model in MEASURED:
        # The last row that matches applies, so each row must be the last match of some material.
        materials = [Material(model, **settings) for settings in tried_parameters(model)]
        applied = {id(find_expectation(material)) for material in materials}
        assert [v.when for v in EXPECTATIONS if v.model == model and id(v) not in applied] == []


# A parameter whose range ends above this number, such as an exponent, is drawn by its logarithm, not evenly.
_LONG_AXIS = 1e3


def random_material(model: str, fixed: Mapping[str, Any], random: np.random.Generator) -> Material:
    """Return a material with random parameters, but for `fixed` ones: values or ranges, as in Expectation.when."""
    parameters = MODELS[model].parameters
    conditions = dict(p.when for p in parameters.values() if p.when and p.name in fixed)
    fixed = {**conditions, **fixed}
    values: dict[str, Any] = {}
    for name, p in parameters.items():
        low, high = p.low, min(p.high, 256) if p.kind == "whole" else p.high
        if p.when and values[p.when[0]] != p.when[1]:
            continue
        if name in fixed and not (isinstance(fixed[name], tuple) and fixed[name]):
            values[name] = fixed[name]
        elif p.kind == "choice":
            values[name] = str(random.choice(p.choices))
        elif p.kind == "whole":
            values[name] = int(random.integers(int(low), int(high), endpoint=True))
        elif high > _LONG_AXIS:
            values[name] = float(np.exp(random.uniform(np.log(max(low, 1e-3)), np.log(high))))
        elif p.kind in ("number", "color"):
            values[name] = float(random.uniform(*fixed.get(name, (low, high))))
    return Material(model, **values)


def test_expected_numbers_apply_only_to_the_listed_parameters_and_laws_apply_to_all() -> None:
    listed = find_expectation(Material("oren_nayar", ka=0.3))
    assert listed and listed.largest and listed.conserving and listed.resolved
    for model in MEASURED:
        random = np.random.default_rng(1)
        expectation = find_expectation(random_material(model, {}, random))
        assert expectation is None or (
            expectation.largest is None and expectation.at is None and not expectation.resolved
        )
        assert model in NOT_RECIPROCAL or (expectation and expectation.reciprocal)
    cases: list[tuple[str, dict[str, Any], bool | None]] = [
        ("ggx", {"alpha": 0.77, "f0": 1.0}, True),
        ("split", {"alpha": 0.5}, None),
        ("split", {"alpha": 0.5, "rho": 0.0}, True),
        ("phong_normalized", {"h": 99.0}, True),
        ("phong_normalized", {"kd": 0.2, "h": 99.0}, None),
        ("minnaert", {"k": 1.5, "rho": 0.3}, True),
        ("minnaert", {"k": 0.6}, None),
        ("cook_torrance", {"rho": 0.5}, None),
    ]
    for model, settings, conserving in cases:
        expectation = find_expectation(Material(model, **settings))
        assert expectation and expectation.reciprocal and expectation.conserving is conserving, (model, settings)
    assert find_expectation(Material("phong", h=0.0, ks=0.0)) is None
    assert find_expectation(Material("phong", kd=0.1)) is None


@pytest.mark.slow
@pytest.mark.gl
@pytest.mark.parametrize("model", MEASURED)
def test_laws_hold_for_random_parameters(model: str) -> None:
    random = np.random.default_rng(2)
    rows = [{}, *(expectation.when for expectation in EXPECTATIONS if expectation.model == model and expectation.law)]
    for when in rows:
        for _ in range(2):
            material = random_material(model, when, random)
            verification = verify(model, material.parameters, degrees=(0.0, 45.0, 75.0, 88.0, 89.9))
            assert verification.differences == [], material


@pytest.mark.gl
def test_measurements_confirm_the_properties_that_theory_predicts() -> None:
    """Well-known examples, with the parameters that differ from the defaults."""

    def measured_properties(model: str, **settings: Any) -> properties.MaterialProperties:
        return next(c.properties for c in verifications(model) if dict(c.parameters) == settings)

    assert not measured_properties("phong").reciprocal and measured_properties("phong").conserving is False
    assert measured_properties("minnaert").reciprocal and measured_properties("minnaert").conserving is False  # k = 0.5
    assert measured_properties("minnaert", k=2.0, rho=1.0).conserving
    full = measured_properties("oren_nayar", rho=1.0)
    assert full.reciprocal and full.conserving is False and 1.01 < full.largest.value < 1.03
    assert measured_properties("ggx").reciprocal and measured_properties("ggx").conserving
    assert measured_properties("mirror").delta and not measured_properties("ggx").delta


@pytest.mark.gl
def test_a_wrong_expectation_is_reported() -> None:
    measured = properties.measure_material(Material("lambert", rho=1.0))
    assert list(_differences(measured, find_expectation(measured.material))) == []
    assert list(_differences(measured, Expectation("lambert", True, None, "open"))) == []
    wrong = Expectation("lambert", False, False, "wrong", largest=(0.9, 1e-3), at=45.0)
    assert len(list(_differences(measured, wrong))) == 4


@pytest.mark.gl
@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda f, wi, wo: 1.01 * f, "conserving"),
        (lambda f, wi, wo: f * (1.0 - 0.01 * wi[..., :1]), "reciprocal"),
        (lambda f, wi, wo: f - 1e-3, "negative"),
        (lambda f, wi, wo: np.where(wi[..., 2:] < 1e-5, np.nan, f), "NaN"),
    ],
)
def test_a_wrong_shader_is_reported(monkeypatch: pytest.MonkeyPatch, break_it: Any, message: str) -> None:
    true = properties.evaluate

    def broken(material: Material, wi: Any, wo: Any, **options: Any) -> Any:
        return break_it(true(material, wi, wo, **options), np.asarray(wi), np.asarray(wo))

    monkeypatch.setattr(properties, "evaluate", broken)
    measured = properties.measure_material(Material("lambert", rho=1.0))
    assert any(message in text for text in _differences(measured, find_expectation(measured.material)))


# The quadrature.


@pytest.mark.parametrize("degrees", [0.0, 1e-3, 30.0, 60.0, 84.0, 89.9])
def test_quadrature_weights_add_up_to_the_hemisphere(degrees: float) -> None:
    w = properties.unit_direction(degrees)
    tilted = properties.unit_direction(degrees, 40.0)
    below = -properties.unit_direction(max(90.0 - degrees, 5.0))
    rules = {
        "halfway": halfway_rule(w, FINE.times(2)),
        "polar": polar_rule(w * (-1, -1, 1), FINE.times(2)),
        "polar, axis below the horizon": polar_rule(below, FINE.times(2)),
        "normal": polar_rule(NORMAL, FINE, kinks=w),
        "whole circles": halfway_rule(tilted, Fineness(12, 32, whole=True)),
        "several": union_rule([w * (-1, -1, 1), properties.unit_direction(40.0), below], FINE.times(4)),
    }
    for name, (directions, weights) in rules.items():
        assert weights.sum() == pytest.approx(2.0 * np.pi, rel=2e-4), name
        assert weights @ directions[:, 2] == pytest.approx(np.pi, rel=2e-4), name
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)


def test_the_weights_of_normals_that_face_a_direction_add_up_to_their_solid_angle() -> None:
    """The lune between two planes at the angle t has the solid angle 2 (pi - t)."""
    for degrees in (0.0, 30.0, 80.0):
        m, weights = facing_rule(properties.unit_direction(degrees), FINE)
        assert weights.sum() == pytest.approx(2.0 * (np.pi - math.radians(degrees)), rel=1e-5)
        assert (m @ properties.unit_direction(degrees) > 0.0).all()


@pytest.mark.gl
def test_albedos_agree_with_published_values() -> None:
    """The values come from separate quadratures in float64. The tolerances follow from their digits."""
    one: dict[str, Any] = {"f0": 1.0}
    assert albedo(Material("ggx", alpha=1.0, **one), 1.0, 0.5, 0.1) == pytest.approx(
        [1.0 - math.log(2.0), 0.4507, 0.7602], abs=2e-4
    )
    separable = Material("ggx", alpha=1.0, masking="separable", **one)
    assert albedo(separable, 1.0, 0.5, 0.1) == pytest.approx([1.0 - math.log(2.0), 0.4091, 0.5579], abs=2e-4)
    assert albedo(Material("ggx", alpha=0.5, **one), 1.0, 0.1) == pytest.approx([0.6878, 0.8601], abs=3e-4)
    assert albedo(Material("ggx", alpha=0.1, **one), 1.0) == pytest.approx([0.9883], abs=2e-4)
    for h, values in {1.0: (1.0, 0.609, 0.370), 10.0: (1.0, 0.5047, 0.1792), 100.0: (1.0, 0.5, 0.1082)}.items():
        material = Material("phong_normalized", kd=0.0, ks=1.0, h=h)
        assert albedo(material, 1.0, 0.5, 0.1) == pytest.approx(values, abs=5e-4), h
    for h, values in {10.0: (1.0, 0.4003, 0.1406), 100.0: (1.0, 0.2651, 0.0276)}.items():
        material = Material("blinn_normalized", kd=0.0, ks=1.0, h=h)
        assert albedo(material, 1.0, 0.5, 0.1) == pytest.approx(values, abs=3e-4), h
    for sigma, short, full in [
        (0.3, (0.893, 0.939, 0.980, 0.998), (0.962, 0.971, 1.001, 1.027)),
        (0.5, (0.785, 0.852, 0.912, 0.939), (0.896, 0.909, 0.953, 0.991)),
        (1.0, (0.624, 0.709, 0.784, 0.816), (0.775, 0.790, 0.845, 0.893)),
    ]:
        for form, values in (("short", short), ("full", full)):
            material = Material("oren_nayar", rho=1.0, sigma=math.degrees(sigma), form=form)
            assert albedo(material, 1.0, 0.7, 0.3, 0.1) == pytest.approx(values, abs=1e-3), (sigma, form)


@pytest.mark.gl
@pytest.mark.parametrize("model", ["ggx", "beckmann"])
def test_albedos_of_sharp_lobes_agree_with_a_finer_quadrature(model: str) -> None:
    """The reference is computed in float64, by a rule four times as fine in both coordinates."""
    material = Material(model, alpha=1e-3, f0=1.0)
    for measured in properties.measure_material(material, (0.0, 60.0, 88.0, 89.9)).albedos:
        w = properties.unit_direction(measured.degrees)
        directions, weights = halfway_rule(w, FINE.times(4))
        N, V = (np.broadcast_to(x, directions.shape) for x in (NORMAL, w))
        right = float((weights @ reflectance.reflected(material, N, directions, V))[0])
        assert measured.resolved and abs(measured.value - right) < 1e-3


@pytest.mark.gl
def test_an_unresolved_sum_is_marked_and_not_called_an_albedo() -> None:
    """Float32 cannot resolve a lobe of 1e-7, whatever its sum is."""
    measured = properties.measure_material(Material("he", tau=1e6), (85.0,))
    assert not measured.largest.resolved and measured.conserving is not True
    check = Verification("he", {"tau": 1e6}, measured, None, [])
    assert "?" in tables._row(check)[4] and tables._row(check)[3] == "?"


@pytest.mark.gl
def test_an_anisotropic_material_is_measured_at_several_azimuths() -> None:
    """A lobe that is scaled along x only has its largest albedo off that axis, as a plain sum confirms."""
    material = Material("lafortune", rho=0.0, lobes=[{"cx": -0.5, "cy": -1.0, "cz": 1.0, "n": 8.0}])
    measured = properties.measure_material(material, (60.0,)).albedos[0]
    wi, weights = polar_rule(NORMAL, Fineness(12, 64, whole=True))
    N = np.broadcast_to(NORMAL, wi.shape)
    sums = {}
    for azimuth in (0.0, 30.0, 60.0, 90.0):
        wo = np.broadcast_to(properties.unit_direction(60.0, azimuth), wi.shape)
        value = np.maximum(wi * wo @ np.array([-0.5, -1.0, 1.0]), 0.0) ** 8
        sums[azimuth] = float(weights @ (value * np.sum(N * wi, axis=1)))
    assert max(sums, key=lambda a: sums[a]) == 90.0 and sums[90.0] > 1.1 * sums[0.0]
    assert measured.value == pytest.approx(sums[90.0], abs=1e-3)


@pytest.mark.gl
def test_a_published_material_is_reciprocal_with_a_plausible_albedo() -> None:
    measured = properties.measure_material(published("lafortune/clay"), (0.0, 60.0))
    assert measured.reciprocal and measured.finite and all(a.resolved for a in measured.albedos)
    assert 0.2 < measured.albedos[0].value < 0.6


@pytest.mark.gl
def test_the_mirror_is_a_delta_whose_albedo_is_the_fresnel_reflectance() -> None:
    material = Material("mirror", f0=(0.2, 0.4, 0.9))
    measured = properties.measure_material(material, (0.0, 60.0))
    assert measured.delta and measured.reciprocity == 0.0
    assert [a.value for a in measured.albedos] == pytest.approx([0.9, 0.9 + 0.1 * 0.5**5], abs=1e-6)


# The command line.


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(["brdf", *arguments])
    printed = capsys.readouterr()
    return status, printed.out, printed.err


@pytest.mark.gl
def test_check_prints_a_table_or_json_and_reports_unmet_expectations(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    status, out, _ = run(capsys, "check", "ggx", "--set", "alpha=0.1", "--set", "f0=1,0.8,0.3")
    assert status == 0 and "alpha=0.1" in out and "as expected" in out and "89.9" in out
    status, out, _ = run(capsys, "check", "lambert", "--json")
    checks = json.loads(out)["checks"]
    assert status == 0 and len(checks) == 3
    assert checks[2]["settings"] == {"rho": 1.0} and checks[2]["largest"]["value"] == pytest.approx(1.0, abs=1e-3)
    assert checks[2]["reciprocal"] is True and checks[2]["conserving"] is True and checks[2]["differs"] == []
    monkeypatch.setattr(expectations, "EXPECTATIONS", (Expectation("lambert", True, False, "wrong", law=True),))
    status, out, _ = run(capsys, "check", "lambert", "--set", "rho=0.5")
    assert status == 1 and "lambert rho=0.5: conserving, not conserving expected" in out


@pytest.mark.gl
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("oren_nayar --set rho=0.5", "1 without an expectation about energy"),
        ("phong_normalized --set kd=0.2", "1 without an expectation about energy"),
        ("lafortune --set rho=0.1", "1 without an expectation about energy"),
        ("split --set alpha=0.5", "1 without an expectation about energy"),
        ("phong --set h=0 --set ks=0", "1 without an expectation"),
        ("ggx --set alpha=0.77", "all as expected\n"),
    ],
)
def test_check_does_not_apply_the_expectations_of_other_parameters(
    capsys: pytest.CaptureFixture[str], arguments: str, says: str
) -> None:
    status, out, _ = run(capsys, "check", *arguments.split())
    assert status == 0 and says in out and "1 measured, all as expected" in out


@pytest.mark.gl
def test_check_reports_faults_for_parameters_without_a_listed_expectation(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    true = properties.evaluate
    monkeypatch.setattr(
        properties, "evaluate", lambda m, wi, wo, **options: true(m, wi, wo, **options) * (1.0 - 0.1 * wi[:, :1])
    )
    status, out, _ = run(capsys, "check", "oren_nayar", "--set", "rho=0.5")
    assert status == 1 and "oren_nayar rho=0.5: not reciprocal, reciprocal expected" in out
    monkeypatch.setattr(properties, "evaluate", lambda m, wi, wo, **options: 1.2 * true(m, wi, wo, **options))
    status, out, _ = run(capsys, "check", "lambert", "--set", "rho=0.9")
    assert status == 1 and "not conserving, conserving expected" in out and "0.9 by its closed form" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("check", "nope"), "expected one of phong"),
        (("check", "ggx", "--set", "alpha"), "NAME=VALUE"),
        (("check", "ggx", "--set", "h=5"), "ggx has no parameter h (known: ka, alpha"),
        (("check", "ggx", "--set", "alpha=5"), "a number in [0.0001, 1]"),
        (("check", "ggx", "--set", "alpha=x"), "--set alpha=x: expected a number"),
        # Parsing this key would take time and memory by the square of its parts, so it must be refused at once.
        (("check", "lafortune", "--set", f"lobes={{{'.'.join('a' * 60_000)} = 1}}"), "expected lobes as in a scene"),
        (("check", "ggx", "--set", "f0=1,2"), "3 numbers"),
        (("check", "ggx", "--set", "masking=none"), "correlated, separable"),
        (("check", "ggx", "--set", "ior=2"), 'fresnel = "dielectric"'),
        (("check", "lafortune", "--set", "lobes=[{"), "lobes as in a scene file"),
        (("check", "lafortune", "--set", f"lobes={'[' * 3000}"), "lobes as in a scene file"),
        (("check", "ggx", "--set", "al\n\x1bpha=1"), r"--set al\n\x1bpha=1: ggx has no"),
        (("check", "ggx", "--set", "masking=\x1b[31m\n"), r"got '\x1b[31m\n'"),
        (("check", "merl"), "file="),
        (("plot", "ggx", "phong", "--set", "alhpa=1", "-o", "x.png"), "no material has a parameter alhpa"),
        (("plot", "ggx", "--set", "alpha", "-o", "x.png"), "--set alpha: expected NAME=VALUE"),
        (("plot", "ggx:alpha", "-o", "x.png"), "raytracer: ggx:alpha: expected NAME=VALUE"),
        (("plot", "ggx:alpha=x", "-o", "x.png"), "raytracer: ggx:alpha=x: expected a number"),
        (("plot", "ggx", "ggx:alpha=7", "-o", "x.png"), "raytracer: ggx:alpha=7: alpha: expected a number in"),
        (("bake", "lambert", "--set", "alpha=1", "-o", "x.binary"), "no material has a parameter alpha"),
        (("list", "ggx", "--markdown"), "no MODEL"),
        (("list", "ggx", "--schema"), "no MODEL"),
        (("check", "lafortune/nope"), "clay"),
        (("plot", "-o", "x.png"), "--lecture"),
        (("plot", "ggx", "-o", "x.jpg"), "ends in .png or .svg or .pdf"),
        (("plot", "ggx", "-o", "nowhere/x.png"), "nowhere"),
        (("plot", "--lecture", "--set", "kd=1", "-o", "x.png"), "only h"),
        (
            ("plot", "--lecture", "--set", "h=1e6", "-o", "x.png"),
            "h: expected a number in [0, 250000], which blinn takes",
        ),
        (("gallery", "--cell", "3", "-o", "x.png"), "--cell"),
        (("list", "nope"), "expected one of phong"),
    ],
)
def test_wrong_input_is_refused_with_a_remedy(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, error = run(capsys, *arguments)
    assert status == 2 and message in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_parameters_get_their_types_from_the_table_of_models() -> None:
    assert parsed("ggx", ["alpha=0.25", "f0=1,0.5,0", "masking=separable"]) == {
        "alpha": 0.25,
        "f0": [1.0, 0.5, 0.0],
        "masking": "separable",
    }
    parameters = parsed("lafortune", ["lobes=[{ cx = -1, cz = 1, n = 20 }]", "tangent=0,1,0"])
    assert parameters == {"lobes": [{"cx": -1, "cz": 1, "n": 20}], "tangent": [0.0, 1.0, 0.0]}


@pytest.mark.gl
def test_list_shows_the_measured_properties_and_the_parameters_of_a_model(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "list", "minnaert")
    assert status == 0 and "Minnaert 1941" in out and "0 to 100" in out
    assert "reciprocal: yes; conserving: no, in 3 of 7 settings (defaults, rho=1, k=0)" in out
    assert "conserving: yes, but not resolved in 3 of 19 settings (alpha=0.0001, " in run(capsys, "list", "ggx")[1]
    assert "needs a file" in run(capsys, "list", "merl")[1]
    status, out, _ = run(capsys, "list", "lambert", "--json")
    description = json.loads(out)["lambert"]
    assert status == 0 and description["parameters"][1]["name"] == "rho" and len(description["measured"]) == 3


def test_other_commands_do_not_load_the_analysis_of_reflectance() -> None:
    code = (
        "import sys; from raytracer.app.cli import _parser; _parser().parse_args(['doctor']);"
        "print([name for name in sys.modules if 'brdf' in name or 'raytracer.analysis' in name])"
    )
    assert run_for_output(sys.executable, "-c", code) == "[]\n"


# Pictures.


@pytest.mark.gl
def test_plots_are_written_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    out = tmp_path / "x.png"
    # A material that the user names twice is plotted twice.
    assert run(capsys, "plot", "phong", "ggx:alpha=0.01", "phong", "--set", "h=8", "-o", str(out))[0] == 0
    with Image.open(out) as picture:
        assert picture.width > 900 and len(np.unique(np.asarray(picture.convert("L")))) > 100
    lecture = tmp_path / "y.pdf"
    assert run(capsys, "plot", "--lecture", "-o", str(lecture))[0] == 0
    assert sorted(tmp_path.iterdir()) == [out, lecture] and lecture.read_bytes().startswith(b"%PDF")


@pytest.mark.gl
def test_an_svg_keeps_its_texts_and_all_columns_have_the_same_scales(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    figures: list[Any] = []

    def kept_figure(*size: Any, **more: Any) -> Any:
        figures.append(new_figure(*size, **more))
        return figures[0]

    monkeypatch.setattr(plots, "new_figure", kept_figure)
    out = tmp_path / "x.svg"
    assert run(capsys, "plot", "phong", "ggx:alpha=0.01:f0=1,0.8,0.3", "-o", str(out))[0] == 0
    texts = [element.text for element in ElementTree.parse(out).iter("{http://www.w3.org/2000/svg}text")]
    assert {"ggx", "alpha=0.01; f0=1,0.8,0.3", "albedo", "angle to the normal", "60°"} <= {*texts}
    for projection in ("polar", "rectilinear"):
        panels = [axes for axes in figures[0].axes if axes.name == projection and axes.axison]
        assert len(panels) == 2 and panels[0].get_ylim() == panels[1].get_ylim()
        assert [*panels[0].get_yticks()] == [*panels[1].get_yticks()]
    radii = [text for text in texts if text in ("0.1", "1", "10", "100", "10³")]
    assert len(radii) >= 6, "both radial scales have labels"


def test_plot_names_the_missing_extra_if_matplotlib_is_not_installed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith("matplotlib")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    status, _, error = run(capsys, "plot", "lambert", "-o", str(tmp_path / "x.png"))
    assert status == 2 and "in the checkout: pip install -e '.[plots]'" in error and not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "status"), [(["--help"], 0), ([], 2)])
def test_the_lecture_figures_show_their_help_and_name_the_missing_extra_without_matplotlib(
    arguments: list[str],
    status: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in [name for name in sys.modules if name.startswith("matplotlib")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr(sys, "argv", ["lecture_figures.py", "-o", str(tmp_path / "figures"), *arguments])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(scenes.CHECKOUT / "examples/lecture_figures.py"), run_name="__main__")
    said = capsys.readouterr()
    assert end.value.code == status and not list(tmp_path.iterdir())
    assert said.out.startswith("usage: ") == (status == 0)
    error = r"lecture_figures\.py: plots need matplotlib.*in the checkout: pip install -e '\.\[plots\]'\n"
    assert re.fullmatch("" if status == 0 else error, said.err)


def test_the_lecture_figures_refuse_a_folder_that_cannot_be_made_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(sys, "argv", ["lecture_figures.py", "-o", str(tmp_path / "file" / "figures")])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(scenes.CHECKOUT / "examples/lecture_figures.py"), run_name="__main__")
    assert end.value.code == 2
    assert capsys.readouterr().err == f"lecture_figures.py: {tmp_path}/file/figures: Not a directory\n"


@pytest.mark.gl
def test_the_gallery_has_a_labelled_cell_for_each_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gallery, "COMPLETE", ["phong", "lambert"])
    out = tmp_path / "g.png"
    from raytracer.rendering.renderer import Renderer

    gallery.write_gallery(out, 64, 1, None, Renderer(shared_device()), None)
    with Image.open(out) as picture:
        sheet = np.asarray(picture.convert("RGB")).astype(int)
    phong, lambert = (sheet[8:72, x : x + 64] for x in (8, 82))
    assert (sheet[8:72, 72:82] == 255).all(), "pictures stand apart"
    # The same floor under either light; the highlight is phong's alone.
    np.testing.assert_allclose(phong[-4:, :8], lambert[-4:, :8], atol=1)
    assert phong.max() > lambert.max() + 20
    assert (sheet[73:92, 8:72].min(axis=2) < 100).any(), "its name is below"


def test_the_gallery_shows_every_model_with_valid_parameters() -> None:
    for model in MEASURED:
        assert gallery.gallery_materials()[model][0].model == model


@pytest.mark.gl
def test_the_lectures_two_highlights_are_alike_in_the_plane_of_incidence_only() -> None:
    """Blinn's (N.H)^(4 h) takes the place of Phong's (R.V)^h.

    In the plane of incidence, cos^4h(x / 2) - cos^h(x) is 0.0043 at most for h = 32.
    """
    x = np.linspace(0.0, np.pi / 4, 100_001)
    largest = float((np.cos(x / 2) ** 128 - np.cos(x) ** 32).max())
    assert largest == pytest.approx(0.0043, abs=1e-4)
    offsets = np.radians(np.linspace(-20.0, 20.0, 401))
    differences = {}
    for across in (False, True):
        wi, wo = (
            properties.unit_direction(60.0, 180.0),
            plots._directions_around(properties.unit_direction(60.0), offsets, across),
        )
        r, n = (
            properties.evaluate(Material(model, kd=0.0, ks=1.0, h=h), wi, wo)[:, 0]
            for model, h in (("phong", 32.0), ("blinn", 128.0))
        )
        differences[across] = float(np.abs(r - n).max())
    assert differences[False] == pytest.approx(largest, abs=1e-4) and differences[True] > 0.4


def test_an_unknown_material_is_refused_with_the_published_names() -> None:
    with pytest.raises(InputError, match="published"):
        from raytracer.analysis.reflectance.verification import make_material

        make_material("nope/clay", {})


@pytest.mark.gl
def test_a_baked_table_reflects_as_its_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "ggx.binary"
    assert main(["brdf", "bake", "ggx:alpha=0.5", "--set", "f0=0.5", "-o", str(file)]) == 0
    assert capsys.readouterr().out.startswith(f"wrote {file}")
    wi, wo = (0.6, 0.0, 0.8), [(-0.6, 0.0, 0.8), (0.0, 0.0, 1.0)]
    table, model = rt.Material("merl", file=file), rt.Material("ggx", alpha=0.5, f0=0.5)
    np.testing.assert_allclose(rt.brdf.evaluate(table, wi, wo), rt.brdf.evaluate(model, wi, wo), rtol=2e-3)
    status, out, _ = run(capsys, "check", "merl", "--set", f"file={file}")
    assert status == 0 and "Not reciprocal" not in out, "rounding moves the place in the table, by up to 2.5e-4"
    assert 0.0 < properties.measure_material(table, (60.0,)).reciprocity < properties.RECIPROCAL_TABLE
    assert main(["brdf", "bake", "ggx", "-o", str(tmp_path / "a.png")]) == 2
    assert "expected an output that ends in .binary" in capsys.readouterr().err
