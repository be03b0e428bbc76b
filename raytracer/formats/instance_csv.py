"""Places of instances in a `.csv` file: columns `x,y,z`, then optionally `scale`, then optionally `qw,qx,qy,qz`."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Iterator
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.scene.instances import Instances
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.solid import Solid

# The largest length of a line, in bytes. Eight numbers take about 200.
_MAX_LINE = 1 << 18
# The largest number of lines, with empty ones: room for an empty line after each row.
_MAX_LINES = 2 * MAX_SURFACES

# The columns of each argument of Instances. `rotations` are quaternions.
_COLUMNS = {"positions": "x,y,z", "scales": "scale", "rotations": "qw,qx,qy,qz"}
_HEADER = "x,y,z, then scale or not, then qw,qx,qy,qz or not"


def read(solid: Solid, data: bytes) -> Instances:
    """Return instances of `solid` with the places in a file's bytes. Raises InputError, with the line."""
    import numpy as np

    numbers, lines, fields = _csv_numbers(data)
    widths = [len(_COLUMNS[field].split(",")) for field in fields]
    table = np.array(numbers).reshape(-1, sum(widths))
    values: dict[str, Any] = dict(zip(fields, np.split(table, np.cumsum(widths)[:-1], axis=1), strict=True))
    if "scales" in values:
        values["scales"] = values["scales"].ravel()
    try:
        return Instances(solid, **values)
    except InputError as error:
        match error.keys:
            case (str() as field, int() as row, *_):
                raise InputError(f"{_COLUMNS[field]}: {error.reason}", line=lines[row]) from None
        raise


def _csv_numbers(data: bytes) -> tuple[array[float], array[int], list[str]]:
    """Return all numbers row by row, the line of each row, and the arguments of Instances that have columns."""
    numbers, lines = array("d"), array("q")
    header: list[str] = []
    fields: list[str] = []
    for number, line in enumerate(_csv_lines(data), start=1):
        try:
            # Parse line by line: no number continues on the next line.
            row = next(csv.reader([line], strict=True), [])
        except csv.Error as error:
            raise InputError(f"expected CSV: {error}", line=number) from None
        if number == 1:
            header = [cell.strip() for cell in row]
            fields = _fields(header)
            continue
        if not row:
            continue
        if len(lines) == MAX_SURFACES:
            raise InputError(f"expected at most {MAX_SURFACES} rows", line=number)
        try:
            # Python's float() also accepts digits of other scripts, and 1_0 for 10: reject both.
            if len(row) != len(header) or not line.isascii() or "_" in line:
                raise ValueError
            numbers.extend([float(cell) for cell in row])
        except ValueError:
            expected = f"{len(header)} numbers: {','.join(header)}"
            raise InputError(f"expected {expected}, got {format_value(','.join(row))}", line=number) from None
        lines.append(number)
    return numbers, lines, fields


def _fields(header: list[str]) -> list[str]:
    """Return the arguments of Instances that the first line of a file has columns for. Raises InputError."""
    for optional in ([], ["scales"], ["rotations"], ["scales", "rotations"]):
        fields = ["positions", *optional]
        if ",".join(header) == ",".join(_COLUMNS[field] for field in fields):
            return fields
    raise InputError(f"expected the header {_HEADER}, got {format_value(','.join(header))}", line=1)


def _csv_lines(data: bytes) -> Iterator[str]:
    """Yield the lines of a text, at least one, without line ends. Raises InputError for lines too long or too many."""
    start = 3 if data.startswith(b"\xef\xbb\xbf") else 0  # skip a byte order mark, which spreadsheets write
    newline = b"\n" if b"\n" in data else b"\r"
    for number in range(1, _MAX_LINES + 1):
        end = data.find(newline, start, start + _MAX_LINE)
        is_last = end < 0 and len(data) - start <= _MAX_LINE
        if end < 0 and not is_last:
            raise InputError(f"expected CSV: lines of at most {_MAX_LINE} bytes", line=number)
        line = data[start:] if is_last else data[start:end]
        try:
            yield line.decode().removesuffix("\r")
        except UnicodeDecodeError as error:
            raise InputError(f"expected UTF-8 text: {error.reason} at byte {start + error.start}") from None
        if is_last:
            return
        start = end + 1
    raise InputError(f"expected CSV: at most {_MAX_LINES} lines", line=_MAX_LINES + 1)
