"""Patches of settings: merging, the qualities in docs/accuracy.md, and the flags of the command line."""

import functools
import itertools
import operator
import re
from contextlib import suppress
from typing import Any

import pytest
from msgspec import UNSET

import raytracer as rt
from raytracer.scene.options import DEFAULT_SAMPLE_LIMIT, CompileOptions, SamplingOptions
from raytracer.scene.settings_patch import (
    EMPTY_PATCH,
    QUALITIES,
    changed_fields,
    flags,
    minimal_patch,
    patch_from_settings,
)
from raytracer.scene.settings_patch import SettingsPatch as Patch
from tests import scenes


def test_the_docs_list_exactly_the_existing_qualities() -> None:
    page = (scenes.CHECKOUT / "docs/accuracy.md").read_text()
    table = re.findall(r"<!-- quality -->\n(.*?)<!-- end of quality -->", page, re.DOTALL)
    assert len(table) == 1
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[0].splitlines()[2:]]
    wanted = [[f"`{name}`", f"`{flags(patch)}`"] for name, patch in QUALITIES.items()]
    assert [row[:2] for row in rows] == wanted, "to be written by python -m benchmarks.quality --docs"
    assert all(re.match(r"[0-9.e+]+ s, [0-9.e+]+ samples?, [0-9.e-]+ \(", cell) for row in rows for cell in row[2:])


def merge(*patches: Patch) -> rt.Settings:
    return functools.reduce(operator.or_, patches).resolve()


def test_a_quality_overrides_earlier_sampling_settings_and_settings_beside_it_override_the_quality() -> None:
    before = Patch(max_error=0.1, time=3.0, samples=7, bounces=2)
    assert merge(before, Patch(quality="draft")) == rt.Settings(bounces=2)
    assert merge(Patch(adaptive=0.1, sequence="r2"), Patch(quality="normal")) == rt.quality("normal")
    assert merge(Patch(quality="high", samples=64)) == rt.Settings(samples=64, max_error=0.0005)
    assert merge(Patch(samples=64), Patch(quality="high")) == rt.quality("high")
    with pytest.raises(rt.InputError, match=r"quality: expected one of draft, normal, high, reference, got 'best'"):
        rt.quality("best")


def test_samples_do_not_limit_an_error_or_a_time_of_a_later_patch() -> None:
    assert merge(Patch(samples=16), Patch(max_error=0.1)).samples == DEFAULT_SAMPLE_LIMIT
    assert merge(Patch(samples=16, time=1.0), Patch(max_error=0.1)).samples == 16
    assert merge(Patch(max_error=0.1), Patch(samples=16)).samples == 16
    assert merge(Patch(max_error=0.1), Patch(adaptive=0.2)).max_error is None
    assert merge(Patch(adaptive=0.2), Patch(time=1.0)) == rt.Settings(samples=DEFAULT_SAMPLE_LIMIT, time=1.0)
    assert merge(Patch(adaptive=0.2)) == rt.Settings(samples=DEFAULT_SAMPLE_LIMIT, adaptive=0.2)
    assert merge(Patch(samples=16), Patch(adaptive=0.2)).samples == DEFAULT_SAMPLE_LIMIT
    assert merge(Patch(samples=16, adaptive=0.1), Patch(adaptive=0.2)).samples == 16
    assert merge(Patch(samples=16, time=1.0), Patch(adaptive=0.2)) == rt.Settings(samples=16, adaptive=0.2)
    with pytest.raises(rt.InputError, match="adaptive: cannot be combined with max_error"):
        merge(Patch(adaptive=0.2, max_error=0.1))


