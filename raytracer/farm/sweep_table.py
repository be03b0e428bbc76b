"""The table of a sweep, sweep.csv: a row for each picture, with its values and its measurements."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, NamedTuple

from raytracer.core.files import read_bounded
from raytracer.farm.sweep_points import Point
from raytracer.formats.estimate import Estimate
from raytracer.formats.value_texts import value_text

# The columns before and after the columns of paths. The measurements hold for one picture and one reference, which the
# columns `key` and `reference` identify.
_FIRST = ("index", "file")
_MEASURED = ("seconds", "samples", "error", "error_kind", "reached", "rmse")
_LAST = ("reference", "key", "problem")
# The most bytes of a table that is read: 1,000 for each of 100,000 rows.
_MAX_BYTES = 100_000_000


class Measurements(NamedTuple):
    """The measurements of a picture, as texts of the table.

    Attributes:
        seconds: the time for drawing the samples, without the compilation of shaders and the encoding of the file.
        samples: the mean number of samples per pixel.
        error: the estimated error, RMSE in linear radiance; "" if unknown.
        error_kind: "about", "at least" or "unknown".
        reached: whether the picture reached its requested error, "yes" or "no"; "" without a request.
        rmse: the root mean square difference from the reference, linear radiance; "" if the sizes differ, or if there
            is no reference.
    """

    seconds: str
    samples: str
    error: str
    error_kind: str
    reached: str
    rmse: str


class SweepRow(NamedTuple):
    """A row of the table.

    Attributes:
        number: the number of the picture, from 0.
        file: the name of the picture's file; "" if there is none.
        point: the values.
        measurements: the measurements, or None if there is no picture.
        reference: the name and the hash of the reference.
        key: the key of the picture's job.
        problem: the reason why there is no picture, in one line; "" if there is one.
    """

    number: int
    file: str
    point: Point
    measurements: Measurements | None = None
    reference: str = ""
    key: str = ""
    problem: str = ""


def make_measurements(estimate: Estimate, rmse: float | None) -> Measurements:
    """Return the measurements of a picture as texts. Errors have all their digits."""
    is_known = estimate.rmse is not None
    return Measurements(
        f"{estimate.seconds:.4g}",
        f"{estimate.samples:.6g}",
        repr(estimate.rmse) if is_known else "",
        "unknown" if not is_known else "at least" if estimate.uncertain else "about",
        {None: "", True: "yes", False: "no"}[estimate.reached],
        "" if rmse is None else repr(rmse),
    )


def write_rows(file: IO[bytes], paths: Sequence[str], rows: Iterable[SweepRow]) -> None:
    """Write the table of a sweep over `paths` to an open binary file, as CSV in UTF-8."""
    text = io.TextIOWrapper(file, "utf-8", newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*_FIRST, *paths, *_MEASURED, *_LAST))
    for row in rows:
        values = (value_text(row.point[path]) for path in paths)
        measured = row.measurements or ("",) * len(_MEASURED)
        writer.writerow((row.number, row.file, *values, *measured, row.reference, row.key, row.problem))
    text.detach()


def read_measurements(path: Path) -> dict[tuple[str, str], Measurements]:
    """Return the measurements of an earlier table, by (reference, key) of their rows.

    The result is empty if there is no such table, and may lack rows of a damaged one: their pictures are drawn again.
    """
    try:
        data = read_bounded(path, _MAX_BYTES)
        if len(data) <= _MAX_BYTES:
            return dict(_read_rows(data.decode()))
    except (OSError, ValueError, csv.Error):  # there is none, or it is not a table of this program
        pass
    return {}


def _read_rows(data: str) -> Iterator[tuple[tuple[str, str], Measurements]]:
    for cells in csv.DictReader(io.StringIO(data, newline="")):
        measured = [cells.get(name) for name in _MEASURED]
        texts = [text for text in measured if text is not None]
        reference, key = cells.get("reference"), cells.get("key")
        if len(texts) == len(_MEASURED) and key and reference is not None and not cells.get("problem"):
            yield (reference, key), Measurements(*texts)
