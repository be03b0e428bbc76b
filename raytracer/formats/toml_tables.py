"""Tables of a TOML text to typed values, with errors that know the keys they are about."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

from raytracer.core.validation import InputError, check_keys

T = TypeVar("T")


def build(kind: type[T], value: Any, **others: Any) -> T:
    """Make a struct of which a table gives the fields, all but `others`. Fields without a default must be there."""
    fields: tuple[str, ...] = kind.__struct_fields__  # pyright: ignore[reportAttributeAccessIssue]
    needed = fields[: len(fields) - len(kind.__struct_defaults__)]  # pyright: ignore[reportAttributeAccessIssue]
    keys = [name for name in fields if name not in others]
    return kind(**check_table(value, keys, [name for name in needed if name not in others]), **others)


def check_table(value: Any, keys: Sequence[str], needed: Sequence[str] = ()) -> dict[str, Any]:
    """Return `value`, a table with no keys but `keys`, and with all of `needed`. Raises InputError."""
    value = as_table(value)
    check_keys(value, keys, needed)
    return value


def as_table(value: Any) -> dict[str, Any]:
    """Return `value`, a table. Raises InputError for another type."""
    if not isinstance(value, dict):
        raise InputError(f"expected a table, got {_kind(value)}")
    return value


def as_list(value: Any) -> list[Any]:
    """Return `value`, a list. Raises InputError for another type."""
    if not isinstance(value, list):
        raise InputError(f"expected a list, got {_kind(value)}")
    return value


def _kind(value: Any) -> str:
    """Name a value's type in the words of TOML."""
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
