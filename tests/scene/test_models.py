"""The table of models: its facts agree with each other, with the shaders, with the schema and with the documents."""

from __future__ import annotations

import json
import tomllib
from typing import Any

import pytest

from raytracer.analysis.reflectance.tables import markdown
from raytracer.app.cli import main
from raytracer.compiler.glsl.materials import FUNCTIONS
from raytracer.core.validation import InputError
from raytracer.formats.material_library import collections, read_collection
from raytracer.formats.material_schema import materials_schema
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from tests.scenes import CHECKOUT

PARAMETERS = [(name, parameter) for name, model in MODELS.items() for parameter in model.parameters.values()]


def test_each_model_has_its_glsl_and_each_form_of_its_parts() -> None:
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


def test_a_name_has_one_kind_in_all_models() -> None:
    kinds: dict[str, set[Any]] = {}
    for _, parameter in PARAMETERS:
        # "k" is an exponent of one model, and an index of refraction of others.
        kinds.setdefault(parameter.member or parameter.name, set()).add((parameter.kind, parameter.values))
    assert {name: found for name, found in kinds.items() if len(found) > 1} == {}


def test_parameters_are_under_their_names() -> None:
    for model in MODELS.values():
        assert [*model.parameters] == [parameter.name for parameter in model.parameters.values()]


def test_defaults_are_what_a_material_takes() -> None:
    for name, parameter in PARAMETERS:
        if name != "merl":  # which needs a file besides
            condition: dict[str, Any] = dict([parameter.when]) if parameter.when else {}
            assert Material(name, **{**condition, parameter.name: parameter.default}) == Material(name, **condition)


def test_defaults_are_within_their_ranges_and_choices_among_theirs() -> None:
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


def test_what_is_out_of_a_range_is_refused() -> None:
    for name, parameter in PARAMETERS:
        if parameter.kind in ("number", "whole", "color") and name != "merl":  # which needs a file besides
            condition: dict[str, Any] = dict([parameter.when]) if parameter.when else {}
            low: dict[str, Any] = {**condition, parameter.name: parameter.low}
            Material(name, **low)
            for wrong in (parameter.low - 1.0, parameter.high * 2.0 + 1.0):
                with pytest.raises(InputError, match=parameter.name):
                    Material(name, **{**low, parameter.name: wrong})


def test_the_schema_has_every_model_with_just_its_parameters() -> None:
    """By hand: what the schema says of each parameter is what the table says."""
    schema = materials_schema()
    definitions = schema["$defs"]
    assert set(definitions) == {"material", *MODELS}
    assert definitions["material"]["properties"]["model"]["enum"] == [*MODELS]
    for name, model in MODELS.items():
        found = definitions[name]
        assert set(found["properties"]) == {"model", *model.parameters} and found["additionalProperties"] is False
        for parameter in model.parameters.values():
            of = found["properties"][parameter.name]
            match parameter.kind:
                case "number" | "whole":
                    assert (of["minimum"], of["maximum"]) == (parameter.low, parameter.high)
                case "color":
                    assert of["anyOf"][0] == of["anyOf"][1]["items"] and of["anyOf"][1]["minItems"] == 3
                    assert of["anyOf"][0]["maximum"] == parameter.high
                case "choice":
                    assert of["enum"] == [*parameter.choices]
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


def test_the_schema_takes_and_refuses_what_a_material_does() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = materials_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    valid = jsonschema.Draft202012Validator(schema).is_valid
    for given in GOOD:
        Material(**given)
        assert valid({"a": given}), given
    for given in BAD:
        with pytest.raises(InputError):
            Material(**given)
        assert not valid({"a": given}), given
    assert valid({"a": {"model": "merl", "file": "x.binary"}})


def test_the_schema_takes_all_examples_and_published_materials() -> None:
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


def test_the_schema_and_the_document_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["brdf", "list", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out) == materials_schema()
    assert main(["brdf", "list", "--markdown"]) == 0
    assert capsys.readouterr().out == markdown()


def test_docs_models_is_up_to_date() -> None:
    """If not: raytracer brdf list --markdown > docs/models.md"""
    assert (CHECKOUT / "docs/models.md").read_text(encoding="utf-8") == markdown()
