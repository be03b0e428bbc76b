"""Conversion of the tables of a scene file to a Scene."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean, known_names
from raytracer.core.validation import InputError, check_choice, check_text, within
from raytracer.formats import csg_expression
from raytracer.formats.companion_files import ByteBudget
from raytracer.formats.instance_files import read_instances
from raytracer.formats.material_library import MaterialLibrary
from raytracer.formats.measured_files import MeasuredFiles
from raytracer.formats.toml_tables import as_list, as_table, build, check_table
from raytracer.scene.camera import Camera
from raytracer.scene.instances import Instances
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids import MAX_SURFACES, Plane, Primitive, Solid, Sphere, leaves

T = TypeVar("T")

# The most operators in the expressions of all objects together: as many as a scene can have primitives.
MAX_OPERATORS = MAX_SURFACES
# The keys of a table in [instances]. For other tables, the keys are the fields of a struct.
_INSTANCES = ("positions", "scales", "file")
_PRIMITIVES: dict[str, type[Primitive]] = {"sphere": Sphere, "plane": Plane}


def build_scene(table: dict[str, Any], name: str, folder: Path | None) -> tuple[Scene, str]:
    """Build a scene from a scene file's tables.

    Args:
        table: the tables by name.
        name: the name of the scene.
        folder: the folder of companion files. None: the tables must not name any.

    Returns:
        The scene, and a warning of shapes that no object uses, or "".

    Raises:
        InputError: a table has a wrong value.
    """
    measured = MeasuredFiles(folder)
    materials = _make_named(table, "materials", lambda value, name: _material(value, name, measured))
    library = MaterialLibrary()
    shapes = _make_named(table, "shapes", lambda value, name: _shape(value, name, materials, library))
    _check_operators(table["objects"])
    solids = _make_named(table, "objects", lambda value, _: _object(value, shapes, table["objects"]))
    objects = solids | _all_instances(table, solids, folder)
    with within("lights"):
        lights = [_light(value, i) for i, value in enumerate(as_list(table.get("lights", [])))]
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
    return scene, _unused_warning(shapes, scene)


def _make_named(table: dict[str, Any], key: str, make: Callable[[Any, str], T]) -> dict[str, T]:
    """Return `make(value, name)` for each entry of the table at `key`, by name. Errors get the path of keys."""
    made: dict[str, T] = {}
    with within(key):
        for name, value in as_table(table.get(key, {})).items():
            with within(name):
                made[name] = make(value, name)
    return made


def _check_operators(objects: Any) -> None:
    """Raise InputError if the expressions of all objects together have too many operators."""
    texts = [text for text in objects.values() if isinstance(text, str)] if isinstance(objects, dict) else []
    if (count := sum(text.count(sign) for text in texts for sign in "~-&|")) > MAX_OPERATORS:
        raise InputError(f"expected at most {MAX_OPERATORS} operators in all, got {count}", "objects")


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


def _shape(value: Any, name: str, materials: dict[str, Material], library: MaterialLibrary) -> Primitive:
    if not csg_expression.is_name(name):
        raise InputError('expected a name of letters, digits and "_" that does not begin with a digit')
    table = check_table(value, ("material", *_PRIMITIVES), ("material",))
    with within("material"):
        material = _material_of(table["material"], materials, library)
    kinds = [kind for kind in _PRIMITIVES if kind in table]
    if len(kinds) != 1:
        raise InputError(f"expected one of sphere or plane, got {' and '.join(kinds) or 'neither'}")
    with within(kinds[0]):
        return build(_PRIMITIVES[kinds[0]], table[kinds[0]], material=material)


def _material_of(name: Any, materials: dict[str, Material], library: MaterialLibrary) -> Material:
    """Return the material `name` of the file, or a published material. Raises InputError."""
    if isinstance(name, str) and name in materials:
        return materials[name]
    if not isinstance(name, str) or "/" not in name:
        hint = did_you_mean(name, materials) if isinstance(name, str) else ""
        raise InputError(f"expected the name of a material, got {format_value(name)} ({known_names(materials)}){hint}")
    return library.material(name)


def _object(text: Any, shapes: dict[str, Primitive], objects: dict[str, Any]) -> Solid:
    if not isinstance(text, str):
        raise InputError(f"expected a string, an expression over shapes, got {format_value(text)}")
    return csg_expression.parse(text, shapes, objects)


def _all_instances(table: dict[str, Any], solids: dict[str, Solid], folder: Path | None) -> dict[str, Instances]:
    """Read the table [instances]. Raises InputError if all instances together have too many primitives.

    Instances checks the limit for each entry. Here the sum is checked, before it takes much time and memory.
    """
    budget = ByteBudget()
    count = 0

    def make(value: Any, name: str) -> Instances:
        nonlocal count
        made = _instances(value, name, solids, folder, budget)
        count += len(made) * len(leaves(solids[name]))
        if count > MAX_SURFACES:
            raise InputError(f"expected at most {MAX_SURFACES} primitives in all, got {count}")
        return made

    return _make_named(table, "instances", make)


def _instances(value: Any, name: str, solids: dict[str, Solid], folder: Path | None, budget: ByteBudget) -> Instances:
    if name not in solids:
        raise InputError(f"expected the name of an object ({known_names(solids)}){did_you_mean(name, solids)}")
    table = check_table(value, _INSTANCES)
    if ("file" in table) == ("positions" in table):
        got = "both" if "file" in table else "neither"
        raise InputError(f"expected one of positions or file, got {got}")
    if "file" not in table:
        return Instances(solids[name], table["positions"], table.get("scales", 1.0))
    if "scales" in table:
        raise InputError(f"expected scales in {format_value(table['file'])} only, not here as well", "scales")
    with within("file"):
        if folder is None:
            raise InputError(
                "expected positions: a scene text has no folder for the file; load() the scene's file instead"
            )
        return read_instances(solids[name], folder, check_text(table["file"], ()), budget)


def _unused_warning(shapes: dict[str, Primitive], scene: Scene) -> str:
    """Return a warning of shapes that no object uses, or ""."""
    assert isinstance(scene.objects, SceneObjects)
    used = {*map(id, scene.objects.nodes)}
    unused = [name for name, shape in shapes.items() if id(shape) not in used]
    shown = ", ".join(unused[:5]) + (", ..." if len(unused) > 5 else "")
    return f"no object uses the shape{'s' if len(unused) > 1 else ''} {shown}" if unused else ""
