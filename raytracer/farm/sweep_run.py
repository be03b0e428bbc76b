"""The pictures of a sweep: missing and outdated ones are drawn, here or on workers, compared with one, and written."""

from __future__ import annotations

import hashlib
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
from raytracer.formats.image_files import FORMATS, load_radiance

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

    def draw(self, run: Run) -> Iterator[SweepOutcome]:
        """Make all pictures, and yield the outcome of each as soon as it is known, in any order.

        A picture that fails leaves all others alone. Pictures that were written stay if the caller ends the iteration.
        If a picture is missing, the picture of the reference is drawn, too, unless its file has its radiance.

        Args:
            run: how jobs are run: run_here(), or the workers of a farm.

        Raises:
            OSError: a file cannot be written.
        """
        radiance, index = self.reference.radiance, self.reference.number
        hashed = self._hash_reference()
        pending: list[int] = []
        for i in range(len(self.points)):
            outcome = self._settle(i, hashed)
            if outcome is None:
                pending.append(i)
            else:
                yield outcome
        if index is not None and pending and hashed:
            if index not in pending:
                radiance = self._read_exact(index)
            if radiance is None:
                for outcome in run(draw_point, [(index, self.make_job(self.points[index]))]):
                    if isinstance(outcome, Done):
                        radiance = outcome.value.radiance
                    if index in pending:
                        yield self._finish(outcome, radiance, hashed)
            pending = [i for i in pending if i != index]
        for outcome in run(draw_point, ((i, self.make_job(self.points[i])) for i in pending)):
            yield self._finish(outcome, radiance, hashed)

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
        return None if FORMATS[path.suffix].is_clipped else load_radiance(path)[:]

    def _settle(self, i: int, hashed: str) -> SweepOutcome | None:
        """Return the outcome of a picture that need not be drawn or cannot be drawn; None if it has to be drawn."""
        point = self.points[i]
        try:
            job = self.make_job(point)
        except InputError as error:
            return SweepOutcome(SweepRow(i, "", point, problem=str(error)))
        key = job.key()
        measured = self.known.get((hashed, key[:_KEY_DIGITS]))
        if measured is None or self.store.read_current(i, key, job.size, self.drivers) is None:
            return None
        return SweepOutcome(SweepRow(i, self.store.path(i).name, point, measured, hashed, key[:_KEY_DIGITS]))

    def _finish(self, outcome: Done | Failed, reference: NDArray[Any] | None, hashed: str) -> SweepOutcome:
        """Write the file of a picture, compare it with the reference, and return its outcome."""
        point = self.points[outcome.job]
        if isinstance(outcome, Failed):
            return SweepOutcome(SweepRow(outcome.job, "", point, problem=outcome.reason))
        frame, radiance = outcome.value
        self.store.write(outcome.job, frame.data)
        rmse = None
        if reference is not None and reference.shape == radiance.shape:
            rmse = compare(radiance, reference).rmse
        measured = make_measurements(frame.estimate, rmse)
        key = self.make_job(point).key()[:_KEY_DIGITS]
        row = SweepRow(outcome.job, self.store.path(outcome.job).name, point, measured, hashed, key)
        return SweepOutcome(row, radiance)
