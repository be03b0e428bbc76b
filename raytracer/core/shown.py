"""Text for values and names in error messages: short, on one line, and safe for any object.

No method of the value's own class is called, because a user's `__repr__` may raise or never return.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from typing import Any

# The largest number of characters of a value or a key in a message.
_LENGTH = 60
# The number of nested collections that are written out.
_DEPTH = 3
# Integers of more bits (308 digits) are shown by their number of digits: Python refuses to convert very long ones.
_MAX_BITS = 1024
# A key that needs no quotes in TOML.
_BARE = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)


def escape_unprintable(text: str) -> str:
    """Return `text` with control characters escaped. File names and keys may contain any character."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def format_keys(keys: Sequence[str | int]) -> str:
    """Return a path of keys in TOML's notation, with indices in brackets: `lights[1].color`, `materials."a: b".kd`."""
    parts = [f"[{key}]" if isinstance(key, int) else f".{_quote(key)}" for key in keys]
    return "".join(parts).removeprefix(".")


def format_value(value: Any) -> str:
    """Return a text for `value` in an error message: at most 60 characters, all printable."""
    try:
        text = _text(value, _DEPTH)
    except Exception:  # no object may prevent the message
        text = _name(type(value))
    return shorten(escape_unprintable(text))


def _quote(key: str) -> str:
    key = shorten(key)
    if _BARE.fullmatch(key):
        return key
    escaped = key.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escape_unprintable(escaped)}"'


def shorten(text: str) -> str:
    """Return at most 60 characters of a text, because names may be very long."""
    return text if len(text) <= _LENGTH else text[: _LENGTH - 3] + "..."


def _text(value: Any, depth: int) -> str:
    kind = type(value)
    if value is None or kind is bool or kind is Decimal:
        return repr(value)
    # Objects of a class derived from a built-in type are shown as the built-in type shows them.
    if issubclass(kind, int):
        bits = int.bit_length(value)
        return int.__repr__(value) if bits <= _MAX_BITS else f"a number of about {int(bits * 0.30103)} digits"
    for plain in (float, complex):
        if issubclass(kind, plain):
            return plain.__repr__(value)
    for plain in (str, bytes, bytearray):
        if issubclass(kind, plain):
            return repr(plain.__getitem__(value, slice(_LENGTH + 1)))
    for plain, (opening, closing) in _BRACKETS.items():
        if issubclass(kind, plain):
            return _collection(plain.__iter__(value), opening, closing, depth)
    if issubclass(kind, dict):
        pairs = iter(dict.items(value))
        return _collection(pairs, "{", "}", depth, lambda pair: ": ".join(_text(part, depth - 1) for part in pair))
    if (numpy := sys.modules.get("numpy")) and issubclass(kind, numpy.ndarray | numpy.generic):
        return _numpy_text(value, depth)
    return _name(kind)


_BRACKETS: dict[type, tuple[str, str]] = {
    list: ("[", "]"),
    tuple: ("(", ")"),
    set: ("{", "}"),
    frozenset: ("{", "}"),
}


def _collection(
    values: Iterator[Any], opening: str, closing: str, depth: int, text: Callable[[Any], str] | None = None
) -> str:
    """Return a text for the first items of a collection, as many as fit into a message."""
    if depth == 0:
        return f"{opening}...{closing}"
    parts: list[str] = []
    length = 0
    for value in values:
        parts.append(text(value) if text else _text(value, depth - 1))
        length += len(parts[-1]) + 2
        if length > _LENGTH:
            break
    comma = "," if opening == "(" and len(parts) == 1 else ""
    return f"{opening}{', '.join(parts)}{comma}{closing}"


def _numpy_text(value: Any, depth: int) -> str:
    """Return a text for a NumPy value: the number for a scalar, the shape for an array."""
    if value.shape:
        return f"an array of shape {value.shape}"
    if depth == 0 or getattr(value, "mask", False):
        return _name(type(value))
    plain = value.item()
    return _name(type(value)) if type(plain) is type(value) else _text(plain, depth - 1)


def _name(kind: type) -> str:
    name: str = type.__dict__["__name__"].__get__(kind)
    return f"{'an' if name[:1] in 'AEIOaeio' else 'a'} {name}"  # "u" takes "a", as in "a Union"
