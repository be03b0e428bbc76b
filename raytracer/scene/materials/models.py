"""The reflectance models: one table of what each takes, in what range, in what unit, and whose it is.

This table decides the parameters of a material for all others: `Material`, scene files, their JSON Schema, the
shaders' struct Material, `raytracer brdf` and its documentation. The formulas are in `shaders/brdf/`, one file a
model, and once more, in float64, in `reflectance.py`.

A name means the same in all models that have it: `rho` is an albedo, `f0` a reflectance at normal incidence.
"""

from __future__ import annotations

import math
from typing import Any, Literal, cast

import msgspec

from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT
from raytracer.scene.materials.lobe import Lobe

# The unit of colours that are shares of light: above 1 more is reflected than comes in.
REFLECTED = "linear RGB"

Kind = Literal["number", "whole", "color", "direction", "choice", "lobes", "measured"]


class Parameter(msgspec.Struct, frozen=True):
    """One parameter of a model: a number or colour is in [`low`, `high`]; a choice is one of `choices`."""

    name: str
    kind: Kind
    default: Any
    meaning: str
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    source: str = ""
    # The names of a choice. If they stand for numbers (`values`), the shader has the number, else a function for each.
    choices: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    # Only where another parameter has this value: ("fresnel", "conductor").
    when: tuple[str, str] | None = None
    # The name in struct Material, where another model has another parameter of the same name.
    member: str = ""


class Model(msgspec.Struct, frozen=True):
    """A reflectance model: a description, its source, and its parameters by name."""

    about: str
    source: str
    parameters: dict[str, Parameter]
    # Whether part of it reflects to one direction only, for which there are reflection rays.
    mirrors: bool = False


def _color(name: str, default: float, meaning: str, high: float = 1.0, **more: Any) -> Parameter:
    return Parameter(name, "color", (default,) * 3, meaning, high=high, **more)


def _number(name: str, default: float, low: float, high: float, meaning: str, **more: Any) -> Parameter:
    return Parameter(name, "number", default, meaning, low, high, **more)


def _choice(name: str, meaning: str, *choices: str, **more: Any) -> Parameter:
    return Parameter(name, "choice", choices[0], meaning, choices=choices, **more)


def _model(about: str, source: str, *parameters: Parameter, ka: float = 0.0, mirrors: bool = False) -> Model:
    common = (
        _color("ka", ka, "ambient factor: sends back ka Ia", MAX_COLOR, unit=REFLECTED),
        *parameters,
        _color("le", 0.0, "emission Le: what it sends of itself, in all directions", MAX_COLOR, unit="radiance"),
    )
    return Model(about, source, {p.name: p for p in common}, mirrors)


_RHO = _color("rho", 0.8, "albedo", unit=REFLECTED)
_ALPHA = _number(
    "alpha", 0.3, 1e-4, 1.0, "roughness of the microfacets: the width of their slopes", source="Walter 2007"
)
_H = _number("h", 32.0, 0.0, MAX_EXPONENT, "exponent of the highlight")
_LECTURE = (
    _color("kd", 0.8, "diffuse factor", MAX_COLOR, unit=REFLECTED),
    _color("ks", 0.5, "specular factor", MAX_COLOR, unit=REFLECTED),
    _H,
)
_NORMALIZED = (
    _color("kd", 0.5, "albedo of the diffuse part", unit=REFLECTED),
    _color("ks", 0.5, "albedo of the specular part at normal incidence", unit=REFLECTED),
    _H,
)
_MASKING = _choice(
    "masking",
    "microfacets hidden from the light and from the viewer: together by their height, or each for itself",
    "correlated",
    "separable",
    source="Smith 1967; Heitz 2014",
)
_SMITH = _choice(
    "smith",
    "masking of Beckmann's facets: as it is, or by the rational fit in common use, 0.35 % off",
    "exact",
    "rational",
    source="Smith 1967; Walter 2007",
)
_DISTRIBUTION = _choice("distribution", "of the microfacets' normals", "ggx", "beckmann")


