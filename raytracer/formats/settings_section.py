"""The [settings] of a scene file: how it is to be rendered, where the command line does not say otherwise."""

from __future__ import annotations

from typing import Any

from raytracer.core.validation import check_size, within
from raytracer.formats.toml_tables import check_table
from raytracer.scene.presets import Fields, combined
from raytracer.scene.settings import Settings

# Width and height in pixels of a picture, where nobody says otherwise.
DEFAULT_SIZE = 1280, 720
_KEYS = (*Settings.__struct_fields__, "quality", "size")


def settings_table(value: Any) -> Fields:
    """The fields of the table: see presets.combined(); "size" is (width, height). Errors have the path of keys."""
    with within("settings"):
        fields = dict(check_table(value, _KEYS))
        if "size" in fields:
            fields["size"] = check_size(fields["size"])
        combined(fields)
    return fields
