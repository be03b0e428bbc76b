"""The pictures of a sweep: missing and outdated ones are drawn, here or on workers, compared with one, and written."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.image_difference import compare
from raytracer.core.validation import InputError
from raytracer.farm.frame_jobs import DrawnFrame, FrameJob, draw_image
from raytracer.farm.frame_store import FrameStore
from raytracer.farm.sweep_points import Point
from raytracer.farm.sweep_table import Measurements, SweepRow, make_measurements
from raytracer.farm.tasks import Done, Failed, Run
from raytracer.formats.image_files import FORMATS, load_picture

# The digits of a picture's key that the table has: enough to tell a billion pictures apart.
_KEY_DIGITS = 20


class DrawnPoint(NamedTuple):
    """A drawn picture of a sweep: the content of its file, and its linear radiance [H, W, 3]."""

    frame: DrawnFrame
    radiance: NDArray[np.float32]


class Reference(NamedTuple):
    """The picture with which the others are compared.

    Attributes:
        number: its number among the pictures of the sweep; None for a picture of a file.
        radiance: the linear radiance of the file [H, W, 3]; None for a picture of the sweep.
        name: its number or the name of the file, for the table.
    """

    number: int | None
    radiance: NDArray[Any] | None
    name: str


class SweepOutcome(NamedTuple):
    """The outcome of one picture: its row of the table, and its radiance if it was drawn."""

    row: SweepRow
    radiance: NDArray[np.float32] | None = None


def draw_point(job: FrameJob) -> DrawnPoint:
    """Draw a picture, and return the content of its file and its radiance. Raises InputError as draw_frame() does."""
    frame, image = draw_image(job)
    return DrawnPoint(frame, image.radiance)


class Sweep(NamedTuple):
    """A sweep to draw.

    Attributes:
        points: the values of each picture.
        make_job: a function that returns the job of a point. It raises InputError for values that the scene refuses.
        store: the files of the pictures.
        reference: the picture for the RMSE of all.
        known: measurements of earlier pictures, by (reference, key), from read_measurements().
        drivers: the names of the drivers with which pictures are drawn. A file by another driver is drawn again.
    """

    points: Sequence[Point]
    make_job: Callable[[Point], FrameJob]
    store: FrameStore
    reference: Reference
    known: Mapping[tuple[str, str], Measurements]
    drivers: Collection[str]

    def draw(self, run: Run, report: Callable[[SweepOutcome], None]) -> None:
        """Make the pictures that are missing or not current.

        A picture that fails leaves all others alone. Pictures that were written stay if this function ends early. If a
        picture is drawn, the picture of the reference is drawn, too, unless its file has its radiance.

        Args:
            run: how jobs are run: run_here(), or the workers of a farm.
            report: a function that is called with the outcome of each picture as soon as it is known, in any order.

        Raises:
            OSError: a file cannot be written.
        """
        hashed = self._hash_reference()
        keys: dict[int, str] = {}
        pending = self._list_jobs(hashed, keys, report)
        first = next(pending, None)
        if first is None:
            return
        radiance, number = self.reference.radiance, self.reference.number
        drawn: int | None = None
        if number is not None and hashed:
            job = self.make_job(self.points[number])
            key = job.key()
            is_pending = self._find_current(number, job, key, hashed) is None
            radiance = None if is_pending else self._read_exact(number)
            if radiance is None:
                for outcome in run(draw_point, [(number, job)]):
                    if isinstance(outcome, Done):
                        radiance = outcome.value.radiance
                    if is_pending:
                        drawn = number
                        report(self._finish(outcome, radiance, hashed, key))
        others = ((i, job) for i, job in itertools.chain([first], pending) if i != drawn)
        for outcome in run(draw_point, others):
            report(self._finish(outcome, radiance, hashed, keys.pop(outcome.job)))

    def _list_jobs(
        self, hashed: str, keys: dict[int, str], report: Callable[[SweepOutcome], None]
    ) -> Iterator[tuple[int, FrameJob]]:
        """Yield the jobs of pictures that have to be drawn, store their keys, and report the other pictures."""
        for i, point in enumerate(self.points):
            try:
                job = self.make_job(point)
            except InputError as error:
                report(SweepOutcome(SweepRow(i, "", point, problem=str(error))))
                continue
            key = job.key()
            row = self._find_current(i, job, key, hashed)
            if row is None:
                keys[i] = key
                yield i, job
            else:
                report(SweepOutcome(row))

    def _hash_reference(self) -> str:
        """Return the name of the reference with a hash of its picture; "" if its values are refused."""
        index, radiance, name = self.reference
        if radiance is not None:
            digest = hashlib.sha256(np.ascontiguousarray(radiance, np.float64).tobytes()).hexdigest()
        elif index is not None:
            try:
                digest = self.make_job(self.points[index]).key()
            except InputError:
                return ""
        else:
            return ""
        return f"{name} {digest[:_KEY_DIGITS]}"

    def _read_exact(self, i: int) -> NDArray[Any] | None:
        """Return the radiance of a picture whose file is current, or None if the format of the file has lost it."""
        path = self.store.path(i)
        return None if FORMATS[path.suffix].is_clipped else load_picture(path).radiance[:]

    def _find_current(self, i: int, job: FrameJob, key: str, hashed: str) -> SweepRow | None:
        """Return the row of a picture that need not be drawn; None if it has to be drawn."""
        measured = self.known.get((hashed, key[:_KEY_DIGITS]))
        if measured is None or self.store.read_current(i, key, job.size, self.drivers) is None:
            return None
        return self._make_row(i, measured, hashed, key)

    def _finish(self, outcome: Done | Failed, reference: NDArray[Any] | None, hashed: str, key: str) -> SweepOutcome:
        """Write the file of a picture, compare it with the reference, and return its outcome."""
        if isinstance(outcome, Failed):
            return SweepOutcome(SweepRow(outcome.job, "", self.points[outcome.job], problem=outcome.reason))
        frame, radiance = outcome.value
        self.store.write(outcome.job, frame.data)
        rmse = None
        if reference is not None and reference.shape == radiance.shape:
            rmse = compare(radiance, reference).rmse
        row = self._make_row(outcome.job, make_measurements(frame.estimate, rmse), hashed, key)
        return SweepOutcome(row, radiance)

    def _make_row(self, i: int, measured: Measurements, hashed: str, key: str) -> SweepRow:
        return SweepRow(i, self.store.path(i).name, self.points[i], measured, hashed, key[:_KEY_DIGITS])
