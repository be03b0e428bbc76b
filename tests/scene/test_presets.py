"""Qualities: that they are what the README says, and what is given besides."""

import re
from contextlib import suppress

import pytest

import raytracer as rt
from raytracer.scene.presets import QUALITIES, combined, flags, over
from raytracer.scene.settings import ASKED_SAMPLES
from tests import scenes


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
    with pytest.raises(rt.InputError, match=r"quality: expected one of draft, normal, high, reference, got 'best'"):
        rt.quality("best")


def test_samples_given_before_an_error_or_a_time_was_asked_for_do_not_limit_it() -> None:
    assert combined({"samples": 16}, {"max_error": 0.1}).samples == ASKED_SAMPLES
    assert combined({"samples": 16, "time": 1.0}, {"max_error": 0.1}).samples == 16
    assert combined({"max_error": 0.1}, {"samples": 16}).samples == 16
    assert combined({"max_error": 0.1}, {"adaptive": 0.2}).max_error is None
    assert combined({"adaptive": 0.2}, {"time": 1.0}) == rt.Settings(samples=ASKED_SAMPLES, time=1.0)
    assert combined({"adaptive": 0.2}) == rt.Settings(samples=ASKED_SAMPLES, adaptive=0.2)
    assert combined({"samples": 16}, {"adaptive": 0.2}).samples == ASKED_SAMPLES
    assert combined({"samples": 16, "adaptive": 0.1}, {"adaptive": 0.2}).samples == 16
    assert combined({"samples": 16, "time": 1.0}, {"adaptive": 0.2}) == rt.Settings(samples=16, adaptive=0.2)
    with pytest.raises(rt.InputError, match="adaptive: expected none with max_error"):
        combined({"adaptive": 0.2, "max_error": 0.1})


PLACES = (
    {},
    {"samples": 64, "shadows": "soft", "size": (64, 36)},
    {"samples": 16, "adaptive": 0.01},
    {"samples": 36, "sequence": "grid"},
    {"max_error": 0.01},
    {"samples": 16, "time": 2.0},
    {"quality": "normal", "shading": "ggx"},
)
MADE = (
    rt.Settings(),
    rt.Settings(samples=16),
    rt.Settings(samples=256, shadows="soft"),
    rt.Settings(samples=16, adaptive=0.02, precision=64),
    rt.Settings(samples=16, max_error=0.00123456789),
    rt.Settings(samples=ASKED_SAMPLES, max_error=0.002, bounces=2),
    rt.Settings(samples=ASKED_SAMPLES, adaptive=0.01),
)


@pytest.mark.parametrize("before", PLACES)
@pytest.mark.parametrize("settings", MADE)
def test_what_is_put_over_a_file_makes_the_settings_and_nothing_of_it_is_superfluous(before, settings) -> None:
    fields = over(before, settings)
    assert combined(before, fields) == settings
    for name in fields:
        fewer = {key: value for key, value in fields.items() if key != name}
        with suppress(rt.InputError):
            assert combined(before, fewer) != settings


def test_flags_are_what_the_command_line_takes_to_the_last_digit() -> None:
    assert flags(over({}, rt.Settings())) == ""
    soft = rt.Settings(samples=16, adaptive=0.01, shadows="soft")
    assert flags(over({}, soft)) == "--samples 16 --shadows soft --adaptive 0.01"
    assert flags(over({"samples": 16, "adaptive": 0.1}, rt.Settings(samples=16))) == "--adaptive none"
    asked = rt.Settings(samples=ASKED_SAMPLES, max_error=0.0012345678)
    assert flags(over({"shading": "ggx"}, asked)) == "--shading none --max-error 0.0012345678"
