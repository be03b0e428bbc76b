"""Scene files: TOML in, Scene and Settings out.

A scene file is untrusted input. It is parsed, never run; no text of it reaches a shader; its
size is bounded. Every error is an `InputError` that names the file, the key and what was expected.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

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
# Of the files that a scene file names.
_SUFFIXES = (*instance_files.READERS, *measured_files.READERS)
# The keys of a file.
_TOP = ("camera", "shapes", "objects", "materials", "lights", "instances", "ambient", "background", "settings")
_NEEDED = ("camera", "shapes", "objects")


def examples() -> dict[str, Path]:
    """The example scenes that come with the package, by name."""
    return {path.stem: path for path in sorted(packaged("scenes", "assets/scenes").glob("*.toml"))}


def load(path: str | os.PathLike[str]) -> Scene:
    """The scene in the TOML file `path`; its `name` is the file's without the suffix.

    Where there is no such file, `path` may be the name of one of `examples()`.

    Warns (UserWarning) of shapes that no object uses. Raises InputError if the file cannot be
    read or is not a scene.
    """
    return _read_all(path)[0]


@public
class SceneFile(NamedTuple):
    """All that a scene file says, in the order in which `render` takes it: `rt.render(*rt.load_all("scene.toml"))`.

    `size` is (width, height) in pixels. Size and settings are those of the table [settings]. Defaults: (1280, 720)
    and `Settings()`.
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings


def load_all(path: str | os.PathLike[str]) -> SceneFile:
    """The scene, the size and the settings in the file that `load` takes for `path`, which is read once.

    Warns and raises as `load`, and for wrong settings.
    """
    scene, section = _read_all(path)
    return SceneFile(scene, section.size or DEFAULT_SIZE, section.settings.resolve())


def _read_all(path: str | os.PathLike[str]) -> tuple[Scene, SettingsSection]:
    return parse_all(*read(path))


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """The settings in the table [settings] of the scene file that `load` takes for `path`; what it does not give is the
    default. A scene has none, as they are what is traded, whatever the scene is. The file's size is no setting:
    `load_all` gives it, with the scene and the settings of one reading.

    Raises InputError if the file cannot be read, is no TOML, or has wrong settings; the scene is not looked at.
    """
    path, text = read(path)
    with _located(path, text):
        return parse_section(parse_toml(text).get("settings", {})).settings.resolve()


def read(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """The file that `load` takes for `path`, and its text. Raises InputError if it cannot be read."""
    path = check_path(path, "path")
    try:
        if not path.exists() and str(path) in examples():
            path = examples()[str(path)]
        data = read_bounded(path, MAX_BYTES, stdin=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        near = did_you_mean_file(path, examples())
        expected = f"a readable scene file or an example ({', '.join(examples())})"
        raise InputError(f"expected {expected}: {reason}{near}", file=str(path)) from None
    if len(data) > MAX_BYTES:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes", file=str(path))
    try:
        return path, _without_mark(data.decode())
    except UnicodeDecodeError as error:
        raise InputError(f"expected UTF-8 text: {error.reason} at byte {error.start}", file=str(path)) from None


def _without_mark(text: str) -> str:
    """A text without the byte order mark with which editors on Windows let it begin."""
    return text.removeprefix("\ufeff")


def parse(path: Path, text: str) -> Scene:
    """The scene in the text of file `path`. Warns and raises as `load`; messages name file and line."""
    return parse_all(path, text)[0]


def parse_all(path: Path, text: str) -> tuple[Scene, SettingsSection]:
    """As parse(), and the file's [settings]."""
    with _located(path, text):
        scene, section, unused = _scene(text, path.stem.encode(errors="replace").decode(), path.parent)
    if unused:
        warnings.warn(f"{path}: {unused}", stacklevel=4)
    return scene, section


@contextmanager
def _located(path: Path, text: str) -> Iterator[None]:
    """Errors in the block are about the text of file `path`: they name it and the line."""
    try:
        yield
    except InputError as error:
        from raytracer.formats.toml_lines import find_line  # its patterns take a while to compile

        raise error.at(path, error.line or find_line(text, error.keys)) from None


def loads(text: str, name: str = "scene") -> Scene:
    """The scene in a TOML text. Warns and raises as `load`, without a file's name; no files of instances are read."""
    scene, _, unused = _scene(_without_mark(text), name, None)
    if unused:
        warnings.warn(unused, stacklevel=2)
    return scene


def named_files(path: Path, text: str) -> list[Path]:
    """The other files that the text of file `path` names, there or not. Raises InputError if it is no TOML."""
    document = parse_toml(text)
    tables = [table for key in ("instances", "materials") if isinstance(table := document.get(key), dict)]
    entries = [entry for table in tables for entry in table.values() if isinstance(entry, dict)]
    names = (entry.get("file") for entry in entries)
    return [path.parent / name for name in names if isinstance(name, str) and is_plain_name(name, _SUFFIXES)]


def moved(text: str, scene: Scene, folder: Path | None = None) -> str:
    """A scene file's text with its camera and lights where `scene` has them; all else stays, comments too.

    `folder` is the scene file's, where its files of instances are. Raises RuntimeError for a text that is
    laid out so strangely that this does not succeed.
    """
    text = _without_mark(text)
    try:
        result = replace_positions(text, scene.camera.position, [light.position for light in scene.lights])
        right = _scene(result, scene.name, folder)[0] == scene
    except ValueError:
        right, result = False, ""
    if not right:
        raise RuntimeError("this scene file is laid out in a way that moved lights and cameras cannot be put into")
    return result


def _scene(text: str, name: str, folder: Path | None) -> tuple[Scene, SettingsSection, str]:
    """The scene, its file's [settings], and a warning or "".

    `folder`: where its files of instances are; None if it can have none.
    """
    table = check_table(parse_toml(text), _TOP, _NEEDED)
    scene, unused = build_scene(table, name, folder)
    return scene, parse_section(table.get("settings", {})), unused
