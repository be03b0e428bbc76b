"""Conversion of the tables of a scene file to a Scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean, known_names
from raytracer.core.validation import InputError, check_choice, check_text, within
from raytracer.formats import csg_expression
from raytracer.formats.companion_files import ByteBudget
from raytracer.formats.instance_files import read_instances
from raytracer.formats.material_library import MaterialLibrary
from raytracer.formats.measured_files import MeasuredFiles
from raytracer.formats.part_sections import find_used, read_parts
from raytracer.formats.shape_sections import count_leaves, read_shapes
from raytracer.formats.toml_tables import as_list, as_table, build, build_each, check_table
from raytracer.scene.camera import Camera
from raytracer.scene.instances import Instances
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.solid import Solid

# The most operators in the expressions of all objects and parts together: as many as a scene can have primitives.
MAX_OPERATORS = MAX_SURFACES
# The keys of a table in [instances]. For other tables, the keys are the fields of a struct.
_INSTANCES = ("positions", "scales", "rotations", "file")
# The tables from which the objects of a scene follow.
_OBJECT_TABLES = ("materials", "shapes", "parts", "objects", "instances")


class BuiltScene(NamedTuple):
    """A scene, and the parts of its construction that scenes of similar tables share.

    Attributes:
        tables: the tables of the scene file.
        folder: the folder of companion files, or None.
        scene: the scene.
        instances: the instances by the names of their objects.
        measured: the measured materials that the scene uses.
        warning: a warning of shapes and parts that no object uses, or "".
    """

    tables: Mapping[str, Any]
    folder: Path | None
    scene: Scene
    instances: Mapping[str, Instances]
    measured: MeasuredFiles
    warning: str


def build_scene(tables: dict[str, Any], name: str, folder: Path | None) -> BuiltScene:
    """Build a scene from a scene file's tables.

    Args:
        tables: the tables by name.
        name: the name of the scene.
        folder: the folder of companion files. None: the tables must not name any.

    Raises:
        InputError: a table has a wrong value.
    """
    return _build(tables, name, folder, MeasuredFiles(folder), None)


def rebuild_scene(base: BuiltScene, tables: dict[str, Any]) -> BuiltScene:
    """Build the scene of tables that share most values with the tables of another scene.

    Objects are taken from the other scene if the tables that describe them are the same objects of Python, as after
    replace_value(). Companion files that the other scene has read are not read again.

    Raises InputError if a table has a wrong value.
    """
    if any(tables.get(key) is not base.tables.get(key) for key in _OBJECT_TABLES):
        return _build(tables, base.scene.name, base.folder, base.measured, base)
    known = base.scene
    scene = Scene(objects=known.objects, materials=known.materials, name=known.name, **_read_view(tables))
    return base._replace(tables=tables, scene=scene)


def _build(
    tables: dict[str, Any], name: str, folder: Path | None, measured: MeasuredFiles, base: BuiltScene | None
) -> BuiltScene:
    """Build a scene as build_scene() does, with the measured materials and the places of instances of `base`."""
    with within("materials"):
        materials = build_each(tables.get("materials", {}), lambda value, name: _material(value, name, measured))
    find_material = _material_finder(materials)
    with within("shapes"):
        shapes = read_shapes(tables["shapes"], find_material)
    with within("objects"):
        expressions = as_table(tables["objects"])
    part_tables = tables.get("parts", {})
    _check_operators(expressions, part_tables)
    with within("parts"):
        parts = read_parts(part_tables, shapes, expressions, find_material)
    named = shapes | parts
    with within("objects"):
        solids = build_each(expressions, lambda value, _: _object(value, named, expressions))
    count = partial(_count_leaves, solids=solids, expressions=expressions, parts=parts)
    instances = _all_instances(tables, solids, folder, count, base)
    view = _read_view(tables)
    objects = _join(solids | instances, count)
    scene = Scene(objects=objects, materials=tuple(materials.values()), name=name, **view)
    used = find_used(expressions.values(), part_tables)
    return BuiltScene(tables, folder, scene, instances, measured, _unused_warning(shapes, parts, used))


def _read_view(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of Scene that do not depend on the objects: lights, camera and colours."""
    with within("lights"):
        lights = [_light(value, i) for i, value in enumerate(as_list(tables.get("lights", [])))]
    with within("camera"):
        camera = _camera(tables["camera"]) if "camera" in tables else None
    return {"lights": lights, "camera": camera} | {k: tables[k] for k in ("ambient", "background") if k in tables}


def _check_operators(objects: dict[str, Any], parts: Any) -> None:
    """Raise InputError if the expressions of all objects and parts together have too many operators."""
    solids = (part.get("solid") for part in parts.values() if isinstance(part, dict)) if isinstance(parts, dict) else ()
    texts = [text for text in (*objects.values(), *solids) if isinstance(text, str)]
    if (count := sum(text.count(sign) for text in texts for sign in "~-&|")) > MAX_OPERATORS:
        where = "objects and parts" if parts else "all"
        raise InputError(f"expected at most {MAX_OPERATORS} operators in {where}, got {count}", "objects")


def camera_values(camera: Camera) -> dict[str, Any]:
    """Return the table of a scene file for a camera."""
    scale = ("vertical_fov",) if camera.projection == "perspective" else ("projection", "height")
    return {name: getattr(camera, name) for name in ("position", "look_at", "up", *scale)}


