"""Albedos that are known as formulas: of a material, by the cosine of the angle, per channel; None if there is none."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from raytracer.ground_truth.microfacets import fresnel
from raytracer.ground_truth.rough_surfaces import eon_albedo, eon_mean_albedo
from raytracer.scene.materials.material import Material


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
    # There is no lobe where its cosine is not above 0, also not with the exponent 0.
    return np.array(m.rho) + sum(
        np.where(cz > 0.0, s * np.maximum(cz, 0.0) ** n * 2.0 * np.pi / (n + 2.0), 0.0) for s, cz, n in lobes
    )


def _of_oren_nayar(m: Material, cosine: float) -> Any:
    """Seen from straight above, beta is 0: C1, and light between facets."""
    rho, s2 = np.array(m.rho), math.radians(m.sigma) ** 2
    if cosine != 1.0:
        return rho if m.sigma == 0.0 else None
    between = 0.17 * rho**2 * s2 / (s2 + 0.13) if m.form == "full" else 0.0
    return rho * (1.0 - 0.5 * s2 / (s2 + 0.33)) + between


def _of_eon(m: Material, cosine: float) -> Any:
    """E(N.V) by single reflections, and the share that more reflections add (Portsmouth, Kutz and Hill 2025)."""
    rho, mean = np.array(m.rho), eon_mean_albedo(m.roughness)
    single = eon_albedo(np.array(math.acos(cosine)), m.roughness)
    return rho * single + rho**2 * mean * (1.0 - single) / (1.0 - rho * (1.0 - mean))


def _of_ggx(m: Material, cosine: float) -> Any:
    """1 - ln 2 for alpha = 1 and F = 1 seen from straight above, where only the light is masked."""
    white = m.fresnel == "schlick" and m.f0 == (1.0,) * 3
    return np.full(3, 1.0 - math.log(2.0)) if cosine == 1.0 and m.alpha == 1.0 and white else None


def _of_mirror(m: Material, cosine: float) -> Any:
    """Fresnel's factor itself."""
    return fresnel(m, np.array([cosine]))[0]


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
