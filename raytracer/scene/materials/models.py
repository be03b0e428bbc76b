"""The table of reflectance models: the parameters of each model with their ranges, units, defaults and sources.

`Material`, scene files, their JSON Schema, the shaders' struct Material, `raytracer brdf` and docs/models.md all take
the parameters from this table. The formulas are in `shaders/brdf/`, one file per model, and a second time, in float64,
in `raytracer/ground_truth/reflectance.py`.

A parameter's name has the same meaning in every model: `rho` is an albedo, `f0` a reflectance at normal incidence.
"""

from __future__ import annotations

import math
from typing import Any, Literal, cast

import msgspec

from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT, Vec3
from raytracer.scene.materials.lobe import Lobe

# The unit of colours that are shares of light. A surface with a share above 1 reflects more light than it receives.
REFLECTED = "linear RGB"
# The default of `ka`, as a share of the diffuse colour. The assignment's materials have this share: of a surface colour
# c, their ka is 0.15 c and their kd 0.8 c, so that shadows keep the hue of the surface.
AMBIENT_SHARE = 0.15 / 0.8

Kind = Literal["number", "whole", "color", "direction", "choice", "lobes", "measured"]


class Parameter(msgspec.Struct, frozen=True):
    """A parameter of a model. Numbers and colours are in [`low`, `high`]; a choice is one of `choices`."""

    name: str
    kind: Kind
    default: Any
    meaning: str
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    source: str = ""
    # The names of a choice. With `values`, the shader reads a choice as a number; without, as a function's name.
    choices: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    # A condition: the material has this parameter only if another one has this value, as in ("fresnel", "conductor").
    when: tuple[str, str] | None = None
    # The name in struct Material, if another model uses this parameter's name with another meaning.
    member: str = ""
    # The colour of which the default is AMBIENT_SHARE. `default` then holds for the default of that colour.
    diffuse: str = ""

    def default_among(self, values: dict[str, Any]) -> Any:
        """Return the default in a material with the other parameters `values`."""
        return ambient_share(values[self.diffuse]) if self.diffuse else self.default


class Model(msgspec.Struct, frozen=True):
    """A reflectance model: a description, its source, and its parameters by name."""

    about: str
    source: str
    parameters: dict[str, Parameter]
    # True if the model reflects some light in the mirror direction only, which takes reflection rays.
    mirrors: bool = False


def ambient_share(diffuse: Vec3) -> Vec3:
    """Return AMBIENT_SHARE of a diffuse colour, rounded to 15 digits, so that 0.8 gives 0.15."""
    r, g, b = (float(f"{AMBIENT_SHARE * part:.15g}") for part in diffuse)
    return r, g, b


def _color(name: str, default: float, meaning: str, high: float = 1.0, **more: Any) -> Parameter:
    return Parameter(name, "color", (default,) * 3, meaning, high=high, **more)


def _number(name: str, default: float, low: float, high: float, meaning: str, **more: Any) -> Parameter:
    return Parameter(name, "number", default, meaning, low, high, **more)


def _choice(name: str, meaning: str, *choices: str, **more: Any) -> Parameter:
    return Parameter(name, "choice", choices[0], meaning, choices=choices, **more)


_KA = _color("ka", 0.0, "ambient factor: the surface reflects ka Ia", MAX_COLOR, unit=REFLECTED)
_LE = _color("le", 0.0, "emission Le: radiance that the surface emits in all directions", MAX_COLOR, unit="radiance")


def _model(about: str, source: str, *parameters: Parameter, ka: Parameter = _KA, mirrors: bool = False) -> Model:
    """Return a model with its own parameters and the two of all models, `ka` and `le`."""
    return Model(about, source, {p.name: p for p in (ka, *parameters, _LE)}, mirrors)


