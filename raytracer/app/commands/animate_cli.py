"""`raytracer animate`: render the frames of a scene file with a table [animation], and write a movie of them."""

from __future__ import annotations

import argparse
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from raytracer.app.options import (
    add_backend,
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
from raytracer.core.output import check_place, make_folder
from raytracer.core.progress import progress_bar
from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean
from raytracer.core.terminal import print_error, print_lines
from raytracer.core.validation import InputError, check_path, check_size, integer, locate_errors
from raytracer.formats.animated_scene import open_animation
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.scene.settings import Settings

if TYPE_CHECKING:
    from raytracer.farm.frame_store import FrameStore
    from raytracer.farm.frames import FrameResult
    from raytracer.formats.estimate import Estimate
    from raytracer.formats.movies import Picture


# A number in the name of a file, in printf's notation, of at most 9 digits.
_NUMBER = re.compile(r"%(?:0[1-9])?d", re.ASCII)
# The names of frames in the folder of a movie: 6 digits number as many frames as an animation can have.
_FRAME_NAME = "%06d.png"
# The most failed frames that are listed: an error that all frames share fills no terminal.
_MOST_LISTED = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `animate`."""
    from raytracer.formats.movies import DEFAULT_CRF, MAX_CRF

    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="movie to write: .mp4 (H.264) or .webm (VP9), which need the extra video; .webp or .png (APNG), which are "
        "lossless. Or the pattern of a file for each frame, such as frames/%%04d.png or .npz. Folders are made.",
    )
    parser.add_argument(
        "--frames",
        metavar="A:B",
        type=_frame_range,
        help="draw the frames from A to B - 1 only; they count from 0. A movie then has these frames. Default: all.",
    )
    parser.add_argument(
        "--keep", action="store_true", help="keep the frames of a movie, PNG files in the folder OUT.frames"
    )
    parser.add_argument(
        "--crf",
        metavar="N",
        type=parse_integer,
        help="quality of .mp4 and .webm: 0 is the best, and 6 more halve the size of the file, roughly. Default: "
        f"{DEFAULT_CRF}. Range: 0-{MAX_CRF}.",
    )
    add_settings(parser, samples=1, adaptive=True)
    add_backend(parser)
    parser.set_defaults(run=run)


class Target(NamedTuple):
    """The files that `animate` writes.

    Attributes:
        movie: the movie, or None if each frame is a file of its own.
        folder: the folder of the frames.
        pattern: the names of the frames.
    """

    movie: Path | None
    folder: Path
    pattern: str


class _Tally:
    """The results of the frames so far."""

    def __init__(self) -> None:
        self.kept = self.drawn = self.failed = self.missed = 0
        self.worst: tuple[int, Estimate] | None = None

    def add(self, result: FrameResult) -> None:
        """Count a result, and print the reason of a failure."""
        if result.failure:
            self.failed += 1
            if self.failed <= _MOST_LISTED:
                print_error(result.failure)
            return
        self.missed += not result.has_reached
        if result.estimate is None:
            self.kept += 1
            return
        self.drawn += 1
        if self.worst is None or (result.estimate.rmse or 0.0) > (self.worst[1].rmse or 0.0):
            self.worst = result.frame, result.estimate


def run(options: argparse.Namespace) -> int:
    """Run `animate` and return the exit status: 1 if a frame failed or did not reach the `max_error` of the user."""
    chosen = chosen_settings(options)
    chosen.resolve()
    target = parse_target(options.output)
    crf = _check_crf(options, target)
    document = read_document(find_scene(options.scene))
    animation = open_animation(document)
    frames = _check_frames(options.frames, animation.frames)
    section = document.section
    with locate_errors(f"{options.scene}: [settings] and the options given"):  # settings that exclude each other
        settings = (section.settings | chosen).resolve()
    size = check_size(chosen_size(options) or section.size or DEFAULT_SIZE)

    from raytracer.farm.frame_jobs import FrameJob
    from raytracer.farm.frame_store import FrameStore
    from raytracer.farm.frames import make_frames
    from raytracer.farm.tasks import run_here
    from raytracer.gpu.device import shared_device

    suffix = _check_target(target, size, settings, len(frames))
    warn_about_scene(options.scene, document.scene, settings)
    driver = shared_device(options.backend, options.device).limits.driver
    _make_folders(target)
    store = FrameStore(target.folder, target.pattern)

    def make_job(frame: int) -> FrameJob:
        return FrameJob(animation.scene(frame), size, settings, suffix, options.backend, options.device)

    tally = _Tally()
    start = time.monotonic()
    try:
        with progress_bar(f"rendering {options.output}") as progress:

            def report(result: FrameResult) -> None:
                tally.add(result)
                progress(tally.drawn + tally.failed, len(frames) - tally.kept)

            make_frames(frames, make_job, store, run_here, [driver], report)
        if target.movie and not tally.failed:
            _write_movie(options, target.movie, store, frames, animation.fps, crf)
    except (KeyboardInterrupt, OSError, RuntimeError) as error:
        return _stop(error, target, store, tally.kept + tally.drawn, len(frames))
    if target.movie and not options.keep and not tally.failed:
        store.remove(frames)
    made = f"{tally.drawn} drawn" + (f", {tally.kept} kept" if tally.kept else "")
    facts = f"{size[0]}x{size[1]}, {made}, {time.monotonic() - start:.1f} s"
    if tally.failed:
        without = f"; no {target.movie.name} without the others" if target.movie else ""
        others = f"the others are in {store.folder}: {facts}{without}"
        print_error(f"{tally.failed} of {len(frames)} frames failed; {others}")
        return 1
    print_lines(f"wrote {options.output}: {len(frames)} frames at {animation.fps:g} fps, {facts}")
    if tally.worst:
        print_lines(f"largest {tally.worst[1]} (frame {tally.worst[0]})")
    if tally.missed:
        missed = f"{tally.missed} of {len(frames)} frames did not reach the error {settings.max_error:g}"
        if is_error_chosen(section.settings, chosen):
            print_error(f"{options.output}: {missed}; try more --samples or --time")
            return 1
        print_lines(missed)  # a quality set max_error, and limits the samples: no failure
    return 0


def _stop(error: BaseException, target: Target, store: FrameStore, ready: int, count: int) -> int:
    """Say how to go on after an interruption, and return the exit status. Raises the error if no frame is there."""
    if not ready:
        if target.movie:
            store.remove([])
        raise error
    is_interrupt = isinstance(error, KeyboardInterrupt)
    reason = "interrupted" if is_interrupt else str(error)
    print_error(f"{reason}; {ready} of {count} frames are in {store.folder}: the same command goes on with them")
    return STATUS if is_interrupt else 1


def _check_target(target: Target, size: tuple[int, int], settings: Settings, count: int) -> str:
    """Check the formats and the memory for `count` frames, and return the suffix of a frame. Raises InputError."""
    from raytracer.formats.image_files import FORMATS
    from raytracer.formats.movies import check_movie

    suffix = Path(target.pattern).suffix.lower()
    if suffix not in FORMATS:
        raise InputError(f"expected a pattern that ends in {' or '.join(FORMATS)}", file=target.pattern)
    if target.movie:
        check_movie(target.movie, size, count)
    sampling = settings.sampling
    geometry = FORMATS[suffix].has_geometry
    check_memory(picture_bytes(size, geometry, sampling.is_adaptive, sampling.has_stopping_rule), size)
    return suffix


def _make_folders(target: Target) -> None:
    """Make the folder of the frames, and check the place of the movie. Raises InputError."""
    if target.movie:
        make_folder(target.movie.parent)
        check_place(target.movie)
    make_folder(target.folder)


def parse_target(text: str) -> Target:
    """Return the files for an argument of -o. Raises InputError for a wrong suffix or pattern."""
    from raytracer.formats.movies import MOVIES

    path = check_path(text, "path")
    if "%" in text:
        numbers = _NUMBER.findall(path.name)
        if len(numbers) != 1 or text.count("%") != 1:
            raise InputError("expected a pattern with one number, such as frames/%04d.png", file=text)
        return Target(None, path.parent, path.name)
    suffix = path.suffix.lower()
    if suffix not in MOVIES:
        hint = did_you_mean(suffix, MOVIES)
        expected = f"a movie that ends in {', '.join(MOVIES)}, or a pattern such as frames/%04d.png"
        raise InputError(f"expected {expected}{hint}", file=text)
    return Target(path, path.with_name(path.name + ".frames"), _FRAME_NAME)


def _check_crf(options: argparse.Namespace, target: Target) -> int:
    """Return the constant rate factor. Raises InputError for options that the output does not have."""
    from raytracer.formats.movies import DEFAULT_CRF, MAX_CRF, MOVIES

    if target.movie is None and options.keep:
        raise InputError("expected no --keep with a pattern: the frames are the output", file=options.output)
    if options.crf is None:
        return DEFAULT_CRF
    if target.movie is None or not MOVIES[target.movie.suffix.lower()].codec:
        raise InputError("expected --crf for .mp4 and .webm only", file=options.output)
    return integer(options.crf, "--crf", 0, MAX_CRF)


def _frame_range(text: str) -> tuple[int, int | None]:
    """Parse A:B, in which A or B may be missing."""
    match = re.fullmatch(r"([0-9]*):([0-9]*)", text, re.ASCII)
    if match is None:
        raise argparse.ArgumentTypeError(f"expected A:B, such as 0:24, got {format_value(text)}")
    return parse_integer(match[1] or "0"), parse_integer(match[2]) if match[2] else None


def _check_frames(chosen: tuple[int, int | None] | None, count: int) -> range:
    """Return the numbers of the frames to draw. Raises InputError for an empty range or one beyond the animation."""
    first, end = chosen or (0, None)
    end = count if end is None else end
    if not first < end <= count:
        raise InputError(f"expected A:B with 0 <= A < B <= {count}, got {first}:{end}", "--frames")
    return range(first, end)


def _write_movie(
    options: argparse.Namespace, movie: Path, store: FrameStore, frames: range, fps: float, crf: int
) -> None:
    """Write the movie of frames that are all there."""
    from raytracer.formats.image_png import read_pixels
    from raytracer.formats.movies import write_movie

    def picture(k: int) -> Picture:
        path = store.path(frames[k])
        with locate_errors(path), path.open("rb") as file:
            return read_pixels(file)

    with options.write(movie) as file, progress_bar(f"writing {movie}") as progress:
        write_movie(movie, file, picture, len(frames), fps, crf, progress)
