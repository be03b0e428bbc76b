"""The [settings] of a scene file: how it is to be rendered, where the command line does not say otherwise."""

from __future__ import annotations

from typing import Any

from raytracer.checks import MAX_SIDE, InputError, shown
from raytracer.presets import Fields, combined
from raytracer.settings import Settings

# Width and height in pixels of a picture, where nobody says otherwise.
DEFAULT_SIZE = 1280, 720
_KEYS = (*Settings.__struct_fields__, "quality", "size")


def settings_table(table: dict[str, Any]) -> Fields:
    """What the table gives: see presets.combined(); "size" is (width, height). Errors begin with the whole key."""
    if unknown := [key for key in table if key not in _KEYS]:
        raise InputError(f"settings: unknown key `{unknown[0]}` (known: {', '.join(_KEYS)})")
    fields = dict(table)
    try:
        if "size" in table:
            fields["size"] = _size(table["size"])
        combined(fields)
    except InputError as error:
        raise InputError(f"settings.{error}") from None
    return fields


def _size(value: Any) -> tuple[int, int]:
    right = isinstance(value, list) and len(value) == 2
    if not right or not all(type(side) is int and 1 <= side <= MAX_SIDE for side in value):
        raise InputError(f"size: expected [width, height] in whole pixels in [1, {MAX_SIDE}], got {shown(value)}")
    return value[0], value[1]
