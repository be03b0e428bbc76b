"""The README and its pictures: short, in sentences of at most 25 words, with the numbers that benchmarks measured."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tools.pictures import PAGES

from .scenes import CHECKOUT

README = (CHECKOUT / "README.md").read_text()
LONGEST_PAGE = 150  # lines
LONGEST_SENTENCE = 25  # words
LARGEST_PICTURE = 150_000  # bytes


def sentences(page: str) -> list[str]:
    """Return the sentences outside of code blocks, pictures and headings. A cell and a list item end a sentence."""
    text = re.sub(r"^```.*?^```$|^#.*$|<!--.*?-->", "", page, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"!\[[^]]*\]\([^)]*\)", "|", text)
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)
    return re.split(r"(?<=[.?!])\s|\n\n|\n- |\|", text)


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) <= LONGEST_PAGE
    words = {sentence.strip(): len(sentence.split()) for sentence in sentences(README)}
    assert not {sentence: count for sentence, count in words.items() if count > LONGEST_SENTENCE}


@pytest.mark.parametrize("page", PAGES)
def test_each_picture_is_there_is_small_and_has_a_text_in_its_place(page: str) -> None:
    path = CHECKOUT / page
    pictures = re.findall(r"!\[([^]]*)\]\(([^)]*)\)", path.read_text())
    assert len(pictures) > 10
    for text, name in pictures:
        assert len(text) > 5, name
        file = path.parent / name
        with Image.open(file) as image:
            assert image.format == "PNG"
        assert file.stat().st_size <= LARGEST_PICTURE, name


def test_each_picture_of_the_folder_is_on_a_page() -> None:
    text = "".join(page.read_text() for page in (*CHECKOUT.glob("*.md"), *CHECKOUT.glob("docs/*.md")))
    assert not [file.name for file in Path(CHECKOUT, "docs/pictures").iterdir() if f"pictures/{file.name}" not in text]


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
