"""Expectations for each model, by theory: whether it is reciprocal and conserves energy, and its largest albedo.

They were written down before any measurement, from formulas and publications. If only a measurement could decide, `why`
says "measured". `verification.py` compares measurements with them, and `closed_forms.py` has closed forms of albedos.
"""

from __future__ import annotations

import math
from typing import Any

import msgspec

from raytracer.analysis.reflectance.tried_parameters import NOT_IN_F, Parameters, tried_parameters
from raytracer.scene.materials.material import Material


class Expectation(msgspec.Struct, frozen=True):
    """An expectation for a model with some parameters. If several expectations fit, the last one applies.

    An expectation holds for the parameters of `tried_parameters()`, for which it was derived or measured. In
    a `law`, `reciprocal` and `conserving` hold for any values of the other parameters. None: nothing is expected.
    """

    model: str
    reciprocal: bool
    conserving: bool | None
    why: str
    when: Parameters = {}  # the parameters for which the expectation holds, others at their defaults
    largest: tuple[float, float] | None = None  # the largest albedo over `properties.DEGREES`, and its tolerance
    at: float | None = None  # the angle of the largest albedo in degrees
    resolved: bool = True  # whether the quadrature must resolve all albedos
    law: bool = False

    def applies_to(self, material: Material) -> bool:
        """Whether the expectation is about this material."""
        return material.model == self.model and all(
            _matches(material.get(name), value) for name, value in self.when.items()
        )


def find_expectation(material: Material) -> Expectation | None:
    """Return the expectation for a material; None if there is none."""
    if not any(expectation.model == material.model for expectation in EXPECTATIONS):
        return None
    rows = [expectation for expectation in EXPECTATIONS if expectation.applies_to(material)]
    if rows and _f_parameters(material) in [
        _f_parameters(Material(material.model, **s)) for s in tried_parameters(material.model)
    ]:
        return rows[-1]
    if laws := [expectation for expectation in rows if expectation.law]:
        return msgspec.structs.replace(laws[-1], largest=None, at=None, resolved=False)
    if material.model not in NOT_RECIPROCAL:
        why = "the formula is symmetric in L and V"
        return Expectation(material.model, True, None, why, resolved=False)
    return None


def _f_parameters(material: Material) -> Parameters:
    """Return the parameters on which a material's reflectance depends."""
    return {name: value for name, value in material.parameters.items() if name not in NOT_IN_F}


def _matches(value: Any, wanted: Any) -> bool:
    """Whether a value is in the range `wanted` (a pair), or equals `wanted`, or has it in all three channels."""
    if isinstance(wanted, tuple) and wanted:
        return value is not None and wanted[0] <= value <= wanted[1]
    return value in (wanted, (wanted,) * 3)


# The models that are reciprocal only with some parameters. All other models are always reciprocal.
NOT_RECIPROCAL = ("phong", "blinn", "strauss")
_BLACK = "black"
_END_OF_FLOAT32 = "a lobe of 1e-4: at grazing angles float32 has too few bits for its halfway vectors"


# Rows that several models share.
def _total(model: str, law: bool) -> tuple[Expectation, ...]:
    edge = "F has a vertical tangent at the angle of total reflection, which the quadrature may not resolve"
    return (
        Expectation(model, True, True, edge, {"fresnel": "dielectric", "ior": (0.1, 0.9999)}, resolved=False, law=law),
        Expectation(model, True, True, edge, {"fresnel": "conductor", "k": 0.0}, resolved=False, law=law),
    )


def _lecture(model: str, lobe: str) -> tuple[Expectation, ...]:
    unbounded = f"the highlight as a reflectance is ks {lobe} / N.L, which has no bound as N.L goes to 0"
    return (
        Expectation(model, False, False, f"kd without 1/pi reflects kd pi, 2.5 by default; {unbounded}"),
        Expectation(model, False, False, unbounded, {"kd": 0.0}),
        Expectation(model, True, False, "diffuse, without 1/pi: kd pi", {"ks": 0.0}, (0.8 * math.pi, 1e-3)),
        Expectation(model, True, True, "diffuse, without 1/pi: kd pi", {"ks": 0.0, "kd": 0.3}, (0.3 * math.pi, 1e-3)),
        Expectation(
            model,
            False,
            False,
            "x^0 = 1 in all directions: the albedo is pi (kd + ks / N.L)",
            {"h": 0.0},
            (math.pi * (0.8 + 0.5 / math.cos(math.radians(89.9))), 10.0),
            89.9,
        ),
        Expectation(model, True, False, "the highlight is 1e-12 of the rest, invisible in float32", {"kd": 1e12}),
    )


