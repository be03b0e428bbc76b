"""The ledger of extremes in its shorter form, and the measurements behind its rows."""

import csv
import dataclasses
import io
import os
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import raytracer as rt
from raytracer import glsl
from raytracer.analysis.numerics import fuzz
from raytracer.analysis.numerics.findings import Finding, worst_findings
from raytracer.analysis.numerics.ledger import ROWS
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.analysis.rounding_bounds import UNIT
from raytracer.app.cli import main
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Evaluator, Precision
from raytracer.scene.settings import Settings
from raytracer.scene.warnings import precision_warning
from tests import scenes
from tests.pictures import assert_agrees, assert_agrees_with_truth
from tests.processes import run_to_end

BALL = rt.Sphere((0, 0, 0), 1, scenes.COLORS[0])


@pytest.mark.gl
@pytest.mark.parametrize(
    "row",
    [pytest.param(row, marks=pytest.mark.slow if row.__name__ == "valid_scenes" else []) for row in ROWS],
    ids=lambda row: row.__name__,
)
def test_every_measurement_of_the_ledger_is_within_its_bound(
    renderer: Renderer, row: Callable[..., Iterator[Finding]]
) -> None:
    findings = list(row(renderer, True))
    assert findings and [f for f in findings if not f.is_within_bound] == []


@pytest.mark.slow
@pytest.mark.gl
def test_random_scenes_over_all_ranges_have_no_fault(renderer: Renderer) -> None:
    assert [f for f in fuzz.measure_random_scenes(renderer, 200) if not f.is_within_bound] == []


def test_random_scenes_repeat_for_one_seed_and_cover_the_ranges() -> None:
    assert fuzz.random_scene(17) == fuzz.random_scene(17)
    random_scenes = [fuzz.random_scene(25 * structure) for structure in range(300)]
    radii = [leaf.radius for s in random_scenes for o in s.solids() for leaf in _spheres(o)]
    fovs = [s.camera.vertical_fov for s in random_scenes if s.camera.projection == "perspective"]
    assert 0.1 < 1.0 - len(fovs) / 300 < 0.4
    assert min(radii) < 1e-6 and max(radii) > 1e6 and min(fovs) < 0.05 and max(fovs) > 150
    assert max(m.h for s in random_scenes for m in s.materials) > 3e5


def _spheres(solid: rt.Solid) -> list[rt.Sphere]:
    from raytracer.scene.solids.flattening import leaves

    return [leaf for leaf in leaves(solid) if isinstance(leaf, rt.Sphere)]


# Regressions that fuzzing found: each scene with the error that its normals had, or 0 if another number was wrong.
MATTE = rt.Material(ka=0, kd=(0.8, 0.1, 0.1), ks=0)
BAD: dict[str, tuple[rt.Scene, float]] = {
    # Normals came from a hit point that is rounded at the scale of its distance, 1e6 radii: off by 0.086. In 1 pixel
    # of 7 float32 may miss the sphere: its two roots differ by less than the error of the depth.
    "normals of a small sphere far away": (
        rt.Scene([rt.Sphere((3e5, -2e5, -9e5), 1)], [], rt.Camera((0, 0, 0), (3e5, -2e5, -9e5), vertical_fov=2e-4)),
        0.086,
    ),
    # The same rounding made 52 pixels dark that face the light.
    "the dark side of a sphere far away": (
        rt.Scene(
            [rt.Sphere((-1713136.237163081, -5061952.163780087, -1615279.4041327743), 3379.277859586039, MATTE)],
            [rt.PointLight((-3398799.446854165, -24294762.64629382, -14623812.262555387))],
            rt.Camera(
                (-1314400596.8955562, -229518130.01746485, -943059907.5655688),
                (-1713987.430499994, -5061792.242792757, -1612012.9972332446),
                (0.7295023576537003, 0.0375966896371232, 0.6829442137583586),
                1e-4,
            ),
        ),
        0.045,
    ),
    # The camera is inside a sphere, with a field of view of 179.9 degrees. A scalar product that cancels made the
    # depth wrong by 1.1e-6 of itself, 2.5 times the bound.
    "the border of a very wide picture": (
        rt.Scene(
            [rt.Sphere((15707.330604341218, -12719.35233186662, 20963.752224910186), 1.2064661164300412, MATTE)],
            [rt.PointLight((15706.407686153554, -12712.668288778847, 20963.84974934618))],
            rt.Camera(
                (15707.831379143317, -12718.258560471742, 20963.802899746675),
                (15708.35855610391, -12718.882446994798, 20964.174224757226),
                (-0.3878254203179379, -0.1100283450414027, -0.9151421783759423),
                179.9,
            ),
        ),
        0.0,
    ),
    # The reference was wrong: its normals came from a hit point in world coordinates, 21 times the bound of doubles.
    "1e11 from the origin": (
        rt.Scene([rt.Sphere((6e10, 3e10, -7e10), 1.5)], [], rt.Camera((6e10, 3e10, -7e10 + 6), (6e10, 3e10, -7e10))),
        0.0,
    ),
}


