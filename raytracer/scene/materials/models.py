"""The table of the reflectance models, with the parameters, ranges, units and sources of each.

This table defines the parameters of materials everywhere: in `Material`, scene files, the JSON Schema of scene files,
the shaders' struct Material, `raytracer brdf` and docs/models.md. The formulas are in `shaders/brdf/`, one file per
model, and again, in float64, in `ground_truth/reflectance.py`.

A parameter name means the same in all models: `rho` is an albedo, `f0` a reflectance at normal incidence.
"""

from __future__ import annotations

import math
from typing import Any, Literal, cast

import msgspec

from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT
from raytracer.scene.materials.lobe import Lobe

# The unit of colours that are fractions of the incident light. A value above 1 reflects more light than comes in.
REFLECTED = "linear RGB"

Kind = Literal["number", "whole", "color", "direction", "choice", "lobes", "measured"]


class Parameter(msgspec.Struct, frozen=True):
    """A parameter of a model: a number or colour in [`low`, `high`], or a choice from `choices`, or another `kind`."""

    name: str
    kind: Kind
    default: Any
    meaning: str
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    source: str = ""
    # The names of a choice. With `values`, the shader gets the number for the name, else it has a function per name.
    choices: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    # The condition for the parameter to exist, as (other parameter, its value): ("fresnel", "conductor").
    when: tuple[str, str] | None = None
    # The name in the shaders' struct Material, if another model has a different parameter of the same name.
    member: str = ""


class Model(msgspec.Struct, frozen=True):
    """A reflectance model: a description, its source, and its parameters by name."""

    about: str
    source: str
    parameters: dict[str, Parameter]
    # Whether the model has an ideal mirror reflection, for which reflection rays are traced.
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
        _color("le", 0.0, "emission Le: radiance that the surface emits in all directions", MAX_COLOR, unit="radiance"),
    )
    return Model(about, source, {p.name: p for p in common}, mirrors)


_RHO = _color("rho", 0.8, "albedo", unit=REFLECTED)
_ALPHA = _number(
    "alpha", 0.3, 1e-4, 1.0, "roughness: the width of the distribution of microfacet slopes", source="Walter 2007"
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
    "masking of microfacets from the light and from the viewer: correlated by their height, or independent",
    "correlated",
    "separable",
    source="Smith 1967; Heitz 2014",
)
_SMITH = _choice(
    "smith",
    "Smith's masking function for Beckmann: exact, or the common rational approximation, with an error of 0.35 %",
    "exact",
    "rational",
    source="Smith 1967; Walter 2007",
)
_DISTRIBUTION = _choice("distribution", "distribution of the microfacet normals", "ggx", "beckmann")


def _fresnel(f0: float) -> tuple[Parameter, ...]:
    """Return the parameters of a Fresnel factor in one of three forms."""
    return (
        _choice("fresnel", "reflectance of a facet by the angle of incidence", "schlick", "dielectric", "conductor"),
        _color("f0", f0, "reflectance at normal incidence", when=("fresnel", "schlick"), source="Schlick 1994"),
        _number("ior", 1.5, 0.1, 10.0, "index of refraction relative to the outside", when=("fresnel", "dielectric")),
        # The defaults are gold at 650, 550 and 450 nm (Johnson and Christy 1972).
        Parameter(
            "n",
            "color",
            (0.156, 0.424, 1.383),
            "real part of the index of refraction",
            0.0,
            100.0,
            when=("fresnel", "conductor"),
        ),
        Parameter(
            "k",
            "color",
            (3.602, 2.472, 1.915),
            "imaginary part of the index of refraction",
            0.0,
            100.0,
            when=("fresnel", "conductor"),
            member="extinction",
        ),
    )