_RHO = _color("rho", 0.8, "albedo", unit=REFLECTED)
_ALPHA = _number(
    "alpha",
    0.3,
    1e-4,
    1.0,
    "roughness of the microfacets: the spread of their slopes",
    source="Walter et al. 2007",
)
_H = _number("h", 32.0, 0.0, MAX_EXPONENT, "exponent of the highlight")
_KD = _color("kd", 0.8, "diffuse factor", MAX_COLOR, unit=REFLECTED)
# Ambient light belongs to the lecture's models. The other models describe reflectance alone.
_LECTURE_KA = msgspec.structs.replace(_KA, default=ambient_share(_KD.default), diffuse="kd")
_LECTURE = (
    _KD,
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
    "share of microfacets hidden from light or viewer: one joint factor (correlated) or two independent ones",
    "correlated",
    "separable",
    source="Smith 1967; Heitz 2014",
)
_SMITH = _choice(
    "smith",
    "Smith's masking of Beckmann's facets: exact, or the rational fit in common use, which is 0.35 % off",
    "exact",
    "rational",
    source="Smith 1967; Walter et al. 2007",
)
_DISTRIBUTION = _choice("distribution", "distribution of the microfacets' normals", "ggx", "beckmann")


def _fresnel(f0: float) -> tuple[Parameter, ...]:
    """Return the parameters of a Fresnel factor in one of three forms."""
    return (
        _choice(
            "fresnel",
            "form of the Fresnel factor",
            "schlick",
            "dielectric",
            "conductor",
        ),
        _color("f0", f0, "reflectance at normal incidence", when=("fresnel", "schlick"), source="Schlick 1994"),
        _number("ior", 1.5, 0.1, 10.0, "index of refraction, relative to the outside", when=("fresnel", "dielectric")),
        # Gold at 650, 550 and 450 nm (Johnson and Christy 1972).
        Parameter(
            "n",
            "color",
            (0.156, 0.424, 1.383),
            "index of refraction, real part",
            0.0,
            100.0,
            when=("fresnel", "conductor"),
        ),
        Parameter(
            "k",
            "color",
            (3.602, 2.472, 1.915),
            "index of refraction, imaginary part",
            0.0,
            100.0,
            when=("fresnel", "conductor"),
            member="extinction",
        ),
    )


def _v_cavity(m: str) -> tuple[Parameter, ...]:
    """Return the parameters of models with V-shaped cavities; `m` is the meaning of the roughness m."""
    return (
        _color("rho", 0.0, "albedo of the diffuse part", unit=REFLECTED),
        _color("ks", 1.0, "scale of all but the diffuse part", unit=REFLECTED),
        _number("m", 0.3, 1e-4, 3.0, m),
        *_fresnel(0.8),
        _choice(
            "constant",
            "factor of D F G / (N.L N.V): 1/4 (modern), 1/pi (cook) or 1 (unnormalized)",
            "modern",
            "cook",
            "unnormalized",
            values=(0.25, 1.0 / math.pi, 1.0),
            source="1/4: Walter et al. 2007",
        ),
    )


