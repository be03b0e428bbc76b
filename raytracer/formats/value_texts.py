"""Texts of numbers, vectors and texts: values of a sweep on the command line and in the cells of a table."""

from __future__ import annotations

import math
import re

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError

# A number, a vector of numbers, or a text.
Value = int | float | str | tuple[int | float, ...]

# The most values of one list or range, and the most pictures of a sweep: a hundred thousand files fill a folder, and
# their rows fill a table. More are better split into several sweeps.
MAX_VALUES = 100_000
# The most numbers of a vector: matrices of transforms have 12, and no other vector of a scene file is longer.
MAX_COMPONENTS = 64
# The most characters of a number. The digits of a float64 that is written out in full are 1,100 at most; nobody types
# more than 20.
_MAX_DIGITS = 100
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?P<point>\.[0-9]*)?|(?P<bare>\.[0-9]+))(?P<exponent>[eE][+-]?[0-9]+)?", re.ASCII)
# A number of a range this close to a whole number, relatively, is the whole number. The rounding of a logarithm over a
# range of 1e12 is a hundred times smaller.
_WHOLE = 1e-12


def parse_value(text: str) -> Value:
    """Return the number in a text such as "0.5", the vector in a text such as "[4, 7, 4]", or any other text itself.

    Raises InputError for an empty text, and for brackets without numbers in them.
    """
    text = text.strip()
    if not text:
        raise InputError("expected a value, got nothing")
    if text.startswith("["):
        inside = text[1:-1].split(",") if text.endswith("]") else []
        numbers = [_parse_number(part.strip()) for part in inside[: MAX_COMPONENTS + 1]]
        if not numbers or None in numbers or len(numbers) > MAX_COMPONENTS:
            raise InputError(f"expected a vector such as [4,7,4], got {format_value(text)}")
        return tuple(number for number in numbers if number is not None)
    number = _parse_number(text)
    return text if number is None else number


def parse_values(text: str) -> list[Value]:
    """Return the values of a list such as "1,4,[4,7,4],ggx", in which each item may be a range "from:to:n[:log]".

    A range has n values from `from` to `to`, both included: with equal differences, or with equal ratios if it ends in
    ":log". The ends are numbers above 0 then. Two vectors make a range of vectors.

    Raises InputError for an empty list or item, a wrong range, and more than MAX_VALUES values.
    """
    if not text.strip():
        raise InputError("expected values, got nothing")
    values: list[Value] = []
    for item in _split(text):
        values += _parse_item(item)
        if len(values) > MAX_VALUES:
            raise InputError(f"expected at most {MAX_VALUES} values")
    return values


def value_text(value: Value) -> str:
    """Return the text from which parse_value() reads the same value: all digits of numbers."""
    if isinstance(value, tuple):
        return f"[{','.join(map(repr, value))}]"
    return value if isinstance(value, str) else repr(value)


def _split(text: str) -> list[str]:
    """Split a text at the commas that are outside brackets."""
    items, depth = [""], 0
    for character in text:
        depth += (character == "[") - (character == "]")
        if character == "," and depth == 0:
            items.append("")
        else:
            items[-1] += character
    return items


def _parse_item(text: str) -> list[Value]:
    """Return the values of one item of a list."""
    start, *rest = (part.strip() for part in text.split(":"))
    if not rest or (not start.startswith("[") and _parse_number(start) is None):
        return [parse_value(text)]
    expected = "a range from:to:n or from:to:n:log"
    if len(rest) not in (2, 3) or (len(rest) == 3 and rest[2] != "log"):
        raise InputError(f"expected {expected}, got {format_value(text)}")
    first, last = parse_value(start), parse_value(rest[0])
    count = _parse_number(rest[1])
    if not isinstance(count, int) or not 1 <= count <= MAX_VALUES:
        raise InputError(
            f"expected {expected} with a whole number n in [1, {MAX_VALUES}], got n = {format_value(rest[1])}"
        )
    return _spread(first, last, count, text, is_log=len(rest) == 3)


def _spread(first: Value, last: Value, count: int, text: str, *, is_log: bool) -> list[Value]:
    """Return `count` numbers or vectors from the first to the last. `text` is the range for error messages."""
    ends = (first if isinstance(first, tuple) else (first,)), (last if isinstance(last, tuple) else (last,))
    numbers = [number for end in ends for number in end if not isinstance(number, str)]
    if isinstance(first, tuple) != isinstance(last, tuple) or len(numbers) != 2 * len(ends[0]):
        raise InputError(f"expected two numbers or two vectors as the ends of a range, got {format_value(text)}")
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"expected finite numbers, got {format_value(text)}")
    if is_log and min(numbers) <= 0:
        raise InputError(f"expected ends above 0 of a range with log, got {format_value(text)}")
    import numpy as np  # imported here, because a command line without ranges does not need NumPy

    start, stop = np.array(ends, np.float64)
    with np.errstate(all="ignore"):
        rows = (np.geomspace(start, stop, count) if is_log else np.linspace(start, stop, count)).tolist()
    if not all(math.isfinite(number) for row in rows for number in row):
        raise InputError(f"expected ends whose difference is a finite number, got {format_value(text)}")
    rows = [tuple(map(_whole, row)) for row in rows]
    return [row if isinstance(first, tuple) else row[0] for row in rows]


def _parse_number(text: str) -> int | float | None:
    """Return the number in a text, whole if it is written without a point and an exponent. None for another text."""
    match = _NUMBER.fullmatch(text) if len(text) <= _MAX_DIGITS else None
    if match is None:
        return None
    is_whole = not (match["point"] or match["bare"] or match["exponent"])
    return int(text) if is_whole else float(text)


def _whole(number: float) -> int | float:
    """Return a number as an int if it is a whole number up to rounding, so that it can be a number of samples."""
    near = round(number)
    return near if abs(number - near) <= _WHOLE * abs(number) else number
