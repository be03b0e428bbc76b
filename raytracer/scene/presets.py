"""Settings by a name, and settings that are given at several places."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Literal, cast

from raytracer.core.validation import InputError, check_choice
from raytracer.scene.settings import ASKED_SAMPLES, Settings

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
# What a picture is of, and how it is made, whatever its samples are.
OWN = ("shading", "shadows", "evaluator", "precision", "bounces")
# What else a quality decides, so that it is the same whatever it is put over.
_ELSE: Fields = {"sequence": "sobol", "adaptive": None, "max_error": None, "time": None}


def quality(name: str) -> Settings:
    """The settings of a quality: "draft", "normal", "high" or "reference". Raises InputError for another name."""
    return combined({"quality": name})


def combined(*places: Fields) -> Settings:
    """Settings that are given at several places: what a place gives is in place of what those before it give.

    A place's "quality" comes before all else that it gives. `adaptive` is in place of `max_error` and `time`, too, and
    these of `adaptive`, as they exclude each other. Where nobody says how many samples an error, a time or adaptive
    samples may take, ASKED_SAMPLES: a number given before those were is no such limit. Raises InputError as Settings
    does.
    """
    fields: dict[str, Any] = {}
    for place in places:
        if "quality" in place:
            fields |= _of_quality(place["quality"])
        fields = _over(fields, {key: value for key, value in place.items() if key not in ("quality", "size")})
    return Settings(**fields)


def own(fields: Fields) -> Fields:
    """What of the fields is a picture's own, and does not say how many samples it has and where."""
    return {name: value for name, value in fields.items() if name in OWN}


def over(before: Fields, settings: Settings) -> Fields:
    """The fewest fields that, put over those given before, make `settings`: of none, what is not by default."""
    base = combined(before)
    # An error, a time or adaptive samples that are given may change the number of samples.
    fields = {
        name: getattr(settings, name)
        for name in settings.__struct_fields__
        if getattr(settings, name) != getattr(base, name) or (settings.refines and name == "samples")
    }
    for name in tuple(fields):
        fewer = {key: value for key, value in fields.items() if key != name}
        with suppress(InputError):
            fields = fewer if combined(before, fewer) == settings else fields
    return fields


def flags(fields: Fields) -> str:
    """Fields of Settings as the command line has them, to the last digit."""
    return " ".join(f"--{key.replace('_', '-')} {'none' if v is None else v}" for key, v in fields.items())


def _of_quality(name: Any) -> Fields:
    return {**_ELSE, **QUALITIES[cast("Quality", check_choice(name, "quality", QUALITIES))]}


def _over(before: Fields, given: Fields) -> dict[str, Any]:
    fields = {**before, **given}
    if _asks(given):
        if "adaptive" not in given:
            fields["adaptive"] = None
        limited = _asks(before)
    elif given.get("adaptive") is not None:
        fields |= {"max_error": None, "time": None}
        limited = _asks(before) or before.get("adaptive") is not None
    else:
        return fields
    if "samples" not in given and not limited:
        fields["samples"] = ASKED_SAMPLES
    return fields


def _asks(fields: Fields) -> bool:
    return any(fields.get(key) is not None for key in ("max_error", "time"))
