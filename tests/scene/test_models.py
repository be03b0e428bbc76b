"""The table of models: it is consistent, and agrees with the shaders, the schema and docs/models.md."""

from __future__ import annotations

import json
import tomllib
from typing import Any

import pytest

from raytracer.analysis.reflectance.tables import models_markdown
from raytracer.app.cli import main
from raytracer.compiler.glsl.materials import FUNCTIONS
from raytracer.core.validation import InputError
from raytracer.formats.material_library import collections, read_collection
from raytracer.formats.material_schema import materials_schema
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from tests.scenes import CHECKOUT

PARAMETERS = [(name, parameter) for name, model in MODELS.items() for parameter in model.parameters.values()]


def test_each_model_and_each_choice_has_a_glsl_function() -> None:
    everything = "".join(path.read_text(encoding="utf-8") for path in (CHECKOUT / "shaders/brdf").glob("*.glsl"))
    for name in MODELS:
        text = (CHECKOUT / "shaders/brdf" / f"{name}.glsl").read_text(encoding="utf-8")
        assert f"vec3 {name}(Material m, vec3 N, vec3 L, vec3 V)" in text
        if MODELS[name].mirrors:
            assert f"vec3 {name}Mirrored(Material m, vec3 N, vec3 V)" in text
    for _, parameter in PARAMETERS:
        if parameter.kind == "choice" and not parameter.values:
            for option in parameter.choices:
                assert (CHECKOUT / "shaders/brdf" / f"{parameter.name}_{option}.glsl").is_file()
                for _, function, _ in FUNCTIONS[parameter.name]:
                    assert f" {option}{function[0].upper()}{function[1:]}(" in everything


def test_a_parameter_name_has_one_kind_in_all_models() -> None:
    kinds: dict[str, set[Any]] = {}
    for _, parameter in PARAMETERS:
        # "k" is an exponent in one model, and an index of refraction in other models: the member tells them apart.
        kinds.setdefault(parameter.member or parameter.name, set()).add((parameter.kind, parameter.values))
    assert {name: variants for name, variants in kinds.items() if len(variants) > 1} == {}


def test_parameters_have_their_names_as_keys() -> None:
    for model in MODELS.values():
        assert [*model.parameters] == [parameter.name for parameter in model.parameters.values()]


def test_defaults_equal_those_of_a_material() -> None:
    for name, parameter in PARAMETERS:
        if name != "merl":  # which needs a file as well
            condition: dict[str, Any] = dict([parameter.when]) if parameter.when else {}
            assert Material(name, **{**condition, parameter.name: parameter.default}) == Material(name, **condition)


def test_defaults_are_within_their_ranges_or_among_their_choices() -> None:
    for name, parameter in PARAMETERS:
        values = parameter.default if isinstance(parameter.default, tuple) else (parameter.default,)
        match parameter.kind:
            case "number" | "whole" | "color":
                assert all(parameter.low <= value <= parameter.high for value in values), (name, parameter.name)
            case "choice":
                assert parameter.default in parameter.choices
                assert not parameter.values or len(parameter.values) == len(parameter.choices)
        if parameter.when:
            assert parameter.when[1] in MODELS[name].parameters[parameter.when[0]].choices
        assert parameter.meaning


def test_values_outside_a_range_are_refused() -> None:
    for name, parameter in PARAMETERS:
        if parameter.kind in ("number", "whole", "color") and name != "merl":  # which needs a file as well
            condition: dict[str, Any] = dict([parameter.when]) if parameter.when else {}
            low: dict[str, Any] = {**condition, parameter.name: parameter.low}
            Material(name, **low)
            for wrong in (parameter.low - 1.0, parameter.high * 2.0 + 1.0):
                with pytest.raises(InputError, match=parameter.name):
                    Material(name, **{**low, parameter.name: wrong})


def test_the_schema_has_exactly_the_parameters_of_every_model() -> None:
    """Compare the schema's ranges and choices with the table, parameter by parameter."""
    schema = materials_schema()
    definitions = schema["$defs"]
    assert set(definitions) == {"material", *MODELS}
    assert definitions["material"]["properties"]["model"]["enum"] == [*MODELS]
    for name, model in MODELS.items():
        definition = definitions[name]
        assert (
            set(definition["properties"]) == {"model", *model.parameters}
            and definition["additionalProperties"] is False
        )
        for parameter in model.parameters.values():
            property_schema = definition["properties"][parameter.name]
            match parameter.kind:
                case "number" | "whole":
                    assert (property_schema["minimum"], property_schema["maximum"]) == (parameter.low, parameter.high)
                case "color":
                    assert (
                        property_schema["anyOf"][0] == property_schema["anyOf"][1]["items"]
                        and property_schema["anyOf"][1]["minItems"] == 3
                    )
                    assert property_schema["anyOf"][0]["maximum"] == parameter.high
                case "choice":
                    assert property_schema["enum"] == [*parameter.choices]
    json.dumps(schema, allow_nan=False)


GOOD = [
    {},
    {"kd": 0.5},
    {"model": "blinn", "h": 3},
    {"model": "ggx", "f0": [1, 0.5, 0]},
    {"model": "ggx", "fresnel": "schlick", "f0": 0.5},
    {"model": "ggx", "fresnel": "conductor", "n": [1, 2, 3]},
    {"model": "lafortune", "lobes": [{"cx": -1, "cz": [1, 1, 1], "n": 3}]},
    {"model": "diffuse_microfacet", "nodes": 64},
]
BAD = [
    {"rho": 1},
    {"model": "nope"},
    {"kd": [1, 2]},
    {"kd": "red"},
    {"model": "lambert", "kd": 0.1},
    {"model": "ggx", "alpha": 2},
    {"model": "ggx", "n": 1},
    {"model": "ggx", "fresnel": "conductor", "f0": 0.5},
    {"model": "ggx", "masking": "none"},
    {"model": "lafortune", "lobes": [{"cx": -1}]},
    {"model": "diffuse_microfacet", "nodes": 64.5},
    {"model": "merl"},
]


def test_the_schema_accepts_exactly_what_a_material_accepts() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = materials_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    valid = jsonschema.Draft202012Validator(schema).is_valid
    for table in GOOD:
        Material(**table)
        assert valid({"a": table}), table
    for table in BAD:
        with pytest.raises(InputError):
            Material(**table)
        assert not valid({"a": table}), table
    assert valid({"a": {"model": "merl", "file": "x.binary"}})


def test_the_schema_accepts_all_examples_and_published_materials() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validate = jsonschema.Draft202012Validator(materials_schema()).validate
    for path in (CHECKOUT / "assets/scenes").glob("*.toml"):
        validate(tomllib.loads(path.read_text(encoding="utf-8")).get("materials", {}))
    for collection in collections():
        validate(
            {
                name: {k: v for k, v in table.items() if k != "source"}
                for name, table in read_collection(collection).items()
            }
        )


def test_the_command_line_prints_the_schema_and_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["brdf", "list", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out) == materials_schema()
    assert main(["brdf", "list", "--markdown"]) == 0
    assert capsys.readouterr().out == models_markdown()


def test_docs_models_is_up_to_date() -> None:
    """Remedy: raytracer brdf list --markdown > docs/models.md"""
    assert (CHECKOUT / "docs/models.md").read_text(encoding="utf-8") == models_markdown()
