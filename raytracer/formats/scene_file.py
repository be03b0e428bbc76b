"""Scene files: TOML in, Scene and Settings out.

A scene file is untrusted input. It is parsed, never run; no text of it reaches a shader; its
size is bounded. Every error is an `InputError` that names the file, the key and what was expected.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from raytracer.core.files import packaged, read_bounded
from raytracer.core.record import public
from raytracer.core.suggest import did_you_mean, did_you_mean_file, known
from raytracer.core.validation import InputError, check_choice, check_path, check_text, shown, within
from raytracer.formats import csg_expression
from raytracer.formats.edited_text import with_positions
from raytracer.formats.instance_file import Room, is_plain, read_instances
from raytracer.formats.settings_section import DEFAULT_SIZE, settings_table
from raytracer.formats.toml_tables import any_list, any_table, build, check_table, toml
from raytracer.scene.instances import Instances
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.presets import Fields, combined
from raytracer.scene.scene import Camera, PointLight, Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids import MAX_SURFACES, Plane, Primitive, Solid, Sphere, leaves

T = TypeVar("T")

MAX_BYTES = 4 * 1024 * 1024
# Each takes 17 MiB here and on the GPU.
MAX_TABLES = 16
# In the expressions of all objects together: as many as a scene can have primitives.
MAX_OPERATORS = MAX_SURFACES

# Of the files that a scene file names.
_SUFFIXES = (".csv", ".npz", ".binary")


# The keys of a file, and of the tables in it that are no struct's fields.
_TOP = ("camera", "shapes", "objects", "materials", "lights", "instances", "ambient", "background", "settings")
_NEEDED = ("camera", "shapes", "objects")
_INSTANCES = ("positions", "scales", "file")
_PRIMITIVES: dict[str, type[Primitive]] = {"sphere": Sphere, "plane": Plane}


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
    scene, fields = _read_all(path)
    return SceneFile(scene, fields.get("size", DEFAULT_SIZE), combined(fields))


def _read_all(path: str | os.PathLike[str]) -> tuple[Scene, Fields]:
    return parse_all(*read(path))


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """The settings in the table [settings] of the scene file that `load` takes for `path`; what it does not give is the
    default. A scene has none, as they are what is traded, whatever the scene is. The file's size is no setting:
    `load_all` gives it, with the scene and the settings of one reading.

    Raises InputError if the file cannot be read, is no TOML, or has wrong settings; the scene is not looked at.
    """
    path, text = read(path)
    with _located(path, text):
        return combined(settings_table(toml(text).get("settings", {})))


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


def parse_all(path: Path, text: str) -> tuple[Scene, Fields]:
    """As parse(), and what the file's [settings] give, for presets.combined()."""
    with _located(path, text):
        scene, given, unused = _scene(text, path.stem.encode(errors="replace").decode(), path.parent)
    if unused:
        warnings.warn(f"{path}: {unused}", stacklevel=4)
    return scene, given


@contextmanager
def _located(path: Path, text: str) -> Iterator[None]:
    """Errors in the block are about the text of file `path`: they name it and the line."""
    try:
        yield
    except InputError as error:
        from raytracer.formats.toml_lines import line_of  # its patterns take a while to compile

        raise error.at(path, error.line or line_of(text, error.keys)) from None


def loads(text: str, name: str = "scene") -> Scene:
    """The scene in a TOML text. Warns and raises as `load`, without a file's name; no files of instances are read."""
    scene, _, unused = _scene(_without_mark(text), name, None)
    if unused:
        warnings.warn(unused, stacklevel=2)
    return scene


def named_files(path: Path, text: str) -> list[Path]:
    """The other files that the text of file `path` names, there or not. Raises InputError if it is no TOML."""
    document = toml(text)
    tables = [table for key in ("instances", "materials") if isinstance(table := document.get(key), dict)]
    entries = [entry for table in tables for entry in table.values() if isinstance(entry, dict)]
    names = (entry.get("file") for entry in entries)
    return [path.parent / name for name in names if isinstance(name, str) and is_plain(name, _SUFFIXES)]


def moved(text: str, scene: Scene, folder: Path | None = None) -> str:
    """A scene file's text with its camera and lights where `scene` has them; all else stays, comments too.

    `folder` is the scene file's, where its files of instances are. Raises RuntimeError for a text that is
    laid out so strangely that this does not succeed.
    """
    text = _without_mark(text)
    try:
        result = with_positions(text, scene.camera.position, [light.position for light in scene.lights])
        right = _scene(result, scene.name, folder)[0] == scene
    except ValueError:
        right, result = False, ""
    if not right:
        raise RuntimeError("this scene file is laid out in a way that moved lights and cameras cannot be put into")
    return result


def _scene(text: str, name: str, folder: Path | None) -> tuple[Scene, Fields, str]:
    """The scene, its file's settings, and a warning or "".

    `folder`: where its files of instances are; None if it can have none.
    """
    table = check_table(toml(text), _TOP, _NEEDED)
    tables: dict[str, Any] = {}
    materials = _named(table, "materials", lambda value, name: _material(value, name, folder, tables))
    shapes = _named(table, "shapes", lambda value, name: _shape(value, name, materials))
    _check_operators(table["objects"])
    solids = _named(table, "objects", lambda value, _: _object(value, shapes, table["objects"]))
    objects = solids | _all_instances(table, solids, folder)
    with within("lights"):
        lights = [_light(value, i) for i, value in enumerate(any_list(table.get("lights", [])))]
    with within("camera"):
        camera = build(Camera, table["camera"])
    scene = Scene(
        objects=tuple(objects.values()),
        lights=lights,
        camera=camera,
        materials=tuple(materials.values()),
        name=name,
        **{key: table[key] for key in ("ambient", "background") if key in table},
    )
    return scene, settings_table(table.get("settings", {})), _unused(shapes, solids.values())


