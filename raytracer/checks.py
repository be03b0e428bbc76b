"""Checks of what a user gives: finite numbers within bounds, vectors, colours; and the bounds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec

Vec3 = tuple[float, float, float]

# float32 squares lengths on the way to a discriminant, so lengths and radii stay within
# 1e-12 .. 1e12: squares, and sums of a few of them, then neither overflow nor lose bits.
MAX_LENGTH = 1e12
MIN_RADIUS = 1e-12
# Light times reflectance, summed over lights and samples, must stay finite in float32 (3.4e38).
MAX_COLOR = 1e12
# Of a picture, in pixels.
MAX_SIDE = 65536
# Highlights sharper than this (0.1 degrees) are no shading model's any more.
MAX_EXPONENT = 1e6


class InputError(ValueError):
    """Something that the user gave is wrong: the message says what, where, and what is expected."""


def number(
    value: Any, key: str, low: float = -math.inf, high: float = math.inf, expected: str = "a finite number"
) -> float:
    """`value` as a finite float with low <= value <= high; `expected` words the error."""
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        result = math.nan
    # NumPy's bool is known by its name, because scenes are made without importing NumPy.
    not_a_number = isinstance(value, str | bytes) or type(value).__name__ in ("bool", "bool_")
    if not_a_number or not math.isfinite(result) or not low <= result <= high:
        raise InputError(f"{key}: expected {expected}, got {shown(value)}")
    return result


def shown(value: Any) -> str:
    """`value` as an error message shows it: short."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def printable(text: str) -> str:
    """`text` without control characters: file names and keys may hold anything."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def _vector(value: Any, key: str, low: float, high: float, expected: str) -> Vec3:
    try:
        x, y, z = value
    except (TypeError, ValueError):
        raise InputError(f"{key}: expected {expected}, got {shown(value)}") from None
    x, y, z = (number(component, key, low, high, expected) for component in (x, y, z))
    return (x, y, z)


def point(value: Any, key: str) -> Vec3:
    """Three lengths."""
    return _vector(value, key, -MAX_LENGTH, MAX_LENGTH, f"3 numbers within +-{MAX_LENGTH:g}")


def color(value: Any, key: str) -> Vec3:
    """Three numbers that are not negative."""
    return _vector(value, key, 0.0, MAX_COLOR, f"3 numbers in [0, {MAX_COLOR:g}] (linear RGB)")


def direction(value: Any, key: str) -> Vec3:
    """Three numbers that point somewhere: a vector shorter than 1e-12 is taken for a mistake."""
    result = _vector(value, key, -MAX_LENGTH, MAX_LENGTH, "3 finite numbers, not all 0")
    if math.hypot(*result) < 1.0 / MAX_LENGTH:
        raise InputError(f"{key}: expected a vector that is not 0, got {shown(value)}")
    return result


@contextmanager
def about(what: object) -> Iterator[None]:
    """InputErrors in the block are about `what`, such as a file: they begin with that."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{what}: {error}") from None


def set_fields(struct: msgspec.Struct, **values: Any) -> None:
    """Store checked values into a frozen struct, from its `__post_init__` only."""
    for name, value in values.items():
        msgspec.structs.force_setattr(struct, name, value)
