"""Qualities: that they are what the README says, and what is given besides."""

import re

import pytest

import raytracer as rt
from raytracer.presets import QUALITIES, Fields, combined, flags, over_file
from raytracer.settings import ASKED_SAMPLES

from . import scenes


def test_the_readme_has_exactly_the_qualities_there_are() -> None:
    readme = (scenes.CHECKOUT / "README.md").read_text()
    table = re.findall(r"<!-- quality -->\n(.*?)<!-- end of quality -->", readme, re.DOTALL)
    assert len(table) == 1
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[0].splitlines()[2:]]
    wanted = [[f"`{name}`", f"`{flags(fields)}`"] for name, fields in QUALITIES.items()]
    assert [row[:2] for row in rows] == wanted, "to be written by python -m benchmarks.quality --readme"
    assert all(re.match(r"[0-9.e+]+ s, [0-9.e+]+ samples?, [0-9.e-]+ \(", cell) for row in rows for cell in row[2:])


def test_a_quality_replaces_what_else_says_how_many_samples_and_is_replaced_by_what_is_given_besides() -> None:
    before = {"max_error": 0.1, "time": 3.0, "samples": 7, "bounces": 2}
    assert combined(before, {"quality": "draft"}) == rt.Settings(bounces=2)
    assert combined({"adaptive": 0.1, "sequence": "r2"}, {"quality": "normal"}) == rt.quality("normal")
    assert combined({"quality": "high", "samples": 64}) == rt.Settings(samples=64, max_error=0.0005)
    assert combined({"samples": 64}, {"quality": "high"}) == rt.quality("high")
    # As None for what is not given takes nothing back: the command line's `none` does.
    assert combined({"quality": "normal", "max_error": None}) == rt.Settings(samples=256)
    with pytest.raises(rt.InputError, match=r"quality: expected one of draft, normal, high, reference, got 'best'"):
        rt.quality("best")


def test_samples_given_before_an_error_or_a_time_was_asked_for_do_not_limit_it() -> None:
    assert combined({"samples": 16}, {"max_error": 0.1}).samples == ASKED_SAMPLES
    assert combined({"samples": 16, "time": 1.0}, {"max_error": 0.1}).samples == 16
    assert combined({"max_error": 0.1}, {"samples": 16}).samples == 16
    assert combined({"max_error": 0.1}, {"adaptive": 0.2}).max_error is None
    assert combined({"adaptive": 0.2}, {"time": 1.0}) == rt.Settings(samples=ASKED_SAMPLES, time=1.0)
    with pytest.raises(rt.InputError, match="adaptive: expected none with max_error"):
        combined({"adaptive": 0.2, "max_error": 0.1})


@pytest.mark.parametrize(
    ("of_file", "given", "says", "remedy"),
    [
        (
            {"sequence": "r2"},
            {"max_error": 0.01},
            "sequence = 'r2', the command line --max-error 0.01: try --sequence sobol, too, or without --max-error",
            {"sequence": "sobol"},
        ),
        (
            {"quality": "normal"},
            {"sequence": "random"},
            "quality = 'normal', the command line --sequence random: try --max-error none, too, or without --sequence",
            {"max_error": None},
        ),
        (
            {"samples": 10},
            {"sequence": "grid"},
            "samples = 10, the command line --sequence grid: try --samples 16, too, or without --sequence",
            {"samples": 16},
        ),
    ],
    ids=range(3),
)
def test_of_settings_that_exclude_each_other_is_said_whose_they_are_and_what_helps(
    of_file: Fields, given: Fields, says: str, remedy: Fields
) -> None:
    with pytest.raises(rt.InputError) as error:
        over_file(of_file, given)
    assert str(error.value).endswith(f"; its [settings] have {says}")
    over_file(of_file, {**given, **remedy})
    over_file(of_file, {})
