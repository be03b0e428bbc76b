"""Checks of a user's values: finite numbers within bounds, vectors, colours, names; the bounds; and the error."""

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

from raytracer.core.shown import dotted, printable, shortened, shown
from raytracer.core.suggest import did_you_mean, known

Vec3 = tuple[float, float, float]
# A name in a table, or an index in a list; and the path of these from the outermost to a value.
Key = str | int
Keys = tuple[Key, ...]

# float32 squares lengths on the way to a discriminant, so lengths and radii stay within
# 1e-12 .. 1e12: squares, and sums of a few of them, then neither overflow nor lose bits.
MAX_LENGTH = 1e12
MIN_RADIUS = 1e-12
# Light times reflectance, summed over lights and samples, must stay finite in float32 (3.4e38).
MAX_COLOR = 1e12
# The largest side of a picture, in pixels.
MAX_SIDE = 65536
# Highlights sharper than this (0.1 degrees) are no shading model's any more.
MAX_EXPONENT = 1e6
# Expected values in the words of errors. To put numbers into text takes as long as all checks of a vector.
_POINT = f"3 numbers within +-{MAX_LENGTH:g}"
_COLOR = f"3 numbers in [0, {MAX_COLOR:g}] (linear RGB)"


class InputError(ValueError):
    """A user's mistake. Its text is one line: the place, the expected value, the value.

    `reason` is the text without the place. `keys` is the path of keys to the value, names and indices from the
    outermost, such as ("materials", "red", "kd"); () if the error is about no single value. `file`, or words of the
    command line, and `line`, from 1, say where the value is written; None if in no file, or on no single line.
    """

    def __init__(self, reason: str, keys: Key | Keys = (), *, file: str | None = None, line: int | None = None) -> None:
        super().__init__(reason)
        self.reason = reason
        self.keys: Keys = keys if isinstance(keys, tuple) else (keys,)
        self.file = file
        self.line = line

    def __str__(self) -> str:
        place = [] if self.file is None else [self.file if self.line is None else f"{self.file}:{self.line}"]
        return printable(": ".join((*place, *filter(None, (dotted(self._named()), self.reason)))))

    def _named(self) -> Keys:
        """The keys that the text begins with."""
        return self.keys

    def within(self, *keys: Key) -> InputError:
        """The same error about a value that is at `keys` of another one."""
        if self.file is None:
            return type(self)(self.reason, (*keys, *self.keys), line=self.line)
        return InputError(str(self), keys)

    def at(self, file: object, line: int | None = None) -> InputError:
        """The same error about what `file` gives, on `line` unless the error knows the line itself."""
        if self.file is None:
            return type(self)(self.reason, self.keys, file=str(file), line=self.line or line)
        return InputError(str(self), file=str(file))


class KeyNameError(InputError):
    """A key, the last of `keys`, that its table has and must not have, or must have and has not.

    The text begins with the table.
    """

    def _named(self) -> Keys:
        return self.keys[:-1]


class _Within:
    """The context of within(). A generator would take three times as long, for each value of a large file."""

    __slots__ = ("_keys",)

    def __init__(self, keys: Keys) -> None:
        self._keys = keys

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: object, _traceback: object) -> None:
        if isinstance(error, InputError):
            raise error.within(*self._keys) from None


def within(*keys: Key) -> _Within:
    """InputErrors in the block are about values at `keys` of another one."""
    return _Within(keys)


@contextmanager
def about(place: object) -> Iterator[None]:
    """InputErrors in the block are about `place`, such as a file: they begin with that."""
    try:
        yield
    except InputError as error:
        raise error.at(place) from None


def _plain(value: Any) -> Any:
    """A NumPy scalar or array without dimensions as the Python number that it holds; else `value` itself.

    Scenes are made without importing NumPy, so NumPy is known by its attributes. A masked number holds none.
    """
    try:
        if type(getattr(value, "ndim", None)) is int and value.ndim == 0 and not getattr(value, "mask", False):
            return value.item()
    except Exception:  # the attributes of any object, which may do anything
        return None
    return value


def is_number(value: Any) -> bool:
    """Whether `value` is one real number of any type."""
    return _is_real(_plain(value))


def _is_real(value: Any) -> bool:
    """Whether a plain value is a real number: neither true nor false, which Python counts as 1 and 0."""
    return issubclass(type(value), Real | Decimal) and type(value) is not bool


def number(
    value: Any, key: Key | Keys, low: float = -math.inf, high: float = math.inf, expected: str = "a finite number"
) -> float:
    """`value`, a real number of any type, as a finite float with low <= value <= high; `expected` words the error."""
    if type(value) is float and low <= value <= high and math.isfinite(value):  # as most are
        return value
    plain = _plain(value)
    try:
        result = float(plain) if _is_real(plain) else math.nan
    except Exception:  # too large, a signalling NaN, or whatever a number's type raises
        result = math.nan
    if not math.isfinite(result) or not low <= result <= high:
        raise InputError(f"expected {expected}, got {shown(value)}", key)
    return result


