"""Instances' places in a file beside the scene file: `.csv` or `.npz`.

Such a file is untrusted input as the scene file is: its size is bounded, and an array's shape is
looked at before the array is read, because little can inflate to much. Every error is an
`InputError` that begins with the file's name, and for a `.csv` the line.
"""

from __future__ import annotations

import csv
import io
import os
from array import array
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PureWindowsPath
from typing import Any

from raytracer.core.files import read_bounded
from raytracer.core.output import write_new
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, about, shown
from raytracer.scene.instances import Instances
from raytracer.scene.solids import MAX_SURFACES, Solid

# Bytes of all files of a scene, and of an array when inflated: all places that a scene can have, generously written.
MAX_BYTES = 64 * 1024 * 1024
# For which a file counts at least, as opening and checking one takes time, too: some 0.1 ms.
_LEAST_BYTES = 4096

# Bytes of a line of a .csv. Four numbers take some 100.
_MAX_LINE = 1 << 18
# Empty ones count, and are not more than the others.
_MAX_LINES = 2 * MAX_SURFACES

_HEADERS = (["x", "y", "z"], ["x", "y", "z", "scale"])
_COLUMNS = {"positions": "x,y,z", "scales": "scale"}


class Room:
    """The number of bytes that a scene's files may still have."""

    def __init__(self) -> None:
        self.left = MAX_BYTES


def read_instances(solid: Solid, folder: Path, name: str, room: Room | None = None) -> Instances:
    """`solid` at the places that the file `name` in `folder` gives. The file takes its part of `room`.

    A `.csv` has the header `x,y,z` or `x,y,z,scale`; an `.npz` an array `positions` (N, 3), and
    `scales` (N,) or () or none. Raises InputError.
    """
    if not is_plain(name):
        expected = "the plain name of a .csv or .npz file in the scene file's folder"
        raise InputError(f"expected {expected}, got {shown(name)}")
    room = room or Room()
    data = _read(folder / name, room.left)
    room.left = max(0, room.left - max(len(data), _LEAST_BYTES))
    with about(name):
        if name.lower().endswith(".csv"):
            return _from_csv(solid, data)
        return Instances(solid, **_npz_arrays(data))


def is_plain(name: str, suffixes: Sequence[str] = (".csv", ".npz")) -> bool:
    """Whether `name` can only be that of a file with one of the suffixes in a folder, on any system."""
    plain = PureWindowsPath(name).name == name and ":" not in name and name.isprintable()
    return plain and PureWindowsPath(name).suffix.lower() in suffixes


@contextmanager
def copied(files: Sequence[Path], folder: Path) -> Iterator[None]:
    """Put copies of the files that a scene names into `folder`, but those that are there with the same content.

    Only files that a scene may read are copied: none outside the folder of `files`, to which a link leads. The copies
    vanish when the block does not end well. Raises RuntimeError if a copy cannot be made or if another file
    has its name.
    """
    made: list[Path] = []
    try:
        for file in files:
            target = folder / file.name
            try:
                data = _read(file)
                if not os.path.lexists(target):
                    write_new(target, lambda copy, data=data: copy.write(data))
                    made.append(target)
                elif _read(target) != data:
                    raise InputError(
                        f"expected no file of this name in {folder.absolute()}, or one of the same content"
                    )
            except (OSError, InputError) as error:
                raise RuntimeError(f"{file}: expected to be copied to {folder.absolute()}: {error}") from None
        yield
    except BaseException:
        for target in made:
            target.unlink(missing_ok=True)
        raise


def _read(path: Path, most: int = MAX_BYTES) -> bytes:
    try:
        data = read_bounded(path, most, path.parent)
    except OSError as error:
        reason = f"{error.strerror or error}{did_you_mean_file(path)}"
        raise InputError(f"expected a file beside the scene file: {reason}", file=path.name) from None
    if len(data) > most:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes, with the scene's others", file=path.name)
    return data


