"""What theory says of each model: is it reciprocal, does it conserve energy, what is its albedo.

Written down before anything is measured, from the formulas and from what has been published; where only a run could
tell, `why` says so. `checks.py` holds what is measured against this.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np

from raytracer.material import Material

# (low, high) stands for all numbers between; one number for a colour of three that are equal.
Settings = Mapping[str, Any]


class Verdict(msgspec.Struct, frozen=True):
    """What is expected of a model where its parameters are as `when` says; of a model's rows, the last that fits holds.

    `largest` is the largest albedo over angles of `measure.DEGREES`, and how far off it may be; `at` is its angle.
    `resolved`: whether the quadrature is to resolve all albedos.
    """

    model: str
    reciprocal: bool
    conserving: bool
    why: str
    when: Settings = {}
    largest: tuple[float, float] | None = None
    at: float | None = None
    resolved: bool = True

    def fits(self, material: Material) -> bool:
        """Whether it is about this material."""
        return material.model == self.model and all(_is(material.get(name), value) for name, value in self.when.items())


def expected(material: Material) -> Verdict:
    """The verdict on a material. Raises LookupError if its model has none."""
    found = [verdict for verdict in VERDICTS if verdict.fits(material)]
    if not found:
        raise LookupError(f"no verdict on {material.model} is written down")
    return found[-1]


def _is(value: Any, wanted: Any) -> bool:
    if isinstance(wanted, tuple) and wanted:
        return value is not None and wanted[0] <= value <= wanted[1]
    return value in (wanted, (wanted,) * 3)


_BLACK = "black"
_END_OF_FLOAT32 = "a lobe of 1e-4: at grazing angles float32 has no more bits for its halfway vectors"


# Rows of models that are made alike.
def _total(model: str) -> tuple[Verdict, ...]:
    edge = "total reflection begins at an angle where F has a vertical tangent: the quadrature may not resolve that"
    return (
        Verdict(model, True, True, edge, {"fresnel": "dielectric", "ior": (0.1, 0.9999)}, resolved=False),
        Verdict(model, True, True, edge, {"fresnel": "conductor", "k": 0.0}, resolved=False),
    )


def _lecture(model: str, lobe: str) -> tuple[Verdict, ...]:
    unbounded = f"the highlight as a reflectance is ks {lobe} / N.L: it grows without bound as N.L goes to 0"
    return (
        Verdict(model, False, False, f"kd without 1/pi reflects kd pi, 2.5 by default; {unbounded}"),
        Verdict(model, False, False, unbounded, {"kd": 0.0}),
        Verdict(model, True, False, "diffuse, without 1/pi: kd pi", {"ks": 0.0}, (0.8 * math.pi, 1e-3)),
        Verdict(model, True, True, "diffuse, without 1/pi: kd pi", {"ks": 0.0, "kd": 0.3}, (0.3 * math.pi, 1e-3)),
        Verdict(
            model,
            False,
            False,
            "x^0 = 1 in all directions: of light at an angle, pi (kd + ks / N.L) is reflected",
            {"h": 0.0},
            (math.pi * (0.8 + 0.5 / math.cos(math.radians(89.9))), 10.0),
            89.9,
        ),
        Verdict(model, True, False, "the highlight is 1e-12 of the rest: not seen in float32", {"kd": 1e12}),
    )


def _normalized(model: str) -> tuple[Verdict, ...]:
    return (
        Verdict(
            model,
            True,
            True,
            "albedo kd + ks straight from above, the largest (Lafortune and Willems 1994)",
            {},
            (1.0, 1e-3),
        ),
        Verdict(model, True, False, "kd + ks is more than 1", {"kd": 1.0, "ks": 0.5}, (1.5, 1e-3), 0.0),
        Verdict(model, True, False, "kd + ks is more than 1", {"kd": 0.5, "ks": 1.0}, (1.5, 1e-3), 0.0),
        Verdict(model, True, True, "nothing but the diffuse part: kd", {"ks": 0.0}, (0.5, 1e-3)),
        Verdict(model, True, True, "nothing but the lobe: ks straight from above", {"kd": 0.0}),
    )


def _cavities(model: str) -> tuple[Verdict, ...]:
    beyond = "other constants than 1/4 reflect more than facets can: 4/pi and 4 times (Walter 2007)"
    return (
        Verdict(model, True, True, "V-shaped cavities mask as much as they have to; 1/4 is the Jacobian (xx)"),
        Verdict(model, True, False, "a diffuse part of albedo 1, and a specular one besides", {"rho": 1.0}),
        Verdict(model, True, True, "nothing but the diffuse part: rho", {"ks": 0.0}, (0.0, 0.0)),
        Verdict(model, True, False, beyond, {"constant": "cook"}),
        Verdict(model, True, False, beyond, {"constant": "unnormalized"}),
        Verdict(model, True, True, _END_OF_FLOAT32, {"m": 1e-4}, resolved=False),
        *_total(model),
    )


VERDICTS: tuple[Verdict, ...] = (
    *_lecture("phong", "(R.V)^h"),
    *_lecture("blinn", "(N.H)^h"),
    Verdict("lambert", True, True, "albedo rho from anywhere (Lambert 1760)"),
    Verdict("minnaert", True, False, "albedo rho (N.V)^(k-1): k < 1 has no bound at grazing angles"),
    Verdict("minnaert", True, True, "albedo rho (N.V)^(k-1), k at least 1: at most rho", {"k": (1.0, 100.0)}),
    Verdict("minnaert", True, True, _BLACK, {"rho": 0.0}, (0.0, 0.0)),
    *_normalized("phong_normalized"),
    *_normalized("blinn_normalized"),
    Verdict(
        "strauss",
        False,
        False,
        "F and the highlight's colour go by the light's angle only; as a reflectance its Qs / N.L has no bound, and Qd "
        "has no 1/pi",
    ),
    Verdict("strauss", False, True, "all is transmitted but for grazing angles; by a run", {"transparency": 1.0}),
    Verdict(
        "strauss",
        False,
        True,
        "its exponent is 1e6, and nothing makes up for the highlight's small size: darker as smoother, which is known",
        {"smoothness": (0.9999, 1.0)},
    ),
    Verdict(
        "lafortune",
        True,
        True,
        "rho + 2 pi / (n + 2) from above, for these lobes",
        {},
        (0.2 + math.pi / 11.0, 1e-3),
        0.0,
    ),
    Verdict("lafortune", True, False, "the diffuse part reflects all", {"rho": 1.0}, (1.0 + math.pi / 11.0, 1e-3), 0.0),
    Verdict("lafortune", True, True, "no lobes: Lambert", {"lobes": ()}, (0.2, 1e-3)),
    Verdict("lafortune", True, True, "lobes only", {"rho": 0.0}, (math.pi / 11.0, 1e-3), 0.0),
    Verdict("oren_nayar", True, True, "full: light between facets is of rho^2, so less", {}, (0.79776, 1e-3), 89.9),
    Verdict(
        "oren_nayar",
        True,
        False,
        "full: more than 1 at grazing angles. Largest by quadrature of the formula in float64, apart from this code",
        {"rho": 1.0},
        (1.02027, 1e-3),
        89.9,
    ),
    Verdict(
        "oren_nayar", True, False, "full, at its worst sigma", {"rho": 1.0, "sigma": 17.189}, (1.04996, 1e-3), 89.9
    ),
    Verdict("oren_nayar", True, True, "short, at sigma 30: rho (A + B / 2) when grazing, 0.94", {"form": "short"}),
    Verdict(
        "oren_nayar",
        True,
        False,
        "short, at its worst sigma: A + B / 2 = 1.0152 at the horizon",
        {"rho": 1.0, "form": "short", "sigma": 11.459},
        (1.0151, 1e-3),
    ),
    Verdict("oren_nayar", True, True, "smooth is Lambert", {"sigma": 0.0}, (0.8, 1e-3)),
    Verdict("oren_nayar", True, True, "rough: 0.89 at most, for rho = 1", {"sigma": 90.0}),
    Verdict("oren_nayar", True, True, "full", {"sigma": 90.0, "form": "full"}, (0.68571, 1e-3), 89.9),
    Verdict("oren_nayar", True, True, _BLACK, {"rho": 0.0}, (0.0, 0.0)),
    Verdict("eon", True, True, "albedo 1 from anywhere for rho = 1, but for a fit that is 6e-4 off (Portsmouth 2025)"),
    *_cavities("torrance_sparrow"),
    Verdict("torrance_sparrow", True, False, "a height c that is not 1 / (pi m^2)", {"c": 1e12}),
    *_cavities("cook_torrance"),
    Verdict(
        "cook_torrance",
        True,
        True,
        "facets steep enough for kinks of the masking at grazing angles that the quadrature may not resolve",
        {"m": 3.0},
        resolved=False,
    ),
    Verdict("ggx", True, True, "single reflections off facets with Smith's masking lose energy, never win"),
    Verdict("ggx", True, True, _END_OF_FLOAT32, {"alpha": 1e-4}, resolved=False),
    *_total("ggx"),
    Verdict("beckmann", True, True, "single reflections off facets with Smith's masking lose energy, never win"),
    Verdict("beckmann", True, True, _END_OF_FLOAT32, {"alpha": 1e-4}, resolved=False),
    *_total("beckmann"),
    Verdict(
        "split",
        True,
        False,
        "1 - F(V.H) is no share that is transmitted: at grazing angles facets reflect F(N.V), near 1, and light from "
        "elsewhere, whose V.H is not small, is reflected diffusely besides",
    ),
    Verdict(
        "split", True, True, "rough facets are seen at a large V.H: rho 0.8 keeps it below 1; by a run", {"alpha": 0.3}
    ),
    Verdict("split", True, False, "the same with rho = 1; by a run", {"alpha": 0.3, "rho": 1.0}),
    Verdict("split", True, False, "narrower at grazing angles than GGX; by a run", {"distribution": "beckmann"}),
    Verdict("split", True, False, "as smooth as a mirror: nearly 2", {"alpha": 1e-4}, resolved=False),
    Verdict("split", True, True, "rough facets are seen at a large V.H; by a run", {"alpha": 1.0}),
    Verdict("split", True, True, "no diffuse part", {"metalness": 1.0}),
    Verdict("split", True, True, "no diffuse part: F is 1", {"f0": 1.0}),
    Verdict("split", True, True, "no diffuse part", {"rho": 0.0}),
    Verdict("diffuse_microfacet", True, True, "single reflections off Lambertian facets lose energy"),
    Verdict("he", True, True, "nothing guarantees it, but F is less than 1: delta and diffuse parts; by a run"),
    Verdict("he", True, False, "a diffuse part of albedo 1, and the others besides", {"rho": 1.0}),
    Verdict("he", True, True, "nothing but the diffuse part: rho", {"ks": 0.0}, (0.0, 0.0)),
    *(
        Verdict("he", True, False, "delta and diffuse parts are 1.025 F at 80 degrees for F = 1; by a run", when)
        for when in ({"f0": 1.0}, {"fresnel": "conductor", "n": 0.0}, {"fresnel": "conductor", "k": 100.0})
    ),
    *(
        Verdict(
            "he",
            True,
            False,
            "the same beyond the angle of total reflection, whose edge may not be resolved",
            when,
            resolved=False,
        )
        for when in ({"fresnel": "dielectric", "ior": 0.1}, {"fresnel": "conductor", "k": 0.0})
    ),
    Verdict("he", True, True, "lobes of wavelength / tau, 1e-7: nothing in float32", {"tau": 1e6}, resolved=False),
    Verdict("mirror", True, True, "a delta, which is not in f: its albedo is F"),
)

# Beyond the ends of each range: settings that tell something.
COMBINATIONS: dict[str, tuple[Settings, ...]] = {
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


# Albedos known as formulas: of a material, by the cosine of the angle; None where there is none. Per channel.
def _of_lambert(m: Material, cosine: float) -> Any:
    return np.array(m.rho)


def _of_minnaert(m: Material, cosine: float) -> Any:
    return np.array(m.rho) * cosine ** (m.k - 1.0)


def _of_phong(m: Material, cosine: float) -> Any:
    """Seen from straight above: the integral of cos^h over the hemisphere."""
    return np.pi * np.array(m.kd) + np.array(m.ks) * 2.0 * np.pi / (m.h + 1.0) if cosine == 1.0 else None


def _of_blinn(m: Material, cosine: float) -> Any:
    """Seen from straight above: the integral of cos^h of half the angle."""
    lobe = 8.0 * np.pi / (m.h + 2.0) * (1.0 - 2.0 ** (-(m.h + 2.0) / 2.0))
    return np.pi * np.array(m.kd) + np.array(m.ks) * lobe if cosine == 1.0 else None


def _of_normalized(m: Material, cosine: float) -> Any:
    return np.array(m.kd) + np.array(m.ks) if cosine == 1.0 else None


def _of_lafortune(m: Material, cosine: float) -> Any:
    """Seen from straight above, lobes are powers of cz N.L."""
    if cosine != 1.0:
        return None
    lobes = [np.array([lobe.scale, lobe.cz, lobe.n]) for lobe in m.lobes]
    return np.array(m.rho) + sum(s * np.maximum(cz, 0.0) ** n * 2.0 * np.pi / (n + 2.0) for s, cz, n in lobes)


def _of_oren_nayar(m: Material, cosine: float) -> Any:
    """Seen from straight above, beta is 0: C1, and light between facets."""
    rho, s2 = np.array(m.rho), math.radians(m.sigma) ** 2
    if cosine != 1.0:
        return rho if m.sigma == 0.0 else None
    between = 0.17 * rho**2 * s2 / (s2 + 0.13) if m.form == "full" else 0.0
    return rho * (1.0 - 0.5 * s2 / (s2 + 0.33)) + between


def _of_eon(m: Material, cosine: float) -> Any:
    """Of single reflections E(N.V), and of more what makes up for it (Portsmouth, Kutz and Hill 2025)."""
    rho, r, s = np.array(m.rho), m.roughness, math.sqrt(1.0 - cosine**2)
    a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * math.pi)) * r)
    g = s * (math.acos(cosine) - s * cosine) + 2.0 / 3.0 * (s / cosine * (1.0 - s**3) - s)
    single = a + r * a / math.pi * g
    mean = a * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * math.pi)) * r)
    return rho * single + rho**2 * mean * (1.0 - single) / (1.0 - rho * (1.0 - mean))


def _of_ggx(m: Material, cosine: float) -> Any:
    """1 - ln 2 for alpha = 1 and F = 1 seen from straight above, where only the light is masked."""
    white = m.fresnel == "schlick" and m.f0 == (1.0,) * 3
    return np.full(3, 1.0 - math.log(2.0)) if cosine == 1.0 and m.alpha == 1.0 and white else None


def _of_mirror(m: Material, cosine: float) -> Any:
    """Fresnel's factor itself, from the amplitudes with a complex index."""
    if m.fresnel == "schlick":
        return np.array(m.f0) + (1.0 - np.array(m.f0)) * (1.0 - cosine) ** 5
    index = np.array(m.n) + 1j * np.array(m.k) if m.fresnel == "conductor" else np.full(3, m.ior, complex)
    inside = np.sqrt(index**2 - 1.0 + cosine**2)
    s = (cosine - inside) / (cosine + inside)
    p = (index**2 * cosine - inside) / (index**2 * cosine + inside)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2.0


ALBEDOS: dict[str, Callable[[Material, float], Any]] = {
    "lambert": _of_lambert,
    "minnaert": _of_minnaert,
    "phong": _of_phong,
    "blinn": _of_blinn,
    "phong_normalized": _of_normalized,
    "blinn_normalized": _of_normalized,
    "lafortune": _of_lafortune,
    "oren_nayar": _of_oren_nayar,
    "eon": _of_eon,
    "ggx": _of_ggx,
    "mirror": _of_mirror,
}
