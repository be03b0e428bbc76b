"""JSON Schema (draft 2020-12) of the materials in scene files, made from the table of models.

Editors use it for checks and completion.
"""

from __future__ import annotations

from typing import Any

from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT
from raytracer.scene.materials.lobe import MAX_COEFFICIENT
from raytracer.scene.materials.material import MAX_LOBES
from raytracer.scene.materials.models import AMBIENT_SHARE, MODELS, Parameter

_DEFAULT_MODEL = "phong"


def materials_schema() -> dict[str, Any]:
    """Return the schema of the table `materials` of a scene file: materials of any model, by name."""
    models = {name: {"$ref": f"#/$defs/{name}"} for name in MODELS}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "materials of a scene file",
        "type": "object",
        "additionalProperties": {"$ref": "#/$defs/material"},
        "$defs": {
            "material": {
                "type": "object",
                "properties": {"model": {"enum": [*MODELS], "default": _DEFAULT_MODEL}},
                "allOf": [{"if": _has_model(name), "then": model} for name, model in models.items()],
            },
            **{name: _model(name) for name in MODELS},
        },
    }


def _has_model(name: str) -> dict[str, Any]:
    required = {} if name == _DEFAULT_MODEL else {"required": ["model"]}
    return {"properties": {"model": {"const": name}}, **required}


def _model(name: str) -> dict[str, Any]:
    model = MODELS[name]
    schema: dict[str, Any] = {
        "description": f"{model.about} ({model.source})",
        "type": "object",
        "properties": {"model": {"const": name}, **{p.name: _parameter(p) for p in model.parameters.values()}},
        "additionalProperties": False,
    }
    if needed := [p.name for p in model.parameters.values() if p.default is None]:
        schema["required"] = needed
    if conditions := {p.name: _condition(name, *p.when) for p in model.parameters.values() if p.when}:
        schema["dependentSchemas"] = conditions
    return schema


def _condition(model: str, choice: str, value: str) -> dict[str, Any]:
    """Return the condition that the parameter `choice` has a value, which may be its default."""
    is_default = MODELS[model].parameters[choice].default == value
    return {"properties": {choice: {"const": value}}, **({} if is_default else {"required": [choice]})}


def _parameter(p: Parameter) -> dict[str, Any]:
    text = p.meaning + (f", in {p.unit}" if p.unit else "") + (f" ({p.source})" if p.source else "")
    if p.diffuse:
        text += f"; default: {AMBIENT_SHARE:g} {p.diffuse}"
    described: dict[str, Any] = {"description": text}
    if p.kind not in ("lobes", "measured") and not p.diffuse:
        described["default"] = list(p.default) if isinstance(p.default, tuple) else p.default
    return described | _kind(p)


def _kind(p: Parameter) -> dict[str, Any]:
    match p.kind:
        case "number":
            return _number(p.low, p.high)
        case "whole":
            return {"type": "integer", "minimum": int(p.low), "maximum": int(p.high)}
        case "color":
            return _one_or_three_numbers(p.low, p.high)
        case "choice":
            return {"enum": [*p.choices]}
        case "direction":
            return {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        case "measured":
            return {"type": "string"}
        case "lobes":
            factor = _one_or_three_numbers(-MAX_COEFFICIENT, MAX_COEFFICIENT)
            lobe = {
                "type": "object",
                "properties": {
                    "cx": factor,
                    "cy": factor,
                    "cz": factor,
                    "n": _one_or_three_numbers(0.0, MAX_EXPONENT),
                    "scale": _one_or_three_numbers(0.0, MAX_COLOR),
                },
                "required": ["cx", "cz", "n"],
                "additionalProperties": False,
            }
            return {"type": "array", "items": lobe, "maxItems": MAX_LOBES}


def _number(low: float, high: float) -> dict[str, Any]:
    return {"type": "number", "minimum": low, "maximum": high}


def _one_or_three_numbers(low: float, high: float) -> dict[str, Any]:
    """Return the schema of three numbers, or one number for all three."""
    one = _number(low, high)
    return {"anyOf": [one, {"type": "array", "items": one, "minItems": 3, "maxItems": 3}]}