def _normalized(model: str, source: str) -> tuple[Expectation, ...]:
    return (
        Expectation(
            model,
            True,
            True,
            f"albedo kd + ks straight from above, the largest ({source})",
            {"kd": 0.5, "ks": 0.5},
            (1.0, 1e-3),
            law=True,
        ),
        Expectation(model, True, False, "kd + ks is more than 1", {"kd": 1.0, "ks": 0.5}, (1.5, 1e-3), 0.0, law=True),
        Expectation(model, True, False, "kd + ks is more than 1", {"kd": 0.5, "ks": 1.0}, (1.5, 1e-3), 0.0, law=True),
        Expectation(model, True, True, "only the diffuse part: kd", {"ks": 0.0}, (0.5, 1e-3), law=True),
        Expectation(model, True, True, "only the lobe: ks straight from above", {"kd": 0.0}, law=True),
    )


def _cavities(model: str, more: Parameters) -> tuple[Expectation, ...]:
    beyond = "constants other than 1/4 reflect more than facets can: 4/pi and 4 times as much (Walter et al. 2007)"
    return (
        Expectation(
            model,
            True,
            True,
            "V-shaped cavities mask as much as necessary; 1/4 is the Jacobian: equation (xx) of the article",
            {"rho": 0.0, "constant": "modern", **more},
            law=True,
        ),
        Expectation(model, True, False, "a diffuse part of albedo 1, plus a specular part", {"rho": 1.0}),
        Expectation(model, True, True, "only the diffuse part: rho", {"ks": 0.0}, (0.0, 0.0), law=True),
        Expectation(model, True, False, beyond, {"constant": "cook"}),
        Expectation(model, True, False, beyond, {"constant": "unnormalized"}),
        Expectation(model, True, True, _END_OF_FLOAT32, {"m": 1e-4}, resolved=False),
        *_total(model, law=False),
    )


