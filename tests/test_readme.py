"""The README and its pictures: short, in sentences of at most 25 words, with the numbers that benchmarks measured."""

import csv
import re

import numpy as np
import pytest
from PIL import Image

from tests.pages import pictures, sentences, target
from tools.pictures import PAGES

from .scenes import CHECKOUT

README = (CHECKOUT / "README.md").read_text()
LONGEST_PAGE = 150  # lines
LONGEST_SENTENCE = 25  # words
LARGEST_PICTURE = 150_000  # bytes


def test_the_readme_is_short_and_so_are_its_sentences() -> None:
    assert len(README.splitlines()) <= LONGEST_PAGE
    assert [sentence for sentence in sentences("README.md") if len(sentence.split()) > LONGEST_SENTENCE] == []


@pytest.mark.parametrize("page", PAGES)
def test_each_picture_of_the_first_pages_is_a_small_png(page: str) -> None:
    assert len(pictures(page)) > 3
    for source, _ in pictures(page):
        file, _ = target(page, source)
        with Image.open(file) as image:
            assert image.format == "PNG"
        assert file.stat().st_size <= LARGEST_PICTURE, source


def test_the_costs_are_those_that_the_benchmark_measured() -> None:
    with (CHECKOUT / "benchmarks/results/quality.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["scene"] == "assignment"]
    shown = {cells[0]: cells[1:] for cells in table_below("| `--quality` |")}

    def numbers(column: str, digits: int = 2, unit: str = "") -> list[str]:
        values = [row[column] for row in rows]
        return [f"{positional(float(value), digits)}{unit}" if value else "unknown" for value in values]

    assert shown["`--quality`"] == [f"`{row['quality']}`" for row in rows]
    assert shown["time"] == numbers("seconds", unit=" s")
    assert shown["samples per pixel, mean"] == [f"{float(row['samples']):.1f}".removesuffix(".0") for row in rows]
    assert shown["true error"] == numbers("error")
    assert shown["error that the picture states"] == numbers("estimate")


def test_the_times_against_povray_are_those_that_the_benchmark_measured() -> None:
    lines = (CHECKOUT / "benchmarks/results/speed.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.count("|") > 5]
    rows = {row[0]: row for row in cells if row[1] == "POV-Ray's trace time"}
    ratios = [float(row[4]) for row in rows.values()]
    text = " ".join(README.split())
    assert f"{min(ratios):.0f} to {max(ratio for ratio in ratios if ratio < 100):.0f} times as fast" in text
    assert f"and {positional(max(ratios), 1)} times with a CSG tree of 1000 spheres" in text
    for call in ("assignment, 16 samples", "10,000 objects"):
        ours, theirs = (positional(float(milliseconds) / 1000, 2) for milliseconds in rows[call][2:4])
        assert re.search(rf"{theirs} s( there and|; a call with 16 samples here takes) {ours} s", text), call


def positional(value: float, digits: int) -> str:
    """Return a number with so many significant digits, without an exponent."""
    return np.format_float_positional(value, precision=digits, fractional=False, trim="-")


def table_below(head: str) -> list[list[str]]:
    """Return the cells of the README's table that begins with `head`, without the line below it."""
    lines = README[README.index(head) :].partition("\n\n")[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in (lines[0], *lines[2:])]
