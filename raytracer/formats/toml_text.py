"""Parsing of untrusted TOML texts within limits of time and memory, and splitting into statements."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any

from raytracer.core.validation import InputError

# A punctuation mark of TOML outside strings and comments, with the text before it. Strings are recognised as tomllib
# does, up to the first syntax error, at which tomllib stops. Possessive quantifiers, and a match at every position,
# keep the time linear for every text.
_MARK = r"""
    (?: [^"'\#.,=\n\[\]{}]++
      | \"{3} (?: [^"\\]++ | \\. | "(?!"") )*+ "{0,5}
      | '{3} (?: [^']++ | '(?!'') )*+ '{0,5}
      | " (?: [^"\\\n]++ | \\. )*+ "?
      | ' [^'\n]*+ '?
      | \# [^\n]*+
    )*+ (?: ( [.,=\n\[\]{}] ) | \Z )"""
# The most parts of a dotted key, and the most brackets open at once. A scene file needs 4 parts and 6 brackets.
_MOST_PARTS = _MOST_OPEN = 32
# The most tables: by headers, by braces, or by the parts of a dotted key beyond the second. tomllib needs up to 2 kB of
# memory per table. A scene file of 4 MB, the largest size, has about 170,000 tables.
_MOST_TABLES = 1 << 18
# The most characters of the parser's message, which may contain a key of any length.
_SHOWN = 1000


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a TOML text. Raises InputError if it is not TOML, or would take much time or memory."""
    _check_marks(text)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"expected TOML: {_cut_middle(str(error))}", line=_line(error, text)) from None
    except (RecursionError, ValueError):  # an integer of more digits than Python converts
        raise InputError("expected TOML without deep nesting or numbers of thousands of digits") from None


def _line(error: tomllib.TOMLDecodeError, text: str) -> int:
    """Return the line, from 1, at which the parser stopped. Before Python 3.14 only the message contains it."""
    if (line := getattr(error, "lineno", None)) is not None:
        return line
    at = re.search(r"\(at line (\d+), column \d+\)$", str(error))
    return int(at[1]) if at else text.count("\n") + 1


def _cut_middle(message: str) -> str:
    """Shorten a message to 1000 characters. It keeps the end, which contains the position of the error."""
    half = _SHOWN // 2
    return message if len(message) <= _SHOWN else f"{message[:half]}...{message[3 - half :]}"


def statements(text: str) -> Iterator[slice]:
    """Yield the statements of a TOML text: headers, assignments and comments, to the end of their last line.

    A statement ends at the end of a line outside all brackets.
    """
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
    """Raise InputError for a text for which tomllib would need much time or memory for its length.

    The time of a dotted key grows with the square of its parts. A table costs some 20 microseconds and 2 kB. Nested
    brackets use Python's stack. Words joined by two or more dots are a key, because a number has at most one dot.
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
