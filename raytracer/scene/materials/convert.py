"""Conversion of a material to another reflectance model, as closely as that model allows, for the setting `shading`.

Parameters that mean the same in both models are kept. Colours and the width of the highlight are converted by their
meaning, and clamped to the ranges of the other model.
"""

from __future__ import annotations

import math
from typing import Any

from raytracer.core.validation import MAX_EXPONENT, InputError, Vec3
from raytracer.core.vectors import add, scale_by
from raytracer.scene.materials.lobe import Lobe
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# The parameters that hold the diffuse and the specular colour, in order of precedence.
_DIFFUSE, _SPECULAR = ("kd", "rho", "color"), ("ks", "f0")
_BLACK = (0.0, 0.0, 0.0)
# Models whose diffuse part has no 1/pi.
WITHOUT_PI = ("phong", "blinn", "strauss")


def convert_material(material: Material, model: str) -> Material:
    """Convert a material to another reflectance model.

    From "phong" to "blinn" the exponent h is multiplied by 4, as in the lecture: then the highlights have the same
    size. Raises InputError if 4 h exceeds 1e6.
    """
    if material.model == model:
        return material
    h = _exponent(material)
    if model == "blinn" and material.model == "phong" and 4.0 * h > MAX_EXPONENT:
        expected = f"exponents h of at most {MAX_EXPONENT / 4:g}, which blinn takes times 4"
        raise InputError(f"expected {expected}, got {h:g}", "shading")
    meant = {**_colors(material, model), **_widths(model, h), **_shared(material, model)}
    if model == "lafortune":
        meant["lobes"] = (Lobe((-1.0,) * 3, (1.0,) * 3, (h,) * 3, (-1.0,) * 3, _colors(material, "phong")["ks"]),)
    known = MODELS[model].parameters
    meant = {name: parameter.default for name, parameter in known.items() if parameter.kind == "choice"} | meant
    parameters: dict[str, Any] = {}
    for name, parameter in known.items():
        value = meant.get(name)
        if value is None or (parameter.when and meant[parameter.when[0]] != parameter.when[1]):
            continue  # the parameter keeps its default, or belongs to a choice that is not in effect
        match parameter.kind:
            case "color":
                parameters[name] = tuple(min(max(part, parameter.low), parameter.high) for part in value)
            case "number":
                parameters[name] = min(max(value, parameter.low), parameter.high)
            case _:
                parameters[name] = value
    return Material(model, name=material.name, **parameters)


def _shared(material: Material, model: str) -> dict[str, Any]:
    """Return the parameters that mean the same in both models."""
    own, other = MODELS[material.model].parameters, MODELS[model].parameters
    shared = {n: v for n, v in material.parameters.items() if n in other and own[n].member == other[n].member}
    if material.model.startswith("blinn") != model.startswith("blinn"):
        shared.pop("h", None)
    # Colours must be converted if the models have different colour parameters, or if one has the factor 1/pi.
    differing = {*_DIFFUSE, *_SPECULAR} & (own.keys() ^ other.keys())
    if differing or (material.model in WITHOUT_PI) != (model in WITHOUT_PI):
        return {n: v for n, v in shared.items() if n not in (*_DIFFUSE, *_SPECULAR)}
    return shared


def _colors(material: Material, model: str) -> dict[str, Any]:
    """Return values for all diffuse and specular colour parameters that `model` may have."""
    wanted = MODELS[model].parameters.keys()
    diffuse, specular = _reflected(material)
    # The lecture's diffuse factor is an albedo divided by pi. Other models limit the albedo to 1: clamp the brightness.
    if material.model in WITHOUT_PI and model not in WITHOUT_PI:
        diffuse = scale_by(diffuse, min(math.pi, 1.0 / max(*diffuse, 1.0 / math.pi)))
    elif model in WITHOUT_PI and material.model not in WITHOUT_PI:
        diffuse = scale_by(diffuse, 1.0 / math.pi)
    if not wanted & {*_DIFFUSE}:
        # The model has mirror facets only. A diffuse material without facets gives them its diffuse colour.
        specular = specular if "fresnel" in material.parameters or not any(diffuse) else diffuse
    elif not wanted & {*_SPECULAR}:
        diffuse = diffuse if any(diffuse) else specular
    colors = dict.fromkeys(_DIFFUSE, diffuse) | dict.fromkeys(_SPECULAR, specular)
    # In a model with both f0 and ks, ks scales the reflectance: leave it at 1.
    return colors | ({"ks": (1.0, 1.0, 1.0)} if wanted >= {*_SPECULAR} else {})


def _reflected(material: Material) -> tuple[Vec3, Vec3]:
    """Return a material's diffuse colour, and its specular colour or reflectance at normal incidence."""
    if table := material.get("file"):
        from statistics import median  # imported here, because it takes long

        r, g, b = (math.pi * float(median(table.values[..., k].ravel()[::1001])) for k in range(3))
        return (r, g, b), _BLACK
    diffuse = next((c for n in _DIFFUSE if (c := material.get(n))), _BLACK)
    specular = normal_reflectance(material)
    if lobes := material.get("lobes"):
        specular = lobes[0].scale
    elif specular is None:
        specular = material.get("ks", _BLACK)
    elif ks := material.get("ks"):
        specular = _product(specular, ks)
    metalness = material.get("metalness", 0.0) if material.model == "split" else 0.0
    specular = add(scale_by(specular, 1.0 - metalness), scale_by(diffuse, metalness))
    return scale_by(diffuse, 1.0 - metalness), specular


def normal_reflectance(material: Material) -> Vec3 | None:
    """Return the Fresnel reflectance of a material at normal incidence, or None if the model has no Fresnel factor."""
    if (ior := material.get("ior")) is not None:
        return (((ior - 1.0) / (ior + 1.0)) ** 2,) * 3
    if (n := material.get("n")) is not None:
        r, g, b = (((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2) for n, k in zip(n, material.k, strict=True))
        return r, g, b
    return material.get("f0")


def _product(a: Vec3, b: Vec3) -> Vec3:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _exponent(material: Material) -> float:
    """Return Phong's exponent for a highlight as wide as the material's, or Phong's default without a highlight."""
    if (h := material.get("h")) is not None:
        return h / 4.0 if material.model.startswith("blinn") else h
    if (alpha := material.get("alpha", material.get("m"))) is not None:
        return max(0.0, (2.0 / alpha**2 - 2.0) / 4.0)
    if (smoothness := material.get("smoothness")) is not None:
        return 3.0 / (1.0 - smoothness)
    if lobes := material.get("lobes"):
        return lobes[0].n[1]
    return MODELS["phong"].parameters["h"].default


def _widths(model: str, h: float) -> dict[str, float]:
    """Return the highlight's width, for Phong's exponent h, in each model's parameters (alpha: Walter et al. 2007)."""
    alpha = math.sqrt(2.0 / (4.0 * h + 2.0))
    return {
        "h": 4.0 * h if model.startswith("blinn") else h,
        "alpha": alpha,
        "m": alpha,
        "smoothness": 1.0 - 3.0 / h if h > 3.0 else 0.0,
    }
