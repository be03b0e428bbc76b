"""Frozen objects: replace() returns a copy with other values for some fields."""

import copy
import re
import sys
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from tests import scenes

BALL, FLOOR = rt.Sphere((0, 0, 0), 1), rt.Plane((0, 1, 0), 0)


FROZEN: list[tuple[Any, dict[str, Any]]] = [
    (BALL, {"radius": 2.0}),
    (FLOOR, {"offset": -1.0}),
    (BALL | FLOOR, {"a": FLOOR}),
    (~BALL, {"a": FLOOR}),
    (rt.Instances(BALL, [[0, 0, 0], [1, 1, 1]], [1, 2]), {"scales": [2, 3]}),
    (rt.PointLight((0, 0, 0), radius=0.5), {"position": (1.0, 2.0, 3.0), "falloff": "inverse_square"}),
    (rt.Camera((0, 0, 5), (0, 0, 0)), {"vertical_fov": 20.0}),
    (scenes.assignment(), {"camera": rt.Camera((0, 0, 5), (0, 0, 0)), "name": "other"}),
    (rt.Settings(samples=4, shadows="soft"), {"samples": 16, "bounces": 0}),
    (rt.Material("ggx", alpha=0.1), {"alpha": 0.2, "name": "rough"}),
    (rt.Lobe(1, 2, 3), {"n": 4}),
    (rt.Image(np.zeros((1, 2, 3), np.float32)), {"metadata": {"Title": "black"}}),
    (rt.compare(np.zeros((1, 1, 3)), np.ones((1, 1, 3))), {"threshold": 0.5}),
]


@pytest.mark.parametrize(("frozen", "changes"), FROZEN, ids=[type(frozen).__name__ for frozen, _ in FROZEN])
def test_replace_returns_a_changed_copy_of_a_frozen_object(frozen: Any, changes: dict[str, Any]) -> None:
    fields = frozen.parameters if isinstance(frozen, rt.Material) else {f: None for f in frozen.__struct_fields__}
    ways = [frozen.replace, frozen.__replace__]
    if sys.version_info >= (3, 13):
        ways.append(lambda **changes: copy.replace(frozen, **changes))  # pyright: ignore[reportAttributeAccessIssue]
    for replace in ways:
        changed = replace(**changes)
        assert type(changed) is type(frozen)
        for name in (*fields, *(["name"] if isinstance(frozen, rt.Material) else [])):
            expected = changes[name] if name in changes else getattr(frozen, name)
            np.testing.assert_array_equal(getattr(changed, name), expected)
        with pytest.raises(rt.InputError):
            replace(nonsense=1)
    if not isinstance(frozen, rt.Image):
        assert frozen.replace() == frozen != frozen.replace(**changes)


def test_replace_checks_its_values_and_suggests_a_name_for_a_misspelt_one() -> None:
    scene = scenes.assignment()
    cases: list[tuple[Any, dict[str, Any], str]] = [
        (scene, {"camra": scene.camera}, "unknown field `camra` of Scene (known: objects, lights, camera, "),
        (scene.camera, {"fov": 3}, "unknown field `fov` of Camera (known: position, look_at, up, vertical_fov, "),
        (rt.Settings(), {"sample": 3}, "unknown field `sample` of Settings "),
        (BALL, {"x": 3}, "unknown field `x` of Sphere (known: center, radius, material)"),
        (BALL, {"radius": -1}, "radius: expected"),
        (rt.Settings(max_error=0.1), {"adaptive": 0.1}, "adaptive: cannot be combined"),
        (scene, {"objects": []}, "objects: expected"),
    ]
    for object, changes, message in cases:
        with pytest.raises(rt.InputError, match=f"^{re.escape(message)}"):
            object.replace(**changes)
    for object, name, near in ((scene, "camra", "camera"), (scene.camera, "fov", "vertical_fov")):
        with pytest.raises(rt.InputError, match=rf'; did you mean "{near}"\?$') as error:
            object.replace(**{name: 3})
        assert error.value.keys == (name,)


def test_a_single_scale_of_instances_also_applies_to_other_positions() -> None:
    two = rt.Instances(BALL, [[0, 0, 0], [1, 1, 1]], 2)
    assert two.replace(positions=[[3, 3, 3]]) == rt.Instances(BALL, [[3, 3, 3]], 2)
    with pytest.raises(rt.InputError, match=r"^scales: expected one number, or 1"):
        rt.Instances(BALL, [[0, 0, 0], [1, 1, 1]], [1, 2]).replace(positions=[[3, 3, 3]])


def test_a_material_keeps_the_parameters_that_its_new_model_has_too() -> None:
    red = rt.Material("ggx", alpha=0.1, f0=0.5, le=0.25, name="red")
    assert red.replace(model="beckmann") == rt.Material("beckmann", alpha=0.1, f0=0.5, le=0.25, name="red")
    assert red.replace(model="lambert", rho=0.5) == rt.Material("lambert", rho=0.5, le=0.25, name="red")
    for model in ("none", None, []):
        with pytest.raises(rt.InputError, match=r"^model: expected one of"):
            red.replace(model=model)
