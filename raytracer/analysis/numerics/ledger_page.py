"""Text of the ledger: a table for the terminal, extremes.csv and extremes.md."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields

from raytracer.analysis.numerics.findings import Finding, LedgerRow

# A part of the names of measures without a bound: the numbers of all wrong pixels, doubtful or not.
IN_FACT = "in fact"
HEADING = ("row", "measured", "beyond bounds", "largest share of a bound, 32 bits", "wrong in fact, 32 / 64 bits")


def summary(rows: Iterable[LedgerRow]) -> list[list[str]]:
    """Return the cells of a line under HEADING for each row."""
    lines = []
    for row in rows:
        near = max(
            (f.measured / f.bound for f in row.findings if f.bits == 32 and 0.0 < f.bound < math.inf), default=0.0
        )
        in_fact = [[f.measured for f in row.findings if f.bits == bits and IN_FACT in f.measure] for bits in (32, 64)]
        broken = sum(not f.is_within_bound for f in row.findings)
        lines.append(
            [
                row.findings[0].row,
                str(len(row.findings)),
                f"**{broken}**" if broken else "none",
                number_text(near),
                " / ".join(number_text(sum(wrong)) for wrong in in_fact if wrong),
            ]
        )
    return lines


def as_csv(findings: Sequence[Finding]) -> str:
    """Return all findings as CSV, with a heading."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*(field.name for field in fields(Finding)), "kept"])
    for finding in findings:
        writer.writerow([*astuple(finding), finding.is_within_bound])
    return text.getvalue()


def as_markdown(rows: Sequence[LedgerRow], measured: str) -> str:
    """Return the ledger as Markdown: a summary, then each row by place. `measured` is a sentence about the run."""
    lines = [
        "# Right at the extremes",
        "",
        "Written by `raytracer extremes` (`make extremes`): pictures and rays from the GPU against float64.",
        f"{measured}",
        "",
        "- A pixel, or a shadow in it, is *doubtful* if rounding allows two answers.",
        "  `raytracer/analysis/pixel_doubt.py` computes this for each ray, from the error bounds in the files of",
        "  `shaders/geometry/`, such as `sphere.glsl` and `torus_wall.glsl`. *Wrong* pixels are wrong without being",
        "  doubtful: their bound is 0. The share of doubtful pixels has a bound, too, so that doubt does not excuse",
        "  everything.",
        "  If this bound is `-`, 32 bits do not resolve the scene. *Wrong in fact* then counts all wrong pixels,",
        "  with 32 bits and with `--precision 64`.",
        "- *Share of its bound*: an error over the bound that is computed for the same pixel. With 64 bits the depth",
        "  is always near its bound, because pictures store float32.",
        "- *ulp*: a unit in the last place of float32.",
        "",
        *_lines(HEADING, summary(rows)),
    ]
    for row in rows:
        title = row.findings[0].row
        lines += ["", f"## {title[0].upper()}{title[1:]}", "", row.about, "", *_by_place(row.findings)]
    return "\n".join(lines) + "\n"


def _by_place(findings: list[Finding]) -> list[str]:
    """Return a table: a line for each place in the range, a column for each measure, values with 32 / 64 bits."""
    cells: dict[tuple[str, str], list[str]] = {}
    bounds: dict[str, dict[str, None]] = {}
    for f in findings:
        text = number_text(f.measured)
        cells.setdefault((f.at, f.measure), []).append(text if f.is_within_bound else f"**{text}**")
        bounds.setdefault(f.measure, {})[number_text(f.bound)] = None
        if f.note:
            cells.setdefault((f.at, "note"), []).append(f.note)
    measures = [m for m in bounds if any(c != "0" for (_, name), row in cells.items() if name == m for c in row)]
    rows = [
        (at, *(" / ".join(cells.get((at, m), [])) for m in measures), "; ".join(cells.get((at, "note"), [])))
        for at in dict.fromkeys(f.at for f in findings)
    ]
    rows = [row for row in rows if any(row[1:])]
    zero = [f"{m} (bound {', '.join(bounds[m])})" for m in bounds if m not in measures]
    heading = [f"{m} (bound {', '.join(bounds[m]) if len(bounds[m]) < 3 else 'computed'})" for m in measures]
    intro = [f"At all places: 0 {'; 0 '.join(zero)}.", ""] if zero else []
    return [*intro, *_lines(("at, with 32 / 64 bits", *heading, "note"), rows)]


def _lines(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    cells = [heading, ["---"] * len(heading), *rows]
    return ["| " + " | ".join(text.replace("|", "\\|") for text in row) + " |" for row in cells]


def number_text(value: float) -> str:
    """Format a number: counts in full, other numbers with three digits, an infinite bound as a dash."""
    if value == math.inf:
        return "-"
    return f"{value:.0f}" if abs(value) < 1e6 and value == int(value) else f"{value:.3g}"