def test_settings_with_an_error_or_a_time_allow_as_many_samples_as_render_does() -> None:
    cases: tuple[dict[str, Any], ...] = {"max_error": 0.1}, {"time": 1.0}, {"adaptive": 0.1}
    for fields in cases:
        none: dict[str, Any] = dict.fromkeys(fields)
        assert rt.Settings(**fields).samples == DEFAULT_SAMPLE_LIMIT
        assert rt.Settings(**fields) == merge(Patch(**fields)) == rt.Settings().replace(**fields)
        assert rt.Settings(**fields, samples=1).samples == 1 == rt.Settings().replace(**fields, samples=1).samples
        assert rt.Settings(samples=16).replace(**fields).samples == 16
        assert merge(Patch(**fields), Patch(**none)) == rt.Settings() == rt.Settings(**fields).replace(**none)
        assert rt.Settings(**fields, samples=64).replace(**none).samples == 64
    assert rt.Settings().samples == rt.Settings(max_error=None).samples == 1


PATCHES = (
    EMPTY_PATCH,
    Patch(samples=64, shadows="soft"),
    Patch(samples=16, adaptive=0.01),
    Patch(samples=36, sequence="grid"),
    Patch(max_error=0.01),
    Patch(samples=16, time=2.0),
    Patch(quality="normal", shading="ggx"),
)
SETTINGS = (
    rt.Settings(),
    rt.Settings(samples=16),
    rt.Settings(samples=256, shadows="soft"),
    rt.Settings(samples=16, adaptive=0.02, precision=64),
    rt.Settings(samples=16, max_error=0.00123456789),
    rt.Settings(samples=DEFAULT_SAMPLE_LIMIT, max_error=0.002, bounces=2),
    rt.Settings(samples=DEFAULT_SAMPLE_LIMIT, adaptive=0.01),
    rt.Settings(samples=DEFAULT_SAMPLE_LIMIT),  # over a patch with max_error, the merged default is 1 sample
)


@pytest.mark.parametrize("before", PATCHES)
@pytest.mark.parametrize("settings", SETTINGS)
def test_the_fewest_overrides_make_the_settings_and_none_is_superfluous(before, settings) -> None:
    patch = minimal_patch(settings, before)
    assert (before | patch).resolve() == settings
    for name in patch.fields():
        with suppress(rt.InputError):
            assert (before | patch.replace(**{name: UNSET})).resolve() != settings


def test_flags_are_options_of_the_command_line_with_all_digits() -> None:
    assert flags(minimal_patch(rt.Settings())) == ""
    soft = rt.Settings(samples=16, adaptive=0.01, shadows="soft")
    assert flags(minimal_patch(soft)) == "--samples 16 --shadows soft --adaptive 0.01"
    assert flags(minimal_patch(rt.Settings(samples=16), Patch(samples=16, adaptive=0.1))) == "--adaptive none"
    asked = rt.Settings(samples=DEFAULT_SAMPLE_LIMIT, max_error=0.0012345678)
    assert flags(minimal_patch(asked, Patch(shading="ggx"))) == "--shading none --max-error 0.0012345678"


def test_the_parts_and_the_patch_have_the_fields_and_defaults_of_settings() -> None:
    parts = (*SamplingOptions.__struct_fields__, *CompileOptions.__struct_fields__)
    assert sorted(parts) == sorted(rt.Settings.__struct_fields__)
    assert Patch.__struct_fields__ == ("quality", *rt.Settings.__struct_fields__)
    assert (rt.Settings().sampling, rt.Settings().compile_options) == (SamplingOptions(), CompileOptions())
    assert EMPTY_PATCH.resolve() == rt.Settings() and EMPTY_PATCH.fields() == {}


def test_the_changes_between_settings_turn_the_first_into_the_second() -> None:
    for before, after in itertools.permutations(SETTINGS, 2):
        patch = changed_fields(before, after)
        # replace() may set another number of samples by itself when max_error or adaptive change.
        assert before.replace(**{"samples": after.samples, **patch.fields()}) == after
        assert (patch_from_settings(before) | patch_from_settings(after)).resolve() == after


def test_none_cancels_an_override_and_the_repr_shows_only_set_fields() -> None:
    patch = Patch(shading="ggx", max_error=0.1) | Patch(shading=None, max_error=None, samples=2)
    assert patch.resolve() == rt.Settings(samples=2)
    assert repr(Patch(shading=None)) == "SettingsPatch(shading=None)"
    assert Patch(samples=3, shadows="off", quality="high").without_sampling() == Patch(shadows="off")
