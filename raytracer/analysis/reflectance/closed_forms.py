"""Closed forms of directional albedos.

Each function takes a material and the cosine of the angle to the normal, and returns the albedo of each channel, or
None if this angle or material has no closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from raytracer.ground_truth.microfacets import fresnel
from raytracer.ground_truth.rough_surfaces import eon_albedo, eon_mean_albedo
from raytracer.scene.materials.material import Material


def _lambert(m: Material, cosine: float) -> Any:
    return np.array(m.rho)


def _minnaert(m: Material, cosine: float) -> Any:
    return np.array(m.rho) * cosine ** (m.k - 1.0)


def _phong(m: Material, cosine: float) -> Any:
    """From straight above: the integral of cos^h over the hemisphere."""
    return np.pi * np.array(m.kd) + np.array(m.ks) * 2.0 * np.pi / (m.h + 1.0) if cosine == 1.0 else None


def _blinn(m: Material, cosine: float) -> Any:
    """From straight above: the integral of cos^h of half the angle."""
    lobe = 8.0 * np.pi / (m.h + 2.0) * (1.0 - 2.0 ** (-(m.h + 2.0) / 2.0))
    return np.pi * np.array(m.kd) + np.array(m.ks) * lobe if cosine == 1.0 else None


def _normalized(m: Material, cosine: float) -> Any:
    return np.array(m.kd) + np.array(m.ks) if cosine == 1.0 else None


def _lafortune(m: Material, cosine: float) -> Any:
    """From straight above, lobes are powers of cz N.L."""
    if cosine != 1.0:
        return None
    lobes = [np.array([lobe.scale, lobe.cz, lobe.n]) for lobe in m.lobes]
    # A lobe is 0 if its cosine is not above 0, even with the exponent 0.
    return np.array(m.rho) + sum(
        np.where(cz > 0.0, s * np.maximum(cz, 0.0) ** n * 2.0 * np.pi / (n + 2.0), 0.0) for s, cz, n in lobes
    )


def _oren_nayar(m: Material, cosine: float) -> Any:
    """From straight above, beta is 0: only C1 and light between facets remain."""
    rho, s2 = np.array(m.rho), math.radians(m.sigma) ** 2
    if cosine != 1.0:
        return rho if m.sigma == 0.0 else None
    between = 0.17 * rho**2 * s2 / (s2 + 0.13) if m.form == "full" else 0.0
    return rho * (1.0 - 0.5 * s2 / (s2 + 0.33)) + between


def _eon(m: Material, cosine: float) -> Any:
    """E(N.V) of single reflections, and the share of multiple reflections (Portsmouth, Kutz and Hill 2025)."""
    rho, mean = np.array(m.rho), eon_mean_albedo(m.roughness)
    single = eon_albedo(np.array(math.acos(cosine)), m.roughness)
    return rho * single + rho**2 * mean * (1.0 - single) / (1.0 - rho * (1.0 - mean))


def _ggx(m: Material, cosine: float) -> Any:
    """1 - ln 2 for alpha = 1 and F = 1 from straight above, where only the light is masked."""
    white = m.fresnel == "schlick" and m.f0 == (1.0,) * 3
    return np.full(3, 1.0 - math.log(2.0)) if cosine == 1.0 and m.alpha == 1.0 and white else None


def _mirror(m: Material, cosine: float) -> Any:
    """The Fresnel factor itself."""
    return fresnel(m, np.array([cosine]))[0]


ALBEDOS: dict[str, Callable[[Material, float], Any]] = {
    "lambert": _lambert,
    "minnaert": _minnaert,
    "phong": _phong,
    "blinn": _blinn,
    "phong_normalized": _normalized,
    "blinn_normalized": _normalized,
    "lafortune": _lafortune,
    "oren_nayar": _oren_nayar,
    "eon": _eon,
    "ggx": _ggx,
    "mirror": _mirror,
}