def _v_cavity(m: str) -> tuple[Parameter, ...]:
    """Return the parameters of models with V-shaped cavities; `m` describes their parameter m."""
    return (
        _color("rho", 0.0, "albedo of the diffuse part", unit=REFLECTED),
        _color("ks", 1.0, "factor of the specular part", unit=REFLECTED),
        _number("m", 0.3, 1e-4, 3.0, m),
        *_fresnel(0.8),
        _choice(
            "constant",
            "constant factor of D F G / (N.L N.V): 1/4, or 1/pi or 1 as in some publications",
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
        "a model of the moon: darker, or brighter, towards its edge",
        "Minnaert 1941",
        _RHO,
        _number("k", 0.5, 0.0, 100.0, "1 is Lambert; below, brighter at grazing angles", member="darkening"),
    ),
    "phong_normalized": _model(
        "Lambert and a lobe of albedo ks around the mirror direction", "Lafortune and Willems 1994", *_NORMALIZED
    ),
    "blinn_normalized": _model(
        "Lambert and a lobe of albedo ks around the halfway vector", "Blinn 1977; Giesen 2009", *_NORMALIZED
    ),
    "strauss": _model(
        "from plastic to metal by five intuitive numbers",
        "Strauss 1990",
        _color("color", 0.7, "colour", unit=REFLECTED),
        # The upper end keeps the exponent of the highlight, 3 / (1 - smoothness), within its limit.
        _number("smoothness", 0.7, 0.0, 1.0 - 3.0 / MAX_EXPONENT, "0 diffuse, near 1 a mirror"),
        _number("metalness", 0.3, 0.0, 1.0, "0 dielectric, 1 metal"),
        _number("transparency", 0.0, 0.0, 1.0, "fraction of the light that is not reflected"),
        _number("kf", 1.12, 1.0 + 1e-3, 10.0, "constant of the Fresnel function F"),
        _number("kg", 1.01, 1.0 + 1e-3, 10.0, "constant of the masking function G"),
        _number("kj", 0.1, 0.0, 1.0, "strength of the additional reflection at grazing angles"),
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
            "direction of the lobes' x axis in the scene's coordinates, projected into the surface",
        ),
    ),
    "oren_nayar": _model(
        "rough diffuse: V-shaped Lambertian facets",
        "Oren and Nayar 1994",
        _RHO,
        _number("sigma", 30.0, 0.0, 90.0, "standard deviation of the facets' slope angle", unit="degrees"),
        _choice("form", "with interreflection between facets, or without (short form)", "full", "short"),
    ),
    "eon": _model(
        "rough diffuse that conserves energy: after Oren, Nayar and Fujii",
        "Portsmouth, Kutz and Hill 2025",
        _RHO,
        _number("roughness", 0.5, 0.0, 1.0, "0 is Lambert"),
    ),
    "torrance_sparrow": _model(
        "mirror facets in V-shaped cavities, with Gaussian angles",
        "Torrance and Sparrow 1967",
        *_v_cavity("width of the distribution of the facets' angles, in radians"),
        _number(
            "c", 0.0, 0.0, 1e12, "height of the distribution; 0 stands for 1 / (pi m^2), which is right for small m"
        ),
    ),
    "cook_torrance": _model(
        "mirror facets in V-shaped cavities, with Beckmann's distribution",
        "Cook and Torrance 1982",
        *_v_cavity("root mean square of the facets' slopes"),
    ),
    "ggx": _model(
        "mirror facets, with a long-tailed distribution",
        "Trowbridge and Reitz 1975; Walter 2007",
        _ALPHA,
        *_fresnel(0.8),
        _MASKING,
    ),
    "beckmann": _model(
        "mirror facets of a Gaussian random surface",
        "Beckmann 1963; Walter 2007",
        _ALPHA,
        *_fresnel(0.8),
        _MASKING,
        _SMITH,
    ),
    "split": _model(
        "mirror facets, and diffuse reflection of the rest: (1 - F) Lambert + F D G / (4 N.L N.V)",
        "the cheat sheet; Karis 2013",
        _RHO,
        _number("metalness", 0.0, 0.0, 1.0, "0 dielectric, 1 metal, which has no diffuse part, and rho as its f0"),
        _color("f0", 0.04, "reflectance of the dielectric at normal incidence"),
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
        Parameter(
            "nodes",
            "whole",
            128,
            "quadrature nodes, in steps of 20 or more: more are slower and more accurate",
            40.0,
            4096.0,
        ),
    ),
    "he": _model(
        "a rough surface by wave optics",
        "He, Torrance, Sillion and Greenberg 1991; Westin's errata",
        msgspec.structs.replace(_RHO, default=(0.0,) * 3, meaning="albedo of the uniform diffuse part"),
        _color("ks", 1.0, "factor of all but the uniform diffuse part", unit=REFLECTED),
        _number("sigma0", 0.18, 0.0, 1e3, "root mean square of the height", unit="um"),
        _number("tau", 3.0, 1e-3, 1e6, "autocorrelation length", unit="um"),
        Parameter("wavelength", "color", (0.65, 0.55, 0.45), "wavelength of each channel", 0.1, 100.0, unit="um"),
        *_fresnel(0.8),
        Parameter("terms", "whole", 64, "terms of the sum: fewer are faster; 32 have an error of 1e-3", 16.0, 1024.0),
        mirrors=True,
    ),
    "mirror": _model("ideal mirror", "Whitted 1980", *_fresnel(0.9), mirrors=True),
    "merl": _model(
        "measured, isotropic, from a file in MERL's format",
        "Matusik et al. 2003",
        Parameter("file", "measured", None, "the .binary file, in the scene file's folder or below"),
    ),
}
# The models to which every material can be converted: all models whose parameters have defaults. "merl" needs a file.
# The list is for type checkers only. SHADINGS computes it from the table, and a test compares the two.
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
