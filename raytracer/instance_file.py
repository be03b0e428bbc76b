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

from raytracer.checks import InputError, about, shown
from raytracer.files import read_bounded
from raytracer.instances import Instances
from raytracer.output import write_new
from raytracer.solids import MAX_SURFACES, Solid
from raytracer.suggest import did_you_mean_file

# Of a file, and of an array in it when inflated: all places that a scene can have, generously written.
MAX_BYTES = 64 * 1024 * 1024

_HEADERS = (["x", "y", "z"], ["x", "y", "z", "scale"])
_COLUMNS = {"positions": "x,y,z", "scales": "scale"}


def read_instances(solid: Solid, folder: Path, name: str) -> Instances:
    """`solid` at the places that the file `name` in `folder` gives.

    A `.csv` has the header `x,y,z` or `x,y,z,scale`; an `.npz` an array `positions` (N, 3), and
    `scales` (N,) or () or none. Raises InputError.
    """
    if not is_plain(name):
        expected = "the plain name of a .csv or .npz file in the scene file's folder"
        raise InputError(f"expected {expected}, got {shown(name)}")
    data = _read(folder / name, name)
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

    Only what a scene may read is copied, so no file outside the folder of `files`, to which a link leads. The copies
    vanish when the block does not end well. Raises RuntimeError if a copy cannot be made or if another file
    has its name.
    """
    made: list[Path] = []
    try:
        for file in files:
            target = folder / file.name
            try:
                data = _read_inside(file)
                if not os.path.lexists(target):
                    write_new(target, lambda copy, data=data: copy.write(data))
                    made.append(target)
                elif _read_inside(target) != data:
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


def _read_inside(path: Path) -> bytes:
    if not path.resolve().is_relative_to(path.parent.resolve()):
        raise InputError(f"{path.name}: expected a file in the scene file's folder, got a link out of it")
    return _read(path, path.name)


def _read(path: Path, name: str) -> bytes:
    try:
        data = read_bounded(path, MAX_BYTES)
    except OSError as error:
        near = did_you_mean_file(path)
        raise InputError(f"expected a file beside the scene file: {error.strerror or error}{near}", file=name) from None
    if len(data) > MAX_BYTES:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes", file=name)
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


def _csv_numbers(data: bytes) -> tuple[array[float], list[int], int]:
    """The numbers row by row, the line of each row, and how many a row has."""
    try:
        text = data.decode("utf-8-sig")  # spreadsheets begin with a mark
    except UnicodeDecodeError as error:
        raise InputError(f"expected UTF-8 text: {error.reason} at byte {error.start}") from None
    reader = csv.reader(io.StringIO(text, newline=""))
    numbers, lines = array("d"), []
    try:
        header = [cell.strip() for cell in next(reader, [])]
        if header not in _HEADERS:
            got = shown(",".join(header))
            raise InputError(f"expected the header {' or '.join(map(','.join, _HEADERS))}, got {got}", line=1)
        for row in reader:
            if not row:
                continue
            if len(lines) == MAX_SURFACES:
                raise InputError(f"expected at most {MAX_SURFACES} rows", line=reader.line_num)
            try:
                if len(row) != len(header):
                    raise ValueError
                numbers.extend([float(cell) for cell in row])
            except ValueError:
                expected = f"{len(header)} numbers: {','.join(header)}"
                raise InputError(f"expected {expected}, got {shown(','.join(row))}", line=reader.line_num) from None
            lines.append(reader.line_num)
    except csv.Error as error:
        raise InputError(f"expected CSV: {error}", line=reader.line_num) from None
    return numbers, lines, len(header)


def _npz_arrays(data: bytes) -> dict[str, Any]:
    """The arrays `positions` and, if it is there, `scales`."""
    from raytracer.npz import read_arrays

    def choose(names: list[str]) -> list[str]:
        if "positions" not in names or not {*names} <= {"positions", "scales"}:
            got = shown(", ".join(names))
            raise InputError(f"expected the arrays positions and, if wanted, scales, got {got}")
        return names

    return read_arrays(io.BytesIO(data), choose, _check_header, MAX_BYTES)


def _check_header(name: str, shape: Sequence[int], dtype: Any) -> None:
    if dtype.kind not in "iuf":
        raise InputError(f"{name}: expected numbers, got an array of {shown(str(dtype))}")
    right = len(shape) == 2 and shape[1] == 3 if name == "positions" else len(shape) <= 1
    if not right or not all(0 <= n <= MAX_SURFACES for n in shape):
        expected = "(N, 3)" if name == "positions" else "(N,) or ()"
        raise InputError(f"{name}: expected an array {expected} with N at most {MAX_SURFACES}, got {shown(shape)}")
