"""Texts of values: numbers, vectors, ranges with exact ends, and tables in CSV."""

import csv
import math
from itertools import pairwise
from pathlib import Path

import pytest

import raytracer as rt
from raytracer.formats.value_table import read_value_table
from raytracer.formats.value_texts import MAX_VALUES, Value, parse_value, parse_values, value_text


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1,4,16", [1, 4, 16]),
        ("0.5, -.5, +1e-3", [0.5, -0.5, 0.001]),
        ("ggx,beckmann", ["ggx", "beckmann"]),
        ("[4,7,4],[0,7.5,4]", [(4, 7, 4), (0, 7.5, 4)]),
        ("0:1:5", [0, 0.25, 0.5, 0.75, 1]),
        ("1:-1:3", [1, 0, -1]),
        ("3:9:1", [3]),
        ("1:64:7:log", [1, 2, 4, 8, 16, 32, 64]),
        ("[4,7,4]:[-4,7,4]:3", [(4, 7, 4), (0, 7, 4), (-4, 7, 4)]),
        ("[1,100]:[4,1]:3:log", [(1, 100), (2, 10), (4, 1)]),
        ("0,1:2:2,none", [0, 1, 2, "none"]),
        ("one:two", ["one:two"]),
    ],
)
def test_a_list_has_the_values_of_its_items_and_ranges(text: str, values: list[Value]) -> None:
    assert parse_values(text) == values


@pytest.mark.parametrize(("ends", "suffix"), [((0.1, 0.7), ""), ((1e-3, 0.3), ":log"), ((1e-12, 7.7e11), ":log")])
def test_a_range_has_exact_ends_and_equal_steps(ends: tuple[float, float], suffix: str) -> None:
    values = [value for value in parse_values(f"{ends[0]!r}:{ends[1]!r}:11{suffix}") if isinstance(value, int | float)]
    assert (values[0], values[-1]) == ends and len(values) == 11
    steps = [math.log(b / a) if suffix else b - a for a, b in pairwise(values)]
    assert max(steps) - min(steps) < 1e-11 * max(map(abs, steps))


def test_whole_numbers_of_a_range_are_ints_as_numbers_of_samples_must_be() -> None:
    values = [*parse_values("1:4096:13:log"), *parse_values("0:1:3")]
    assert [type(value) for value in values] == [int] * 14 + [float] + [int]


@pytest.mark.parametrize("value", [0, -7, 0.1, 1e300, (4, 0.1, -4), "a - b", "ggx"])
def test_a_value_is_read_from_its_own_text(value: Value) -> None:
    again = parse_value(value_text(value))
    assert again == value and type(again) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected values, got nothing"),
        ("1,,2", "expected a value, got nothing"),
        ("1,", "expected a value, got nothing"),
        ("[1,2", "expected a vector such as [4,7,4], got '[1,2'"),
        ("[1,x]", "expected a vector"),
        ("[]", "expected a vector"),
        ("1:2", "expected a range from:to:n or from:to:n:log, got '1:2'"),
        ("1:2:3:lin", "expected a range"),
        ("1:2:0", "with a whole number n in [1, 100000], got n = '0'"),
        ("1:2:2.5", "got n = '2.5'"),
        ("1:2:100001", "got n = '100001'"),
        ("0:1:3:log", "expected ends above 0 of a range with log, got '0:1:3:log'"),
        ("[1,2]:3:3", "expected two numbers or two vectors as the ends of a range"),
        ("[1,2]:[1,2,3]:3", "expected two numbers or two vectors"),
        ("1:x:3", "expected two numbers or two vectors"),
        ("-1e308:1e308:3", "expected ends whose difference is a finite number"),
        ("1:1e999:3", "expected finite numbers"),
        ("0:1:100000,2", f"expected at most {MAX_VALUES} values"),
    ],
)
def test_a_wrong_list_is_refused_in_one_line(text: str, message: str) -> None:
    with pytest.raises(rt.InputError) as caught:
        parse_values(text)
    assert message in str(caught.value)


def test_a_table_returns_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    rows = [{"lights.0.position": (4, 7.25, 4), "materials.'a, b'.model": "ggx", "settings.samples": n} for n in (1, 4)]
    with path.open("w", newline="", encoding="utf-8-sig") as file:
        writer = csv.writer(file)
        writer.writerow(rows[0])
        writer.writerows([value_text(value) for value in row.values()] for row in rows)
        file.write("\r\n")
    assert read_value_table(path) == rows


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "values.csv:1: expected a header of 1 to 64 paths, got 0"),
        (b"lights.0.radius\n", "values.csv:1: expected a row of values"),
        (b"lights.0.radius,lights.0.radius\n1,2\n", "values.csv:1: expected different paths"),
        (b"lights..radius\n1\n", "values.csv:1: expected a path such as"),
        (b"a,b\n1\n", "values.csv:2: expected 2 values, got 1"),
        (b"a,b\n1,2\n\n1,[2\n", "values.csv:4: b: expected a vector"),
        (b'a\n1\n"\n', "values.csv:3: expected CSV: unexpected end of data"),
        (b"a\n\xff\n", "values.csv: expected UTF-8 text"),
        (b"a\n" + b"1\n" * (MAX_VALUES + 1), f"values.csv:{MAX_VALUES + 2}: expected at most {MAX_VALUES} rows"),
    ],
)
def test_a_wrong_table_is_refused_with_its_line(data: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    path.write_bytes(data)
    with pytest.raises(rt.InputError) as caught:
        read_value_table(path)
    assert message in str(caught.value) and "\n" not in str(caught.value)
