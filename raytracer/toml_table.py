"""TOML from anyone: text to tables to typed values, with errors that begin with the key they are about."""

from __future__ import annotations

import itertools
import re
import tomllib
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import msgspec

from raytracer.checks import InputError

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
        raise InputError(f"expected TOML: {error}") from None
    except (RecursionError, ValueError):  # deep nesting; an integer of more digits than Python converts
        raise InputError("expected TOML without deep nesting or numbers of thousands of digits") from None


def convert(value: Any, kind: type[T], key: str, keys: Sequence[str] = ()) -> T:
    """`value` as a `kind`, of which a file may give `keys` (default: all its fields).

    Errors begin with the whole key, e.g. `shapes.a.sphere.radius`.
    """
    keys = keys or kind.__struct_fields__  # pyright: ignore[reportAttributeAccessIssue]
    if isinstance(value, dict) and (unknown := [name for name in value if name not in keys]):
        raise InputError(": ".join(filter(None, (key, f"unknown key `{unknown[0]}` ({known(keys)})"))))
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        message, _, inner = str(error).partition(" - at `$")
        where = ".".join(filter(None, (key, inner.rstrip("`").removeprefix("."))))
        if isinstance(error.__cause__, InputError):  # from a __post_init__: the message begins with the field
            raise InputError(".".join(filter(None, (where, message)))) from None
        raise InputError(": ".join(filter(None, (where, _reworded(message))))) from None


_WORDS = {
    "`float | array`": "a number or a list",
    "`array`": "a list",
    "`object`": "a table",
    "`float`": "a number",
    "`str`": "a string",
    "`int`": "a number",
}


def _reworded(message: str) -> str:
    """A message of msgspec in the words of TOML."""
    message = message.replace("Object missing required field", "missing key")
    for word, plain in _WORDS.items():
        message = message.replace(word, plain)
    return message[:1].lower() + message[1:]


def known(names: Iterable[str]) -> str:
    """A remedy for a name that is not there."""
    shown = ", ".join(itertools.islice(names, 12))
    return f"known: {shown}" if len(shown) <= 120 else f"known: {shown[:120]}..."
