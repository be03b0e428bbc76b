"""The table of the times, as speed.md and speed.csv."""

import csv
import io
import re
from collections.abc import Sequence

from benchmarks.bench import FRAMES, OTHER_RAYS, SAME_RAYS, TOLERANCE, Bench
from benchmarks.speed_rows import SpeedRow, Timing

# A row, and what was measured or why that could not be.
TimedRow = tuple[SpeedRow, Timing | str]


def stem_of(bench: Bench) -> str:
    """Return the stem of the files: those of different GPUs lie beside each other."""
    device = re.sub(r"[^a-z0-9]+", "-", bench.context.info["GL_RENDERER"].lower()).strip("-")
    return "speed" if bench.software else f"speed-{device}"


def as_markdown(results: Sequence[TimedRow], rates: Sequence[tuple[str, ...]], on: str, bench: Bench) -> str:
    """The report."""
    width, height = bench.size
    lines = [
        "# How fast it is",
        "",
        f"Written by `make bench`: {width}x{height}, hard shadows, rounds: {bench.rounds}.",
        "",
        on,
        "",
        "| work | against | ours, ms | theirs, ms | ratio | at least / at most | picture |",
        "| --- | --- | --- | --- | --- | --- | --- |",
        *(_line(row, timing) for row, timing in results),
        "",
        f"""\
- Times are medians. In each round {FRAMES} frames of ours are taken, then what they are compared with: one run of
  POV-Ray with 2 threads, or frames. *Ratio*: how many times faster it is, or with *at most* how many times as long
  it takes; **bold** where that is not what it should be.
- A frame of ours is the drawing of all its samples, of a scene that the GPU has already, without read-back.
  POV-Ray's is its trace time, without parsing, bounding and writing. It shoots its 4 or 16 rays through every pixel
  besides one through its centre (`+AM1 +A0.0 +R2` or `+R4`, `-J`).
- *Picture*: the share of pixels with a value that differs by more than {TOLERANCE} of 255 from POV-Ray's picture, or
  from that of the float64 reference. With the same rays all but those at outlines are the same, where rounding
  decides ({100.0 * SAME_RAYS:g} %). POV-Ray's 4 or 16 rays are not where ours are, and the literal shader moves its
  shadow rays' starts, which shows at outlines ({100.0 * OTHER_RAYS:g} %).
- *Command line*: `raytracer render assignment -o picture.png` against a process that imports numpy and moderngl,
  opens EGL, clears a frame and reads it. *Again*: Mesa has the compiled programs on disk; *first ever*: it has not.""",
    ]
    if rates:
        lines += ["", "Frames a second:", "", "| work | 1920x1080 | 3840x2160 |", "| --- | --- | --- |"]
        lines += [f"| {' | '.join(line)} |" for line in rates]
    return "\n".join(lines) + "\n"


def _line(row: SpeedRow, timing: Timing | str) -> str:
    wanted = f"at {'most' if row.at_most else 'least'} {row.wanted:g}"
    if isinstance(timing, str):
        return f"| {row.work} | {row.against} | | | | {wanted} | not available: {timing} |"
    ratio = f"{row.ratio(timing):.{1 if row.wanted > 3 else 2}f}"
    ratio = ratio if row.reached(timing) else f"**{ratio}**"
    picture = ("" if timing.agreement.right else "**wrong**: ") + "; ".join(timing.agreement.findings)
    note = f" ({timing.note})" if timing.note else ""
    ours, theirs = _milliseconds(timing.ours), _milliseconds(timing.theirs)
    return f"| {row.work}{note} | {row.against} | {ours} | {theirs} | {ratio} | {wanted} | {picture} |"


def _milliseconds(seconds: float) -> str:
    return f"{1000.0 * seconds:.{1 if seconds < 0.1 else 0}f}"


def as_csv(results: Sequence[TimedRow]) -> str:
    """A line for each row; empty where it was not measured."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("work", "against", "ours_s", "theirs_s", "ratio", "bound", "wanted", "reached", "right", "note"))
    for row, timing in results:
        bound = "at most" if row.at_most else "at least"
        if isinstance(timing, str):
            writer.writerow((row.work, row.against, "", "", "", bound, row.wanted, "", "", timing))
        else:
            times = timing.ours, timing.theirs, row.ratio(timing)
            what = bound, row.wanted, row.reached(timing), timing.agreement.right
            writer.writerow((row.work, row.against, *(f"{time:.6g}" for time in times), *what, timing.note))
    return text.getvalue()
