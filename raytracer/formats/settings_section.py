"""The table [settings] of a scene file: render settings that command line options override."""

from __future__ import annotations

from typing import Any

import msgspec

from raytracer.core.validation import check_size, within
from raytracer.formats.toml_tables import check_table
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import EMPTY_PATCH, SettingsPatch, minimal_patch

# The default (width, height) of a picture, in pixels.
DEFAULT_SIZE = 1280, 720
_KEYS = (*Settings.__struct_fields__, "quality", "size")


class SettingsSection(msgspec.Struct, frozen=True):
    """The settings in a scene file, and the picture's (width, height) in pixels; None if the file has no size."""

    settings: SettingsPatch = EMPTY_PATCH
    size: tuple[int, int] | None = None


def parse_section(value: Any) -> SettingsSection:
    """Check and convert the table [settings]. Raises InputError with the path of keys."""
    with within("settings"):
        fields = dict(check_table(value, _KEYS))
        size = check_size(fields.pop("size")) if "size" in fields else None
        settings = SettingsPatch(**fields)
        settings.resolve()
    return SettingsSection(settings, size)


def section_text(settings: Settings, size: tuple[int, int] | None = None) -> str:
    """Return a table [settings] in TOML for `settings`, without the defaults, and for `size` unless it is None."""
    lines = [f"size = [{size[0]}, {size[1]}]"] if size else []
    lines += [
        f'{name} = "{value}"' if isinstance(value, str) else f"{name} = {value}"
        for name, value in minimal_patch(settings).fields().items()
    ]
    return "\n".join(["[settings]", *lines]) + "\n"
