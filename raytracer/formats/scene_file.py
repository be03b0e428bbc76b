"""Scene files: reading TOML into Scene and Settings.

A scene file is untrusted input. It is parsed and never executed, none of its text gets into a shader, and its size is
limited. Every error is an `InputError` that names the file, the line, the key and the expected value.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from raytracer.core.collector import pause_collector
from raytracer.core.files import find_data_folder, read_bounded
from raytracer.core.record import public
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path
from raytracer.formats import instance_files, measured_files
from raytracer.formats.animation_section import parse_animation
from raytracer.formats.companion_files import is_plain_name
from raytracer.formats.scene_paths import replace_values
from raytracer.formats.scene_sections import BuiltScene, build_scene, camera_values, rebuild_scene
from raytracer.formats.settings_section import DEFAULT_SIZE, SettingsSection, parse_section
from raytracer.formats.toml_edit import add_table, replace_positions
from raytracer.formats.toml_tables import SCENE_KEYS, check_table
from raytracer.formats.toml_text import parse_toml
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.tracks import Animation

MAX_BYTES = 4 * 1024 * 1024
# The suffixes of companion files.
_SUFFIXES = (*instance_files.READERS, *measured_files.READERS)
# The required top-level keys of a scene file.
_NEEDED = ("shapes", "objects")


@public
class SceneFile(NamedTuple):
    """The content of a scene file, in the order of the arguments of `render`: `rt.render(*rt.load_all("scene.toml"))`.

    Attributes:
        scene: the scene.
        size: (width, height) in pixels, from the table [settings]. Default: (1280, 720).
        settings: the settings in the table [settings]. Default: Settings().
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings


class SceneDocument(NamedTuple):
    """A scene file after reading: its path and text, and the scene and the settings in the text.

    Attributes:
        path: the file.
        text: the text of the file.
        scene: the scene.
        section: the settings.
        animation: the frames in the text, or None if the text describes a single picture.
        built: the construction of the scene in the text, from which change() goes on. None for a document without one.
    """

    path: Path
    text: str
    scene: Scene
    section: SettingsSection
    animation: Animation | None = None
    built: BuiltScene | None = None

    def change(self, values: Mapping[str, Any]) -> SceneDocument:
        """Return the document with another scene, or other settings: with other values at some paths of its tables.

        The values replace those of the text, not those of an earlier change. Objects and companion files that do not
        depend on the values are not built or read again. Unused shapes are not warned about.

        Args:
            values: numbers, vectors of numbers or texts, by path, such as {"lights.0.position": (4, 7, 4)}.

        Raises:
            InputError: a wrong path, or a scene or settings that such a file could not have.
        """
        assert self.built
        with _locate_errors(self.path, self.text):
            tables = replace_values(self.built.tables, values)
            section = parse_section(tables.get("settings", {}))
            return self._replace(scene=rebuild_scene(self.built, tables).scene, section=section)


def examples() -> dict[str, Path]:
    """Return the files of the example scenes that are installed with the package, by name."""
    return {path.stem: path for path in sorted(find_data_folder("scenes", "assets/scenes").glob("*.toml"))}


def load(path: str | os.PathLike[str]) -> Scene:
    """Load a scene from a TOML file. The scene's `name` is the file's name without the suffix.

    Args:
        path: the file, or the name of an example scene such as "assignment" (if there is no such file).

    Returns:
        The scene. Settings in the file are ignored: see `load_settings` and `load_all`.

    Raises:
        InputError: the file cannot be read, or does not describe a scene. The error has `file`, `line` and `keys`.

    Warns (UserWarning) of shapes and parts that no object uses.
    """
    return read_document(find_scene(path)).scene


def load_all(path: str | os.PathLike[str]) -> SceneFile:
    """Load the scene, the picture size and the settings from a TOML file: `rt.render(*rt.load_all("scene.toml"))`.

    Args:
        path: the file, or the name of an example scene, as for `load`.

    Returns:
        A named tuple (scene, size, settings).

    Raises:
        InputError: as `load`, and for wrong settings.

    Warns (UserWarning) of shapes and parts that no object uses.
    """
    document = read_document(find_scene(path))
    section = document.section
    return SceneFile(document.scene, section.size or DEFAULT_SIZE, section.settings.resolve())


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """Load only the settings from the table [settings] of a scene file. Missing settings have their defaults.

    The picture size in the table is not part of Settings; `load_all` returns it.

    Args:
        path: the file, or the name of an example scene, as for `load`.

    Returns:
        The settings.

    Raises:
        InputError: the file cannot be read, is not TOML, or has wrong settings. The scene is not checked.
    """
    path = find_scene(path)
    text = read_text(path)
    with _locate_errors(path, text):
        return parse_section(parse_toml(text).get("settings", {})).settings.resolve()


