"""TOML texts from anyone: parsed within bounds of time and memory, and split into statements."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any

from raytracer.core.validation import InputError

# A mark of TOML that is in no string and no comment, with the text before it. Up to the first mistake in a text, where
# tomllib stops, this reads strings as tomllib does. It is possessive and matches wherever it begins, so that no text
# makes the search slow.
_MARK = r"""
    (?: [^"'\#.,=\n\[\]{}]++
      | \"{3} (?: [^"\\]++ | \\. | "(?!"") )*+ "{0,5}
      | '{3} (?: [^']++ | '(?!'') )*+ '{0,5}
      | " (?: [^"\\\n]++ | \\. )*+ "?
      | ' [^'\n]*+ '?
      | \# [^\n]*+
    )*+ (?: ( [.,=\n\[\]{}] ) | \Z )"""
# A scene file needs 4 parts and 6 brackets.
_MOST_PARTS = _MOST_OPEN = 32
# With headers, in braces, or by a key's parts beyond its second. tomllib takes up to 2 kB for each, and 4 MB of text
# that fill a scene have some 170,000.
_MOST_TABLES = 1 << 18
# Characters of a message, in which there may be a key of any length.
_SHOWN = 1000


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a TOML text. Raises InputError for no TOML, and for a text that would take long or much memory."""
    _check_marks(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"expected TOML: {_without_middle(str(error))}", line=_line(error, text)) from None
    except (RecursionError, ValueError):  # an integer of more digits than Python converts
        raise InputError("expected TOML without deep nesting or numbers of thousands of digits") from None


def _line(error: tomllib.TOMLDecodeError, text: str) -> int:
    """The line, from 1, at which the parser stopped. Before Python 3.14 only its message says so."""
    if (line := getattr(error, "lineno", None)) is not None:
        return line
    at = re.search(r"\(at line (\d+), column \d+\)$", str(error))
    return int(at[1]) if at else text.count("\n") + 1


def _without_middle(message: str) -> str:
    """A message of at most 1000 characters: its begin, and its end, which says where."""
    half = _SHOWN // 2
    return message if len(message) <= _SHOWN else f"{message[:half]}...{message[3 - half :]}"


def statements(text: str) -> Iterator[slice]:
    """The parts of a TOML text that end with a line and outside of all brackets: headers, assignments, comments."""
    start = opened = 0
    for match in re.finditer(_MARK, text, re.VERBOSE | re.DOTALL):
        mark = match[1]
        if mark == "\n" and not opened:
            yield slice(start, match.end())
            start = match.end()
        opened += mark is not None and ((mark in "[{") - (mark in "]}"))
    if start < len(text):
        yield slice(start, len(text))


def _check_marks(text: str) -> None:
    """Raise InputError for a text for which tomllib would take long, or much memory, for its length.

    A key's parts cost their square, each table some 20 microseconds and 2 kB, and brackets in brackets Python's stack.
    A number with more than one dot is no TOML, so what more dots join is a key.
    """
    opened = dots = tables = 0
    before = "\n"
    for mark in filter(None, re.findall(_MARK, text, re.VERBOSE | re.DOTALL)):
        if mark == ".":
            dots += 1
            tables += dots > 1
            if dots == _MOST_PARTS:
                raise InputError(f"expected keys of at most {_MOST_PARTS} parts")
        else:
            dots = 0
            if mark in "[{":
                tables += mark == "{" or (before == "\n" and not opened)
                opened += 1
                if opened > _MOST_OPEN:
                    raise InputError(f"expected TOML with at most {_MOST_OPEN} brackets open at once")
            elif mark in "]}":
                opened -= 1
        before = mark
    if tables > _MOST_TABLES:
        raise InputError(f"expected TOML of at most {_MOST_TABLES} tables, got about {tables}")
