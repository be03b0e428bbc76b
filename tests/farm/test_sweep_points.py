"""Points of sweeps: the product of values in order, tables, and values of NumPy."""

import itertools
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.farm.sweep_points import label_names, list_points, point_text, varied_paths


def test_a_product_has_all_combinations_and_its_first_path_changes_slowest() -> None:
    points = list_points({"lights.0.radius": [0, 1, 2], "materials.gold.model": ["ggx", "beckmann"]})
    assert [tuple(point.values()) for point in points] == [*itertools.product((0, 1, 2), ("ggx", "beckmann"))]


def test_a_table_keeps_its_order_and_its_repeated_rows() -> None:
    rows = [{"lights.0.radius": 2}, {"lights.0.radius": 1}, {"lights.0.radius": 2}]
    assert list_points(rows) == rows


def test_values_of_numpy_become_numbers_and_tuples() -> None:
    points = list_points({"lights.0.position": np.eye(3), "lights.0.radius": np.linspace(0, 1, 2)})
    assert points[1] == {"lights.0.position": (1.0, 0.0, 0.0), "lights.0.radius": 1.0}
    values = [*points[1].values()]
    assert type(values[1]) is float and isinstance(values[0], tuple) and type(values[0][0]) is float
    assert type(list_points({"settings.samples": np.array([4])})[0]["settings.samples"]) is int


def test_the_text_of_a_point_has_all_digits() -> None:
    assert point_text({"a.b": 0.1, "c": (1, 2.5), "d": "ggx"}) == "a.b = 0.1, c = [1,2.5], d = ggx"


def test_names_of_labels_are_short_and_different() -> None:
    paths = ["materials.gold.alpha", "materials.clay.alpha", "lights.0.position", "camera.position.1", "ambient"]
    names = ["gold.alpha", "clay.alpha", "position", "position.1", "ambient"]
    assert label_names(paths) == dict(zip(paths, names, strict=True))
    assert label_names(["lights.0.position", "lights.1.position"])["lights.1.position"] == "lights.1.position"


def test_a_path_with_one_value_is_not_varied() -> None:
    assert varied_paths([{"a": 1, "b": 1}, {"a": 1, "b": 2}]) == ["b"]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "values: expected a path with values, got none"),
        ([], "values: expected a mapping from paths to values"),
        (7, "values: expected a mapping"),
        ({"lights.0.radius": []}, 'values."lights.0.radius": expected 1 to 100000 values, got []'),
        ({"lights.0.radius": 1}, "expected 1 to 100000 values, got 1"),
        ({"lights.0.radius": [1, 1.0]}, "expected different values, got 1.0 twice"),
        ({"lights.0.radius": [{}]}, "expected a number, a text or a vector"),
        ({"lights.0.radius": [np.eye(3)]}, "expected a number, a text or a vector"),
        ({"lights..radius": [1]}, "expected a path such as"),
        ({"lights.0.position": [(0, 1, 2)], "lights.0.position.1": [3]}, "is inside the other"),
        ({"lights.0.radius": [1], "lights.'0'.radius": [2]}, "expected different paths"),
        ({"a.b": range(1000), "c.d": range(101)}, "expected at most 100000 pictures, got 1000 x 101 = 101000"),
        ([{"a": 1}, {"b": 1}], "values[1]: expected the paths of the first mapping (a), got b"),
        ([{"a": 1}, 2], "expected a mapping from paths to values, or 1 to 100000 mappings"),
    ],
)
def test_wrong_values_are_refused_in_one_line(values: Any, message: str) -> None:
    with pytest.raises(rt.InputError) as caught:
        list_points(values)
    assert message in str(caught.value) and "\n" not in str(caught.value)