def _named(table: dict[str, Any], key: str, make: Callable[[Any, str], T]) -> dict[str, T]:
    """The results of `make(value, name)` for each entry of the table at `key`."""
    made: dict[str, T] = {}
    with within(key):
        for name, value in any_table(table.get(key, {})).items():
            with within(name):
                made[name] = make(value, name)
    return made


def _check_operators(objects: Any) -> None:
    """Raise InputError where the expressions of all objects together have too many operators."""
    texts = [text for text in objects.values() if isinstance(text, str)] if isinstance(objects, dict) else []
    if (count := sum(text.count(sign) for text in texts for sign in "~-&|")) > MAX_OPERATORS:
        raise InputError(f"expected at most {MAX_OPERATORS} operators in all, got {count}", "objects")


def _light(value: Any, i: int) -> PointLight:
    with within(i):
        return build(PointLight, value)


def _material(value: Any, name: str, folder: Path | None, tables: dict[str, Any]) -> Material:
    """`tables`: of the .binary files that were read."""
    # The label is the table's own name, so `name` is no key of it.
    model = check_choice(any_table(value).get("model", "phong"), "model", MODELS)
    parameters = dict(check_table(value, ("model", *MODELS[model].parameters)))
    if "file" in parameters:
        with within("file"):
            parameters["file"] = _measured_file(parameters["file"], folder, tables)
    return Material(**parameters, name=name)


def _measured_file(name: Any, folder: Path | None, tables: dict[str, Any]) -> Any:
    if not isinstance(name, str) or not is_plain(name, (".binary",)):
        raise InputError(f"expected the plain name of a .binary file in the scene file's folder, got {shown(name)}")
    if folder is None:
        raise InputError("a text is in no folder; load() the scene's file instead")
    if name not in tables and len(tables) == MAX_TABLES:
        raise InputError(f"expected at most {MAX_TABLES} .binary files in a scene")
    if name not in tables:
        from raytracer.scene.materials.merl import read  # with NumPy, which few scene files need

        tables[name] = read(folder / name, folder)
    return tables[name]


def _shape(value: Any, name: str, materials: dict[str, Material]) -> Primitive:
    if not csg_expression.is_name(name):
        raise InputError('expected a name of letters, digits and "_" that begins with no digit')
    table = check_table(value, ("material", *_PRIMITIVES), ("material",))
    with within("material"):
        material = _material_of(table["material"], materials)
    kinds = [kind for kind in _PRIMITIVES if kind in table]
    if len(kinds) != 1:
        raise InputError(f"expected one of sphere or plane, got {' and '.join(kinds) or 'neither'}")
    with within(kinds[0]):
        return build(_PRIMITIVES[kinds[0]], table[kinds[0]], material=material)


def _material_of(name: Any, materials: dict[str, Material]) -> Material:
    """The file's own material of that name, or a published one."""
    if isinstance(name, str) and name in materials:
        return materials[name]
    if not isinstance(name, str) or "/" not in name:
        near = did_you_mean(name, materials) if isinstance(name, str) else ""
        raise InputError(f"expected the name of a material, got {shown(name)} ({known(materials)}){near}")
    from raytracer.formats.material_library import material_named

    return material_named(name)


def _object(text: Any, shapes: dict[str, Primitive], objects: dict[str, Any]) -> Solid:
    if not isinstance(text, str):
        raise InputError(f"expected a string, an expression over shapes, got {shown(text)}")
    return csg_expression.parse(text, shapes, objects)


def _all_instances(table: dict[str, Any], solids: dict[str, Solid], folder: Path | None) -> dict[str, Instances]:
    """The table [instances]. Each is bounded alone, and here all are together, before they take time and memory."""
    room = Room()
    count = 0

    def make(value: Any, name: str) -> Instances:
        nonlocal count
        made = _instances(value, name, solids, folder, room)
        count += len(made) * len(leaves(solids[name]))
        if count > MAX_SURFACES:
            raise InputError(f"expected at most {MAX_SURFACES} primitives in all, got {count}")
        return made

    return _named(table, "instances", make)


def _instances(value: Any, name: str, solids: dict[str, Solid], folder: Path | None, room: Room) -> Instances:
    if name not in solids:
        raise InputError(f"expected the name of an object ({known(solids)}){did_you_mean(name, solids)}")
    table = check_table(value, _INSTANCES)
    if ("file" in table) == ("positions" in table):
        got = "both" if "file" in table else "neither"
        raise InputError(f"expected one of positions or file, got {got}")
    if "file" not in table:
        return Instances(solids[name], table["positions"], table.get("scales", 1.0))
    if "scales" in table:
        raise InputError(f"expected scales in {shown(table['file'])}, not here too", "scales")
    with within("file"):
        if folder is None:
            raise InputError("expected positions: a text is in no folder; load() the scene's file instead")
        return read_instances(solids[name], folder, check_text(table["file"], ()), room)


def _unused(shapes: dict[str, Primitive], objects: Iterable[Solid]) -> str:
    """A warning of shapes that no object uses, or ""."""
    used = {id(leaf) for solid in objects for leaf in leaves(solid)}
    unused = [name for name, shape in shapes.items() if id(shape) not in used]
    shown = ", ".join(unused[:5]) + (", ..." if len(unused) > 5 else "")
    return f"no object uses the shape{'s' if len(unused) > 1 else ''} {shown}" if unused else ""
