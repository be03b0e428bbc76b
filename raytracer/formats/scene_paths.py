"""Paths of values in the tables of a scene file, such as "lights.0.position", and replacement of the values.

A path has the names of tables and keys, and the indices of list items from 0, joined by dots. A name with other
characters than letters, digits, "_" and "-" is quoted as in TOML: `materials."old gold".alpha`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from raytracer.core.shown import format_keys, format_value
from raytracer.core.suggest import did_you_mean, known_names
from raytracer.core.validation import InputError, Keys, is_number
from raytracer.formats.toml_tables import SCENE_KEYS

# The most characters of a path, and the most parts: a scene file has at most 6 parts, as in
# "shapes.hull.polyhedron.points.3.0", and names are rarely longer than 40 characters.
MAX_CHARACTERS = 1000
MAX_PARTS = 16
# A part of a path, and the dot or the end after it. The text in quotes may contain an escaped quote or backslash.
_PART = re.compile(
    r"""\s*(?:"(?P<quoted>(?:[^"\\]|\\["\\])*+)"|'(?P<literal>[^']*+)'|(?P<bare>[^\s."']+))\s*(?P<end>\.|\Z)"""
)
_ESCAPE = re.compile(r"\\(.)")
# An index without a sign. Longer ones are beyond every list.
_INDEX = re.compile(r"[0-9]{1,9}", re.ASCII)


def parse_path(text: Any) -> Keys:
    """Return the parts of a path: names and, for parts of digits only, numbers. Raises InputError for another text.

    A part of digits is a number here, and replace_value() takes it as a name where it meets a table.
    """
    expected = 'a path such as "lights.0.position" or "shapes.ball.sphere.radius"'
    if not isinstance(text, str) or not text or len(text) > MAX_CHARACTERS:
        raise InputError(f"expected {expected}, got {format_value(text)}")
    parts: list[str | int] = []
    at, end = 0, "."
    while end == ".":
        match = _PART.match(text, at)
        if match is None or len(parts) == MAX_PARTS:
            raise InputError(f"expected {expected}, got {format_value(text)}")
        at, end = match.end(), match["end"]
        if (bare := match["bare"]) is not None:
            parts.append(int(bare) if _INDEX.fullmatch(bare) else bare)
        else:
            parts.append(match["literal"] if match["quoted"] is None else _ESCAPE.sub(r"\1", match["quoted"]))
    return tuple(parts)


def replace_value(tables: Mapping[str, Any], path: Keys, value: Any) -> dict[str, Any]:
    """Return the tables of a scene file with another value at a path. The old tables stay as they are.

    A key that the file does not have may be set: the check of the new tables accepts or refuses it.

    Args:
        tables: the tables of a scene file.
        path: the path, from parse_path().
        value: a number, a vector of numbers or a text.

    Raises:
        InputError: the path leads to no value of a scene, or to a value of another kind.
    """
    first = str(path[0])
    if first not in SCENE_KEYS:
        known = known_names(SCENE_KEYS)
        raise InputError(
            f"expected a path that begins with a table of the scene, got {_shown(path, 1)} ({known})"
            f"{did_you_mean(first, SCENE_KEYS)}"
        )
    return _replace(tables, path, 0, value)


def replace_values(tables: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a scene file with other values at several paths, as replace_value() does for one.

    Args:
        tables: the tables of a scene file.
        values: numbers, vectors of numbers or texts, by the texts of their paths.
    """
    changed = dict(tables)
    for text, value in values.items():
        changed = replace_value(changed, parse_path(text), value)
    return changed


def _replace(place: Any, path: Keys, depth: int, value: Any) -> Any:
    """Return the value `place`, which the first `depth` parts of the path lead to, with another value in it."""
    if depth == len(path):
        _check_kind(place, path, value)
        return list(value) if isinstance(value, tuple) else value
    if isinstance(place, dict):
        return _replace_entry(place, path, depth, value)
    if isinstance(place, list):
        return _replace_item(place, path, depth, value)
    raise InputError(f"expected {_shown(path, depth)} as the end of the path, which is no table or list")


def _replace_entry(table: dict[str, Any], path: Keys, depth: int, value: Any) -> dict[str, Any]:
    name = str(path[depth])
    if name in table:
        return {**table, name: _replace(table[name], path, depth + 1, value)}
    # The names of the first level are those of an empty scene file, and of the second level those that the user chose.
    is_named = depth == 1 and path[0] in ("shapes", "parts", "objects", "materials", "instances")
    if name == "settings" and depth == 0:  # all its keys have defaults
        return {**table, name: _replace({}, path, depth + 1, value)}
    if depth + 1 < len(path) or is_named:
        known = f" ({known_names(table)})" if table else ""
        where = f"in {_shown(path, depth)}" if depth else "in the file"
        raise InputError(
            f"expected a path of the scene, but {where} is no {format_value(name)}{known}{did_you_mean(name, table)}"
        )
    return {**table, name: list(value) if isinstance(value, tuple) else value}


def _replace_item(values: list[Any], path: Keys, depth: int, value: Any) -> list[Any]:
    index = path[depth]
    if not isinstance(index, int) or index >= len(values):
        got = index if isinstance(index, int) else format_value(index)
        most = f"an index in [0, {len(values) - 1}]" if values else "no index, as the list is empty,"
        raise InputError(f"expected {most} after {_shown(path, depth)}, got {got}")
    return [*values[:index], _replace(values[index], path, depth + 1, value), *values[index + 1 :]]


def _check_kind(old: Any, path: Keys, value: Any) -> None:
    """Raise InputError unless the old value at a path is of the kind of the new one: numbers or a text."""
    if isinstance(old, str):
        kind = "a text"
    elif is_number(old) or _is_vector(old):
        kind = "numbers"
    else:
        got = (
            "a table" if isinstance(old, dict) else "a list of tables or lists" if isinstance(old, list) else "no value"
        )
        inside = _list_keys(old)
        raise InputError(f"expected the path of a number, a vector or a text, but {_shown(path)} is {got}{inside}")
    if isinstance(value, str) != (kind == "a text"):
        raise InputError(f"expected {kind} for {_shown(path)}, got {format_value(value)}")


def _list_keys(table: Any) -> str:
    """Return the list of a table's keys for the end of an error message, or ""."""
    return f" ({known_names(table)})" if isinstance(table, dict) and table else ""


def _is_vector(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(map(is_number, value))


def _shown(path: Keys, depth: int | None = None) -> str:
    """Return a text for the first parts of a path, in the notation of paths: dots also before indices."""
    return ".".join(str(key) if isinstance(key, int) else format_keys([key]) for key in path[:depth])