EXPECTATIONS: tuple[Expectation, ...] = (
    *_lecture("phong", "(R.V)^h"),
    *_lecture("blinn", "(N.H)^h"),
    Expectation("lambert", True, True, "albedo rho from anywhere (Lambert 1760)", law=True),
    Expectation("minnaert", True, False, "albedo rho (N.V)^(k-1): k < 1 has no bound at grazing angles"),
    Expectation(
        "minnaert", True, True, "albedo rho (N.V)^(k-1), k at least 1: at most rho", {"k": (1.0, 100.0)}, law=True
    ),
    Expectation("minnaert", True, True, _BLACK, {"rho": 0.0}, (0.0, 0.0), law=True),
    *_normalized("phong_normalized", "Lafortune and Willems 1994"),
    *_normalized("blinn_normalized", "Giesen 2009"),
    Expectation(
        "strauss",
        False,
        False,
        "F and the highlight's colour depend on the light's angle only; the reflectance Qs / N.L has no bound, and Qd "
        "lacks 1/pi",
    ),
    Expectation(
        "strauss", False, True, "transmits all light except at grazing angles; measured", {"transparency": 1.0}
    ),
    Expectation(
        "strauss",
        False,
        True,
        "the exponent is 1e6, and nothing compensates for the small highlight: smoother is darker, as is known",
        {"smoothness": (0.9999, 1.0)},
    ),
    Expectation(
        "lafortune",
        True,
        True,
        "rho + 2 pi / (n + 2) from above, for these lobes",
        {},
        (0.2 + math.pi / 11.0, 1e-3),
        0.0,
    ),
    Expectation(
        "lafortune",
        True,
        False,
        "the diffuse part reflects everything",
        {"rho": 1.0},
        (1.0 + math.pi / 11.0, 1e-3),
        0.0,
    ),
    Expectation("lafortune", True, True, "no lobes: Lambert", {"lobes": ()}, (0.2, 1e-3), law=True),
    Expectation("lafortune", True, True, "lobes only", {"rho": 0.0}, (math.pi / 11.0, 1e-3), 0.0),
    Expectation("oren_nayar", True, True, "full: light between facets has only rho^2", {}, (0.79776, 1e-3), 89.9),
    Expectation(
        "oren_nayar",
        True,
        False,
        "full: more than 1 at grazing angles. Largest albedo by an independent quadrature of the formula in float64",
        {"rho": 1.0},
        (1.02027, 1e-3),
        89.9,
    ),
    Expectation(
        "oren_nayar", True, False, "full, at its worst sigma", {"rho": 1.0, "sigma": 17.189}, (1.04996, 1e-3), 89.9
    ),
    Expectation("oren_nayar", True, True, "short, at sigma 30: grazing rho (A + B / 2), 0.94", {"form": "short"}),
    Expectation(
        "oren_nayar",
        True,
        False,
        "short, at its worst sigma: A + B / 2 = 1.0152 at the horizon",
        {"rho": 1.0, "form": "short", "sigma": 11.459},
        (1.0151, 1e-3),
    ),
    Expectation("oren_nayar", True, True, "smooth is Lambert", {"sigma": 0.0}, (0.8, 1e-3), law=True),
    Expectation("oren_nayar", True, True, "rough: 0.89 at most, for rho = 1", {"sigma": 90.0}, law=True),
    Expectation("oren_nayar", True, True, "full", {"sigma": 90.0, "form": "full"}, (0.68571, 1e-3), 89.9),
    Expectation("oren_nayar", True, True, _BLACK, {"rho": 0.0}, (0.0, 0.0), law=True),
    Expectation(
        "eon",
        True,
        True,
        "albedo 1 from anywhere for rho = 1, by the exact E (Portsmouth, Kutz and Hill 2025)",
        law=True,
    ),
    *_cavities("torrance_sparrow", {"c": 0.0}),
    Expectation("torrance_sparrow", True, False, "a height c that is not 1 / (pi m^2)", {"c": 1e12}),
    *_cavities("cook_torrance", {}),
    Expectation(
        "cook_torrance",
        True,
        True,
        "facets so steep that the masking has kinks at grazing angles, which the quadrature may not resolve",
        {"m": 3.0},
        resolved=False,
    ),
    Expectation(
        "ggx",
        True,
        True,
        "single reflections off facets with Smith's masking lose energy, and never gain any",
        law=True,
    ),
    Expectation("ggx", True, True, _END_OF_FLOAT32, {"alpha": 1e-4}, resolved=False, law=True),
    *_total("ggx", law=True),
    Expectation(
        "beckmann",
        True,
        True,
        "single reflections off facets with Smith's masking lose energy, and never gain any",
        law=True,
    ),
    Expectation("beckmann", True, True, _END_OF_FLOAT32, {"alpha": 1e-4}, resolved=False, law=True),
    *_total("beckmann", law=True),
    Expectation(
        "split",
        True,
        False,
        "1 - F(V.H) is not the transmitted share: at grazing angles facets reflect F(N.V), near 1, and light with a "
        "large V.H, from other directions, is reflected diffusely as well",
    ),
    Expectation(
        "split", True, True, "rough facets have a large V.H: rho 0.8 keeps the sum below 1; measured", {"alpha": 0.3}
    ),
    Expectation("split", True, False, "rough facets with rho = 1 exceed 1; measured", {"alpha": 0.3, "rho": 1.0}),
    Expectation("split", True, False, "narrower at grazing angles than GGX; measured", {"distribution": "beckmann"}),
    Expectation("split", True, False, "smooth as a mirror: nearly 2", {"alpha": 1e-4}, resolved=False),
    Expectation("split", True, True, "rough facets have a large V.H; measured", {"alpha": 1.0}),
    Expectation("split", True, True, "no diffuse part", {"metalness": 1.0}, law=True),
    Expectation("split", True, True, "no diffuse part: F is 1", {"f0": 1.0, "metalness": 0.0}, law=True),
    Expectation("split", True, True, "no diffuse part", {"rho": 0.0}, law=True),
    Expectation(
        "diffuse_microfacet",
        True,
        True,
        "single reflections off Lambertian facets lose energy",
        {"distribution": "ggx"},
        law=True,
    ),
    Expectation(
        "diffuse_microfacet",
        True,
        True,
        "as with ggx, but no law: the shader's quadrature gives 1.0015 for smooth white facets; measured",
        {"distribution": "beckmann"},
    ),
    Expectation("he", True, True, "not guaranteed, but delta and diffuse parts have F below 1; measured"),
    Expectation("he", True, False, "a diffuse part of albedo 1, plus the other parts", {"rho": 1.0}),
    Expectation("he", True, True, "only the diffuse part: rho", {"ks": 0.0}, (0.0, 0.0), law=True),
    *(
        Expectation("he", True, False, "delta and diffuse parts sum to 1.025 F at 80 degrees, F = 1; measured", when)
        for when in ({"f0": 1.0}, {"fresnel": "conductor", "n": 0.0}, {"fresnel": "conductor", "k": 100.0})
    ),
    *(
        Expectation(
            "he",
            True,
            False,
            "delta and diffuse parts exceed F = 1 beyond the angle of total reflection, whose edge may not be resolved",
            when,
            resolved=False,
        )
        for when in ({"fresnel": "dielectric", "ior": 0.1}, {"fresnel": "conductor", "k": 0.0})
    ),
    Expectation("he", True, True, "lobes of wavelength / tau, 1e-7, vanish in float32", {"tau": 1e6}, resolved=False),
    Expectation("mirror", True, True, "a delta, which is not part of f: its albedo is F", law=True),
)
