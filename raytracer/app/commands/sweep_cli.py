"""`raytracer sweep`: render a scene with many values, and write the pictures, their table and a contact sheet."""

from __future__ import annotations

import argparse
import os
import re
import time
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from raytracer.app.farm_options import add_farm_options, check_farm_options, open_farm
from raytracer.app.options import (
    add_backend,
    add_picture_options,
    add_scene,
    add_settings,
    chosen_settings,
    chosen_size,
    is_error_chosen,
    parse_integer,
    warn_about_scene,
)
from raytracer.core.interrupts import STATUS
from raytracer.core.memory import check_memory, picture_bytes
from raytracer.core.progress import progress_bar
from raytracer.core.shown import format_value, shorten
from raytracer.core.suggest import did_you_mean
from raytracer.core.terminal import print_error, print_lines
from raytracer.core.validation import InputError, check_size, locate_errors
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.value_texts import MAX_VALUES, Value, parse_values

if TYPE_CHECKING:
    from raytracer.core.output import Writer
    from raytracer.farm.frame_jobs import FrameJob
    from raytracer.farm.sweep_points import Point
    from raytracer.farm.sweep_run import Reference, SweepOutcome
    from raytracer.farm.sweep_sheet import SweepSheet
    from raytracer.farm.sweep_table import SweepRow
    from raytracer.farm.swept_scenes import SweepSource

TABLE, SHEET = "sweep.csv", "contact-sheet.png"
# PATH=VALUES: the path may have names in quotes.
_SET = re.compile(r"""(?P<path>(?:"(?:[^"\\]|\\.)*"|'[^']*'|[^="'])*)=(?P<values>.*)""", re.DOTALL)
# The most pictures without a file that are listed: a mistake that all pictures share fills no terminal.
_MOST_LISTED = 10
# Seconds between two writes of the table while pictures are drawn: a process that is killed loses no more of them.
_SECONDS_TO_TABLE = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `sweep`."""
    add_scene(parser)
    parser.add_argument(
        "--set",
        metavar="PATH=VALUES",
        action="append",
        default=[],
        help="values of a number, vector or text of the scene file: a list such as materials.gold.alpha=0.1,0.2 or "
        "lights.0.position=[4,7,4],[0,7,4]; a range FROM:TO:N of N values, both ends included, or FROM:TO:N:log with "
        "equal ratios. settings.samples=1,4,16 sets settings. Several --set draw all combinations; the first one "
        f"changes slowest. At most {MAX_VALUES} pictures.",
    )
    parser.add_argument(
        "--table",
        metavar="FILE",
        help="CSV file in place of --set: the first line has paths, each further line the values of one picture",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        required=True,
        help=f"folder for the pictures 0000.png, 0001.png, ..., {TABLE} and {SHEET}; created if missing, existing "
        "files are overwritten. Pictures that are up to date are not drawn again.",
    )
    parser.add_argument(
        "--format", metavar="NAME", default="png", help="file format of the pictures: png, npz or exr. Default: png."
    )
    parser.add_argument(
        "--reference",
        metavar="FILE|N",
        default="0",
        help="picture with which all pictures are compared: a file, or the number of a picture of the sweep, from 0. "
        "Default: 0.",
    )
    add_picture_options(parser)
    add_settings(parser, samples=1, adaptive=True)
    add_backend(parser)
    add_farm_options(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `sweep` and return the exit status: 1 if a picture is missing or did not reach the user's `max_error`."""
    chosen = chosen_settings(options)
    chosen.resolve()
    size = chosen_size(options)
    if size:
        check_size(size)
    check_farm_options(options)
    listed = _read_values(options)
    document = read_document(find_scene(options.scene))
    with locate_errors(f"{options.scene}: [settings] and the options given"):  # settings that exclude each other
        (document.section.settings | chosen).resolve()

    from raytracer.core.output import check_folder, make_folder
    from raytracer.farm.frame_store import FrameStore
    from raytracer.farm.sweep_points import list_points
    from raytracer.farm.sweep_run import Sweep
    from raytracer.farm.sweep_sheet import SweepSheet
    from raytracer.farm.sweep_table import read_measurements
    from raytracer.farm.swept_scenes import SweepSource
    from raytracer.formats.image_files import FORMATS, check_picture_output
    from raytracer.gpu.device import shared_device

    suffix = f".{options.format}"
    if suffix not in FORMATS:
        names = [name[1:] for name in FORMATS]
        near = did_you_mean(options.format, names)
        raise InputError(f"expected {' or '.join(names)}, got {format_value(options.format)}{near}", file="--format")
    source = SweepSource(document, size, chosen=chosen)
    place = f"--table {options.table}" if options.table else "--set"
    try:
        points = list_points(listed)
        source.check(points)
    except InputError as error:
        raise InputError(error.reason if error.keys[:1] == ("values",) else str(error), file=place) from None
    jobs = _JobMaker(source, suffix, options)
    first = _first_job(points, jobs, options)
    reference = _read_reference(options.reference, len(points))
    if reference.radiance is not None and not any("size" in path for path in points[0]):
        height, width = reference.radiance.shape[:2]
        if (width, height) != first.size:
            got = f"got {width}x{height}"
            raise InputError(f"expected a picture of {first.size[0]}x{first.size[1]}, {got}", file=reference.name)
    warn_about_scene(options.scene, first.scene, first.settings)
    folder = Path(options.output)
    make_folder(folder)
    check_folder(folder, TABLE, SHEET)
    digits = max(4, len(str(len(points) - 1)))
    store = FrameStore(folder, f"%0{digits}d{suffix}")
    check_picture_output(store.path(0), options.bits)
    known = read_measurements(folder / TABLE)
    tally = _Tally(points, store.folder, SweepSheet(points), options.write)
    start = time.monotonic()
    try:
        with open_farm(options) as farm, progress_bar(f"rendering {folder}") as progress:
            drivers = farm.drivers or [shared_device(options.backend, options.device).limits.driver]

            def report(outcome: SweepOutcome) -> None:
                tally.add(outcome.row, outcome.radiance)
                progress(tally.drawn + tally.missing, len(points) - tally.kept)

            Sweep(points, jobs, store, reference, known, drivers).draw(farm.run, report)
        tally.write_table()
        with options.write(folder / SHEET) as file, progress_bar(f"writing {folder / SHEET}") as progress:
            tally.sheet.write(file, tally.rows, folder, progress)
    except (KeyboardInterrupt, OSError, RuntimeError) as error:
        ready = tally.kept + tally.drawn
        if not ready:
            raise
        with suppress(OSError):  # the disk is full
            tally.write_table()
        reason = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        print_error(f"{reason}; {ready} of {len(points)} pictures are in {folder}: the same command goes on with them")
        return STATUS if isinstance(error, KeyboardInterrupt) else 1
    return tally.summarize(time.monotonic() - start, is_error_chosen=_is_error_chosen(source, points))


