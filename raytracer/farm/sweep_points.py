"""The points of a sweep: values by path, from lists of values for each path, or from the rows of a table."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, is_number, items
from raytracer.formats.scene_paths import parse_path
from raytracer.formats.value_texts import MAX_COMPONENTS, MAX_VALUES, Value, value_text

# The values of one picture, by the paths of a scene.
Point = Mapping[str, Value]


def list_points(values: Any) -> list[Point]:
    """Return the points of a sweep.

    Args:
        values: a mapping from a path to its values, whose product is taken: the first path changes slowest. Or a
            sequence of mappings from a path to a value, one for each point, with the same paths in all. A value is a
            number, a vector of numbers or a text, and may be of NumPy.

    Raises:
        InputError: other values, no point or more than 100,000, a wrong path, a path inside another one, or a value
            twice for one path of a product.
    """
    if isinstance(values, Mapping):
        axes = {_text(path): _axis(path, axis) for path, axis in values.items()}
        _check_paths([*axes])
        count = math.prod(map(len, axes.values()))
        if count > MAX_VALUES:
            sizes = " x ".join(str(len(axis)) for axis in axes.values())
            raise InputError(f"expected at most {MAX_VALUES} pictures, got {sizes} = {count}", "values")
        return [dict(zip(axes, point, strict=True)) for point in itertools.product(*axes.values())]
    rows = items(values, MAX_VALUES)
    if not rows or len(rows) > MAX_VALUES or not all(isinstance(row, Mapping) for row in rows):
        expected = f"a mapping from paths to values, or 1 to {MAX_VALUES} mappings from paths to a value"
        raise InputError(f"expected {expected}, got {format_value(values)}", "values")
    paths = [_text(path) for path in rows[0]]
    _check_paths(paths)
    return [_row(row, paths, i) for i, row in enumerate(rows)]


def point_text(point: Point) -> str:
    """Return a text for the values of a point, such as "lights.0.radius = 0.5, settings.samples = 4"."""
    return ", ".join(f"{path} = {value_text(value)}" for path, value in point.items())


def varied_paths(points: Sequence[Point]) -> list[str]:
    """Return the paths whose values differ between the points; all paths if there is one point only."""
    first = points[0]
    return [path for path in first if len(points) == 1 or any(point[path] != first[path] for point in points)]


def label_names(paths: Sequence[str]) -> dict[str, str]:
    """Return a short name for each path: its shortest end with a name of a key that no other path ends in."""
    names: dict[str, str] = {}
    for path in paths:
        parts = path.split(".")
        ends = [".".join(parts[i:]) for i in reversed(range(len(parts))) if not parts[i].isdigit()]
        others = [f".{other}" for other in paths if other != path]
        names[path] = next((end for end in ends if not any(other.endswith(f".{end}") for other in others)), path)
    return names


def _text(path: Any) -> str:
    if not isinstance(path, str):
        raise InputError(f'expected paths such as "lights.0.position", got {format_value(path)}', "values")
    return path


def _axis(path: str, values: Any) -> list[Value]:
    """Return the values of one path. Raises InputError unless there are some, and all differ."""
    listed = items(values, MAX_VALUES)
    if not listed or len(listed) > MAX_VALUES:
        expected = f"1 to {MAX_VALUES} values"
        raise InputError(f"expected {expected}, got {format_value(values)}", ("values", path))
    axis = [_plain_value(value, ("values", path)) for value in listed]
    known: set[Value] = set()
    for value in axis:
        if value in known:
            raise InputError(f"expected different values, got {value_text(value)} twice", ("values", path))
        known.add(value)
    return axis


def _row(row: Mapping[Any, Any], paths: list[str], i: int) -> Point:
    if row.keys() != {*paths}:
        expected = f"the paths of the first mapping ({', '.join(paths)})"
        raise InputError(f"expected {expected}, got {', '.join(map(str, row))}", ("values", i))
    return {path: _plain_value(row[path], ("values", i, path)) for path in paths}


def _plain_value(value: Any, keys: tuple[str | int, ...]) -> Value:
    """Return a number or text of any type as one of Python, and an array or list of numbers as a tuple."""
    if isinstance(value, str):
        return value
    parts = None if is_number(value) else items(value, MAX_COMPONENTS)
    numbers = [value] if parts is None else parts
    if not 1 <= len(numbers) <= MAX_COMPONENTS or not all(map(is_number, numbers)):
        expected = f"a number, a text or a vector of 1 to {MAX_COMPONENTS} numbers"
        raise InputError(f"expected {expected}, got {format_value(value)}", keys)
    plain = [number.item() if hasattr(number, "item") else number for number in numbers]
    return plain[0] if parts is None else tuple(plain)


def _check_paths(paths: list[str]) -> None:
    """Raise InputError for no path, a wrong path, and a path that is a part of another one."""
    if not paths:
        raise InputError("expected a path with values, got none", "values")
    parsed: dict[tuple[str, ...], str] = {}
    for path in paths:
        parts = tuple(map(str, parse_path(path)))
        for others, other in parsed.items():
            if parts == others:
                raise InputError(f"expected different paths, got {format_value(path)} twice", "values")
            if parts == others[: len(parts)] or others == parts[: len(others)]:
                raise InputError(
                    f"expected paths of different values, but one of {other} and {path} is inside the other", "values"
                )
        parsed[parts] = path
