"""Partial settings from several sources (file, preset, options), and the precedence by which they are merged."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Literal, cast

import msgspec
from msgspec import UNSET, UnsetType

from raytracer.core.record import Record
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, check_choice
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import CompileOptions, Evaluator, Precision, SamplingOptions, Shadows
from raytracer.scene.sequences import SampleSequence
from raytracer.scene.settings import Settings

Quality = Literal["draft", "normal", "high", "reference"]


class SettingsPatch(Record, frozen=True, repr_omit_defaults=True):
    """Partial settings: some fields of Settings. The other fields are UNSET.

    None is a value like others: it disables a field that an earlier patch sets. `quality` is a preset of all fields of
    SamplingOptions; the other fields of the same patch override it. `earlier | later` merges two patches, and the
    later one has precedence. resolve() checks the values.
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
        """Merge two patches: fields of `later` override the fields here. A quality is replaced by its fields.

        `adaptive` in `later` disables `max_error` and `time` of this patch, and the other way round, because they
        exclude each other. If `later` is the first to set `max_error`, `time` or `adaptive`, and does not set
        `samples`, `samples` becomes UNSET, which stands for DEFAULT_SAMPLE_LIMIT: an earlier `samples` was not meant as
        the limit of these. Raises InputError for an unknown quality.
        """
        return SettingsPatch(**_merge(_merge({}, self.fields()), later.fields()))

    def resolve(self) -> Settings:
        """Return the settings, with defaults for UNSET fields. Raises InputError as Settings() and quality() do."""
        return Settings(**_merge({}, self.fields()))

    def fields(self) -> dict[str, Any]:
        """Return the fields that are set, by name."""
        return {name: value for name, value in msgspec.structs.asdict(self).items() if value is not UNSET}

    def without_sampling(self) -> SettingsPatch:
        """Return the patch with the fields of CompileOptions only."""
        return SettingsPatch(**{k: v for k, v in self.fields().items() if k in CompileOptions.__struct_fields__})

    @staticmethod
    def without_none(**fields: Any) -> SettingsPatch:
        """Return a patch of the keyword arguments that are not None. None stands for an omitted argument here."""
        return SettingsPatch(**{name: value for name, value in fields.items() if value is not None})


EMPTY_PATCH = SettingsPatch()
# The quality presets. benchmarks/quality.py measures their time and error. "reference" has a fixed number of samples,
# so that it does not rely on an error estimate. It keeps 32-bit precision, because 64 bits allow 512 primitives only,
# and `render` warns if 32 bits are not enough.
QUALITIES: dict[Quality, SettingsPatch] = {
    "draft": SettingsPatch(samples=1),
    "normal": SettingsPatch(max_error=0.002, samples=256),
    "high": SettingsPatch(max_error=0.0005, samples=4096),
    "reference": SettingsPatch(samples=1024),
}


def quality(name: str) -> Settings:
    """Return the settings of a quality preset.

    Args:
        name: "draft" (1 sample per pixel), "normal" (RMS error 0.002, up to 256 samples), "high" (RMS error 0.0005, up
            to 4096 samples) or "reference" (1024 samples).

    Raises:
        InputError: an unknown name.
    """
    return SettingsPatch(quality=cast("Quality", name)).resolve()


def patch_from_settings(settings: Any) -> SettingsPatch:
    """Return a patch of all fields of a Settings object; for None, an empty patch. Raises InputError otherwise."""
    if settings is None:
        return EMPTY_PATCH
    if not isinstance(settings, Settings):
        sources = "from Settings(), quality() or load_settings()"
        raise InputError(f"expected Settings ({sources}), got {format_value(settings)}", "settings")
    return SettingsPatch(**msgspec.structs.asdict(settings))


def changed_fields(before: Settings, after: Settings) -> SettingsPatch:
    """Return the fields that differ, with the values of `after`."""
    old = msgspec.structs.asdict(before)
    return SettingsPatch(**{k: v for k, v in msgspec.structs.asdict(after).items() if v != old[k]})


def minimal_patch(settings: Settings, over: SettingsPatch = EMPTY_PATCH) -> SettingsPatch:
    """Return the smallest patch that turns the patch `over` into `settings`. Default of `over`: an empty patch."""
    # Setting or cancelling max_error, time or adaptive may change the number of samples, so it may have to be set, too.
    fields = {**changed_fields(over.resolve(), settings).fields(), "samples": settings.samples}
    for name in tuple(fields):
        smaller = {key: value for key, value in fields.items() if key != name}
        with suppress(InputError):
            fields = smaller if (over | SettingsPatch(**smaller)).resolve() == settings else fields
    return SettingsPatch(**fields)


def flags(patch: SettingsPatch) -> str:
    """Return the command line options for the fields of `patch`. Numbers have all their digits."""
    return " ".join(f"--{key.replace('_', '-')} {'none' if v is None else v}" for key, v in patch.fields().items())


def _merge(before: dict[str, Any], later: dict[str, Any]) -> dict[str, Any]:
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
        fields.pop("samples", None)  # the default of SamplingOptions is DEFAULT_SAMPLE_LIMIT
    return fields


def _has_stopping_rule(fields: dict[str, Any]) -> bool:
    return any(fields.get(key) is not None for key in ("max_error", "time"))