class _JobMaker:
    """The function from a point of a sweep to its job, for a command line."""

    def __init__(self, source: SweepSource, suffix: str, options: argparse.Namespace) -> None:
        self._source, self._suffix, self._options = source, suffix, options

    def __call__(self, point: Point) -> FrameJob:
        """Return the job of a point. Raises InputError for values that the scene refuses, and for a huge picture."""
        from raytracer.farm.frame_jobs import FrameJob
        from raytracer.formats.image_files import FORMATS

        scene, size, settings = self._source.scene_at(point)
        sampling = settings.sampling
        form, options = FORMATS[self._suffix], self._options
        needed = picture_bytes(
            size, form.has_geometry, sampling.is_adaptive, sampling.has_stopping_rule, options.transparent
        )
        with warnings.catch_warnings(action="ignore"):  # the same warning for each picture
            check_memory(needed + size[0] * size[1] * form.writing_bytes, size)
        own = options.transparent, options.bits, options.backend, options.device
        return FrameJob(scene, size, settings, self._suffix, *own)


class _Tally:
    """The rows of the pictures so far, and their table."""

    def __init__(self, points: Sequence[Point], folder: Path, sheet: SweepSheet, write: Writer) -> None:
        self.sheet = sheet
        self.rows: dict[int, SweepRow] = {}
        self.kept = self.drawn = self.missing = 0
        self._points, self._folder, self._write = points, folder, write
        self._last_write = time.monotonic()

    def add(self, row: SweepRow, radiance: Any) -> None:
        """Add a row, and print its problem. `radiance`: the radiance of a drawn picture, or None."""
        from raytracer.farm.sweep_points import point_text

        self.rows[row.number] = row
        if row.problem:
            self.missing += 1
            if self.missing <= _MOST_LISTED:
                print_error(f"picture {row.number} ({shorten(point_text(row.point))}): {row.problem}")
        elif radiance is None:
            self.kept += 1
        else:
            self.drawn += 1
            self.sheet.add(row.number, radiance)
            if time.monotonic() - self._last_write > _SECONDS_TO_TABLE:
                self.write_table()
                self._last_write = time.monotonic()

    def write_table(self) -> None:
        """Write the table of the pictures so far."""
        from raytracer.farm.sweep_table import write_rows

        rows = [self.rows[index] for index in sorted(self.rows)]
        with self._write(self._folder / TABLE) as file:
            write_rows(file, [*self._points[0]], rows)

    def summarize(self, seconds: float, *, is_error_chosen: bool) -> int:
        """Print the result, and return the exit status."""
        folder, count = self._folder, len(self._points)
        made = f"{self.drawn} drawn" + (f", {self.kept} kept" if self.kept else "")
        print_lines(f"wrote {count - self.missing} pictures, {TABLE} and {SHEET} in {folder}: {made}, {seconds:.1f} s")
        status = 0
        if self.missing:
            print_error(f"{self.missing} of {count} pictures are missing: see the column problem of {folder / TABLE}")
            status = 1
        missed = sum(row.measurements is not None and row.measurements.reached == "no" for row in self.rows.values())
        if missed:
            message = f"{missed} of {count} pictures did not reach the requested error: see the column reached"
            if is_error_chosen:
                print_error(message)
                return 1
            print_lines(message)
        return status


