"""The parameters with which each model is measured: its defaults, both ends of all ranges, and some combinations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS, Parameter

# Parameters by name. In an expectation, (low, high) matches all numbers between them. One number may stand for a colour
# of three equal numbers.
Parameters = Mapping[str, Any]

# Parameters that are not varied: they are no part of f (ka, le), or only rotate it (tangent).
NOT_IN_F = ("ka", "le", "tangent")
# Informative combinations of parameters, besides the ends of each range.
COMBINATIONS: dict[str, tuple[Parameters, ...]] = {
    "phong": ({"kd": 0.3, "ks": 0.0},),
    "blinn": ({"kd": 0.3, "ks": 0.0},),
    "minnaert": ({"k": 1.0}, {"k": 2.0, "rho": 1.0}),
    "phong_normalized": tuple({"kd": 0.0, "ks": 1.0, "h": h} for h in (0.0, 1.0, 10.0, 100.0, 1e6)),
    "blinn_normalized": tuple({"kd": 0.0, "ks": 1.0, "h": h} for h in (0.0, 1.0, 10.0, 100.0, 1e6)),
    "oren_nayar": (
        {"rho": 1.0, "sigma": 17.189},
        {"rho": 1.0, "form": "short", "sigma": 11.459},
        {"form": "short", "sigma": 90.0},
    ),
    "diffuse_microfacet": ({"alpha": 1.0, "rho": 1.0},),
    "eon": ({"rho": 1.0, "roughness": 1.0}, {"rho": 1.0, "roughness": 0.1}),
    "torrance_sparrow": ({"m": 1e-3}, {"f0": 1.0, "m": 0.1}),
    "cook_torrance": ({"m": 1e-3}, {"f0": 1.0, "m": 0.1}),
    "ggx": (
        *({"f0": 1.0, "alpha": alpha} for alpha in (1e-3, 0.1, 0.5, 1.0)),
        {"f0": 1.0, "alpha": 1.0, "masking": "separable"},
    ),
    "beckmann": (
        *({"f0": 1.0, "alpha": alpha} for alpha in (1e-3, 0.1, 1.0)),
        {"f0": 1.0, "alpha": 1.0, "smith": "rational"},
    ),
    "split": ({"alpha": 1e-3}, {"distribution": "beckmann", "alpha": 0.1}),
}


def tried_parameters(model: str) -> list[Parameters]:
    """Return the model's defaults, both ends of each parameter's range, one at a time, and its combinations."""
    tried: list[Parameters] = [{}]
    for name, parameter in MODELS[model].parameters.items():
        if name in NOT_IN_F:
            continue
        condition = dict([parameter.when]) if parameter.when else {}
        tried += [{**condition, name: end} for end in _ends(parameter)]
    tried += COMBINATIONS.get(model, ())
    materials = [Material(model, **parameters) for parameters in tried]
    return [s for i, s in enumerate(tried) if materials[i] not in materials[:i]]


def _ends(parameter: Parameter) -> Sequence[Any]:
    match parameter.kind:
        case "choice":
            return parameter.choices
        case "lobes":
            return [()]
        case "whole":
            return [int(parameter.low), int(parameter.high)]
        case "number" | "color":
            return [parameter.low, parameter.high]
        case _:
            return []
