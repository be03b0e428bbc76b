"""Scene files: TOML in, Scene and Settings out.

A scene file is untrusted input. It is parsed, never run; no text of it reaches a shader; its
size is bounded. Every error is an `InputError` that names the file, the key and what was expected.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from raytracer import expression
from raytracer.checks import InputError, Vec3, shown
from raytracer.files import packaged, read_bounded
from raytracer.instance_file import Room, is_plain, read_instances
from raytracer.instances import Instances
from raytracer.material import Material
from raytracer.models import MODELS
from raytracer.moved_text import with_positions
from raytracer.presets import Fields, combined
from raytracer.scene import Camera, PointLight, Scene
from raytracer.settings import Settings
from raytracer.settings_table import settings_table
from raytracer.solids import MAX_SURFACES, Plane, Primitive, Solid, Sphere, leaves
from raytracer.toml_table import convert, known, shortened, toml

MAX_BYTES = 4 * 1024 * 1024
# Each takes 17 MiB here and on the GPU.
MAX_TABLES = 16
# Of the expressions of all objects: as many as a scene can have primitives.
MAX_OPERATORS = MAX_SURFACES

# Of the files that a scene file names.
_SUFFIXES = (".csv", ".npz", ".binary")


class _SphereTable(msgspec.Struct):
    center: Vec3
    radius: float


class _PlaneTable(msgspec.Struct):
    normal: Vec3
    offset: float


class _ShapeTable(msgspec.Struct):
    material: str
    sphere: dict[str, Any] | None = None
    plane: dict[str, Any] | None = None


class _InstancesTable(msgspec.Struct):
    positions: list[Vec3] = []
    scales: float | list[float] = 1.0
    file: str = ""


class _SceneTable(msgspec.Struct):
    """The file's top level. Tables of named entries stay raw, to be checked with their names at hand."""

    camera: dict[str, Any]
    shapes: dict[str, Any]
    objects: dict[str, Any]
    materials: dict[str, Any] = {}
    lights: list[Any] = []
    instances: dict[str, Any] = {}
    ambient: Vec3 | None = None
    background: Vec3 | None = None
    settings: dict[str, Any] = {}


class _SettingsOnly(msgspec.Struct):
    settings: dict[str, Any]


def examples() -> dict[str, Path]:
    """The example scenes that come with the package, by name."""
    return {path.stem: path for path in sorted(packaged("scenes", "assets/scenes").glob("*.toml"))}


def load(path: str | os.PathLike[str]) -> Scene:
    """The scene in the TOML file `path`; its `name` is the file's without the suffix.

    Where there is no such file, `path` may be the name of one of `examples()`.

    Warns (UserWarning) of shapes that no object uses. Raises InputError if the file cannot be
    read or is not a scene.
    """
    return parse(*read(path))


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """The settings in the table [settings] of the scene file that `load` takes for `path`; what it does not give is the
    default. A scene has none, as they are what is traded, whatever the scene is.

    Raises InputError if the file cannot be read, is no TOML, or has wrong settings; the scene is not looked at.
    """
    path, text = read(path)
    with _located(path, text):
        table = convert({"settings": toml(text).get("settings", {})}, _SettingsOnly, "")
        return combined(settings_table(table.settings))