def _read_values(options: argparse.Namespace) -> dict[str, list[Value]] | Sequence[dict[str, Value]]:
    """Return the values of --set by path, or the rows of --table. Raises InputError."""
    if bool(options.set) == (options.table is not None):
        raise InputError(f"expected either --set or --table, got {'both' if options.set else 'neither'}")
    if options.table is not None:
        from raytracer.formats.value_table import read_value_table

        return read_value_table(Path(options.table))
    axes: dict[str, list[Value]] = {}
    for text in options.set:
        with locate_errors(f"--set {shorten(text)}"):
            match = _SET.fullmatch(text)
            if match is None or not match["path"].strip():
                raise InputError("expected PATH=VALUES, such as lights.0.radius=0,0.5,1")
            path = match["path"].strip()
            if path in axes:
                raise InputError(f"expected different paths, got {format_value(path)} twice")
            axes[path] = parse_values(match["values"])
    return axes


def _first_job(points: Sequence[Point], make_job: _JobMaker, options: argparse.Namespace) -> FrameJob:
    """Return the job of the first point that the scene accepts. Raises InputError if it refuses all points."""
    from raytracer.farm.sweep_points import point_text

    problem: InputError | None = None
    for point in points:
        try:
            return make_job(point)
        except InputError as error:
            problem = problem or InputError(f"{error} (with {shorten(point_text(point))})")
    assert problem
    raise problem


def _read_reference(text: str, count: int) -> Reference:
    """Return the reference of --reference: a picture of the sweep by its number, or a file. Raises InputError."""
    from raytracer.farm.sweep_run import Reference
    from raytracer.formats.image_files import load_picture

    if text.isascii() and text.isdigit():
        index = parse_integer(text)
        if index >= count:
            raise InputError(
                f"expected a file, or the number of a picture in [0, {count - 1}], got {text}", file="--reference"
            )
        return Reference(index, None, text)
    return Reference(None, load_picture(text).radiance[:], os.path.basename(text))


def _is_error_chosen(source: SweepSource, points: Sequence[Point]) -> bool:
    """Whether the user set max_error as a number: by an option, in the file, or as a value of the sweep."""
    from raytracer.formats.scene_file import SceneDocument

    assert isinstance(source.base, SceneDocument)
    is_swept = any("max_error" in path for path in points[0])
    return is_swept or is_error_chosen(source.base.section.settings, source.chosen)
