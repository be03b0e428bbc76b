"""The contact sheet of a sweep: each picture with its number and the values that vary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.farm.sweep_points import Point, label_names, varied_paths
from raytracer.farm.sweep_table import SweepRow
from raytracer.formats.contact_sheet import (
    Cell,
    choose_cells,
    count_columns,
    reduce_picture,
    small_side,
    write_sheet,
)
from raytracer.formats.image_files import load_picture
from raytracer.formats.value_texts import Value


class SweepSheet:
    """The contact sheet of a sweep, which collects small copies of pictures while they are drawn.

    It shows 400 pictures at most, at equal distances among all.
    """

    def __init__(self, points: Sequence[Point]) -> None:
        self._points = points
        self._shown = choose_cells(len(points))
        self._columns = count_columns(len(self._shown), _last_axis(points))
        self._small: dict[int, NDArray[np.uint8]] = {}
        self._wanted = frozenset(self._shown)

    def add(self, index: int, radiance: NDArray[Any]) -> None:
        """Keep a small copy of a picture if the sheet shows it. `radiance`: linear radiance [H, W, 3]."""
        if index in self._wanted:
            self._small[index] = reduce_picture(radiance, small_side(self._columns))

    def write(self, file: IO[bytes], rows: Mapping[int, SweepRow], folder: Path, progress: Progress) -> None:
        """Write the sheet as PNG.

        Args:
            file: an open binary file.
            rows: the rows of all pictures, by their numbers.
            folder: the folder of the pictures. Pictures that were not drawn now are read there.
            progress: receives the number of pictures that are ready, and of all pictures of the sheet.
        """
        paths = varied_paths(self._points)
        names = label_names(paths)
        cells: list[Cell] = []
        for i, index in enumerate(self._shown):
            progress(i, len(self._shown))
            row = rows[index]
            if row.file and index not in self._small:
                with suppress(InputError):  # the sheet can do without a picture of more pixels than are read
                    self.add(index, load_picture(folder / row.file).radiance[:])
            values = [f"{names[path]} = {_short_text(row.point[path])}" for path in paths]
            cells.append(Cell(self._small.get(index), [row.file or f"{index}: no picture", *values]))
        write_sheet(file, cells, self._columns)


def _last_axis(points: Sequence[Point]) -> int | None:
    """Return the number of values of the path that changes fastest if the points are a product, else None."""
    (path, *others) = reversed([*points[0]])
    axis = list(dict.fromkeys(point[path] for point in points))
    count = len(axis)
    is_product = count > 1 and all(
        point[path] == axis[i % count] and all(point[o] == points[i - i % count][o] for o in others)
        for i, point in enumerate(points)
    )
    return count if is_product and len(points) % count == 0 and others else None


def _short_text(value: Value) -> str:
    """Return a value for a label, with 6 digits of each number."""
    if isinstance(value, tuple):
        return ", ".join(f"{number:.6g}" for number in value)
    return value if isinstance(value, str) else f"{value:.6g}"