def _camera(value: Any) -> Camera:
    camera = build(Camera, value)
    if camera.projection == "orthographic" and "vertical_fov" in value:
        raise InputError(
            "expected no vertical_fov with an orthographic projection: height sets the scale", "vertical_fov"
        )
    return camera


def _light(value: Any, i: int) -> PointLight:
    with within(i):
        return build(PointLight, value)


def _material(value: Any, name: str, measured: MeasuredFiles) -> Material:
    # The material's label is the name of its table, so the table must not have a key `name`.
    model = check_choice(as_table(value).get("model", "phong"), "model", MODELS)
    parameters = dict(check_table(value, ("model", *MODELS[model].parameters)))
    if "file" in parameters:
        with within("file"):
            parameters["file"] = measured.read(parameters["file"])
    return Material(**parameters, name=name)


def _material_finder(materials: dict[str, Material]) -> Callable[[Any], Material]:
    """Return a function from a name to the file's material of this name, or a published one. It raises InputError."""
    library = MaterialLibrary()

    def find(name: Any) -> Material:
        if isinstance(name, str) and name in materials:
            return materials[name]
        if not isinstance(name, str) or "/" not in name:
            hint = did_you_mean(name, materials) if isinstance(name, str) else ""
            expected = "the name of a material"
            raise InputError(f"expected {expected}, got {format_value(name)} ({known_names(materials)}){hint}")
        return library.material(name)

    return find


def _object(value: Any, named: Mapping[str, Solid], objects: dict[str, Any]) -> Solid:
    return csg_expression.parse(csg_expression.check_text(value), named, objects)


def _join(objects: dict[str, Solid | Instances], count: Callable[[str], int]) -> SceneObjects:
    """Return the objects of a scene. `count` is _count_leaves() of a name, which names the object that is wrong."""
    try:
        return SceneObjects(tuple(objects.values()))
    except InputError:
        checked = 0
        for name in objects:
            checked += count(name)
            # All objects together are too many: no single one is wrong.
            if checked > MAX_SURFACES:
                break
        raise


def _count_leaves(
    name: str, solids: Mapping[str, Solid], expressions: Mapping[str, str], parts: Mapping[str, Solid]
) -> int:
    """Return the number of leaves of an object. Raises InputError, which names the object, or its part that is wrong.

    Args:
        name: the name of the object.
        solids: the solids of the objects.
        expressions: the expressions of the objects.
        parts: the parts.
    """
    try:
        return count_leaves(solids[name])
    except InputError as error:
        # An object does not move its parts, so it is beyond the limits of lengths only if one of them is.
        for used in sorted(csg_expression.list_names(expressions[name])):
            if used in parts:
                with within("parts", used):
                    count_leaves(parts[used])
        raise error.within("objects", name) from None


def _all_instances(
    table: dict[str, Any],
    solids: dict[str, Solid],
    folder: Path | None,
    count: Callable[[str], int],
    base: BuiltScene | None,
) -> dict[str, Instances]:
    """Read the table [instances]. Raises InputError if all instances together have too many primitives.

    Instances checks the limit for each entry. Here the sum is checked, before it takes much time and memory.

    Args:
        table: the tables of the file.
        solids: the objects.
        folder: the folder of companion files, if any.
        count: _count_leaves() of an object.
        base: a scene whose places of instances are taken if their tables are the same, or None.
    """
    known = base.tables.get("instances", {}) if base else {}
    budget = ByteBudget()
    made: dict[str, Instances] = {}
    total = 0
    with within("instances"):
        tables = as_table(table.get("instances", {}))
    for name, value in tables.items():
        with within("instances", name):
            if name not in solids:
                raise InputError(f"expected the name of an object ({known_names(solids)}){did_you_mean(name, solids)}")
        leaves = count(name)
        with within("instances", name):
            if base and known.get(name) is value:
                made[name] = base.instances[name].replace(solid=solids[name])
            else:
                made[name] = _instances(value, solids[name], folder, budget)
            total += len(made[name]) * leaves
            if total > MAX_SURFACES:
                raise InputError(f"expected at most {MAX_SURFACES} primitives in all, got {total}")
    return made


def _instances(value: Any, solid: Solid, folder: Path | None, budget: ByteBudget) -> Instances:
    table = check_table(value, _INSTANCES)
    if ("file" in table) == ("positions" in table):
        got = "both" if "file" in table else "neither"
        raise InputError(f"expected one of positions or file, got {got}")
    if "file" not in table:
        return Instances(solid, **table)
    for key in ("scales", "rotations"):
        if key in table:
            raise InputError(f"expected {key} in {format_value(table['file'])} only, not here as well", key)
    with within("file"):
        if folder is None:
            raise InputError(
                "expected positions: a scene text has no folder for the file; load() the scene's file instead"
            )
        return read_instances(solid, folder, check_text(table["file"], ()), budget)


def _unused_warning(shapes: Mapping[str, Solid], parts: Mapping[str, Solid], used: set[str]) -> str:
    """Return a warning of shapes and parts that no object uses, or ""."""
    unused: list[str] = []
    for kind, solids in (("shape", shapes), ("part", parts)):
        names = [name for name in solids if name not in used]
        if names:
            shown = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
            unused.append(f"the {kind}{'s' if len(names) > 1 else ''} {shown}")
    return f"no object uses {' and '.join(unused)}" if unused else ""
