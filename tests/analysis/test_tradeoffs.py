"""`raytracer trade`: the plan, the Pareto front, rates of convergence, plots, and the files."""

from __future__ import annotations

import csv
import json
import re
import sys
from base64 import b64decode
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import msgspec
import numpy as np
import pytest

from raytracer.analysis.figures import SEQUENCE_STYLES, TECHNIQUE_STYLES
from raytracer.analysis.image_difference import Comparison
from raytracer.analysis.tradeoffs import approximations, configurations, page, plots
from raytracer.analysis.tradeoffs import measurement as measuring
from raytracer.analysis.tradeoffs.approximations import replace_materials
from raytracer.analysis.tradeoffs.configurations import FULL, MAIN, QUICK, Configuration, Plan, Target, plan
from raytracer.analysis.tradeoffs.data_files import as_csv, as_json
from raytracer.analysis.tradeoffs.measurement import Result, measure_tradeoffs, resize_picture
from raytracer.analysis.tradeoffs.page import write_page
from raytracer.analysis.tradeoffs.pareto import find_dominating, fit_slope
from raytracer.analysis.tradeoffs.targets import Reference, make_reference
from raytracer.app.cli import main
from raytracer.formats.image import Image
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.material import Material
from raytracer.scene.sequences import SEQUENCES, SampleSequence, sample_place
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch, minimal_patch
from tests import scenes

gl = pytest.mark.gl
SCENE = str(scenes.ASSIGNMENT)


def test_a_point_off_the_pareto_front_is_dominated_by_the_fastest_point_that_is_as_accurate() -> None:
    points = [(1.0, 9.0), (2.0, 4.0), (3.0, 4.0), (2.5, 5.0), (4.0, 1.0), (5.0, 4.5), (0.5, 9.0)]
    assert find_dominating(points) == [6, None, 1, 1, None, 1, None]


@gl
def test_a_reference_with_an_uncertain_error_says_so_and_resolves_less(renderer: Renderer) -> None:
    for scene, uncertain in ((scenes.glint(), True), (scenes.assignment(), False)):
        target = Target("hard shadows", scene, Settings())
        reference = make_reference(target, (160, 90), renderer, "gpu", gpu_samples=16)
        assert reference.is_uncertain == uncertain == ("at least" in reference.in_words)
        assert reference.resolved_from == (10.0 if uncertain else 3.0) * reference.error


def test_equal_points_do_not_dominate_each_other() -> None:
    assert find_dominating([(1.0, 1.0), (1.0, 1.0)]) == [None, None]


@pytest.mark.parametrize("p", [0.5, 0.75, 1.0])
def test_the_slope_of_a_power_law_is_its_exponent(p: float) -> None:
    counts = [4, 16, 64, 256]
    assert fit_slope(counts, [0.3 * n**-p for n in counts]) == pytest.approx((p, 0.3))
    assert fit_slope([4], [0.1]) is None


