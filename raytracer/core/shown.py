"""Values and names as error messages show them: short, in one line, and whatever they are.

Nothing of a value's own code runs here: a `__repr__` may raise, or take for ever.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from typing import Any

# Characters of a value in a message, and of a key.
_LENGTH = 60
# Collections inside one another that are shown.
_DEPTH = 3
# Whole numbers of more bits, 308 digits, are shown by their length: Python refuses to write some of them out.
_MAX_BITS = 1024
# A key that TOML writes without quotes.
_BARE = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)


def printable(text: str) -> str:
    """`text` without control characters: file names and keys may hold anything."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def dotted(keys: Sequence[str | int]) -> str:
    """A path of keys as TOML writes it, with indices in brackets: `lights[1].color`, `materials."a: b".kd`."""
    parts = [f"[{key}]" if isinstance(key, int) else f".{_quoted(key)}" for key in keys]
    return "".join(parts).removeprefix(".")


def shown(value: Any) -> str:
    """`value` as an error message shows it: at most 60 characters, all printable."""
    try:
        text = _text(value, _DEPTH)
    except Exception:  # a message must come whatever it is about
        text = _name(type(value))
    return shortened(printable(text))


def _quoted(key: str) -> str:
    key = shortened(key)
    if _BARE.fullmatch(key):
        return key
    escaped = key.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{printable(escaped)}"'


def shortened(text: str) -> str:
    """At most 60 characters of a text: names may be very long."""
    return text if len(text) <= _LENGTH else text[: _LENGTH - 3] + "..."


def _text(value: Any, depth: int) -> str:
    kind = type(value)
    if value is None or kind is bool or kind is Decimal:
        return repr(value)
    # Types that are derived from Python's are shown as Python shows its own.
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
    """The beginning of a collection: as much of it as a message shows."""
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
    """A scalar as the number that it holds; an array by its shape."""
    if value.shape:
        return f"an array of shape {value.shape}"
    if depth == 0 or getattr(value, "mask", False):
        return _name(type(value))
    held = value.item()
    return _name(type(value)) if type(held) is type(value) else _text(held, depth - 1)


def _name(kind: type) -> str:
    name: str = type.__dict__["__name__"].__get__(kind)
    return f"{'an' if name[:1] in 'AEIOaeio' else 'a'} {name}"  # a Union