@pytest.mark.gl
@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("name", BAD)
def test_scenes_that_once_were_wrong_agree_with_the_reference(
    renderer: Renderer, name: str, precision: Precision
) -> None:
    scene, previous_normal_error = BAD[name]
    image = renderer.render(scene, (96, 64), Settings(precision=precision))
    truth = ray_tracer.trace(scene, (96, 64))
    resolved = find_pixel_doubt(scene, (96, 64), precision)
    assert_agrees(image, truth, resolved, doubt=0.15)
    assert previous_normal_error == 0 or previous_normal_error > 100 * resolved.normal[~resolved.doubtful].max()
    dark = (image.radiance == 0).all(axis=2) != (truth.radiance == 0).all(axis=2)
    assert not (dark & ~resolved.doubtful & ~resolved.unlit).any()


# (h, angle in radians between R and V, the error of pow(cosine, h) in float32)
HIGHLIGHTS = [(1e4, 0.01, 1.7e-3), (1e5, 0.004, 1e-2), (1e6, 0.001, 0.19)]


@pytest.mark.gl
@pytest.mark.parametrize(("h", "angle", "pow_error"), HIGHLIGHTS)
def test_a_sharp_highlight_is_more_precise_than_pow(
    renderer: Renderer, h: float, angle: float, pow_error: float
) -> None:
    V = (np.sin(angle), 0, np.cos(angle))
    value = glsl.call("mirrorLobe", (0, 0, 1), (0, 0, 1), V, h, device=renderer.device)[0]
    V32 = np.array(V, np.float32).astype(float)
    exact = np.exp(-0.5 * h * np.log1p((V32[0] / V32[2]) ** 2))
    assert abs(value / exact - 1) < 1e-5 < pow_error


@pytest.mark.gl
def test_a_highlight_of_any_exponent_is_1_at_its_middle_and_0_behind(renderer: Renderer) -> None:
    z, back, side = (0, 0, 1), (0, 0.6, -0.8), (1, 0, 0)
    for h in (0.0, 1e-30, 0.5, 1e6):
        for lobe in ("mirrorLobe", "halfwayLobe"):
            assert glsl.call(lobe, z, z, z, h, device=renderer.device)[0] == 1
        expected = 1 if h == 0 else 0
        assert glsl.call("mirrorLobe", z, z, back, h, device=renderer.device)[0] == expected
        assert glsl.call("mirrorLobe", z, z, side, h, device=renderer.device)[0] == expected  # R.V = 0
        assert glsl.call("halfwayLobe", z, z, (0, 0, -1), h, device=renderer.device)[0] == expected  # H is undefined


@pytest.mark.gl
@pytest.mark.parametrize("evaluator", get_args(Evaluator))
def test_doubles_make_the_same_picture_more_precisely(renderer: Renderer, evaluator: str) -> None:
    settings = Settings(precision=64, evaluator=evaluator, shadows="diluted", samples=3)  # pyright: ignore[reportArgumentType]
    image = renderer.render(scenes.assignment(), (160, 90), settings)
    truth = ray_tracer.trace(scenes.assignment(), (160, 90), settings)
    assert image.depth is not None and truth.depth is not None
    hit = np.isfinite(truth.depth)
    np.testing.assert_allclose(image.depth[hit], truth.depth[hit], rtol=UNIT[32])
    np.testing.assert_allclose(image.radiance, truth.radiance, atol=1e-6)


