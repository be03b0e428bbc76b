"""What was found, as a table for the terminal, as CSV and as Markdown."""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields


@dataclass(frozen=True)
class Finding:
    """One measurement: `found` is to be at most `bound`."""

    what: str  # the row of the ledger
    at: str  # where in its range
    bits: int  # of the intersections' precision; 32 for what has only that
    measure: str
    found: float
    bound: float
    note: str = ""

    @property
    def kept(self) -> bool:
        return self.found <= self.bound  # so not a NaN


def worst(findings: Iterable[Finding]) -> list[Finding]:
    """Of each row's measures at each precision the largest finding, or the largest that is beyond its bound."""
    groups: dict[object, list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.what, finding.measure, finding.bits), []).append(finding)
    return [max(group, key=lambda finding: (not finding.kept, finding.found)) for group in groups.values()]


HEADING = ("what", "measure", "32 bits", "64 bits", "bound", "kept", "worst at")


def summary(findings: Iterable[Finding]) -> list[list[str]]:
    """Rows under HEADING: the worst of each measure at either precision."""
    pairs: dict[tuple[str, str], dict[int, Finding]] = {}
    for finding in worst(findings):
        pairs.setdefault((finding.what, finding.measure), {})[finding.bits] = finding
    rows = []
    for (what, measure), by_bits in pairs.items():
        found = [shown(by_bits[bits].found) if bits in by_bits else "" for bits in (32, 64)]
        first, *_ = shortest = sorted(by_bits.values(), key=lambda f: f.kept)  # what is not kept first
        kept = ("yes" if first.bound < math.inf else "-") if first.kept else "**no**"
        # Where nothing at all was found, there is no worst place.
        places = dict.fromkeys(f.at for f in shortest if f.found)
        bounds = dict.fromkeys(shown(by_bits[bits].bound) for bits in (32, 64) if bits in by_bits)
        rows.append([what, measure, *found, " / ".join(bounds), kept, "; ".join(places)])
    return rows


def as_csv(findings: Sequence[Finding]) -> str:
    """Every finding, with a heading."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(field.name for field in fields(Finding)), "kept"])
    for finding in findings:
        writer.writerow([*astuple(finding), finding.kept])
    return text.getvalue()


def as_markdown(findings: Sequence[Finding], machine: str) -> str:
    """The worst of every row, then all."""
    lines = [
        "# Right at the extremes",
        "",
        "Written by `raytracer extremes` (`make extremes`): every picture and every ray is compared with float64.",
        "A pixel is *doubtful*, and not counted as wrong, where the rounding of its numbers lets two answers be. That",
        "is computed for each ray by `raytracer/resolution.py`, from the error bounds that `shaders/sphere.glsl` and",
        "`plane.glsl` state. *Share of its bound* is the largest error over the bound that is computed for that pixel;",
        "*ulp* is a unit in the last place of float32; the bounds there are the median and the largest computed ones.",
        "",
        f"Measured on {machine}.",
        "",
        "## The worst of each",
        "",
        *_lines(HEADING, summary(findings)),
        "",
        "## All",
        "",
        "Where there are two numbers, the first is found with 32 bits and the second with 64.",
    ]
    for what, group in itertools.groupby(findings, key=lambda finding: finding.what):
        lines += ["", f"### {what[0].upper()}{what[1:]}", "", *_by_place(list(group))]
    return "\n".join(lines) + "\n"


def _by_place(findings: list[Finding]) -> list[str]:
    """A line for each place in the range, a column for each measure."""
    measures = list(dict.fromkeys(f.measure for f in findings))
    cells: dict[tuple[str, str], list[str]] = {}
    for f in findings:
        cells.setdefault((f.at, f.measure), []).append(shown(f.found) if f.kept else f"**{shown(f.found)}**")
        if f.note:
            cells.setdefault((f.at, "note"), []).append(f.note)
    rows = [
        (
            at,
            *(" / ".join(cells.get((at, measure), [])) for measure in measures),
            "; ".join(cells.get((at, "note"), [])),
        )
        for at in dict.fromkeys(f.at for f in findings)
    ]
    return _lines(("at", *measures, "note"), rows)


def _lines(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    cells = [heading, ["---"] * len(heading), *rows]
    return ["| " + " | ".join(text.replace("|", "\\|") for text in row) + " |" for row in cells]


def shown(value: float) -> str:
    """Counts as they are, all else to three digits; no bound is a dash."""
    if value == math.inf:
        return "-"
    return f"{value:.0f}" if abs(value) < 1e6 and value == int(value) else f"{value:.3g}"