MODELS: dict[str, Model] = {
    "phong": _model("the lecture's model: kd N.L + ks (R.V)^h", "Phong 1975", *_LECTURE, ka=_LECTURE_KA),
    "blinn": _model("the lecture's model: kd N.L + ks (N.H)^h", "Blinn 1977", *_LECTURE, ka=_LECTURE_KA),
    "lambert": _model("diffuse: the same radiance in all directions", "Lambert 1760", _RHO),
    "minnaert": _model(
        "diffuse, darker or brighter towards the edge, as the moon is",
        "Minnaert 1941",
        _RHO,
        _number("k", 0.5, 0.0, 100.0, "1: Lambert; below 1, brighter at grazing angles", member="darkening"),
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
        _number("smoothness", 0.7, 0.0, 1.0 - 3.0 / MAX_EXPONENT, "0: diffuse; near 1: a mirror"),
        _number("metalness", 0.3, 0.0, 1.0, "0: dielectric; 1: metal"),
        _number("transparency", 0.0, 0.0, 1.0, "share of the light that is not reflected"),
        _number("kf", 1.12, 1.0 + 1e-3, 10.0, "constant of F"),
        _number("kg", 1.01, 1.0 + 1e-3, 10.0, "constant of G"),
        _number("kj", 0.1, 0.0, 1.0, "additional reflectance at grazing angles"),
    ),
    "lafortune": _model(
        "Lambert and any number of generalised cosine lobes",
        "Lafortune et al. 1997",
        msgspec.structs.replace(_RHO, default=(0.2,) * 3),
        Parameter("lobes", "lobes", (Lobe((-1.0,) * 3, (1.0,) * 3, (20.0,) * 3, (-1.0,) * 3),), "list of lobes"),
        Parameter(
            "tangent",
            "direction",
            (1.0, 0.0, 0.0),
            "direction of the lobes' x axis, in scene axes; projected into the surface",
        ),
    ),
    "oren_nayar": _model(
        "rough diffuse: V-shaped Lambertian facets",
        "Oren and Nayar 1994",
        _RHO,
        _number("sigma", 30.0, 0.0, 90.0, "standard deviation of the facets' slope angle", unit="degrees"),
        _choice("form", "full: with light between facets; short: without", "full", "short"),
    ),
    "eon": _model(
        "energy-conserving rough diffuse: after Oren, Nayar and Fujii",
        "Portsmouth, Kutz and Hill 2025",
        _RHO,
        _number("roughness", 0.5, 0.0, 1.0, "0: Lambert"),
    ),
    "torrance_sparrow": _model(
        "mirror facets, Gaussian in their angle, in V-shaped cavities",
        "Torrance and Sparrow 1967",
        *_v_cavity("width of the distribution of the facets' angles, in radians"),
        _number("c", 0.0, 0.0, 1e12, "height of the distribution; 0: 1 / (pi m^2), which is correct for small m"),
    ),
    "cook_torrance": _model(
        "mirror facets, Beckmann's distribution, in V-shaped cavities",
        "Cook and Torrance 1982",
        *_v_cavity("root mean square of the facets' slopes"),
    ),
    "ggx": _model(
        "mirror facets, a long-tailed distribution",
        "Trowbridge and Reitz 1975; Walter et al. 2007",
        _ALPHA,
        *_fresnel(0.8),
        _MASKING,
    ),
    "beckmann": _model(
        "mirror facets of a Gaussian rough surface",
        "Beckmann and Spizzichino 1963; Walter et al. 2007",
        _ALPHA,
        *_fresnel(0.8),
        _MASKING,
        _SMITH,
    ),
    "split": _model(
        "light that facets do not reflect is diffuse: (1 - F) Lambert + F D G / (4 N.L N.V)",
        '"Physical based rendering cheat sheet"; Karis 2013',
        _RHO,
        _number("metalness", 0.0, 0.0, 1.0, "0: dielectric; 1: metal, without a diffuse part and with rho as its f0"),
        _color("f0", 0.04, "reflectance at normal incidence of the dielectric"),
        _ALPHA,
        _DISTRIBUTION,
        _MASKING,
        msgspec.structs.replace(_SMITH, when=("distribution", "beckmann")),
    ),
    "diffuse_microfacet": _model(
        "Lambertian facets, by quadrature over their normals",
        'equation (xxiii) of "Microfacet BRDFs from Scratch"; Heitz and Dupuy 2015',
        _RHO,
        _ALPHA,
        _DISTRIBUTION,
        _MASKING,
        msgspec.structs.replace(_SMITH, when=("distribution", "beckmann")),
        Parameter(
            "nodes",
            "whole",
            128,
            "quadrature nodes, in steps of at least 20: more are slower and more accurate",
            40.0,
            4096.0,
        ),
    ),
    "he": _model(
        "a rough surface by wave optics",
        "He, Torrance, Sillion and Greenberg 1991; Westin's implementation",
        msgspec.structs.replace(_RHO, default=(0.0,) * 3, meaning="albedo of the uniform diffuse part"),
        _color("ks", 1.0, "scale of all but the diffuse part", unit=REFLECTED),
        _number("sigma0", 0.18, 0.0, 1e3, "root mean square of the surface height", unit="um"),
        _number("tau", 3.0, 1e-3, 1e6, "autocorrelation length of the surface height", unit="um"),
        Parameter("wavelength", "color", (0.65, 0.55, 0.45), "wavelength of each channel", 0.1, 100.0, unit="um"),
        *_fresnel(0.8),
        Parameter("terms", "whole", 64, "terms of the sum: fewer are faster; 32 are accurate to 1e-3", 16.0, 1024.0),
        mirrors=True,
    ),
    "mirror": _model("ideal mirror", "Whitted 1980", *_fresnel(0.9), mirrors=True),
    "merl": _model(
        "measured isotropic reflectance, from a file in MERL's format",
        "Matusik et al. 2003",
        Parameter("file", "measured", None, "a .binary file, in the folder of the scene file or below"),
    ),
}
# The models to which every material can be converted: the models whose parameters all have defaults ("merl" needs a
# file). The names stand here for static types only; SHADINGS has the names of the table, and a test compares both.
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
