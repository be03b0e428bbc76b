"""Validation of user input: checks of numbers, vectors, colours and names, their limits, and InputError."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from decimal import Decimal
from itertools import islice
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import msgspec

from raytracer.core.shown import escape_unprintable, format_keys, format_value, shorten
from raytracer.core.suggest import did_you_mean, known_names

Vec3 = tuple[float, float, float]
# Key: a name in a table, or an index in a list. Keys: the path of keys to a value, outermost key first.
Key = str | int
Keys = tuple[Key, ...]

# Lengths and radii stay within 1e-12 .. 1e12, because shaders square lengths in float32 to compute a discriminant:
# the squares, and sums of a few squares, then neither overflow nor lose bits.
MAX_LENGTH = 1e12
MIN_RADIUS = 1e-12
# Light times reflectance, summed over lights and samples, must stay finite in float32 (3.4e38).
MAX_COLOR = 1e12
# The largest side of a picture, in pixels.
MAX_SIDE = 65536
# The largest exponent of a highlight, which is 0.1 degrees wide. Sharper highlights are not useful as shading.
MAX_EXPONENT = 1e6
# Expected values for error messages, formatted once: formatting takes as long as all checks of a vector.
_POINT = f"3 numbers within +-{MAX_LENGTH:g}"
_DIRECTION = f"3 numbers within +-{MAX_LENGTH:g}, not all 0"
_COLOR = f"3 numbers in [0, {MAX_COLOR:g}] (linear RGB)"


class InputError(ValueError):
    """A wrong value in a call, a scene file or a command line. It is a ValueError.

    The message is one line: the location, the expected value and the actual value.

    Attributes:
        reason: the message without the location.
        keys: the path of keys to the value, names and indices, outermost first, such as ("materials", "red", "kd").
            () if the error is not about a single value.
        file: the file that holds the value, or the part of the command line. None if the value is in no file.
        line: the line of the file, from 1. None if the value is on no single line.
    """

    def __init__(self, reason: str, keys: Key | Keys = (), *, file: str | None = None, line: int | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.keys: Keys = keys if isinstance(keys, tuple) else (keys,)
        self.file = file
        self.line = line

    def __str__(self) -> str:
        location = [] if self.file is None else [self.file if self.line is None else f"{self.file}:{self.line}"]
        return escape_unprintable(": ".join((*location, *filter(None, (format_keys(self._shown_keys()), self.reason)))))

    def _shown_keys(self) -> Keys:
        """Return the keys that the message begins with."""
        return self.keys

    def within(self, *keys: Key) -> InputError:
        """Return a copy of the error with `keys` put in front of its keys: the path to the value that contains it."""
        if self.file is None:
            return type(self)(self.reason, (*keys, *self.keys), line=self.line)
        return InputError(str(self), keys)

    def at(self, file: object, line: int | None = None) -> InputError:
        """Return a copy of the error with a file, and with a line unless the error already has one."""
        if self.file is None:
            return type(self)(self.reason, self.keys, file=str(file), line=self.line or line)
        return InputError(str(self), file=str(file))


class KeyNameError(InputError):
    """An unknown or missing key of a table: the last of `keys`. The message begins with the path to the table."""

    def _shown_keys(self) -> Keys:
        return self.keys[:-1]


class _Within:
    """The context manager of within(). A generator function would be three times slower, for each value of a file."""

    __slots__ = ("_keys",)

    def __init__(self, keys: Keys) -> None:
        self._keys = keys

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: object, _traceback: object) -> None:
        if isinstance(error, InputError):
            raise error.within(*self._keys) from None


def within(*keys: Key) -> _Within:
    """Prefix the keys of InputErrors raised in the block with `keys`."""
    return _Within(keys)


@contextmanager
def locate_errors(place: object) -> Iterator[None]:
    """Prefix InputErrors raised in the block with `place`, for example a file name."""
    try:
        yield
    except InputError as error:
        raise error.at(place) from None


def _plain(value: Any) -> Any:
    """Convert a NumPy scalar or zero-dimensional array to a Python number; return any other `value` unchanged.

    NumPy objects are recognised by their attributes, so that NumPy need not be imported. Masked values are returned
    unchanged.
    """
    try:
        if type(getattr(value, "ndim", None)) is int and value.ndim == 0 and not getattr(value, "mask", False):
            return value.item()
    except Exception:  # attributes of an arbitrary object may raise anything
        return None
    return value


def is_number(value: Any) -> bool:
    """Whether `value` is one real number of any type."""
    return _is_real(_plain(value))


def _is_real(value: Any) -> bool:
    """Whether a plain value is a real number. Booleans do not count, although Python treats them as 1 and 0."""
    return issubclass(type(value), Real | Decimal) and type(value) is not bool


def number(
    value: Any, key: Key | Keys, low: float = -math.inf, high: float = math.inf, expected: str = "a finite number"
) -> float:
    """Return a real number of any type as a finite float.

    Args:
        value: the user's value.
        key: the location of the value, for errors.
        low: the smallest accepted number.
        high: the largest accepted number.
        expected: the expected value, in the words of the error message.

    Raises:
        InputError: the value is no finite number in [low, high].
    """
    if type(value) is float and low <= value <= high and math.isfinite(value):  # the most common case, made fast
        return value
    plain = _plain(value)
    try:
        result = float(plain) if _is_real(plain) else math.nan
    except Exception:  # too large, a signalling NaN, or any error of the number's type
        result = math.nan
    if not math.isfinite(result) or not low <= result <= high:
        raise InputError(f"expected {expected}, got {format_value(value)}", key)
    return result


def integer(value: Any, key: Key | Keys, low: int, high: int) -> int:
    """Return an integer of any type as an int in [low, high]; 4.0 is rejected. Raises InputError."""
    plain = _plain(value)
    try:
        result = int(plain) if _is_real(plain) and issubclass(type(plain), Integral) else None
    except Exception:  # any error of the number's type
        result = None
    if result is None or not low <= result <= high:
        raise InputError(f"expected a whole number in [{low}, {high}], got {format_value(value)}", key)
    return result


def check_flag(value: Any, key: Key | Keys) -> bool:
    """Return a boolean of Python or NumPy as a bool. Raises InputError."""
    plain = _plain(value)
    if type(plain) is not bool:
        raise InputError(f"expected True or False, got {format_value(value)}", key)
    return plain


def check_choice(value: Any, key: Key | Keys, choices: Iterable[str], *, expected: str = "", hint: str = "") -> str:
    """Return `value` if it is one of the `choices`.

    Args:
        value: the user's value.
        key: the location of the value, for errors.
        choices: the accepted names.
        expected: the expected value, in the words of the error message. Default: the list of choices.
        hint: the end of the error message. Default: the most similar choice.

    Raises:
        InputError: the value is none of the choices.
    """
    names = tuple(choices)
    name = str.__str__(value) if issubclass(type(value), str) else None
    if name not in names:
        hint = hint or (did_you_mean(name, names) if name else "")
        expected = expected or f"one of {', '.join(names)}"
        raise InputError(f"expected {expected}, got {format_value(value)}{hint}", key)
    return name


def check_text(value: Any, key: Key | Keys) -> str:
    """Return `value` as a str. Raises InputError for null characters and lone surrogates, which files cannot hold."""
    if not issubclass(type(value), str):
        raise InputError(f"expected a string, got {format_value(value)}", key)
    plain = str.__str__(value)
    if "\0" in plain or any("\ud800" <= c <= "\udfff" for c in plain):
        raise InputError(f"expected text without null characters and lone surrogates, got {format_value(value)}", key)
    return plain


def check_path(value: Any, key: Key | Keys) -> Path:
    """Return a str or os.PathLike as a Path. Raises InputError if the file system cannot have such a path."""
    try:
        plain = os.fspath(value)
        os.fsencode(plain)
    except Exception:  # no path, a lone surrogate, or any error of __fspath__
        plain = None
    if not isinstance(plain, str) or not plain or "\0" in plain:  # an empty string would mean the folder "."
        raise InputError(f"expected the path of a file, got {format_value(value)}", key)
    return Path(plain)


def items(value: Any, most: int) -> list[Any] | None:
    """Return the first `most` + 1 items of an ordered collection; None for other values, and for text and bytes."""
    if issubclass(type(value), str | bytes | bytearray | memoryview | Mapping | Set):
        return None
    try:
        return list(islice(iter(value), most + 1))
    except Exception:  # not iterable, or any error of its iterator
        return None


def vector(value: Any, key: Key | Keys, low: float, high: float, expected: str) -> Vec3:
    """Return three numbers in [low, high]. Raises InputError, with `expected` as the expected value in its message."""
    parts = value if type(value) in (tuple, list) else items(value, 3)
    if parts is None or len(parts) != 3:
        raise InputError(f"expected {expected}, got {format_value(value)}", key)
    x, y, z = parts
    return (
        number(x, key, low, high, expected),
        number(y, key, low, high, expected),
        number(z, key, low, high, expected),
    )


def three_numbers(value: Any, key: Key | Keys, low: float, high: float) -> Vec3:
    """Return three numbers in [low, high]; a single number is repeated three times. Raises InputError."""
    expected = f"3 numbers, or one for all, in [{low:g}, {high:g}]"
    return vector((value,) * 3 if is_number(value) else value, key, low, high, expected)


def point(value: Any, key: Key | Keys) -> Vec3:
    """Return a point: three numbers within +-1e12. Raises InputError."""
    return vector(value, key, -MAX_LENGTH, MAX_LENGTH, _POINT)


def color(value: Any, key: Key | Keys) -> Vec3:
    """Return a linear RGB colour: three numbers in [0, 1e12]. Raises InputError."""
    return vector(value, key, 0.0, MAX_COLOR, _COLOR)


def direction(value: Any, key: Key | Keys) -> Vec3:
    """Return a vector that defines a direction. Raises InputError, also for a vector shorter than 1e-12."""
    result = vector(value, key, -MAX_LENGTH, MAX_LENGTH, _DIRECTION)
    if math.hypot(*result) < 1.0 / MAX_LENGTH:
        least = f" and {1.0 / MAX_LENGTH:g} or more long" if any(result) else ""
        raise InputError(f"expected a vector that is not 0{least}, got {format_value(value)}", key)
    return result


def check_keys(table: Mapping[str, Any], keys: Sequence[str], needed: Sequence[str] = ()) -> None:
    """Raise KeyNameError if a key of `table` is not in `keys`, or if `table` lacks a key of `needed`."""
    for name in table:
        if name not in keys:
            raise KeyNameError(f"unknown key `{shorten(name)}` ({known_names(keys)}){did_you_mean(name, keys)}", name)
    for name in needed:
        if name not in table:
            raise KeyNameError(f"missing key `{name}`", name)


def check_size(value: Any) -> tuple[int, int]:
    """Return a picture size: (width, height), two integers in [1, MAX_SIDE], in pixels. Raises InputError."""
    expected = f"expected [width, height] in whole pixels in [1, {MAX_SIDE}]"
    sides = items(value, 2)
    try:
        width, height = (integer(side, "size", 1, MAX_SIDE) for side in sides or ())
    except ValueError:  # an InputError, which is a ValueError, or a wrong number of sides
        raise InputError(f"{expected}, got {format_value(value)}", "size") from None
    return width, height


def set_fields(struct: msgspec.Struct, **values: Any) -> None:
    """Store checked values in the fields of a frozen struct. Only its `__post_init__` may call this."""
    for name, value in values.items():
        msgspec.structs.force_setattr(struct, name, value)