def read(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """The file that `load` takes for `path`, and its text. Raises InputError if it cannot be read."""
    path = Path(path)
    try:
        if not path.exists() and str(path) in examples():
            path = examples()[str(path)]
        data = read_bounded(path, MAX_BYTES, stdin=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        names = ", ".join(examples())
        raise InputError(f"{path}: expected a readable scene file or an example ({names}): {reason}") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"{path}: expected a file of at most {MAX_BYTES} bytes")
    try:
        return path, _without_mark(data.decode())
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected UTF-8 text: {error.reason} at byte {error.start}") from None


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
        from raytracer.scene_text import line_of_error  # its patterns take a while to compile

        line = line_of_error(text, str(error))
        message = shortened(str(error))
        raise InputError(f"{path}:{line}: {message}" if line else f"{path}: {message}") from None


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
    table = convert(toml(text), _SceneTable, "")
    tables: dict[str, Any] = {}
    materials = {key: _material(value, key, folder, tables) for key, value in table.materials.items()}
    shapes = {key: _shape(value, key, materials) for key, value in table.shapes.items()}
    expressions = [text for text in table.objects.values() if isinstance(text, str)]
    if (count := sum(text.count(sign) for text in expressions for sign in "~-&|")) > MAX_OPERATORS:
        raise InputError(f"objects: expected at most {MAX_OPERATORS} operators in all, got {count}")
    solids = {key: _object(text, key, shapes, table.objects) for key, text in table.objects.items()}
    objects = solids | _all_instances(table.instances, solids, folder)
    options = {key: getattr(table, key) for key in ("ambient", "background") if getattr(table, key) is not None}
    scene = Scene(
        objects=tuple(objects.values()),
        lights=[convert(value, PointLight, f"lights[{i}]") for i, value in enumerate(table.lights)],
        camera=convert(table.camera, Camera, "camera"),
        materials=tuple(materials.values()),
        name=name,
        **options,
    )
    return scene, settings_table(table.settings), _unused(shapes, solids.values())


def _material(value: Any, name: str, folder: Path | None, tables: dict[str, Any]) -> Material:
    """`tables`: of the .binary files that were read."""
    key = f"materials.{name}"
    if not isinstance(value, dict):
        raise InputError(f"{key}: expected a table, got {shown(value)}")
    # The label is the table's own name, so `name` is no key of it.
    model = value.get("model", "phong")
    if not isinstance(model, str) or model not in MODELS:
        raise InputError(f"{key}.model: expected one of {', '.join(MODELS)}, got {shown(model)}")
    keys = "model", *MODELS[model].parameters
    if unknown := [name for name in value if name not in keys]:
        raise InputError(f"{key}: unknown key `{unknown[0]}` ({known(keys)})")
    try:
        if "file" in value:
            value = value | {"file": _measured_file(value["file"], folder, tables)}
        return Material(**value, name=name)
    except InputError as error:
        raise InputError(f"{key}.{error}") from None


def _measured_file(name: Any, folder: Path | None, tables: dict[str, Any]) -> Any:
    if not isinstance(name, str) or not is_plain(name, (".binary",)):
        raise InputError(
            f"file: expected the plain name of a .binary file in the scene file's folder, got {shown(name)}"
        )
    if folder is None:
        raise InputError("file: a text is in no folder; load() the scene's file instead")
    if name not in tables and len(tables) == MAX_TABLES:
        raise InputError(f"file: expected at most {MAX_TABLES} .binary files in a scene")
    if name not in tables:
        from raytracer.merl import read  # with NumPy, which few scene files need

        try:
            tables[name] = read(folder / name, folder)
        except InputError as error:
            raise InputError(f"file: {error}") from None
    return tables[name]


def _shape(value: Any, name: str, materials: dict[str, Material]) -> Primitive:
    key = f"shapes.{name}"
    if not expression.is_name(name):
        raise InputError(f'{key}: expected a name of letters, digits and "_" that begins with no digit')
    table = convert(value, _ShapeTable, key)
    material = _material_of(table.material, f"{key}.material", materials)
    tables = {"sphere": (table.sphere, _SphereTable, Sphere), "plane": (table.plane, _PlaneTable, Plane)}
    given = [name for name, (value, _, _) in tables.items() if value is not None]
    if len(given) != 1:
        raise InputError(f"{key}: expected one of sphere or plane, got {' and '.join(given) or 'neither'}")
    value, kind, primitive = tables[given[0]]
    numbers = msgspec.structs.asdict(convert(value, kind, f"{key}.{given[0]}"))
    try:
        return primitive(**numbers, material=material)
    except InputError as error:
        raise InputError(f"{key}.{given[0]}.{error}") from None


def _material_of(name: str, key: str, materials: dict[str, Material]) -> Material:
    """The file's own material of that name, or a published one."""
    if name in materials:
        return materials[name]
    if "/" not in name:
        raise InputError(f"{key}: expected the name of a material, got {name[:40]!r} ({known(materials)})")
    from raytracer.library import published

    try:
        return published(name)
    except InputError as error:
        raise InputError(f"{key}: {error}") from None


def _object(text: Any, key: str, shapes: dict[str, Primitive], objects: dict[str, Any]) -> Solid:
    if not isinstance(text, str):
        raise InputError(f"objects.{key}: expected a string, an expression over shapes, got {shown(text)}")
    try:
        return expression.parse(text, shapes)
    except InputError as error:
        hint = f" ({known(shapes)})" if "the name of a shape" in str(error) else ""
        if any(f'"{name}"' in str(error) for name in objects.keys() - shapes.keys()):
            hint = " (an object; only shapes can be named)"
        raise InputError(f"objects.{key}: {error}{hint}") from None


def _all_instances(tables: dict[str, Any], solids: dict[str, Solid], folder: Path | None) -> dict[str, Instances]:
    """The table [instances]. Each is bounded alone, and here all are together, before they take time and memory."""
    result: dict[str, Instances] = {}
    room = Room()
    count = 0
    for name, value in tables.items():
        result[name] = _instances(value, name, solids, folder, room)
        count += len(result[name]) * len(leaves(solids[name]))
        if count > MAX_SURFACES:
            raise InputError(f"instances.{name}: expected at most {MAX_SURFACES} primitives in all, got {count}")
    return result


def _instances(value: Any, name: str, solids: dict[str, Solid], folder: Path | None, room: Room) -> Instances:
    key = f"instances.{name}"
    if name not in solids:
        raise InputError(f"{key}: expected the name of an object ({known(solids)})")
    table = convert(value, _InstancesTable, key)
    if ("file" in value) == ("positions" in value):
        given = "both" if "file" in value else "neither"
        raise InputError(f"{key}: expected one of positions or file, got {given}")
    if "file" not in value:
        try:
            return Instances(solids[name], table.positions, table.scales)
        except InputError as error:
            raise InputError(f"{key}.{error}") from None
    if "scales" in value:
        raise InputError(f"{key}.scales: expected scales in {shown(table.file)}, not here too")
    if folder is None:
        raise InputError(f"{key}.file: expected positions: a text is in no folder; load() the scene's file instead")
    try:
        return read_instances(solids[name], folder, table.file, room)
    except InputError as error:
        raise InputError(f"{key}.file: {error}") from None


def _unused(shapes: dict[str, Primitive], objects: Iterable[Solid]) -> str:
    """A warning of shapes that no object uses, or ""."""
    used = {id(leaf) for solid in objects for leaf in leaves(solid)}
    unused = [name for name, shape in shapes.items() if id(shape) not in used]
    shown = ", ".join(unused[:5]) + (", ..." if len(unused) > 5 else "")
    return f"no object uses the shape{'s' if len(unused) > 1 else ''} {shown}" if unused else ""
