"""The report of the speed benchmark: speed.md, speed.csv and the table of docs/performance.md."""

import csv
import io
import re
from collections.abc import Sequence

from benchmarks.bench import CALLS, OTHER_RAYS, SAME_RAYS, TOLERANCE, Bench
from benchmarks.speed_rows import SpeedRow, Timing

# A row, and its times or the reason why it has none.
TimedRow = tuple[SpeedRow, Timing | str]


def stem_of(bench: Bench) -> str:
    """Return the stem of the file names. It names the GPU, so that the results of several GPUs fit into one folder."""
    device = re.sub(r"[^a-z0-9]+", "-", bench.device.limits.driver.lower()).strip("-")
    return "speed" if bench.software else f"speed-{device}"


def as_markdown(results: Sequence[TimedRow], rates: Sequence[tuple[str, ...]], machine: str, bench: Bench) -> str:
    """Format the report."""
    width, height = bench.size
    lines = [
        "# Speed",
        "",
        f"Written by `make bench`: {width}x{height}, hard shadows, rounds: {bench.rounds}.",
        "",
        machine,
        "",
        "| call | against | ours, ms | theirs, ms | ratio | goal | reached | picture |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        *(_line(row, timing) for row, timing in results),
        "",
        f"""\
- *Call*: a user's call, `rt.render(scene, size, samples=n)`, from its arguments to the picture in the processor's
  memory. Programs are compiled before. Usually all calls render one scene object. In rows with *made anew* each call
  renders a new scene of new solids, after a picture of another scene; making the scene is not counted. Rows with
  *inner* time a part of a call, which users do not call alone.
- Times are medians. Each round has {CALLS} of our calls, and then the peer's: one run of POV-Ray with 2 threads, or
  {CALLS} calls. *Ratio*: how many times faster our call is; if the goal is *at most*, how many times as long it takes.
- POV-Ray's time is its trace time, without parsing, bounding and writing. POV-Ray shoots its 4 or 16 rays through every
  pixel, and one more ray through the centre (`+AM1 +A0.0 +R2` or `+R4`, `-J`).
- *Bare draws*: the replayed draws of the picture and of its error estimate, without their preparation, and every
  read-back of the call.
  *Frame*: a frame of the window with the assignment, by `python -m benchmarks.frames`. *Numbers of a frame*: by
  `python -m benchmarks.light_frames`, for a floor under 20,000 spheres.
- *Picture*: the share of pixels with a value that differs by more than {TOLERANCE} of 255 from POV-Ray's picture, or
  from the picture of the float64 reference. With the same rays only pixels at outlines differ, where rounding decides
  (at most {100.0 * SAME_RAYS:g} %). More pixels at outlines differ where POV-Ray's 4 or 16 rays have other places than
  ours, and where the literal shader offsets the origins of its shadow rays (at most {100.0 * OTHER_RAYS:g} %).
- *Command line*: `raytracer render assignment -o picture.png` against a process that imports numpy and moderngl,
  opens EGL, clears a frame and reads it back. *Again*: Mesa has the compiled programs on disk; *first ever*: it does
  not have them.""",
    ]
    if rates:
        lines += ["", "Pictures a second:", "", "| call | 1920x1080 | 3840x2160 |", "| --- | --- | --- |"]
        lines += [f"| {' | '.join(line)} |" for line in rates]
    return "\n".join(lines) + "\n"


def calls_table(results: Sequence[TimedRow]) -> str:
    """Format the rows of users' calls, with the columns of docs/performance.md."""
    lines = [
        "| call | against | ours, ms | theirs, ms | ratio | goal | reached |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    rows = [_cells(row, timing) for row, timing in results if row.is_in_docs and not isinstance(timing, str)]
    return "\n".join((*lines, *(f"| {' | '.join(cells[:7])} |" for cells in rows)))


def _line(row: SpeedRow, timing: Timing | str) -> str:
    """Format a row of the report's table."""
    return f"| {' | '.join(_cells(row, timing))} |"


def _cells(row: SpeedRow, timing: Timing | str) -> tuple[str, ...]:
    """Format the cells of a row of the report's table."""
    goal = f"at {'most' if row.at_most else 'least'} {row.goal:g}"
    if isinstance(timing, str):
        return row.call, row.against, "", "", "", goal, "", f"not available: {timing}"
    ratio = f"{row.ratio(timing):.{1 if row.goal > 3 else 2}f}"
    is_reached = "yes" if row.is_reached(timing) else "**no**"
    agreement = timing.agreement
    picture = ("" if agreement.right else "**wrong**: ") + "; ".join(agreement.findings) if agreement else ""
    call = f"{row.call} ({timing.note})" if timing.note else row.call
    return call, row.against, *map(_milliseconds, (timing.ours, timing.theirs)), ratio, goal, is_reached, picture


def _milliseconds(seconds: float) -> str:
    return f"{1000.0 * seconds:.{1 if seconds < 0.1 else 0}f}"


def as_csv(results: Sequence[TimedRow]) -> str:
    """Format the rows as CSV. Rows without times have empty cells."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("call", "against", "ours_s", "theirs_s", "ratio", "bound", "goal", "reached", "right", "note"))
    for row, timing in results:
        bound = "at most" if row.at_most else "at least"
        if isinstance(timing, str):
            writer.writerow((row.call, row.against, "", "", "", bound, row.goal, "", "", timing))
        else:
            times = timing.ours, timing.theirs, row.ratio(timing)
            right = timing.agreement.right if timing.agreement else ""
            verdict = bound, row.goal, row.is_reached(timing), right, timing.note
            writer.writerow((row.call, row.against, *(f"{time:.6g}" for time in times), *verdict))
    return text.getvalue()