@pytest.mark.gl
def test_a_line_in_a_plane_lies_inside_the_half_space_and_crosses_nothing(renderer: Renderer) -> None:
    rays = np.zeros(3, glsl.dtype("Ray"))
    rays["ro"], rays["rd"] = [(0, 2, 0), (0, 1.5, 0), (0, 2.5, 0)], (1, 0, 0)
    span = glsl.call("planeSpan", rays, (0, 1, 0, 2), 0.0, device=renderer.device)
    np.testing.assert_array_equal(np.sign(span), [(-1, 1), (-1, 1), (1, -1)])


@pytest.mark.gl
def test_64_bits_resolve_a_sphere_that_32_bits_cannot(renderer: Renderer) -> None:
    # A sphere whose radius is 1e-9 of its distance: in float32 its two roots are one number.
    ball = rt.Sphere((3e8, -2e8, -9e8), 1)
    scene = rt.Scene(
        [ball], [rt.PointLight((3e8, -2e8 + 3, -9e8 + 4))], rt.Camera((0, 0, 0), ball.center, vertical_fov=2e-7)
    )
    assert "--precision 64" in str(precision_warning(scene, Settings()))
    assert precision_warning(scene, Settings(precision=64)) is None
    assert find_pixel_doubt(scene, (32, 32), 32).doubtful.mean() > 0.2
    assert_agrees_with_truth(renderer, scene, (32, 32), Settings(precision=64))


def test_the_precision_warning_starts_where_float32_loses_the_smallest_radius() -> None:
    def warned(*objects: rt.Solid, eye: float = 5.0) -> bool:
        return precision_warning(scenes.lit_scene(*objects, eye=(0, 0, eye)), Settings()) is not None

    assert not warned(BALL) and not warned(BALL, eye=4e4) and warned(BALL, eye=4.3e4)
    # A huge sphere is as near as its nearest point, which float32 resolves. From inside, its far side is far away.
    assert not warned(BALL, rt.Sphere((0, -1e7 - 1, 0), 1e7), eye=2)
    assert warned(BALL, ~rt.Sphere((0, 0, 0), 1e7), eye=2)
    assert precision_warning(scenes.assignment(), Settings()) is None
    with pytest.warns(UserWarning, match="try --precision 64"):
        rt.render(scenes.lit_scene(BALL, eye=(0, 0, 1e6)), (2, 2))


def test_render_warns_of_low_precision_and_refuses_doubles_that_the_driver_lacks(tmp_path: Path) -> None:
    scene = tmp_path / "far.toml"
    scene.write_text(
        "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, -1]\nvertical_fov = 1e-4\n[materials.m]\n"
        '[shapes.ball]\nsphere = { center = [0, 0, -1e6], radius = 1 }\nmaterial = "m"\n[objects]\nball = "ball"\n'
    )

    def run(*arguments: str, **environment: str) -> tuple[int, str]:
        command = [
            sys.executable,
            "-m",
            "raytracer",
            "render",
            str(scene),
            "-o",
            str(tmp_path / "o.png"),
            "--size",
            "9x9",
        ]
        done = run_to_end(*command, *arguments, env={**os.environ, **environment})
        return done.returncode, done.stderr

    status, errors = run()
    assert status == 0 and errors.startswith(f"raytracer: warning: {scene}: ") and "--precision 64" in errors
    assert run("--precision", "64") == (0, "")
    # An environment variable limits Mesa to OpenGL 3.3, the version of some other drivers.
    status, errors = run("--precision", "64", MESA_GL_VERSION_OVERRIDE="3.3")
    assert status == 2 and "precision: 64 needs OpenGL 4.0 or later, got 3.3" in errors and errors.count("\n") == 1