def _fresnel(f0: float) -> tuple[Parameter, ...]:
    """A Fresnel factor in one of three forms."""
    return (
        _choice("fresnel", "how much a facet reflects, by the angle", "schlick", "dielectric", "conductor"),
        _color("f0", f0, "reflectance at normal incidence", when=("fresnel", "schlick"), source="Schlick 1994"),
        _number("ior", 1.5, 0.1, 10.0, "index of refraction, over that outside", when=("fresnel", "dielectric")),
        # Gold at 650, 550 and 450 nm (Johnson and Christy 1972).
        Parameter(
            "n", "color", (0.156, 0.424, 1.383), "real part of the index", 0.0, 100.0, when=("fresnel", "conductor")
        ),
        Parameter(
            "k",
            "color",
            (3.602, 2.472, 1.915),
            "imaginary part of the index",
            0.0,
            100.0,
            when=("fresnel", "conductor"),
            member="extinction",
        ),
    )


def _v_cavity(m: str) -> tuple[Parameter, ...]:
    """The parameters of models with V-shaped cavities."""
    return (
        _color("rho", 0.0, "albedo of a diffuse part", unit=REFLECTED),
        _color("ks", 1.0, "scales all but that", unit=REFLECTED),
        _number("m", 0.3, 1e-4, 3.0, m),
        *_fresnel(0.8),
        _choice(
            "constant",
            "of D F G / (N.L N.V): 1/4, or as others have it: 1/pi or 1",
            "modern",
            "cook",
            "unnormalized",
            values=(0.25, 1.0 / math.pi, 1.0),
            source="1/4: Walter 2007",
        ),
    )


