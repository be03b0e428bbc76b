"""Library of published materials by name: `lafortune/clay` is the table [clay] of materials/lafortune.toml."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from raytracer.core.files import find_data_folder, read_packaged
from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import InputError, within
from raytracer.formats.toml_text import parse_toml
from raytracer.scene.materials.material import Material


def folder() -> Path:
    """Return the folder of the collections' files."""
    return find_data_folder("materials", "assets/materials")


def collections() -> list[str]:
    """Return the names of all collections: the part of a material's name before the slash."""
    return sorted(path.stem for path in folder().glob("*.toml"))


def read_collection(name: str) -> dict[str, dict[str, Any]]:
    """Read the materials of a collection as tables, by name. Each table has the key `source`, the publication."""
    text = read_packaged(folder() / f"{name}.toml")
    return {key: value for key, value in parse_toml(text).items() if isinstance(value, dict)}


def published(name: str) -> Material:
    """Return a published material, measured and fitted in the literature.

    Args:
        name: collection and material, such as "lafortune/clay". The collections are conductors, lafortune, ngan and
            ngan-lafortune, with 193 materials: the tables of assets/materials/*.toml.

    Raises:
        InputError: there is no such material.
    """
    if not isinstance(name, str):
        raise InputError(f"expected {_library_hint(collections())}, got {format_value(name)}", "name")
    with within("name"):
        return _library().material(str.__str__(name))


class MaterialLibrary:
    """The published materials. A library reads each collection once, and creates each material once."""

    def __init__(self) -> None:
        self._tables: dict[str, dict[str, dict[str, Any]]] = {}
        self._materials: dict[str, Material] = {}

    def material(self, name: str) -> Material:
        """Return the material `name`, as published() does. Raises InputError without a key."""
        if name not in self._materials:
            collection, _, key = name.partition("/")
            parameters = {k: v for k, v in self._table(name, collection, key).items() if k != "source"}
            self._materials[name] = Material(**parameters, name=name)
        return self._materials[name]

    def _table(self, name: str, collection: str, key: str) -> dict[str, Any]:
        if collection not in self._tables:
            known = collections()
            if collection not in known:
                hint = did_you_mean(collection, known)
                raise InputError(f"expected {_library_hint(known)}, got {format_value(name)}{hint}")
            self._tables[collection] = read_collection(collection)
        tables = self._tables[collection]
        if key not in tables:
            names = ", ".join(list(tables)[:8])
            hint = did_you_mean(key, tables)
            raise InputError(f"expected a material of {collection} (such as {names}), got {format_value(key)}{hint}")
        return tables[key]


@cache
def _library() -> MaterialLibrary:
    """Return the library of this process, shared so that repeated calls of published() read each file once."""
    return MaterialLibrary()


def _library_hint(known: list[str]) -> str:
    return f"a published material as {'/..., '.join(known)}/..."
