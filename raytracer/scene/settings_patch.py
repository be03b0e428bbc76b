"""Some of the settings: given at several places, or by the name of a quality, and merged."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Literal, cast

import msgspec
from msgspec import UNSET, UnsetType

from raytracer.core.record import Record
from raytracer.core.shown import shown
from raytracer.core.validation import InputError, check_choice
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import CompileOptions, Evaluator, Precision, SamplingOptions, Shadows
from raytracer.scene.sequences import SampleSequence
from raytracer.scene.settings import Settings

# The most samples under an error, a time or adaptive samples, unless a number of samples is given, too: the error falls
# by less than 1e-3 then.
ASKED_SAMPLES = 4096

Quality = Literal["draft", "normal", "high", "reference"]


class SettingsPatch(Record, frozen=True, repr_omit_defaults=True):
    """Some fields of Settings; the others are UNSET. None takes back what another patch gives.

    `quality` stands for all fields of SamplingOptions, and comes before the patch's own fields. resolve() checks the
    values. `earlier | later` merges two patches, and chains are merged from the left.
    """

    quality: Quality | UnsetType = UNSET
    samples: int | UnsetType = UNSET
    shading: Shading | UnsetType | None = UNSET
    shadows: Shadows | UnsetType = UNSET
    evaluator: Evaluator | UnsetType = UNSET
    precision: Precision | UnsetType = UNSET
    adaptive: float | UnsetType | None = UNSET
    bounces: int | UnsetType = UNSET
    sequence: SampleSequence | UnsetType = UNSET
    max_error: float | UnsetType | None = UNSET
    time: float | UnsetType | None = UNSET

    def __or__(self, later: SettingsPatch) -> SettingsPatch:
        """Merge two patches: a value of `later` is in place of the value here. The result has no quality by name.

        `adaptive` displaces `max_error` and `time`, and is displaced by them, as they exclude each other. Where nobody
        says how many samples an error, a time or adaptive samples may take, ASKED_SAMPLES: a number given
        before those were is no such limit. Raises InputError for a quality that is none.
        """
        return SettingsPatch(**_merged(_merged({}, self.fields()), later.fields()))

    def resolve(self) -> Settings:
        """Fill up with defaults. Raises InputError as Settings does, and for a quality that is none."""
        return Settings(**_merged({}, self.fields()))

    def fields(self) -> dict[str, Any]:
        """The fields that are not UNSET, by name."""
        return {name: value for name, value in msgspec.structs.asdict(self).items() if value is not UNSET}

    def without_sampling(self) -> SettingsPatch:
        """The fields of CompileOptions alone: they say nothing of how many samples there are, and where."""
        return SettingsPatch(**{k: v for k, v in self.fields().items() if k in CompileOptions.__struct_fields__})

    @staticmethod
    def without_none(**fields: Any) -> SettingsPatch:
        """A patch of the fields that are not None, as keywords of a function are where nobody gives them."""
        return SettingsPatch(**{name: value for name, value in fields.items() if value is not None})


EMPTY = SettingsPatch()
# As the README has them: benchmarks/quality.py measures each. "reference" leaves nothing to an estimate. It is not of
# 64 bits: those take no more than 512 primitives, and `render` says where 32 are not enough.
QUALITIES: dict[Quality, SettingsPatch] = {
    "draft": SettingsPatch(samples=1),
    "normal": SettingsPatch(max_error=0.002, samples=256),
    "high": SettingsPatch(max_error=0.0005, samples=4096),
    "reference": SettingsPatch(samples=1024),
}


def quality(name: str) -> Settings:
    """The settings of a quality: "draft", "normal", "high" or "reference". Raises InputError for another name."""
    return SettingsPatch(quality=cast("Quality", name)).resolve()


def checked_patch(settings: Any) -> SettingsPatch:
    """All fields of `settings`; no field of None. Raises InputError for another type."""
    if settings is None:
        return EMPTY
    if not isinstance(settings, Settings):
        makers = "Settings(), quality() or load_settings() make them"
        raise InputError(f"expected Settings ({makers}), got {shown(settings)}", "settings")
    return SettingsPatch(**msgspec.structs.asdict(settings))


def changes(before: Settings, after: Settings) -> SettingsPatch:
    """The fields that differ between `before` and `after`, as `after` has them."""
    old = msgspec.structs.asdict(before)
    return SettingsPatch(**{k: v for k, v in msgspec.structs.asdict(after).items() if v != old[k]})


def fewest(settings: Settings, over: SettingsPatch = EMPTY) -> SettingsPatch:
    """The fewest fields that make `settings`: alone, or merged with the patch that they are `over`."""
    fields = changes(over.resolve(), settings).fields()
    # An error, a time or adaptive samples among the fields may change the number of samples.
    if settings.sampling.is_adaptive:
        fields["samples"] = settings.samples
    for name in tuple(fields):
        fewer = {key: value for key, value in fields.items() if key != name}
        with suppress(InputError):
            fields = fewer if (over | SettingsPatch(**fewer)).resolve() == settings else fields
    return SettingsPatch(**fields)


def flags(patch: SettingsPatch) -> str:
    """The options of the command line that give the fields of `patch`, to the last digit."""
    return " ".join(f"--{key.replace('_', '-')} {'none' if v is None else v}" for key, v in patch.fields().items())


def _merged(before: dict[str, Any], later: dict[str, Any]) -> dict[str, Any]:
    if "quality" in later:
        name = cast("Quality", check_choice(later["quality"], "quality", QUALITIES))
        sampling = msgspec.structs.asdict(SamplingOptions())
        before = {**before, **sampling, **QUALITIES[name].fields()}
        later = {key: value for key, value in later.items() if key != "quality"}
    fields = {**before, **later}
    if _has_stopping_rule(later):
        if "adaptive" not in later:
            fields["adaptive"] = None
        has_limit = _has_stopping_rule(before)
    elif later.get("adaptive") is not None:
        fields |= {"max_error": None, "time": None}
        has_limit = _has_stopping_rule(before) or before.get("adaptive") is not None
    else:
        return fields
    if "samples" not in later and not has_limit:
        fields["samples"] = ASKED_SAMPLES
    return fields


def _has_stopping_rule(fields: dict[str, Any]) -> bool:
    return any(fields.get(key) is not None for key in ("max_error", "time"))
