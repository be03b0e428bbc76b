"""Scenes and settings of a sweep: a scene file or a Scene with other values at the paths of a point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from raytracer.core.validation import InputError, KeyNameError, locate_errors
from raytracer.farm.scene_attributes import replace_attribute
from raytracer.farm.sweep_points import Point
from raytracer.formats.scene_file import SceneDocument
from raytracer.formats.scene_paths import parse_path, replace_value
from raytracer.formats.settings_section import DEFAULT_SIZE, parse_section
from raytracer.formats.value_texts import Value
from raytracer.scene.options import SamplingOptions
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import EMPTY_PATCH, SettingsPatch

# The settings that the text "none" cancels, as the options of the command line do.
_CANCELLED_BY_NONE = ("shading", "adaptive", "max_error", "time")
# The settings of which each one replaces the others of another source.
_STOPPING = ("adaptive", "max_error", "time")


class SweptScene(NamedTuple):
    """All values that determine one picture of a sweep."""

    scene: Scene
    size: tuple[int, int]
    settings: Settings


class SweepSource(NamedTuple):
    """The scene and the settings that a sweep varies.

    Attributes:
        base: a scene file, in which paths name values of its tables, or a Scene, in which paths name attributes. Both
            have paths "settings.NAME", too.
        size: (width, height) in pixels, in place of the file's size. None: the file's size.
        settings: settings in place of the file's settings. Swept settings override them. None: the file's settings.
        chosen: settings that override all others.
    """

    base: SceneDocument | Scene
    size: tuple[int, int] | None = None
    settings: SettingsPatch | None = None
    chosen: SettingsPatch = EMPTY_PATCH

    def scene_at(self, point: Point) -> SweptScene:
        """Return the scene, the size and the settings of a point. Raises InputError for values that they cannot have.

        The scenes of two points share the objects that do not depend on their values.
        """
        base = self.base
        values, swept = _split(point)
        if isinstance(base, SceneDocument):
            scene = base.change(values).scene if values else base.scene
            tables = base.built.tables.get("settings", {}) if base.built and self.settings is None else {}
        else:
            scene, tables = base, {}
            for path, value in values.items():
                scene = replace_attribute(scene, parse_path(path), value)
        section = parse_section({**tables, **swept})
        settings = section.settings if self.settings is None else self.settings | section.settings
        size = section.size if "size" in swept else self.size or section.size
        return SweptScene(scene, size or DEFAULT_SIZE, (settings | self.chosen).resolve())

    def check(self, points: Sequence[Point]) -> None:
        """Raise InputError if a path leads to no value of the scene, or if a chosen setting hides a swept one.

        Values that the scene refuses are no error here, except a text in place of numbers and the other way round.
        """
        for path in points[0]:
            keys = parse_path(path)
            with locate_errors(path):
                for value in dict.fromkeys(point[path] for point in points):
                    self._check_path(path, value)
                if keys[0] == "settings":
                    _check_conflicts(str(keys[1]), self.chosen, is_sized=self.size is not None)
        try:
            self.scene_at(points[0])
        except KeyNameError as error:
            # A name of a path that the file could have, but that the scene does not know.
            if error.keys in [parse_path(path) for path in points[0]]:
                raise
        except InputError:
            pass

    def _check_path(self, path: str, value: Value) -> None:
        """Raise InputError if a path leads to no value, or to a value of another kind."""
        keys = parse_path(path)
        _, swept = _split({path: value})
        if isinstance(self.base, SceneDocument) and not swept:
            assert self.base.built
            replace_value(self.base.built.tables, keys, value)
            return
        try:
            if swept:
                parse_section(swept)
            else:
                assert isinstance(self.base, Scene)
                replace_attribute(self.base, keys, value)
        except KeyNameError:
            raise
        except InputError:  # a value of the right place, which may be right together with others
            pass


def _split(point: Point) -> tuple[dict[str, Value], dict[str, Any]]:
    """Return the values of the scene by path, and the values of settings by name."""
    values: dict[str, Value] = {}
    swept: dict[str, Any] = {}
    for path, value in point.items():
        keys = parse_path(path)
        if keys[0] != "settings":
            values[path] = value
        elif len(keys) == 2:
            name = str(keys[1])
            swept[name] = None if value == "none" and name in _CANCELLED_BY_NONE else value
        else:
            raise InputError(f"expected a path such as settings.samples, got {path}")
    return values, swept


def _check_conflicts(name: str, chosen: SettingsPatch, *, is_sized: bool) -> None:
    """Raise InputError if settings that override all others replace the swept setting `name`."""
    names = [*chosen.fields(), *(["size"] if is_sized else [])]
    sampling = SamplingOptions.__struct_fields__
    for other in names:
        is_both_stopping = name in _STOPPING and other in _STOPPING
        is_quality = (other == "quality" and name in sampling) or (name == "quality" and other in sampling)
        if other == name or is_quality or is_both_stopping:
            raise InputError(f"expected no {other} beside a sweep of this setting, which {other} would override")
