"""The page of speed: rows, goals, and the table of docs/performance.md, which has the same numbers."""

import csv
import re
from types import SimpleNamespace
from typing import Any

import numpy as np

from benchmarks.bench import Agreement
from benchmarks.speed_page import as_csv, as_markdown, calls_table
from benchmarks.speed_rows import ROWS, SpeedRow, Timing
from tests.scenes import CHECKOUT

RESULTS = CHECKOUT / "benchmarks" / "results" / "speed.md"
SIZE = 1280, 720


def refuse_measurement(_bench: Any) -> Timing:
    raise AssertionError


FAST = SpeedRow("assignment", "assignment, 1 sample", "POV-Ray's trace time", 13, refuse_measurement)
LONG = SpeedRow("geometry", "assignment, saved", "the same", 1.1, refuse_measurement, at_most=True)
INNER = SpeedRow("literal", "inner: draws", "the literal shader", 15, refuse_measurement)


def rows_of(text: str) -> list[list[str]]:
    """Return the cells of the rows of all tables in Markdown, without the lines below the headings."""
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in cells] for cells in lines if set("".join(cells)) - set("- ")]


def test_a_goal_is_the_least_or_the_largest_allowed_ratio() -> None:
    assert FAST.ratio(Timing(0.02, 0.3)) == 15 and FAST.is_reached(Timing(0.02, 0.3))
    assert not FAST.is_reached(Timing(0.03, 0.3))
    assert LONG.ratio(Timing(0.3, 0.2)) == 0.3 / 0.2 and not LONG.is_reached(Timing(0.3, 0.2))
    assert LONG.is_reached(Timing(0.2, 0.2))


def test_each_row_of_the_page_has_times_a_goal_and_the_agreement() -> None:
    right, wrong = Agreement(), Agreement()
    picture = np.zeros((2, 2, 3), np.uint8)
    right.compare(picture, picture, "POV-Ray's")
    wrong.compare(picture, picture + 9, "float64's")
    assert right.right and not wrong.right
    results = [(FAST, Timing(0.02, 0.3, right)), (LONG, Timing(0.3, 0.2, wrong, "twice")), (INNER, "no | povray")]
    bench: Any = SimpleNamespace(size=SIZE, rounds=5)
    page = rows_of(as_markdown(results, [], "- a machine", bench))
    assert page[0] == ["call", "against", "ours, ms", "theirs, ms", "ratio", "goal", "reached", "picture"]
    finding = "0 % off POV-Ray's (at most 0.01 %)"
    assert page[1] == [
        "assignment, 1 sample",
        "POV-Ray's trace time",
        "20.0",
        "300",
        "15.0",
        "at least 13",
        "yes",
        finding,
    ]
    finding = "**wrong**: 1e+02 % off float64's (at most 0.01 %)"
    assert page[2] == ["assignment, saved (twice)", "the same", "300", "200", "1.50", "at most 1.1", "**no**", finding]
    assert page[3][5:] == ["at least 15", "", "not available: no", "povray"]

    lines = list(csv.DictReader(as_csv(results).splitlines()))
    assert [(line["ratio"], line["reached"], line["right"]) for line in lines] == [
        ("15", "True", "True"),
        ("1.5", "False", "False"),
        ("", "", ""),
    ]
    calls = rows_of(calls_table(results))
    assert calls[0] == page[0][:7] and calls[1:] == [cells[:7] for cells in page[1:3]], "calls alone"


def test_rows_have_the_names_of_users_calls_or_start_with_inner() -> None:
    names = [(row.call, row.against) for row in ROWS]
    assert len(names) == len(set(names))
    assert {row.group for row in ROWS if row.call.startswith("inner: ")} == {"lights", "literal"}
    assert not [row for row in ROWS if row.call.startswith("inner: ") and row.is_in_docs]


def test_the_table_of_the_docs_has_the_rows_of_the_results() -> None:
    table = re.search("<!-- speed -->(.*?)<!-- end of speed -->", (CHECKOUT / "docs/performance.md").read_text(), re.S)
    assert table
    calls, results = rows_of(table[1]), rows_of(RESULTS.read_text())
    assert len(calls) > 10
    assert all(row in [cells[:7] for cells in results] for row in calls)
