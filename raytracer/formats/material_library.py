"""Materials that others have published, by name: `lafortune/clay` is [clay] of materials/lafortune.toml."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from raytracer.core.files import packaged, read_packaged
from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import InputError, shown, within
from raytracer.formats.toml_tables import toml
from raytracer.scene.materials.material import Material


def folder() -> Path:
    """Where the collections' files are."""
    return packaged("materials", "assets/materials")


def collections() -> list[str]:
    """The names before the slash."""
    return sorted(path.stem for path in folder().glob("*.toml"))


@cache
def tables(collection: str) -> dict[str, dict[str, Any]]:
    """The tables of a collection, one of `collections()`; each with `source`, who published it."""
    text = read_packaged(folder() / f"{collection}.toml")
    return {key: value for key, value in toml(text).items() if isinstance(value, dict)}


def published(name: str) -> Material:
    """The material of that name, such as "lafortune/clay". Raises InputError if there is none."""
    if not isinstance(name, str):
        raise InputError(f"expected {_some()}, got {shown(name)}", "name")
    with within("name"):
        return material_named(str.__str__(name))


def _some() -> str:
    return f"a published material as {'/..., '.join(collections())}/..."


# A scene of very many shapes may name one in each. A name that is none raises, and is not kept.
@cache
def material_named(name: str) -> Material:
    """As `published`, whose errors have the key "name", of a name that is written at another place."""
    known = collections()
    collection, _, key = name.partition("/")
    if collection not in known:
        near = did_you_mean(collection, known)
        raise InputError(f"expected {_some()}, got {shown(name)}{near}")
    if key not in tables(collection):
        names = ", ".join(list(tables(collection))[:8])
        near = did_you_mean(key, tables(collection))
        raise InputError(f"expected a material of {collection} (such as {names}), got {shown(key)}{near}")
    return Material(**{k: v for k, v in tables(collection)[key].items() if k != "source"}, name=name)