def texts(svg: bytes) -> set[str]:
    """The texts of an .svg file, which must be well-formed."""
    return {element.text or "" for element in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")}


def test_each_sequence_and_technique_has_its_own_marker_and_each_sequence_its_own_colour() -> None:
    assert [*SEQUENCE_STYLES] == [*SEQUENCES]
    styles = [*SEQUENCE_STYLES.values(), *TECHNIQUE_STYLES.values()]
    assert len({(style.marker, style.filled) for style in styles}) == len(styles)
    colors = [style.color for style in SEQUENCE_STYLES.values()]
    assert len({*colors} - {style.color for style in TECHNIQUE_STYLES.values()}) == len(SEQUENCES)


def test_panels_of_approximations_have_one_scale_and_labels_apart() -> None:
    pytest.importorskip("matplotlib")
    settings, times = Settings(), {"exact": 0.2, "fast": 0.01, "faster": 0.009, "slow": 0.5}
    errors = {"exact": 0.0, "fast": 0.01, "faster": 0.0101, "slow": 1e-5}
    results = [
        Result(Configuration((name,), label, name, settings), [times[label]], error=comparison(errors[label]))
        for name in ("a: exact", "b: exact")
        for label in times
        if name[0] == "a" or label != "slow"
    ]
    targets = {name: Target(name, scenes.assignment(), settings, True) for name in ("a: exact", "b: exact")}
    trade = measuring.Tradeoffs("", (1, 1), 1, {}, Plan(targets, [], []), {}, results)
    figure = plots.error_of_approximations(trade, [*targets])
    a, b = figure.axes
    assert (a.get_xlim(), a.get_ylim()) == (b.get_xlim(), b.get_ylim())
    assert a.get_xlim()[0] < 0.045 and a.get_xlim()[1] > 2.5 and a.get_ylim()[0] < 1e-5
    figure.draw_without_rendering()
    points = sorted(text.xyann[1] * a.bbox.height * 72.0 / figure.dpi for text in a.texts)
    assert min(np.diff(points)) > a.texts[0].get_fontsize(), "no two labels overlap"


def comparison(rmse: float) -> Comparison:
    return Comparison(rmse, rmse, (0, 0), 0.0, None, 0.01, 0.0)


def coverage_error(sequence: SampleSequence, n: int) -> float:
    """Return the root mean square error of the share of a pixel beyond an edge, over random edges.

    Each edge cuts the upper and the lower side of the pixel. The exact share is the mean of the two places.
    """
    rng = np.random.default_rng(1)
    tangent = rng.uniform(-1.0, 1.0, 2000)  # x = middle + tangent * (y - 1/2)
    middle = rng.uniform(0.5 * np.abs(tangent), 1.0 - 0.5 * np.abs(tangent))
    points = np.array([sample_place(k, sequence, n) for k in range(n)]) * 2.0**-24
    # Edges near the y direction, and edges near the x direction.
    inside = points[:, 0] < middle[:, None] + tangent[:, None] * (points[:, 1] - 0.5)
    other = points[:, 1] < middle[:, None] + tangent[:, None] * (points[:, 0] - 0.5)
    return float(np.sqrt(np.mean((np.stack([inside, other]).mean(axis=2) - middle) ** 2)))


def test_on_random_edges_sobols_points_converge_faster_than_random_ones_and_are_always_better() -> None:
    counts = [4, 16, 64, 256]
    errors = {name: [coverage_error(name, n) for n in counts] for name in ("sobol", "random", "r2")}
    rates = {name: fit_slope(counts, series) for name, series in errors.items()}
    assert rates["sobol"] and rates["random"]
    # Independent points: n^-1/2. Scrambled nets on edges: n^-3/4.
    assert rates["random"][0] == pytest.approx(0.5, abs=0.12)
    assert rates["sobol"][0] == pytest.approx(0.75, abs=0.12)
    assert all(np.array(errors["sobol"]) < errors["random"])


@pytest.mark.parametrize("extent", [FULL, QUICK])
def test_every_setting_is_varied_once_and_compared_with_its_own_shadow_model(extent) -> None:
    made = plan(scenes.with_light_radii(scenes.assignment(), 0.0), extent)
    keys = [(c.target, c.settings, c.scale, c.estimates) for c in made.configurations]
    assert len(set(keys)) == len(keys), "no configuration is measured twice"
    for configuration in made.configurations:
        shadows = made.targets[configuration.target].settings.shadows
        assert configuration.settings.shadows == shadows and configuration.target == f"{shadows} shadows"
    knobs = {knob for configuration in made.configurations for knob in configuration.knobs}
    assert knobs >= {"samples", "sequence", "adaptive", "max error", "shadows", "precision", "evaluator", "resolution"}
    assert all(light.radius > 0.0 for light in made.targets["soft shadows"].scene.lights)
    assert "no light" in made.left_out[0][1], "it says that it gave the lights a radius"


def test_other_settings_come_from_the_scene_file_and_flags_override_it() -> None:
    file_settings = SettingsPatch(samples=64, adaptive=0.01, shading="blinn", shadows="soft", bounces=2, precision=64)
    made = plan(scenes.assignment(), QUICK, file_settings)
    everything = [c.settings for c in made.configurations] + [target.settings for target in made.targets.values()]
    assert {(settings.shading, settings.bounces) for settings in everything} == {("blinn", 2)}
    assert {settings.precision for settings in everything} == {32, 64}
    labels = {c.label: c for c in made.configurations if c.target == MAIN}
    assert "16 sobol" in labels and "4 sobol, 32 bits" in labels
    for configuration in made.configurations:
        overrides = minimal_patch(configuration.settings, file_settings)
        assert (file_settings | overrides).resolve() == configuration.settings
    flags = measuring.Tradeoffs("", (1, 1), 1, {}, made, {}, [measuring.Result(labels["16 sobol"], [])])
    assert "--samples 16 --shadows hard --adaptive none" in as_csv(flags)


def test_a_scene_without_lights_has_one_shadow_model() -> None:
    made = plan(msgspec.structs.replace(scenes.assignment(), lights=()), QUICK)
    assert list(made.targets) == ["hard shadows"] and made.left_out == [("shadows", "the scene has no lights")]
    assert {configuration.target for configuration in made.configurations} == {"hard shadows"}


def test_resizing_keeps_the_mean_and_a_constant() -> None:
    picture = np.random.default_rng(0).random((8, 12, 3)).astype(np.float32)
    small = resize_picture(picture, (6, 4))
    np.testing.assert_allclose(small, picture.reshape(4, 2, 6, 2, 3).mean(axis=(1, 3)), rtol=1e-6)
    np.testing.assert_allclose(resize_picture(np.full((2, 3, 3), 0.25, np.float32), (12, 8)), 0.25, rtol=1e-6)


def test_other_materials_keep_the_objects_of_the_scene() -> None:
    scene = replace_materials(scenes.assignment(), lambda _: Material("lambert"))
    assert scene.materials == (Material("lambert"),)
    assert len(scene.solids()) == len(scenes.assignment().solids())


@gl
def test_a_quick_trade_writes_a_table_json_and_a_page_that_needs_no_other_file(tmp_path: Path) -> None:
    folder = tmp_path / "trade"
    assert main(["trade", SCENE, "-o", str(folder), "--quick", "--rounds", "1"]) == 0
    with (folder / "trade.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    data = json.loads((folder / "trade.json").read_text())
    assert data["complete"] and len(rows) == len(data["configurations"])
    measured = [row for row in rows if row["seconds"]]
    assert len(measured) > 30 and all(float(row["fastest"]) <= float(row["seconds"]) for row in measured)
    by = {(row["target"], row["configuration"]): row for row in measured}
    resolved = {name: truth["resolved"] for name, truth in data["truths"].items()}
    for row in measured:
        assert (row["front"] == "True") == (row["beaten_by"] == "")
        if row["beaten_by"]:
            # The dominating configuration is as fast and as accurate, above the error that the reference resolves.
            other, floor = by[row["target"], row["beaten_by"]], resolved[row["target"]]
            assert float(other["seconds"]) <= float(row["seconds"])
            assert max(float(other["rmse"]), floor) <= max(float(row["rmse"]), floor)
    error = {label: float(row["rmse"]) for (target, label), row in by.items() if target == "hard shadows"}
    assert error["16 sobol"] < error["4 sobol"] < error["1 sample, the centre"]
    html = (folder / "trade.html").read_text()
    assert "<svg" in html and "data:image/png;base64," in html
    links = re.findall(r'<a download="([^"]+)[.]svg" href="data:image/svg[+]xml;base64,([^"]+)"', html)
    assert len(links) == html.count("<svg") - 1 >= 6, "each plot but the colour scale is offered as a file"
    svg = {name: texts(b64decode(file)) for name, file in links}
    samples = svg["error-against-samples-hard-shadows"]
    assert {"4", "16", "samples per pixel, n", "error (RMSE, linear radiance)"} <= samples and "10" not in samples
    assert {"sobol", "random", "Pareto front", "time (milliseconds, median)"} <= svg["error-against-time"]
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!data:|#)|url\((?!["']?#)|@import|<script|<link""", html)


@gl
def test_an_interrupted_trade_keeps_its_measurements_and_the_page_escapes_the_scenes_name(
    renderer: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = '<script>alert("&")</script>'
    scene = msgspec.structs.replace(scenes.assignment(), name=name)
    made = plan(scene, QUICK)
    count = 0
    picture = measuring.time_picture

    def interrupted(*arguments):
        nonlocal count
        count += 1
        if count > 7:
            raise KeyboardInterrupt
        return picture(*arguments)

    monkeypatch.setattr(measuring, "time_picture", interrupted)

    def bar(title):
        from contextlib import nullcontext

        return nullcontext()

    trade = measure_tradeoffs(scene, made, renderer, (32, 18), 3, bar, method="gpu", gpu_samples=64)
    assert not trade.complete and sum(result.measured for result in trade.results) == 3
    html = write_page(trade, renderer, tmp_path).read_text()
    assert "Interrupted" in html and name not in html and "&lt;script&gt;" in html
    assert json.loads(as_json(trade))["scene"] == name


@gl
@pytest.mark.parametrize("why", ["Ctrl-C", "a driver's error"])
def test_a_failed_page_leaves_the_tables_and_no_older_page(
    why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt if why == "Ctrl-C" else RuntimeError("no more")

    def smaller_plan(*arguments: Any) -> Plan:
        made = plan(*arguments)
        made.targets = {MAIN: made.targets[MAIN]}
        made.configurations = [c for c in made.configurations if c.target == MAIN][:2]
        return made

    monkeypatch.setattr(page, "make_strips", stop)
    monkeypatch.setattr(configurations, "plan", smaller_plan)
    monkeypatch.setattr(approximations, "add_approximations", lambda *_: None)
    (tmp_path / "trade.html").write_text("an older one")
    assert main(["trade", SCENE, "-o", str(tmp_path), "--quick", "--size", "32x18"]) == (130 if why == "Ctrl-C" else 1)
    assert {file.name for file in tmp_path.iterdir()} == {"trade.csv", "trade.json"}
    assert len(json.loads((tmp_path / "trade.json").read_text())["configurations"]) == 2
    said = capsys.readouterr()
    timing = "timing all 2 configurations in turns, 2 times"
    steps = [f"rendering the reference of {MAIN} (1 of 1)", f"measuring {MAIN} (1 of 1)", timing, "drawing trade.html"]
    assert said.err.splitlines()[: len(steps)] == steps, "without a terminal it prints each step"
    assert "trade.html is missing" in said.out if why == "Ctrl-C" else "no more" in said.err


def test_without_matplotlib_nothing_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert main(["trade", SCENE, "-o", str(tmp_path / "trade")]) == 2
    assert "in the checkout: pip install -e '.[plots]'" in capsys.readouterr().err
    assert not (tmp_path / "trade").exists()


def test_the_folder_is_not_made_for_a_scene_that_cannot_be_rendered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "lights.toml"
    scene.write_text(scenes.ASSIGNMENT.read_text() + "[[lights]]\nposition = [1, 2, 3]\n" * 5000)
    assert main(["trade", str(scene), "-o", str(tmp_path / "trade"), "--quick"]) == 2
    assert "expected at most" in capsys.readouterr().err and not (tmp_path / "trade").exists()
    assert main(["trade", SCENE, "-o", str(tmp_path / ("x" * 300)), "--quick"]) == 2
    assert "File name too long" in capsys.readouterr().err


def test_a_picture_with_nan_is_refused_and_the_others_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    made = plan(scenes.assignment(), QUICK)
    broken = Image(np.full((2, 2, 3), np.nan, np.float32))
    monkeypatch.setattr(measuring, "time_picture", lambda *_: (broken, 0.0))
    references = {MAIN: Reference(np.zeros((2, 2, 3)), 0.0, "black")}
    trade = measuring.Tradeoffs("scene", (2, 2), 1, {}, made, references, [])
    result = measuring._measure_first(made.configurations[0], trade, None)  # pyright: ignore[reportArgumentType]
    assert "finite" in result.refused and not result.measured


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["trade", SCENE, "-o", "{tmp}/no/where"], "a folder that exists"),
        (["trade", SCENE, "-o", "{tmp}", "--rounds", "0"], "--rounds"),
        (["trade", SCENE, "-o", "{tmp}", "--size", "0x2"], "size"),
        (["tune", SCENE], "--max-error"),
        (["tune", SCENE, "--max-error", "0"], "--max-error: expected a finite number above 0"),
        (["tune", SCENE, "--max-error", "0.1", "--time", "1"], "--time"),
    ],
)
def test_wrong_input_is_status_2_and_one_line(
    arguments: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([argument.replace("{tmp}", str(tmp_path)) for argument in arguments]) == 2
    errors = capsys.readouterr().err
    assert says in errors and errors.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
