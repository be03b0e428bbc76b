"""A material as another model would have it, for the shading override: as like as that model can be made.

Parameters that both models have stay. Of the others a model's colours, and the width of its highlight, become the
other model's, by their meaning, within the ranges of the other model.
"""

from __future__ import annotations

import math
from typing import Any

from raytracer.core.validation import MAX_EXPONENT, InputError, Vec3
from raytracer.core.vectors import add, scaled
from raytracer.scene.materials.lobe import Lobe
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# The names of diffuse and of specular factors: the first that a material has counts.
_DIFFUSE, _SPECULAR = ("kd", "rho", "color"), ("ks", "f0")
_BLACK = (0.0, 0.0, 0.0)
# Models whose diffuse part has no 1/pi.
WITHOUT_PI = ("phong", "blinn", "strauss")


def translated(material: Material, model: str) -> Material:
    """`material` as the `model` has it.

    Between "phong" and "blinn" as in the lecture: Blinn's highlight with 4 h has the size of Phong's with h. Raises
    InputError where 4 h is above 1e6.
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
            continue  # also not what belongs to another choice than the one that stays
        match parameter.kind:
            case "color":
                parameters[name] = tuple(min(max(part, parameter.low), parameter.high) for part in value)
            case "number":
                parameters[name] = min(max(value, parameter.low), parameter.high)
            case _:
                parameters[name] = value
    return Material(model, name=material.name, **parameters)


def _shared(material: Material, model: str) -> dict[str, Any]:
    """The parameters that mean the same in both models."""
    own, other = MODELS[material.model].parameters, MODELS[model].parameters
    same = {n: v for n, v in material.parameters.items() if n in other and own[n].member == other[n].member}
    if material.model.startswith("blinn") != model.startswith("blinn"):
        same.pop("h", None)
    # Colours are shared out anew where one of the models has others, or means others.
    others = {*_DIFFUSE, *_SPECULAR} & (own.keys() ^ other.keys())
    if others or (material.model in WITHOUT_PI) != (model in WITHOUT_PI):
        return {n: v for n, v in same.items() if n not in (*_DIFFUSE, *_SPECULAR)}
    return same


def _colors(material: Material, model: str) -> dict[str, Any]:
    """The colours that say how much is reflected diffusely, and as a highlight, for a model that has some of these."""
    wanted = MODELS[model].parameters.keys()
    diffuse, specular = _reflected(material)
    # The lecture's diffuse factor is an albedo over pi, which others may not have above 1: then as bright as can be.
    if material.model in WITHOUT_PI and model not in WITHOUT_PI:
        diffuse = scaled(diffuse, min(math.pi, 1.0 / max(*diffuse, 1.0 / math.pi)))
    elif model in WITHOUT_PI and material.model not in WITHOUT_PI:
        diffuse = scaled(diffuse, 1.0 / math.pi)
    if not wanted & {*_DIFFUSE}:
        # A model of mirror facets only: of what has no such facets itself, they get the whole colour.
        specular = specular if "fresnel" in material.parameters or not any(diffuse) else diffuse
    elif not wanted & {*_SPECULAR}:
        diffuse = diffuse if any(diffuse) else specular
    colors = dict.fromkeys(_DIFFUSE, diffuse) | dict.fromkeys(_SPECULAR, specular)
    # Where both are there, ks scales what f0 reflects.
    return colors | ({"ks": (1.0, 1.0, 1.0)} if wanted >= {*_SPECULAR} else {})


def _reflected(material: Material) -> tuple[Vec3, Vec3]:
    """A material's diffuse colour, and its reflectance as a mirror or highlight at normal incidence."""
    if table := material.get("file"):
        from statistics import median  # takes long to import

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
    specular = add(scaled(specular, 1.0 - metalness), scaled(diffuse, metalness))
    return scaled(diffuse, 1.0 - metalness), specular


def normal_reflectance(material: Material) -> Vec3 | None:
    """The Fresnel factor of a material at normal incidence; None of a model without one."""
    if (ior := material.get("ior")) is not None:
        return (((ior - 1.0) / (ior + 1.0)) ** 2,) * 3
    if (n := material.get("n")) is not None:
        r, g, b = (((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2) for n, k in zip(n, material.k, strict=True))
        return r, g, b
    return material.get("f0")


def _product(a: Vec3, b: Vec3) -> Vec3:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _exponent(material: Material) -> float:
    """Phong's exponent for a highlight of the size of this material's; the default's if it has none."""
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
    """The parameters that say how wide a highlight is, for Phong's exponent; by Walter (2007) for microfacets."""
    alpha = math.sqrt(2.0 / (4.0 * h + 2.0))
    return {
        "h": 4.0 * h if model.startswith("blinn") else h,
        "alpha": alpha,
        "m": alpha,
        "smoothness": 1.0 - 3.0 / h if h > 3.0 else 0.0,
    }