MODELS: dict[str, Model] = {
    "phong": _model("the lecture's: kd N.L + ks (R.V)^h", "Phong 1975", *_LECTURE, ka=0.1),
    "blinn": _model("the lecture's: kd N.L + ks (N.H)^h", "Blinn 1977", *_LECTURE, ka=0.1),
    "lambert": _model("diffuse: the same radiance in all directions", "Lambert 1760", _RHO),
    "minnaert": _model(
        "the moon's: darker, or brighter, towards its edge",
        "Minnaert 1941",
        _RHO,
        _number("k", 0.5, 0.0, 100.0, "1 is Lambert; below, brighter at grazing angles", member="darkening"),
    ),
    "phong_normalized": _model(
        "Lambert and a lobe around the mirror direction of albedo ks", "Lafortune and Willems 1994", *_NORMALIZED
    ),
    "blinn_normalized": _model(
        "Lambert and a lobe around the halfway vector of albedo ks", "Blinn 1977; Giesen 2009", *_NORMALIZED
    ),
    "strauss": _model(
        "from plastic to metal by five intuitive numbers",
        "Strauss 1990",
        _color("color", 0.7, "colour", unit=REFLECTED),
        # Its exponent is 3 / (1 - smoothness).
        _number("smoothness", 0.7, 0.0, 1.0 - 3.0 / MAX_EXPONENT, "0 diffuse, near 1 a mirror"),
        _number("metalness", 0.3, 0.0, 1.0, "0 dielectric, 1 metal"),
        _number("transparency", 0.0, 0.0, 1.0, "share of the light that is not reflected"),
        _number("kf", 1.12, 1.0 + 1e-3, 10.0, "constant of F"),
        _number("kg", 1.01, 1.0 + 1e-3, 10.0, "constant of G"),
        _number("kj", 0.1, 0.0, 1.0, "how much grazing light is reflected beyond the rest"),
    ),
    "lafortune": _model(
        "Lambert and any number of generalised cosine lobes",
        "Lafortune et al. 1997",
        msgspec.structs.replace(_RHO, default=(0.2,) * 3),
        Parameter("lobes", "lobes", (Lobe((-1.0,) * 3, (1.0,) * 3, (20.0,) * 3, (-1.0,) * 3),), "the lobes"),
        Parameter(
            "tangent",
            "direction",
            (1.0, 0.0, 0.0),
            "towards where x of the lobes is, in the scene's axes; only its part in the surface counts",
        ),
    ),
    "oren_nayar": _model(
        "rough diffuse: V-shaped Lambertian facets",
        "Oren and Nayar 1994",
        _RHO,
        _number("sigma", 30.0, 0.0, 90.0, "standard deviation of the facets' slope angle", unit="degrees"),
        _choice("form", "with light between facets, or the short form without", "full", "short"),
    ),
    "eon": _model(
        "rough diffuse that keeps energy: after Oren, Nayar and Fujii",
        "Portsmouth, Kutz and Hill 2025",
        _RHO,
        _number("roughness", 0.5, 0.0, 1.0, "0 is Lambert"),
    ),
    "torrance_sparrow": _model(
        "mirror facets, Gaussian in their angle, in V-shaped cavities",
        "Torrance and Sparrow 1967",
        *_v_cavity("width of the facets' angles, in radians"),
        _number("c", 0.0, 0.0, 1e12, "height of the distribution; 0: 1 / (pi m^2), which is right for small m"),
    ),
    "cook_torrance": _model(
        "mirror facets, Beckmann's distribution, in V-shaped cavities",
        "Cook and Torrance 1982",
        *_v_cavity("root mean square of the facets' slopes"),
    ),
    "ggx": _model(
        "mirror facets, long-tailed", "Trowbridge and Reitz 1975; Walter 2007", _ALPHA, *_fresnel(0.8), _MASKING
    ),
    "beckmann": _model(
        "mirror facets, of a Gaussian rough surface",
        "Beckmann 1963; Walter 2007",
        _ALPHA,
        *_fresnel(0.8),
        _MASKING,
        _SMITH,
    ),
    "split": _model(
        "what a facet does not reflect is diffuse: (1 - F) Lambert + F D G / (4 N.L N.V)",
        "the cheat sheet; Karis 2013",
        _RHO,
        _number("metalness", 0.0, 0.0, 1.0, "a metal has no diffuse part, and rho is its f0"),
        _color("f0", 0.04, "reflectance at normal incidence of what is no metal"),
        _ALPHA,
        _DISTRIBUTION,
        _MASKING,
        msgspec.structs.replace(_SMITH, when=("distribution", "beckmann")),
    ),
    "diffuse_microfacet": _model(
        "Lambertian facets, by quadrature over their normals",
        "the article's equation xxiii; Heitz and Dupuy 2015",
        _RHO,
        _ALPHA,
        _DISTRIBUTION,
        _MASKING,
        msgspec.structs.replace(_SMITH, when=("distribution", "beckmann")),
        Parameter("nodes", "whole", 128, "of the quadrature, by 20 or more: more are slower and better", 40.0, 4096.0),
    ),
    "he": _model(
        "a rough surface by wave optics",
        "He, Torrance, Sillion and Greenberg 1991; Westin's errata",
        msgspec.structs.replace(_RHO, default=(0.0,) * 3, meaning="albedo of the uniform diffuse part"),
        _color("ks", 1.0, "scales all but that", unit=REFLECTED),
        _number("sigma0", 0.18, 0.0, 1e3, "root mean square of the height", unit="um"),
        _number("tau", 3.0, 1e-3, 1e6, "autocorrelation length", unit="um"),
        Parameter("wavelength", "color", (0.65, 0.55, 0.45), "of each channel", 0.1, 100.0, unit="um"),
        *_fresnel(0.8),
        Parameter("terms", "whole", 64, "of the sum: fewer are quicker; 32 are good to 1e-3", 16.0, 1024.0),
        mirrors=True,
    ),
    "mirror": _model("ideal mirror", "Whitted 1980", *_fresnel(0.9), mirrors=True),
    "merl": _model(
        "measured, isotropic, from a file in MERL's format",
        "Matusik et al. 2003",
        Parameter("file", "measured", None, "the .binary file, in the scene file's folder or below"),
    ),
}
# The models to which every material can be converted: those whose parameters all have defaults. "merl" needs a file.
# The names are written down for static types only: SHADINGS has them from the table, and a test compares the two.
Shading = Literal[
    "phong",
    "blinn",
    "lambert",
    "minnaert",
    "phong_normalized",
    "blinn_normalized",
    "strauss",
    "lafortune",
    "oren_nayar",
    "eon",
    "torrance_sparrow",
    "cook_torrance",
    "ggx",
    "beckmann",
    "split",
    "diffuse_microfacet",
    "he",
    "mirror",
]
SHADINGS: tuple[Shading, ...] = tuple(
    cast("Shading", name)
    for name, model in MODELS.items()
    if all(parameter.default is not None for parameter in model.parameters.values())
)