def whole(value: Any, key: Key | Keys, low: int, high: int) -> int:
    """`value`, a whole number of any type, as an int with low <= value <= high; 4.0 is none."""
    plain = _plain(value)
    try:
        result = int(plain) if _is_real(plain) and issubclass(type(plain), Integral) else None
    except Exception:  # whatever a number's type raises
        result = None
    if result is None or not low <= result <= high:
        raise InputError(f"expected a whole number in [{low}, {high}], got {shown(value)}", key)
    return result


def check_flag(value: Any, key: Key | Keys) -> bool:
    """`value`, true or false, NumPy's too, as a bool."""
    plain = _plain(value)
    if type(plain) is not bool:
        raise InputError(f"expected True or False, got {shown(value)}", key)
    return plain


def check_choice(value: Any, key: Key | Keys, choices: Iterable[str], *, expected: str = "", hint: str = "") -> str:
    """`value` as one of the names `choices`; `expected` words the error, and `hint` ends it."""
    names = tuple(choices)
    name = str.__str__(value) if issubclass(type(value), str) else None
    if name not in names:
        hint = hint or (did_you_mean(name, names) if name else "")
        expected = expected or f"one of {', '.join(names)}"
        raise InputError(f"expected {expected}, got {shown(value)}{hint}", key)
    return name


def check_text(value: Any, key: Key | Keys) -> str:
    """`value` as a str that any file can hold: without null characters and halves of surrogate pairs."""
    if not issubclass(type(value), str):
        raise InputError(f"expected a string, got {shown(value)}", key)
    plain = str.__str__(value)
    if "\0" in plain or any("\ud800" <= c <= "\udfff" for c in plain):
        raise InputError(f"expected text without null characters and lone surrogates, got {shown(value)}", key)
    return plain


def check_path(value: Any, key: Key | Keys) -> Path:
    """`value`, a str or os.PathLike, as a Path that the file system can be asked for."""
    try:
        plain = os.fspath(value)
        os.fsencode(plain)
    except Exception:  # no path, a lone surrogate, or whatever __fspath__ raises
        plain = None
    if not isinstance(plain, str) or not plain or "\0" in plain:  # an empty one would be the folder "."
        raise InputError(f"expected the path of a file, got {shown(value)}", key)
    return Path(plain)


def items(value: Any, most: int) -> list[Any] | None:
    """The items of an ordered collection, or its first `most` + 1; None if `value` is none, or is text or bytes."""
    if issubclass(type(value), str | bytes | bytearray | memoryview | Mapping | Set):
        return None
    try:
        return list(islice(iter(value), most + 1))
    except Exception:  # not iterable, or whatever its iterator raises
        return None


def vector(value: Any, key: Key | Keys, low: float, high: float, expected: str) -> Vec3:
    """Three numbers, each with low <= number <= high; `expected` words the error."""
    parts = value if type(value) in (tuple, list) else items(value, 3)
    if parts is None or len(parts) != 3:
        raise InputError(f"expected {expected}, got {shown(value)}", key)
    x, y, z = parts
    return (
        number(x, key, low, high, expected),
        number(y, key, low, high, expected),
        number(z, key, low, high, expected),
    )


def three(value: Any, key: Key | Keys, low: float, high: float) -> Vec3:
    """Three numbers, or one that stands for three."""
    expected = f"3 numbers, or one for all, in [{low:g}, {high:g}]"
    return vector((value,) * 3 if is_number(value) else value, key, low, high, expected)


def point(value: Any, key: Key | Keys) -> Vec3:
    """Three lengths."""
    return vector(value, key, -MAX_LENGTH, MAX_LENGTH, _POINT)


def color(value: Any, key: Key | Keys) -> Vec3:
    """Three numbers that are not negative."""
    return vector(value, key, 0.0, MAX_COLOR, _COLOR)


def direction(value: Any, key: Key | Keys) -> Vec3:
    """Three numbers that point somewhere: a vector shorter than 1e-12 is taken for a mistake."""
    result = vector(value, key, -MAX_LENGTH, MAX_LENGTH, "3 finite numbers, not all 0")
    if math.hypot(*result) < 1.0 / MAX_LENGTH:
        raise InputError(f"expected a vector that is not 0, got {shown(value)}", key)
    return result


def check_keys(table: Mapping[str, Any], keys: Sequence[str], needed: Sequence[str] = ()) -> None:
    """Raise KeyNameError for a key of `table` that is none of `keys`, and for one of `needed` that is not there."""
    for name in table:
        if name not in keys:
            raise KeyNameError(f"unknown key `{shortened(name)}` ({known(keys)}){did_you_mean(name, keys)}", name)
    for name in needed:
        if name not in table:
            raise KeyNameError(f"missing key `{name}`", name)


def check_size(value: Any) -> tuple[int, int]:
    """(width, height) in whole pixels in [1, `MAX_SIDE`]."""
    expected = f"expected [width, height] in whole pixels in [1, {MAX_SIDE}]"
    sides = items(value, 2)
    try:
        width, height = (whole(side, "size", 1, MAX_SIDE) for side in sides or ())
    except ValueError:  # InputError is one; unpacking raises ValueError
        raise InputError(f"{expected}, got {shown(value)}", "size") from None
    return width, height


def set_fields(struct: msgspec.Struct, **values: Any) -> None:
    """Store checked values into a frozen struct, from its `__post_init__` only."""
    for name, value in values.items():
        msgspec.structs.force_setattr(struct, name, value)
