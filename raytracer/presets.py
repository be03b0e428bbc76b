"""Settings by a name, and settings that are given at several places."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal

from raytracer.checks import InputError, shown
from raytracer.settings import ASKED_SAMPLES, Settings

# Some fields of Settings by their names; "quality" is one of them, and a "size" is nothing here.
Fields = Mapping[str, Any]

Quality = Literal["draft", "normal", "high", "reference"]
# How the README has them: benchmarks/quality.py measures each. "reference" leaves nothing to an estimate. It is not of
# 64 bits: those take no more than 512 primitives, and `render` says where 32 are not enough.
QUALITIES: dict[Quality, Fields] = {
    "draft": {"samples": 1},
    "normal": {"max_error": 0.002, "samples": 256},
    "high": {"max_error": 0.0005, "samples": 4096},
    "reference": {"samples": 1024},
}
# What else a quality decides, so that it is the same whatever it is put over.
_ELSE: Fields = {"sequence": "sobol", "adaptive": None, "max_error": None, "time": None}


# What goes with every other setting, to be given in place of what does not: without it, the default.
_FITS: Fields = {"samples": 16}


def quality(name: str) -> Settings:
    """The settings of a quality: "draft", "normal", "high" or "reference". Raises InputError for another name.

    render() takes None for what is not given: it does not take back the error that a quality asks for. All that is
    left of "normal" without it is `samples=256`, and no quality.
    """
    return combined({"quality": name})


def combined(*places: Fields) -> Settings:
    """Settings that are given at several places: what a place gives is in place of what those before it give.

    A place's "quality" comes before all else that it gives. `adaptive` is in place of `max_error` and `time`, too, and
    these of `adaptive`, as they exclude each other. Where nobody says how many samples an error or a time may take,
    ASKED_SAMPLES: a number given before those were is no such limit. Raises InputError as Settings does.
    """
    fields: dict[str, Any] = {}
    for place in places:
        if "quality" in place:
            fields |= _of_quality(place["quality"])
        fields = _over(fields, {key: value for key, value in place.items() if key not in ("quality", "size")})
    return Settings(**fields)


def over_file(of_file: Fields, given: Fields, defaults: Fields | None = None) -> Settings:
    """What a file's [settings] and the command line give. InputErrors of what does not go together say whose it is."""
    try:
        return combined(defaults or {}, of_file, given)
    except InputError as error:
        raise InputError(f"{error}{_whose(str(error), of_file, given)}") from None


def _whose(error: str, of_file: Fields, given: Fields) -> str:
    """Where the settings that an error names are from, and a remedy; "" if they are not from both places."""
    words = re.findall(r"\w+", error)
    named = [key for key in Settings.__struct_fields__ if key in words]
    here = {by: given[by] for key in named if (by := _giver(key, given))}
    there = {key: by for key in named if not _giver(key, given) and (by := _giver(key, of_file))}
    if not here or not there:
        return ""
    in_file = " and ".join(f"{by} = {of_file[by]!r}" for by in dict.fromkeys(there.values()))
    instead = flags({key: _FITS.get(key, getattr(Settings(), key)) for key in there})
    without = " and ".join(flags({by: ""}).strip() for by in here)
    says = f"its [settings] have {in_file}, the command line {flags(here)}"
    return f"; {says}: try {instead}, too, or without {without}"


def _giver(key: str, place: Fields) -> str:
    """What of a place gives the setting: itself, a quality, or nothing."""
    if key in place:
        return key
    return "quality" if "quality" in place and key in _of_quality(place["quality"]) else ""


def chosen(settings: Settings) -> Fields:
    """What of the settings is not by default; no `samples` where an error or a time is asked for, whose own default is
    another one.
    """
    default = Settings()
    given = {name: getattr(settings, name) for name in settings.__struct_fields__}
    if settings.asks:
        del given["samples"]
    return {name: value for name, value in given.items() if value != getattr(default, name)}


def flags(fields: Fields) -> str:
    """Fields of Settings as the command line has them."""
    return " ".join(f"--{key.replace('_', '-')} {'none' if v is None else v}" for key, v in fields.items())


def _of_quality(name: Any) -> Fields:
    if not isinstance(name, str) or name not in QUALITIES:
        raise InputError(f"quality: expected one of {', '.join(QUALITIES)}, got {shown(name)}")
    return {**_ELSE, **QUALITIES[name]}


def _over(before: Fields, given: Fields) -> dict[str, Any]:
    fields = {**before, **given}
    if _asks(given):
        if "adaptive" not in given:
            fields["adaptive"] = None
        if "samples" not in given and not _asks(before):
            fields["samples"] = ASKED_SAMPLES
    elif given.get("adaptive") is not None:
        fields |= {"max_error": None, "time": None}
    return fields


def _asks(fields: Fields) -> bool:
    return any(fields.get(key) is not None for key in ("max_error", "time"))
