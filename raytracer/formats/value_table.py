"""Tables of values in .csv files: a column for each path of a scene file, and a row for each picture."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from raytracer.core.files import read_bounded
from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, locate_errors
from raytracer.formats.scene_paths import parse_path
from raytracer.formats.value_texts import MAX_VALUES, Value, parse_value

# The most bytes of a file: 160 for each row.
MAX_BYTES = 16 * 1024 * 1024
# The most columns. Each is a path of the scene file.
MAX_COLUMNS = 64


def read_value_table(path: Path) -> list[dict[str, Value]]:
    """Read a table: the first line has paths such as "lights.0.position", and each further line their values.

    Args:
        path: the file, UTF-8. Vectors are in quotes: "[4, 7, 4]". Empty lines are skipped.

    Returns:
        The values by path, one mapping for each row.

    Raises:
        InputError: the file cannot be read, or is no such table. The message has the file and the line.
    """
    try:
        data = read_bounded(path, MAX_BYTES, stdin=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"expected a readable table: {reason}{did_you_mean_file(path)}", file=str(path)) from None
    with locate_errors(path):
        if len(data) > MAX_BYTES:
            raise InputError(f"expected a file of at most {MAX_BYTES} bytes")
        try:
            text = data.decode("utf-8-sig")  # without the byte order mark that spreadsheets write
        except UnicodeDecodeError as error:
            raise InputError(f"expected UTF-8 text: {error.reason} at byte {error.start}") from None
        rows = _read_rows(text)
        line, header = next(rows, (1, []))
        paths = _check_header([cell.strip() for cell in header], line)
        table = [_read_values(paths, cells, line) for line, cells in rows]
        if not table:
            raise InputError("expected a row of values after the header", line=line)
        return table


def _read_rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line and the cells of each row that is not empty. Raises InputError."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    count = 0
    try:
        for cells in reader:
            if cells:
                count += 1
                if count > MAX_VALUES + 1:
                    raise InputError(f"expected at most {MAX_VALUES} rows", line=reader.line_num)
                yield reader.line_num, cells
    except csv.Error as error:
        raise InputError(f"expected CSV: {error}", line=reader.line_num) from None


def _check_header(paths: list[str], line: int) -> list[str]:
    """Return the paths of a header. Raises InputError unless each is a path, and all differ."""
    if not 1 <= len(paths) <= MAX_COLUMNS:
        raise InputError(f"expected a header of 1 to {MAX_COLUMNS} paths, got {len(paths)}", line=line)
    for i, path in enumerate(paths):
        try:
            parse_path(path)
        except InputError as error:
            raise InputError(error.reason, line=line) from None
        if path in paths[:i]:
            raise InputError(f"expected different paths, got {format_value(path)} twice", line=line)
    return paths


def _read_values(paths: list[str], cells: list[str], line: int) -> dict[str, Value]:
    """Return the values of a row, by path. Raises InputError."""
    if len(cells) != len(paths):
        raise InputError(f"expected {len(paths)} values, got {len(cells)}", line=line)
    values: dict[str, Value] = {}
    for path, cell in zip(paths, cells, strict=True):
        try:
            values[path] = parse_value(cell)
        except InputError as error:
            raise InputError(error.reason, path, line=line) from None
    return values