def loads(text: str, name: str = "scene") -> Scene:
    """Return the scene in a TOML text, without companion files. Warns and raises as `load`, without a file name."""
    built = _parse(_remove_mark(text), name, None)[0]
    if built.warning:
        warnings.warn(built.warning, stacklevel=2)
    return built.scene


def find_scene(path: str | os.PathLike[str]) -> Path:
    """Return the file for an argument of `load`: an example's file if `path` does not exist, else `path`.

    Raises InputError if `path` is not a path.
    """
    path = check_path(path, "path")
    with suppress(OSError, ValueError):  # the file system does not accept the name
        if not path.exists():
            return examples().get(str(path), path)
    return path


def read_document(path: Path) -> SceneDocument:
    """Read a scene file. Warns and raises as `load`; the warning points at the caller of `load`."""
    return parse_document(path, read_text(path), stacklevel=4)


def read_text(path: Path) -> str:
    """Read the text of a scene file. Raises InputError if it cannot be read."""
    try:
        data = read_bounded(path, MAX_BYTES, stdin=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        hint = did_you_mean_file(path, examples())
        expected = f"a readable scene file or an example ({', '.join(examples())})"
        raise InputError(f"expected {expected}: {reason}{hint}", file=str(path)) from None
    if len(data) > MAX_BYTES:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes", file=str(path))
    try:
        return _remove_mark(data.decode())
    except UnicodeDecodeError as error:
        raise InputError(f"expected UTF-8 text: {error.reason} at byte {error.start}", file=str(path)) from None


def parse_document(path: Path, text: str, *, stacklevel: int = 2) -> SceneDocument:
    """Parse the text of the scene file `path`. Warns and raises as `load`; messages name file and line."""
    with _locate_errors(path, text):
        built, section, animation = _parse(text, path.stem.encode(errors="replace").decode(), path.parent)
    if built.warning:
        warnings.warn(f"{path}: {built.warning}", stacklevel=stacklevel)
    return SceneDocument(path, text, built.scene, section, animation, built)


def companion_paths(path: Path, text: str) -> list[Path]:
    """Return the companion files that the text of the scene file `path` names, whether they exist or not.

    Raises InputError if the text is not TOML.
    """
    document = parse_toml(text)
    tables = [table for key in ("instances", "materials") if isinstance(table := document.get(key), dict)]
    entries = [entry for table in tables for entry in table.values() if isinstance(entry, dict)]
    names = (entry.get("file") for entry in entries)
    return [path.parent / name for name in names if isinstance(name, str) and is_plain_name(name, _SUFFIXES)]


def edit_positions(text: str, scene: Scene, folder: Path | None = None) -> str:
    """Replace the positions of the camera and the lights in a scene file's text, and keep everything else.

    An orthographic camera may have another height, too. A text without a camera gets one at its end if the camera of
    the scene is not the one that frames the objects.

    Args:
        text: the text of the scene file, whose comments and layout are kept.
        scene: the scene with the new positions. It must otherwise equal the scene in the text.
        folder: the scene file's folder, for its companion files. None: there are none.

    Returns:
        The new text.

    Raises:
        RuntimeError: the text has an unsupported TOML layout.
    """
    text = _remove_mark(text)
    try:
        camera = camera_values(scene.camera)
        moved = {name: value for name, value in camera.items() if name in ("position", "height")}
        edited = replace_positions(text, moved, [light.position for light in scene.lights])
        if "camera" not in parse_toml(text) and scene.camera != _parse(text, scene.name, folder)[0].scene.camera:
            edited = add_table(edited, "camera", camera)
        is_right = _parse(edited, scene.name, folder)[0].scene == scene
    except ValueError:
        is_right, edited = False, ""
    if not is_right:
        raise RuntimeError("cannot write the moved light or camera back into the file: unsupported TOML layout")
    return edited


@contextmanager
def _locate_errors(path: Path, text: str) -> Iterator[None]:
    """Add the file and the line to InputErrors raised in the block, which are about the text of the file `path`."""
    try:
        yield
    except InputError as error:
        from raytracer.formats.toml_lines import find_line  # imported here, because its patterns compile slowly

        raise error.at(path, error.line or find_line(text, error.keys)) from None


def _remove_mark(text: str) -> str:
    """Remove the byte order mark that some editors on Windows put at the beginning of a text."""
    return text.removeprefix("\ufeff")


def _parse(text: str, name: str, folder: Path | None) -> tuple[BuiltScene, SettingsSection, Animation | None]:
    """Return the scene, the settings and the animation in a text.

    `folder` contains the companion files. None: the text must not name any.
    """
    with pause_collector():
        tables = check_table(parse_toml(text), (*SCENE_KEYS, "animation"), _NEEDED)
        built = build_scene(tables, name, folder)
        animation = parse_animation(tables["animation"], tables) if "animation" in tables else None
        return built, parse_section(tables.get("settings", {})), animation
