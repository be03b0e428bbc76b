"""Materials that others have published, by name: `lafortune/clay` is [clay] of materials/lafortune.toml."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from raytracer.core.files import packaged, read_packaged
from raytracer.core.shown import shown
from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import InputError, within
from raytracer.formats.toml_text import parse_toml
from raytracer.scene.materials.material import Material


def folder() -> Path:
    """Find the folder of the collections' files."""
    return packaged("materials", "assets/materials")


def collections() -> list[str]:
    """List the names before the slash."""
    return sorted(path.stem for path in folder().glob("*.toml"))


def read_collection(name: str) -> dict[str, dict[str, Any]]:
    """Read the tables of one of `collections()`; each has the key `source`, who published it."""
    text = read_packaged(folder() / f"{name}.toml")
    return {key: value for key, value in parse_toml(text).items() if isinstance(value, dict)}


def published(name: str) -> Material:
    """The material of that name, such as "lafortune/clay". Raises InputError if there is none."""
    if not isinstance(name, str):
        raise InputError(f"expected {_some(collections())}, got {shown(name)}", "name")
    with within("name"):
        return _library().material(str.__str__(name))


class MaterialLibrary:
    """The published materials. A library reads a collection once, and makes a material once."""

    def __init__(self) -> None:
        self._tables: dict[str, dict[str, dict[str, Any]]] = {}
        self._materials: dict[str, Material] = {}

    def material(self, name: str) -> Material:
        """The material of that name, as `published`. Errors are about no key."""
        if name not in self._materials:
            collection, _, key = name.partition("/")
            parameters = {k: v for k, v in self._table(name, collection, key).items() if k != "source"}
            self._materials[name] = Material(**parameters, name=name)
        return self._materials[name]

    def _table(self, name: str, collection: str, key: str) -> dict[str, Any]:
        if collection not in self._tables:
            known = collections()
            if collection not in known:
                near = did_you_mean(collection, known)
                raise InputError(f"expected {_some(known)}, got {shown(name)}{near}")
            self._tables[collection] = read_collection(collection)
        tables = self._tables[collection]
        if key not in tables:
            names = ", ".join(list(tables)[:8])
            near = did_you_mean(key, tables)
            raise InputError(f"expected a material of {collection} (such as {names}), got {shown(key)}{near}")
        return tables[key]


@cache
def _library() -> MaterialLibrary:
    """The library of this process: a program may ask for a material again and again."""
    return MaterialLibrary()


def _some(known: list[str]) -> str:
    return f"a published material as {'/..., '.join(known)}/..."
