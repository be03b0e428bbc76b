"""Scene files: TOML in, Scene and Settings out.

A scene file is untrusted input: it is parsed, never run; no text of the file reaches a shader; the file's size is
bounded. Every error is an `InputError` that names the file, the key and the expected value.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from raytracer.core.collector import collector_paused
from raytracer.core.files import packaged, read_bounded
from raytracer.core.record import public
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path
from raytracer.formats import instance_files, measured_files
from raytracer.formats.companion_files import is_plain_name
from raytracer.formats.scene_sections import build_scene
from raytracer.formats.settings_section import DEFAULT_SIZE, SettingsSection, parse_section
from raytracer.formats.toml_edit import replace_positions
from raytracer.formats.toml_tables import check_table
from raytracer.formats.toml_text import parse_toml
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

MAX_BYTES = 4 * 1024 * 1024
# The suffixes of the files that a scene file names.
_SUFFIXES = (*instance_files.READERS, *measured_files.READERS)
# The keys of a file.
_TOP = ("camera", "shapes", "objects", "materials", "lights", "instances", "ambient", "background", "settings")
_NEEDED = ("camera", "shapes", "objects")


@public
class SceneFile(NamedTuple):
    """The content of a scene file, in the order in which `render` takes it: `rt.render(*rt.load_all("scene.toml"))`.

    `size` is (width, height) in pixels. The table [settings] gives size and settings. Defaults: (1280, 720)
    and `Settings()`.
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings


class SceneDocument(NamedTuple):
    """A scene file that was read: the file's path, its text, and the scene and the settings that the text gives."""

    path: Path
    text: str
    scene: Scene
    section: SettingsSection


def examples() -> dict[str, Path]:
    """List the example scenes that come with the package, by name."""
    return {path.stem: path for path in sorted(packaged("scenes", "assets/scenes").glob("*.toml"))}


def load(path: str | os.PathLike[str]) -> Scene:
    """The scene in the TOML file `path`; its `name` is the file's without the suffix.

    Where there is no such file, `path` may be the name of one of `examples()`.

    Warns (UserWarning) of shapes that no object uses. Raises InputError if the file cannot be
    read or is not a scene.
    """
    return read_document(find_scene(path)).scene


def load_all(path: str | os.PathLike[str]) -> SceneFile:
    """The scene, the size and the settings in the file that `load` takes for `path`, which is read once.

    Warns and raises as `load`, and for wrong settings.
    """
    document = read_document(find_scene(path))
    section = document.section
    return SceneFile(document.scene, section.size or DEFAULT_SIZE, section.settings.resolve())


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """The settings in the table [settings] of the scene file that `load` takes for `path`; other settings are defaults.

    A Scene has no settings, as the same scene is rendered with many. The file's size is no setting: `load_all` gives
    the size, with the scene and the settings of one reading.

    Raises InputError if the file cannot be read, is no TOML, or has wrong settings; the scene is not looked at.
    """
    path = find_scene(path)
    text = read_text(path)
    with _located(path, text):
        return parse_section(parse_toml(text).get("settings", {})).settings.resolve()


def loads(text: str, name: str = "scene") -> Scene:
    """The scene in a TOML text. Warns and raises as `load`, without a file's name; no files of instances are read."""
    scene, _, warning = _parse(_without_mark(text), name, None)
    if warning:
        warnings.warn(warning, stacklevel=2)
    return scene


def find_scene(path: str | os.PathLike[str]) -> Path:
    """Find the file that `load` takes for `path`, there or not. Raises InputError for no path."""
    path = check_path(path, "path")
    with suppress(OSError, ValueError):  # a name that the file system does not take
        if not path.exists():
            return examples().get(str(path), path)
    return path


def read_document(path: Path) -> SceneDocument:
    """Read a scene file. Warns and raises as `load`, whose caller the warning names."""
    return parse_document(path, read_text(path), stacklevel=4)


def read_text(path: Path) -> str:
    """Read the text of a scene file. Raises InputError if it cannot be read."""
    try:
        data = read_bounded(path, MAX_BYTES, stdin=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        near = did_you_mean_file(path, examples())
        expected = f"a readable scene file or an example ({', '.join(examples())})"
        raise InputError(f"expected {expected}: {reason}{near}", file=str(path)) from None
    if len(data) > MAX_BYTES:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes", file=str(path))
    try:
        return _without_mark(data.decode())
    except UnicodeDecodeError as error:
        raise InputError(f"expected UTF-8 text: {error.reason} at byte {error.start}", file=str(path)) from None


def parse_document(path: Path, text: str, *, stacklevel: int = 2) -> SceneDocument:
    """Parse the text of the scene file `path`. Warns and raises as `load`; messages name file and line."""
    with _located(path, text):
        scene, section, warning = _parse(text, path.stem.encode(errors="replace").decode(), path.parent)
    if warning:
        warnings.warn(f"{path}: {warning}", stacklevel=stacklevel)
    return SceneDocument(path, text, scene, section)


def companion_paths(path: Path, text: str) -> list[Path]:
    """List the other files that the text of file `path` names, there or not. Raises InputError if it is no TOML."""
    document = parse_toml(text)
    tables = [table for key in ("instances", "materials") if isinstance(table := document.get(key), dict)]
    entries = [entry for table in tables for entry in table.values() if isinstance(entry, dict)]
    names = (entry.get("file") for entry in entries)
    return [path.parent / name for name in names if isinstance(name, str) and is_plain_name(name, _SUFFIXES)]


def edit_positions(text: str, scene: Scene, folder: Path | None = None) -> str:
    """Put the positions of the camera and the lights of `scene` into a scene file's text; all else stays, comments too.

    `folder` is the scene file's, where its files of instances are. Raises RuntimeError for a text with so strange a
    layout that this does not succeed.
    """
    text = _without_mark(text)
    try:
        edited = replace_positions(text, scene.camera.position, [light.position for light in scene.lights])
        is_right = _parse(edited, scene.name, folder)[0] == scene
    except ValueError:
        is_right, edited = False, ""
    if not is_right:
        raise RuntimeError("this scene file is laid out in a way that moved lights and cameras cannot be put into")
    return edited


@contextmanager
def _located(path: Path, text: str) -> Iterator[None]:
    """Errors in the block are about the text of file `path`: they name the file and the line."""
    try:
        yield
    except InputError as error:
        from raytracer.formats.toml_lines import find_line  # its patterns take a while to compile

        raise error.at(path, error.line or find_line(text, error.keys)) from None


def _without_mark(text: str) -> str:
    """A text without the byte order mark with which editors on Windows let it begin."""
    return text.removeprefix("\ufeff")


def _parse(text: str, name: str, folder: Path | None) -> tuple[Scene, SettingsSection, str]:
    """The scene, its file's [settings], and a warning or "".

    `folder`: where the scene's files of instances are; None if there can be none.
    """
    with collector_paused():
        table = check_table(parse_toml(text), _TOP, _NEEDED)
        scene, warning = build_scene(table, name, folder)
        return scene, parse_section(table.get("settings", {})), warning
