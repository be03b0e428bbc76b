"""assets/materials/*.toml: each entry is valid for its model and has the published numbers."""

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT
from raytracer.scene.materials.lobe import Lobe
from raytracer.scene.materials.models import MODELS, Parameter

FOLDER = Path(__file__).parents[2] / "assets/materials"
FILES = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))}
ENTRIES = {
    f"{stem}/{name}": entry for stem, file in FILES.items() for name, entry in file.items() if isinstance(entry, dict)
}


def _is_number(value: Any, low: float, high: float) -> bool:
    return isinstance(value, float) and math.isfinite(value) and low <= value <= high


def _is_color(value: Any, low: float, high: float) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(_is_number(v, low, high) for v in value)


def _is_lobe(lobe: dict[str, Any]) -> bool:
    lows = {"cx": -MAX_COLOR, "cy": -MAX_COLOR, "cz": -MAX_COLOR, "n": 0.0, "scale": 0.0}
    highs = dict.fromkeys(lows, MAX_COLOR) | {"n": MAX_EXPONENT}
    assert lobe.keys() <= set(Lobe.__struct_fields__)
    assert {"cx", "cz", "n"} <= lobe.keys()
    return all(_is_number(v, lows[k], highs[k]) or _is_color(v, lows[k], highs[k]) for k, v in lobe.items())


def _holds(parameter: Parameter, value: Any) -> bool:
    match parameter.kind:
        case "number":
            return _is_number(value, parameter.low, parameter.high)
        case "whole":
            return isinstance(value, int) and parameter.low <= value <= parameter.high
        case "color":
            return _is_color(value, parameter.low, parameter.high)
        case "choice":
            return value in parameter.choices
        case "lobes":
            return len(value) > 0 and all(_is_lobe(lobe) for lobe in value)
        case _:
            return False


def test_each_file_has_the_expected_number_of_materials():
    counts = {stem: sum(isinstance(entry, dict) for entry in file.values()) for stem, file in FILES.items()}
    assert counts == {"conductors": 14, "lafortune": 7, "ngan": 86, "ngan-lafortune": 86}
    assert FILES["ngan"].keys() == FILES["ngan-lafortune"].keys()


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_has_only_parameters_of_its_model_within_their_ranges(name: str):
    entry = ENTRIES[name]
    parameters = MODELS[entry["model"]].parameters
    values = {key: value for key, value in entry.items() if key not in ("model", "source")}
    assert values.keys() <= parameters.keys()
    for key, value in values.items():
        parameter = parameters[key]
        assert _holds(parameter, value), key
        if parameter.when:
            other, required = parameter.when
            assert values.get(other, parameters[other].default) == required, key


@pytest.mark.parametrize("name", ENTRIES)
def test_each_entry_states_its_source(name: str):
    assert FILES[name.split("/")[0]]["source"]
    assert ENTRIES[name].get("source", "of its file")


def test_lafortune_clay_has_the_numbers_of_pbrt():
    clay = ENTRIES["lafortune/clay"]
    assert clay["rho"] == [0.383626, 0.260749, 0.274207]
    assert clay["lobes"][0] == {
        "cx": [-1.089701, -1.102701, -1.107603],
        "cz": [-1.354682, -2.714801, -1.569866],
        "n": [17.968505, 11.024489, 21.270282],
    }


def test_ngan_nickel_has_the_published_numbers_times_the_factors_of_the_channels():
    # Published: rho .0342 .0256 .014 and ks .16 .124 .0798.
    assert ENTRIES["ngan/nickel"] == {
        "model": "cook_torrance",
        "rho": [0.0342, 0.02944, 0.02324],
        "ks": [0.16, 0.1426, 0.132468],
        "f0": [0.733, 0.733, 0.733],
        "m": 0.0424,
        "constant": "cook",
    }


def test_ngan_lafortune_lobes_are_the_published_lobes_in_another_form():
    # Published: rho .475 .27 .0681, Cxy -.596, Cz .537, n 12.8. A port of pbrt (Joo-Haeng Lee 2007) includes the factor
    # rho (n + 2) / (2 pi max^n) in its lobes: Cxy -1.00881, -.96526, -.866779 and Cz .908947, .869705, .780974.
    (lobe,) = ENTRIES["ngan-lafortune/gold-metallic-paint"]["lobes"]
    inside = [(s / c) ** (1.0 / lobe["n"]) for s, c in zip(lobe["scale"], (1.0, 1.15, 1.66), strict=True)]
    assert [lobe["cx"] * f for f in inside] == pytest.approx([-1.00881, -0.96526, -0.866779], rel=1e-5)
    assert [lobe["cz"] * f for f in inside] == pytest.approx([0.908947, 0.869705, 0.780974], rel=1e-5)


def test_gold_lies_between_neighbouring_rows_of_johnson_and_christy():
    # The neighbouring rows are at 616.8 and 659.5 nm, at 548.6 and 582.1 nm, and at 430.5 and 450.9 nm.
    gold = ENTRIES["conductors/gold"]
    assert all(a <= n <= b for n, a, b in zip(gold["n"], (0.14, 0.29, 1.38), (0.21, 0.43, 1.45), strict=True))
    assert all(a <= k <= b for k, a, b in zip(gold["k"], (3.272, 2.455, 1.914), (3.697, 2.863, 1.948), strict=True))


def test_brass_and_aluminium_equal_rows_of_their_tables():
    assert ENTRIES["conductors/brass"]["n"] == [0.444, 0.527, 1.094]
    assert ENTRIES["conductors/brass"]["k"] == [3.695, 2.765, 1.829]
    assert ENTRIES["conductors/aluminium"]["k"] == [6.852, 5.852, 4.778]
