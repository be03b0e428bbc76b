"""Frames of a movie: those whose files are missing or out of date are drawn, here or on workers, and written."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import NamedTuple

from raytracer.core.validation import InputError
from raytracer.farm.frame_jobs import REACHED, DrawnFrame, FrameJob, draw_frame
from raytracer.farm.frame_store import FrameStore
from raytracer.farm.tasks import Failed, Run
from raytracer.formats.estimate import Estimate


class FrameResult(NamedTuple):
    """The result of one frame: its file was current, or it was drawn, or it failed.

    Attributes:
        frame: the number of the frame.
        estimate: the estimated error of a frame that was drawn and written now. None if the file was current, or the
            frame failed.
        failure: the reason why there is no frame, in one line that names the frame; "" if there is one.
        has_reached: whether the picture reached the requested error, or none was requested.
    """

    frame: int
    estimate: Estimate | None = None
    failure: str = ""
    has_reached: bool = True


def make_frames(
    frames: Iterable[int],
    make_job: Callable[[int], FrameJob],
    store: FrameStore,
    run: Run,
    drivers: Collection[str],
    report: Callable[[FrameResult], None],
) -> None:
    """Make the files of frames that are missing or not current.

    A frame that fails leaves all others alone. Frames that were written stay if this function ends early.

    Args:
        frames: the numbers of the frames.
        make_job: a function that returns the job of a frame. It raises InputError, which names the frame, for a frame
            without a scene.
        store: the files.
        run: how jobs are run: run_here(), or the workers of a farm.
        drivers: the drivers with which frames are drawn. A file by another driver is drawn again.
        report: a function that is called with the result of each frame as soon as it is known, in any order.

    Raises:
        OSError: a file cannot be written.
    """

    def jobs() -> Iterator[tuple[int, FrameJob]]:
        for frame in frames:
            try:
                job = make_job(frame)
            except InputError as error:
                report(FrameResult(frame, failure=str(error)))
                continue
            texts = store.read_current(frame, job.key(), job.size, drivers)
            if texts is None:
                yield frame, job
            else:
                report(FrameResult(frame, has_reached=texts.get(REACHED) != "no"))

    for outcome in run(draw_frame, jobs()):
        if isinstance(outcome, Failed):
            report(FrameResult(outcome.job, failure=f"frame {outcome.job}: {outcome.reason}"))
            continue
        drawn: DrawnFrame = outcome.value
        store.write(outcome.job, drawn.data)
        report(FrameResult(outcome.job, drawn.estimate, has_reached=drawn.estimate.reached is not False))
