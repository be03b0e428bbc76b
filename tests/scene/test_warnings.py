"""Warnings about scenes that probably do not look as intended. Examples and published materials have no warnings."""

import math
import warnings
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.formats.material_library import collections, published, read_collection
from raytracer.formats.scene_file import examples
from raytracer.scene.materials.models import MODELS
from raytracer.scene.warnings import scene_warnings
from tests import scenes


@pytest.fixture
def bright(tmp_path: Path) -> Path:
    """The assignment with a red in the range 0 to 255, a common mistake."""
    file = tmp_path / "bright.toml"
    text = scenes.ASSIGNMENT.read_text()
    file.write_text(text.replace("kd = [0.64, 0.08, 0.08]", "kd = [178, 25, 25]"))
    return file


@pytest.mark.gl
def test_a_material_with_an_albedo_above_1_is_named_once_with_its_parameters(
    bright: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        rt.render(rt.load(bright), (8, 8))
    assert [str(warning.message).partition(":")[0] for warning in caught] == ["material 'red'"]
    assert "kd = 178" in str(caught[0].message) and caught[0].filename == __file__
    assert main(["render", str(bright), "-o", str(tmp_path / "a.png"), "--size", "8x8"]) == 0
    errors = capsys.readouterr().err
    assert errors.startswith(f"raytracer: warning: {bright}: material 'red': kd = 178: ") and errors.count("\n") == 1


def test_a_warning_shows_all_digits_of_a_value_just_above_1() -> None:
    material = rt.Material(kd=1.0000001)
    scene = rt.Scene([rt.Sphere((0, 0, 0), 1, material)], [], rt.Camera((0, 0, 5), (0, 0, 0)))
    assert "kd = 1.0000001: a value above 1" in scene_warnings(scene, rt.Settings())[0]


def test_reflected_shares_above_1_warn_and_emission_and_indices_do_not() -> None:
    def warned(material: rt.Material) -> list[str]:
        scene = rt.Scene([rt.Sphere((0, 0, 0), 1, material)], [rt.PointLight((0, 9, 0), (9, 9, 9))], camera)
        return scene_warnings(scene, rt.Settings())

    camera = scenes.assignment().camera
    cases: tuple[dict[str, Any], ...] = {"kd": (0, 1.5, 0)}, {"ks": 2}, {"ka": 255}
    for parameters in cases:
        (warning,) = warned(rt.Material(**parameters))
        assert next(iter(parameters)) in warning and "material 0" in warning
    for material in (
        rt.Material(kd=1, ks=1, ka=1, le=40),
        rt.Material("ggx", fresnel="conductor", n=3, k=4),
        rt.Material("minnaert", k=2),
        rt.Material("lafortune", lobes=[rt.Lobe(-1, 1, 20, scale=3)]),
        rt.Material("he", wavelength=2, sigma0=5),
    ):
        assert warned(material) == []


def test_warnings_name_only_the_first_of_many_materials() -> None:
    spheres = [rt.Sphere((i, 0, 0), 0.4, rt.Material(kd=2 + i, name=f"m{i}")) for i in range(40)]
    texts = scene_warnings(scenes.lit_scene(*spheres), rt.Settings())
    assert len(texts) == 6 and "'m4'" in texts[4] and texts[5].startswith("35 more materials")


def test_soft_shadows_without_a_light_or_without_a_radius_warn() -> None:
    point = scenes.with_light_radii(scenes.assignment(), 0.0)
    (warning,) = scene_warnings(point, rt.Settings(shadows="soft"))
    assert "no light has a radius" in warning
    dark = msgspec.structs.replace(point, lights=())
    for shadows in ("soft", "diluted"):
        (warning,) = scene_warnings(dark, rt.Settings(shadows=shadows))
        assert warning.startswith(f"{shadows} shadows have no effect here, because the scene has no light")
    for scene, settings in (
        (point, rt.Settings()),
        (point, rt.Settings(shadows="diluted")),
        (scenes.assignment(), rt.Settings(shadows="soft")),
        (dark, rt.Settings()),
    ):
        assert scene_warnings(scene, settings) == []


@pytest.mark.gl
def test_a_reference_warns_about_materials_and_memory_but_not_about_distances(
    bright: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # A scene beyond the distances of 32 bits, about which render() warns. The reference computes with 64 bits.
    far = rt.Scene([rt.Sphere((0, 0, 0), 1e-4), rt.Plane((0, 1, 0), -1e6)], [], rt.Camera((0, 0, 9), (0, 0, 0)))
    monkeypatch.setattr("raytracer.core.memory._WARN_BYTES", 1)
    monkeypatch.setattr("raytracer.core.memory._WARN_SHARE", 0.0)
    for scene, messages in ((rt.load(bright), ["material 'red'", "this picture needs"]), (far, ["this picture needs"])):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            rt.reference(scene, (4, 4), samples=16, cache=False, workers=1)
        assert all(str(warning.message).startswith(text) for warning, text in zip(caught, messages, strict=True))
        assert {warning.filename for warning in caught} == {__file__}
    assert capsys.readouterr().err == ""
    assert main(["render", "assignment", "-o", str(tmp_path / "a.png"), "--size", "4x4"]) == 0
    assert "raytracer: warning: this picture needs 0.0 GiB of memory" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["render", "reference", "tune"])
def test_every_command_that_draws_prints_the_warning(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "point.toml"
    file.write_text(scenes.ASSIGNMENT.read_text().replace("radius = 0.4 ", ""))

    def draw(*_: object, **__: object) -> None:
        raise RuntimeError("enough")

    monkeypatch.setattr("raytracer.rendering.renderer.Renderer.render", draw)
    monkeypatch.setattr("raytracer.ground_truth.converged.trace_converged", draw)
    out = ["-o", str(tmp_path / "a.npz")] if command != "tune" else ["--max-error", "0.1"]
    assert main([command, str(file), *out, "--size", "8x8", "--shadows", "soft"]) == 1
    assert "no light has a radius" in capsys.readouterr().err


def test_examples_and_published_materials_do_not_warn() -> None:
    for name in examples():
        assert scene_warnings(rt.load(name), rt.Settings(shadows="soft" if name != "many" else "hard")) == []
    names = [f"{collection}/{name}" for collection in collections() for name in read_collection(collection)]
    materials = [published(name) for name in names]
    defaults = [rt.Material(model) for model in MODELS if model != "merl"]
    spheres = [rt.Sphere((i, 0, 0), 0.4, material) for i, material in enumerate([*materials, *defaults])]
    assert len(materials) > 100 and scene_warnings(scenes.lit_scene(*spheres), rt.Settings()) == []


def test_the_precision_warning_measures_distances_to_outlines_or_from_inside_to_the_far_side() -> None:
    rng = np.random.default_rng(2)
    eye = (0.5, -1.0, 2.0)
    for _ in range(20):
        balls = [rt.Sphere(tuple(rng.normal(size=3).tolist()), 10.0 ** rng.uniform(-7, 1)) for _ in range(4)]
        powers = [ball.power(eye) for ball in balls]
        reached = [
            math.sqrt(power) if power > 0.0 else math.dist(ball.center, eye) + ball.radius
            for ball, power in zip(balls, powers, strict=True)
        ]
        farthest, smallest = max(reached), min(ball.radius for ball in balls)
        texts = scene_warnings(scenes.lit_scene(*balls, eye=eye), rt.Settings())
        assert len(texts) == (farthest > 0.01 * 2.0**22 * smallest)
        assert all(f"({farthest:.2g})" in text and f"({smallest:.2g})" in text for text in texts)


def test_the_precision_warning_knows_half_the_thickness_of_all_solids_moved_or_in_instances() -> None:
    eye = (0.0, 0.0, 100.0)
    plate = rt.Box((-1, -1, 0), (1, 1, 4e-3))
    thin: list[rt.Solid | rt.Instances] = [
        plate.rotate((1, 2, 3), 40),
        rt.Ellipsoid((0, 0, 0), (1, 1, 2e-3)),
        rt.Cylinder((0, 0, 0), (1, 2, 0), 2e-3),
        rt.Torus((0, 0, 0), (1, 2, 3), 1, 2e-3),
        rt.Box((0, 0, 0), (2, 2, 2)).scale((1, 1, 2e-3)),
        rt.Instances(plate.scale(0.1), [[0, 0, 0], [0, 0.5, 0]], [10, 10]),
    ]
    for solid in thin:
        (text,) = scene_warnings(scenes.lit_scene(solid, eye=eye), rt.Settings())
        assert "(1e+02) is 5e+04 times" in text and "half thickness (0.002)" in text
    for solid in (plate.scale(2), rt.Cone((0, 0, 0), (0, 1, 0), 1, 0), rt.Paraboloid((0, 0, 0), (0, 1, 0), 1)):
        assert scene_warnings(scenes.lit_scene(solid, eye=eye), rt.Settings()) == []
