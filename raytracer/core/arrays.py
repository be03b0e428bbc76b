"""Arrays of numbers from a user's values: an array without a copy, a list row by row."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from raytracer.core.shown import shown
from raytracer.core.validation import InputError, Key, Keys, items

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Whole and real numbers: not true and false, nor complex numbers, text, dates and objects.
_KINDS = "iuf"


def number_array(
    value: Any, key: Key | Keys, most: int, check_row: Callable[[Any, Keys], Any], expected: str = "numbers"
) -> NDArray[Any]:
    """An array of real numbers, without a copy; or float64 made of a list of at most `most` rows.

    `check_row(row, keys)` makes a row's numbers, or raises InputError. Raises InputError for all else, which
    `expected` words.
    """
    import numpy as np

    keys = key if isinstance(key, tuple) else (key,)
    array = _array(value, key)
    if array is not None and array.dtype.kind in _KINDS:
        return array
    # Arrays of objects may hold numbers. Arrays of other kinds hold none.
    rows = items(value, most) if array is None or array.dtype.kind == "O" else None
    if rows is None:
        raise InputError(f"expected {expected}, got {shown(value)}", key)
    if len(rows) > most:
        raise InputError(f"expected at most {most} rows", key)
    if not _are_plain(rows):
        rows = [check_row(row, (*keys, i)) for i, row in enumerate(rows)]
    try:
        with np.errstate(over="ignore"):  # a number of more bits becomes infinite, which whoever asks refuses
            return np.array(rows, np.float64)
    except OverflowError:  # a whole number that float64 does not hold
        return np.array([check_row(row, (*keys, i)) for i, row in enumerate(rows)], np.float64)
    except ValueError:  # whose own message is long
        raise InputError(f"expected {expected}, in rows of one length", key) from None


def _array(value: Any, key: Key | Keys) -> NDArray[Any] | None:
    """An array, NumPy's or another library's, as NumPy's; None if `value` is no array."""
    if not hasattr(type(value), "__array__"):
        return None
    import numpy as np

    if type(value) is np.ndarray:  # and so not masked: the import of numpy.ma takes longer than many a picture
        return value
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise InputError("expected numbers, got some that are masked", key)
    try:
        return np.asarray(value)
    except Exception:  # whatever another library raises
        return None


def _are_plain(rows: list[Any]) -> bool:
    """Whether all rows are numbers of Python's own types, or all are three of these: then none need be looked at."""
    numbers = (float, int)
    if all(type(row) in numbers for row in rows):
        return True
    threes = all(type(row) in (list, tuple) and len(row) == 3 for row in rows)
    return threes and all(type(part) in numbers for row in rows for part in row)
