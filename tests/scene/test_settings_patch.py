"""Patches of settings: how they merge, the qualities that the README has, and the command line's flags."""

import functools
import itertools
import operator
import re
from contextlib import suppress

import pytest
from msgspec import UNSET

import raytracer as rt
from raytracer.scene.options import CompileOptions, SamplingOptions
from raytracer.scene.settings_patch import ASKED_SAMPLES, EMPTY, QUALITIES, changes, checked_patch, fewest, flags
from raytracer.scene.settings_patch import SettingsPatch as Patch
from tests import scenes


def test_the_readme_has_exactly_the_qualities_there_are() -> None:
    readme = (scenes.CHECKOUT / "README.md").read_text()
    table = re.findall(r"<!-- quality -->\n(.*?)<!-- end of quality -->", readme, re.DOTALL)
    assert len(table) == 1
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[0].splitlines()[2:]]
    wanted = [[f"`{name}`", f"`{flags(patch)}`"] for name, patch in QUALITIES.items()]
    assert [row[:2] for row in rows] == wanted, "to be written by python -m benchmarks.quality --readme"
    assert all(re.match(r"[0-9.e+]+ s, [0-9.e+]+ samples?, [0-9.e-]+ \(", cell) for row in rows for cell in row[2:])


def merged(*patches: Patch) -> rt.Settings:
    return functools.reduce(operator.or_, patches).resolve()


def test_a_quality_replaces_what_else_says_how_many_samples_and_is_replaced_by_what_is_given_besides() -> None:
    before = Patch(max_error=0.1, time=3.0, samples=7, bounces=2)
    assert merged(before, Patch(quality="draft")) == rt.Settings(bounces=2)
    assert merged(Patch(adaptive=0.1, sequence="r2"), Patch(quality="normal")) == rt.quality("normal")
    assert merged(Patch(quality="high", samples=64)) == rt.Settings(samples=64, max_error=0.0005)
    assert merged(Patch(samples=64), Patch(quality="high")) == rt.quality("high")
    with pytest.raises(rt.InputError, match=r"quality: expected one of draft, normal, high, reference, got 'best'"):
        rt.quality("best")


def test_samples_given_before_an_error_or_a_time_was_asked_for_do_not_limit_it() -> None:
    assert merged(Patch(samples=16), Patch(max_error=0.1)).samples == ASKED_SAMPLES
    assert merged(Patch(samples=16, time=1.0), Patch(max_error=0.1)).samples == 16
    assert merged(Patch(max_error=0.1), Patch(samples=16)).samples == 16
    assert merged(Patch(max_error=0.1), Patch(adaptive=0.2)).max_error is None
    assert merged(Patch(adaptive=0.2), Patch(time=1.0)) == rt.Settings(samples=ASKED_SAMPLES, time=1.0)
    assert merged(Patch(adaptive=0.2)) == rt.Settings(samples=ASKED_SAMPLES, adaptive=0.2)
    assert merged(Patch(samples=16), Patch(adaptive=0.2)).samples == ASKED_SAMPLES
    assert merged(Patch(samples=16, adaptive=0.1), Patch(adaptive=0.2)).samples == 16
    assert merged(Patch(samples=16, time=1.0), Patch(adaptive=0.2)) == rt.Settings(samples=16, adaptive=0.2)
    with pytest.raises(rt.InputError, match="adaptive: cannot be combined with max_error"):
        merged(Patch(adaptive=0.2, max_error=0.1))


PLACES = (
    EMPTY,
    Patch(samples=64, shadows="soft"),
    Patch(samples=16, adaptive=0.01),
    Patch(samples=36, sequence="grid"),
    Patch(max_error=0.01),
    Patch(samples=16, time=2.0),
    Patch(quality="normal", shading="ggx"),
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
    patch = fewest(settings, before)
    assert (before | patch).resolve() == settings
    for name in patch.fields():
        with suppress(rt.InputError):
            assert (before | patch.replace(**{name: UNSET})).resolve() != settings


def test_flags_are_what_the_command_line_takes_to_the_last_digit() -> None:
    assert flags(fewest(rt.Settings())) == ""
    soft = rt.Settings(samples=16, adaptive=0.01, shadows="soft")
    assert flags(fewest(soft)) == "--samples 16 --shadows soft --adaptive 0.01"
    assert flags(fewest(rt.Settings(samples=16), Patch(samples=16, adaptive=0.1))) == "--adaptive none"
    asked = rt.Settings(samples=ASKED_SAMPLES, max_error=0.0012345678)
    assert flags(fewest(asked, Patch(shading="ggx"))) == "--shading none --max-error 0.0012345678"


def test_the_halves_and_the_patch_have_the_fields_and_the_defaults_of_settings() -> None:
    halves = (*SamplingOptions.__struct_fields__, *CompileOptions.__struct_fields__)
    assert sorted(halves) == sorted(rt.Settings.__struct_fields__)
    assert Patch.__struct_fields__ == ("quality", *rt.Settings.__struct_fields__)
    assert (rt.Settings().sampling, rt.Settings().compile_options) == (SamplingOptions(), CompileOptions())
    assert EMPTY.resolve() == rt.Settings() and EMPTY.fields() == {}


def test_a_patch_of_changes_makes_the_second_settings_of_the_first() -> None:
    for before, after in itertools.permutations(MADE, 2):
        patch = changes(before, after)
        assert before.replace(**patch.fields()) == after
        assert (checked_patch(before) | checked_patch(after)).resolve() == after


def test_none_takes_back_and_a_patch_shows_only_what_it_has() -> None:
    patch = Patch(shading="ggx", max_error=0.1) | Patch(shading=None, max_error=None, samples=2)
    assert patch.resolve() == rt.Settings(samples=2)
    assert repr(Patch(shading=None)) == "SettingsPatch(shading=None)"
    assert Patch(samples=3, shadows="off", quality="high").without_sampling() == Patch(shadows="off")