def _from_csv(solid: Solid, data: bytes) -> Instances:
    import numpy as np

    numbers, lines, width = _csv_numbers(data)
    table = np.array(numbers).reshape(-1, width)
    try:
        return Instances(solid, table[:, :3], table[:, 3] if width == 4 else 1.0)
    except InputError as error:
        match error.keys:
            case (str() as array, int() as row, *_):
                raise InputError(f"{_COLUMNS[array]}: {error.reason}", line=lines[row]) from None
        raise


def _csv_numbers(data: bytes) -> tuple[array[float], array[int], int]:
    """The numbers row by row, the line of each row, and how many a row has."""
    numbers, lines, header = array("d"), array("q"), []
    for number, line in enumerate(_csv_lines(data), start=1):
        try:
            # Line by line, as no number goes on in the next one.
            row = next(csv.reader([line], strict=True), [])
        except csv.Error as error:
            raise InputError(f"expected CSV: {error}", line=number) from None
        if number == 1:
            header = [cell.strip() for cell in row]
            if header not in _HEADERS:
                got = shown(",".join(header))
                raise InputError(f"expected the header {' or '.join(map(','.join, _HEADERS))}, got {got}", line=1)
            continue
        if not row:
            continue
        if len(lines) == MAX_SURFACES:
            raise InputError(f"expected at most {MAX_SURFACES} rows", line=number)
        try:
            # Python's float() takes digits of all scripts, and 1_0 for 10.
            if len(row) != len(header) or not line.isascii() or "_" in line:
                raise ValueError
            numbers.extend([float(cell) for cell in row])
        except ValueError:
            expected = f"{len(header)} numbers: {','.join(header)}"
            raise InputError(f"expected {expected}, got {shown(','.join(row))}", line=number) from None
        lines.append(number)
    return numbers, lines, len(header)


def _csv_lines(data: bytes) -> Iterator[str]:
    """The lines of a text, at least one, without their ends. Raises InputError for one too long, or too many."""
    start = 3 if data.startswith(b"\xef\xbb\xbf") else 0  # a byte order mark, with which spreadsheets begin
    newline = b"\n" if b"\n" in data else b"\r"
    for number in range(1, _MAX_LINES + 1):
        end = data.find(newline, start, start + _MAX_LINE)
        last = end < 0 and len(data) - start <= _MAX_LINE
        if end < 0 and not last:
            raise InputError(f"expected CSV: lines of at most {_MAX_LINE} bytes", line=number)
        line = data[start:] if last else data[start:end]
        try:
            yield line.decode().removesuffix("\r")
        except UnicodeDecodeError as error:
            raise InputError(f"expected UTF-8 text: {error.reason} at byte {start + error.start}") from None
        if last:
            return
        start = end + 1
    raise InputError(f"expected CSV: at most {_MAX_LINES} lines", line=_MAX_LINES + 1)


def _npz_arrays(data: bytes) -> dict[str, Any]:
    """The arrays `positions` and, if it is there, `scales`."""
    from raytracer.core.npz import read_arrays

    def choose(names: list[str]) -> list[str]:
        if "positions" not in names or not {*names} <= {"positions", "scales"}:
            got = shown(", ".join(names))
            raise InputError(f"expected the arrays positions and, if wanted, scales, got {got}")
        return names

    return read_arrays(io.BytesIO(data), choose, _check_header, MAX_BYTES)


def _check_header(name: str, shape: Sequence[int], dtype: Any) -> None:
    if dtype.kind not in "iuf":
        raise InputError(f"expected numbers, got an array of {shown(str(dtype))}", name)
    right = len(shape) == 2 and shape[1] == 3 if name == "positions" else len(shape) <= 1
    if not right or not all(0 <= n <= MAX_SURFACES for n in shape):
        expected = "(N, 3)" if name == "positions" else "(N,) or ()"
        raise InputError(f"expected an array {expected} with N at most {MAX_SURFACES}, got {shown(shape)}", name)
