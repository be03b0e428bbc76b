"""TOML from anyone: text to tables to typed values, with errors that know the keys they are about."""

from __future__ import annotations

import itertools
import re
import tomllib
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from raytracer.checks import InputError, UnknownKeyError
from raytracer.shown import shortened
from raytracer.suggest import did_you_mean

# tomllib takes time that is quadratic in the parts of a dotted key: a.b.c.
_LONG_KEY = re.compile(r"""(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){32}""")

T = TypeVar("T")


def toml(text: str) -> dict[str, Any]:
    """A TOML text. Raises InputError if it is none, or such that to read it would take long."""
    if _LONG_KEY.search(text):
        raise InputError("expected keys of at most 32 parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"expected TOML: {error}", line=_line(error, text)) from None
    except (RecursionError, ValueError):  # deep nesting; an integer of more digits than Python converts
        raise InputError("expected TOML without deep nesting or numbers of thousands of digits") from None


def _line(error: tomllib.TOMLDecodeError, text: str) -> int:
    """The line, from 1, at which the parser stopped. Before Python 3.14 only its message says so."""
    if (line := getattr(error, "lineno", None)) is not None:
        return line
    at = re.search(r"\(at line (\d+), column \d+\)$", str(error))
    return int(at[1]) if at else text.count("\n") + 1


def build(kind: type[T], value: Any, **others: Any) -> T:
    """A struct of which a table gives the fields, all but `others`; those without a default must be there."""
    fields: tuple[str, ...] = kind.__struct_fields__  # pyright: ignore[reportAttributeAccessIssue]
    needed = fields[: len(fields) - len(kind.__struct_defaults__)]  # pyright: ignore[reportAttributeAccessIssue]
    keys = [name for name in fields if name not in others]
    return kind(**check_table(value, keys, [name for name in needed if name not in others]), **others)


def check_table(value: Any, keys: Sequence[str], needed: Sequence[str] = ()) -> dict[str, Any]:
    """`value`, if it is a table with no keys but `keys`, and all that are `needed`."""
    value = any_table(value)
    for name in value:
        if name not in keys:
            raise UnknownKeyError(f"unknown key `{shortened(name)}` ({known(keys)}){did_you_mean(name, keys)}", name)
    for name in needed:
        if name not in value:
            raise InputError(f"missing key `{name}`")
    return value


def any_table(value: Any) -> dict[str, Any]:
    """`value`, if it is a table."""
    if not isinstance(value, dict):
        raise InputError(f"expected a table, got {_kind(value)}")
    return value


def any_list(value: Any) -> list[Any]:
    """`value`, if it is a list."""
    if not isinstance(value, list):
        raise InputError(f"expected a list, got {_kind(value)}")
    return value


def _kind(value: Any) -> str:
    """A value's type in the words of TOML."""
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


def known(names: Iterable[str]) -> str:
    """A remedy for a name that is not there."""
    listed = ", ".join(map(shortened, itertools.islice(names, 12)))
    return f"known: {listed}" if len(listed) <= 120 else f"known: {listed[:120]}..."
