"""Conversion of TOML tables to typed values, with errors that name the wrong key."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from raytracer.core.validation import InputError, check_keys, within

T = TypeVar("T")
# The top-level keys of a scene file that describe the scene and its settings.
SCENE_KEYS = (
    "camera",
    "shapes",
    "parts",
    "objects",
    "materials",
    "lights",
    "instances",
    "ambient",
    "background",
    "settings",
)


def build(kind: type[T], value: Any, **others: Any) -> T:
    """Create a struct from a table with the struct's fields.

    Args:
        kind: the class of the struct.
        value: the table. Fields without a default are required.
        others: fields that are not read from the table, with their values.

    Raises:
        InputError: a key is missing or unknown, or a value is wrong.
    """
    fields: tuple[str, ...] = kind.__struct_fields__  # pyright: ignore[reportAttributeAccessIssue]
    needed = fields[: len(fields) - len(kind.__struct_defaults__)]  # pyright: ignore[reportAttributeAccessIssue]
    keys = [name for name in fields if name not in others]
    return kind(**check_table(value, keys, [name for name in needed if name not in others]), **others)


def build_each(tables: Any, make: Callable[[Any, str], T]) -> dict[str, T]:
    """Return `make(value, name)` for each entry of a table, by name. Raises InputError, with the name in its keys."""
    made: dict[str, T] = {}
    for name, value in as_table(tables).items():
        with within(name):
            made[name] = make(value, name)
    return made


def check_table(value: Any, keys: Sequence[str], needed: Sequence[str] = ()) -> dict[str, Any]:
    """Return `value` if it is a table with all keys of `needed` and no other keys than `keys`. Raises InputError."""
    value = as_table(value)
    check_keys(value, keys, needed)
    return value


def as_table(value: Any) -> dict[str, Any]:
    """Return `value` if it is a table. Raises InputError otherwise."""
    if not isinstance(value, dict):
        raise InputError(f"expected a table, got {_kind(value)}")
    return value


def as_list(value: Any) -> list[Any]:
    """Return `value` if it is a list. Raises InputError otherwise."""
    if not isinstance(value, list):
        raise InputError(f"expected a list, got {_kind(value)}")
    return value


def _kind(value: Any) -> str:
    """Return the name of a value's type in TOML's terms."""
    match value:
        case dict():
            return "a table"
        case list():
            return "a list"
        case str():
            return "a string"
        case bool() | int() | float():
            return str(value).lower() if isinstance(value, bool) else "a number"
    return "a date or time"