def test_the_power_of_a_point_is_exact_to_double_rounding_for_any_radius() -> None:
    rng = np.random.default_rng(6)
    for _ in range(300):
        center, radius = rng.normal(size=3) * 10 ** rng.uniform(-6, 9), 10 ** rng.uniform(-6, 9)
        direction = rng.normal(size=3)
        point = center + direction / np.linalg.norm(direction) * radius * (1 + 10 ** rng.uniform(-16, 1))
        exact = (
            sum((Fraction(c) - Fraction(p)) ** 2 for c, p in zip(center, point, strict=True)) - Fraction(radius) ** 2
        )
        power = rt.Sphere(tuple(center), radius).power(tuple(point))
        assert abs(Fraction(power) - exact) <= abs(exact) * Fraction(2) ** -52


def test_a_point_touches_a_surface_within_the_rounding_of_its_coordinates() -> None:
    ball, floor = rt.Sphere((0, 1, 0), 1), rt.Plane((1, 2, 7), 5)
    assert ball.touches((0.6, 1, 0.8)) and ball.touches((0, 0, 0)) and not ball.touches((0.6, 1, 0.8 + 1e-14))
    assert floor.touches((0.1, 0.7, 0.5)) and not floor.touches((0.1, 0.7, 0.5 + 1e-14))
    far = rt.Sphere((1e9, 1, 0), 1)
    assert far.touches((1e9 + 0.6, 1, 0.8)) and not far.touches((1e9 + 0.61, 1, 0.8))


def test_pixels_are_doubtful_only_near_tangents_and_ties() -> None:
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=60)
    ball = rt.Scene([BALL], [], camera)
    assert not find_pixel_doubt(ball, (400, 400)).doubtful.any()
    # The camera looks straight at the outline, so closely that a pixel is smaller than a unit in the last place.
    tangent = rt.Camera((0, 0, 5), (2 * 6**0.5 / 5, 0, 0.2), vertical_fov=1e-6)
    doubtful = find_pixel_doubt(rt.Scene([BALL], [], tangent), (16, 16))
    assert doubtful.doubtful.all()
    assert not find_pixel_doubt(rt.Scene([BALL], [], tangent), (16, 16), 64).doubtful.all()
    # Coincident surfaces are no tie; almost coincident surfaces are.
    for radius, tie in ((1.0, False), (1.0 + 1e-9, True), (1.0 + 1e-4, False)):
        twins = rt.Scene([BALL, rt.Sphere((0, 0, 0), radius)], [], camera)
        assert find_pixel_doubt(twins, (9, 9)).doubtful[4, 4] == tie


def test_a_finding_beyond_its_bound_is_reported_and_sets_the_exit_status(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(renderer: Renderer, short: bool) -> Iterator[Finding]:
        """About it."""
        yield Finding("a row", "1e3", 32, "wrong pixels", 0, 0)
        yield Finding("a row", "1e6", 32, "wrong pixels", 7, 0, "a note")

    monkeypatch.setattr("raytracer.analysis.numerics.ledger.ROWS", (broken,))
    command = ["extremes", "-o", str(tmp_path), "--fuzz", "0"]
    assert main(command) == 1
    out = capsys.readouterr().out
    assert "2 measurements, 1 beyond their bounds" in out
    assert "a row, 1e6, 32 bits: wrong pixels: 7, bound 0" in out
    rows = list(csv.DictReader(io.StringIO((tmp_path / "extremes.csv").read_text())))
    assert [row["kept"] for row in rows] == ["True", "False"] and rows[1]["note"] == "a note"
    text = (tmp_path / "extremes.md").read_text()
    assert "| a row | 2 | **1** | 0 |  |" in text and "| 1e6 | **7** | a note |" in text and "About it." in text
    assert main([*command[:1], "-o", str(tmp_path / "nowhere")]) == 2


def test_the_worst_finding_is_one_beyond_its_bound_or_else_the_largest() -> None:
    fine = Finding("w", "a", 32, "m", 0.5, 1)
    larger, broken = dataclasses.replace(fine, at="b", measured=0.9), dataclasses.replace(fine, at="c", bound=0.4)
    assert worst_findings([fine, larger])[0].at == "b"
    assert worst_findings([fine, broken, larger])[0].at == "c"
    assert not dataclasses.replace(fine, measured=float("nan")).is_within_bound
