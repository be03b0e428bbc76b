"""Conversion of user input to NumPy arrays: arrays are passed through without a copy, lists are checked row by row."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, Key, Keys, items

if TYPE_CHECKING:
    from numpy.typing import NDArray

# NumPy's kind codes of signed integers, unsigned integers and floats. Excluded: booleans, complex numbers, text, dates
# and objects.
_KINDS = "iuf"


def number_array(
    value: Any, key: Key | Keys, most: int, check_row: Callable[[Any, Keys], Any], expected: str = "numbers"
) -> NDArray[Any]:
    """Convert `value` to an array of real numbers.

    Args:
        value: an array, which is returned without a copy, or a list, which becomes a float64 array.
        key: the location of `value`, for errors.
        most: the largest number of rows of a list.
        check_row: a function of (row, keys) that returns the row's numbers, or raises InputError.
        expected: the expected value, in the words of the error message.

    Raises:
        InputError: `value` is neither, or has too many rows, or rows of different lengths.
    """
    import numpy as np

    keys = key if isinstance(key, tuple) else (key,)
    array = _array(value, key)
    if array is not None and array.dtype.kind in _KINDS:
        return array
    # Arrays of objects may hold numbers. Arrays of other dtypes, such as text, hold none.
    rows = items(value, most) if array is None or array.dtype.kind == "O" else None
    if rows is None:
        raise InputError(f"expected {expected}, got {format_value(value)}", key)
    if len(rows) > most:
        raise InputError(f"expected at most {most} rows", key)
    if not _are_plain(rows):
        rows = [check_row(row, (*keys, i)) for i, row in enumerate(rows)]
    try:
        with np.errstate(over="ignore"):  # a number beyond float64 becomes infinite, and the caller rejects infinity
            return np.array(rows, np.float64)
    except OverflowError:  # an integer beyond the range of float64, for which check_row() has a better error
        return np.array([check_row(row, (*keys, i)) for i, row in enumerate(rows)], np.float64)
    except ValueError:  # rows of different lengths; NumPy's own message is long
        raise InputError(f"expected {expected}, in rows of one length", key) from None


def float_array(array: NDArray[Any]) -> NDArray[Any]:
    """Copy an array to float64, with -0 replaced by 0, so that equal arrays have equal bytes and equal hashes."""
    import numpy as np

    with np.errstate(over="ignore"):  # numbers beyond float64 become infinite, which callers reject
        return np.asarray(array, np.float64, order="C") + 0.0


def _array(value: Any, key: Key | Keys) -> NDArray[Any] | None:
    """Convert an array of NumPy or of another library to a NumPy array; return None if `value` is no array."""
    if not hasattr(type(value), "__array__"):
        return None
    import numpy as np

    if type(value) is np.ndarray:  # not masked, so numpy.ma is not imported, which would take longer than many a render
        return value
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise InputError("expected numbers, got some that are masked", key)
    try:
        return np.asarray(value)
    except Exception:  # the other library may raise anything
        return None


def _are_plain(rows: list[Any]) -> bool:
    """Whether all rows are ints and floats, or all are lists or tuples of three: then check_row() is not needed."""
    numbers = (float, int)
    if all(type(row) in numbers for row in rows):
        return True
    threes = all(type(row) in (list, tuple) and len(row) == 3 for row in rows)
    return threes and all(type(part) in numbers for row in rows for part in row)
