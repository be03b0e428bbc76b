"""Reflectance models in float64 NumPy, written from their definitions. Tests compare `shaders/brdf/` with them.

Each model's function returns f cos(theta_i) [R, 3] for unit vectors N, L, V [R, 3] with N.L > 0 and N.V > 0. After
rounding to float32 the vectors are not exactly unit vectors, which matters if L and V are nearly opposite or a lobe is
narrow. So the functions use only directions and sums of vectors: H = (L + V) / |L + V|, V.H = |L + V| / 2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raytracer.ground_truth import rough_surfaces
from raytracer.ground_truth.microfacets import column, distribution, dot, fresnel, masking, schlick
from raytracer.scene.materials.material import Material

Array = NDArray[np.float64]


def reflected(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return f cos(theta_i) of a material [R, 3], for unit vectors [R, 3] with N.L > 0."""
    with np.errstate(under="ignore", over="ignore"):
        return REFLECTANCES[m.model](m, N, L, V)


def mirrored(m: Material, N: Array, V: Array) -> Array:
    """Return the fraction of the radiance from the mirror direction that a material reflects towards V [R, 3]."""
    return rough_surfaces.he_mirrored(m, N, V) if m.model == "he" else fresnel(m, np.clip(dot(N, V), 0.0, 1.0))


def _halfway(L: Array, V: Array) -> Array:
    H = L + V
    return H / np.maximum(np.linalg.norm(H, axis=-1, keepdims=True), np.finfo(float).tiny)


def _facet_cosine(L: Array, V: Array) -> Array:
    """Return V.H [R]."""
    return np.linalg.norm(L + V, axis=-1) / 2.0


def _mirror_lobe(N: Array, L: Array, V: Array, h: float) -> Array:
    R = 2.0 * column(dot(N, L)) * N - L
    return np.maximum(dot(R, V) / np.linalg.norm(R, axis=-1) / np.linalg.norm(V, axis=-1), 0.0) ** h


def _halfway_lobe(N: Array, L: Array, V: Array, h: float) -> Array:
    return np.maximum(dot(N, _halfway(L, V)), 0.0) ** h


def _phong(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.array(m.kd) * column(dot(N, L)) + np.array(m.ks) * column(_mirror_lobe(N, L, V, m.h))


def _blinn(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.array(m.kd) * column(dot(N, L)) + np.array(m.ks) * column(_halfway_lobe(N, L, V, m.h))


def _lambert(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.array(m.rho) / np.pi * column(dot(N, L))


def _minnaert(m: Material, N: Array, L: Array, V: Array) -> Array:
    NoL, NoV = dot(N, L), dot(N, V)
    return np.array(m.rho) * column((m.k + 1.0) / (2.0 * np.pi) * (NoL * NoV) ** (m.k - 1.0) * NoL)


def _phong_normalized(m: Material, N: Array, L: Array, V: Array) -> Array:
    lobe = (m.h + 2.0) / (2.0 * np.pi) * _mirror_lobe(N, L, V, m.h)
    return (np.array(m.kd) / np.pi + np.array(m.ks) * column(lobe)) * column(dot(N, L))


def _blinn_normalized(m: Material, N: Array, L: Array, V: Array) -> Array:
    constant = (m.h + 2.0) * (m.h + 4.0) / (8.0 * np.pi * (2.0 ** (-m.h / 2.0) + m.h))
    lobe = constant * _halfway_lobe(N, L, V, m.h)
    return (np.array(m.kd) / np.pi + np.array(m.ks) * column(lobe)) * column(dot(N, L))


def _mirror(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.zeros(N.shape)


def _facets(m: Material, kind: str, N: Array, L: Array, V: Array) -> Array:
    """Return D G / (4 N.V) [R]."""
    NoV = dot(N, V)
    return distribution(m, kind, dot(N, _halfway(L, V))) * masking(m, kind, dot(N, L), NoV) / (4.0 * NoV)


def _ggx(m: Material, N: Array, L: Array, V: Array) -> Array:
    return fresnel(m, _facet_cosine(L, V)) * column(_facets(m, "ggx", N, L, V))


def _beckmann(m: Material, N: Array, L: Array, V: Array) -> Array:
    return fresnel(m, _facet_cosine(L, V)) * column(_facets(m, "beckmann", N, L, V))


def _split(m: Material, N: Array, L: Array, V: Array) -> Array:
    f0 = (1.0 - m.metalness) * np.array(m.f0) + m.metalness * np.array(m.rho)
    F = schlick(f0, _facet_cosine(L, V))
    diffuse = (1.0 - F) * (1.0 - m.metalness) * _lambert(m, N, L, V)
    return diffuse + F * column(_facets(m, m.distribution, N, L, V))


CONSTANTS = {"modern": 0.25, "cook": 1.0 / np.pi, "unnormalized": 1.0}


def _v_cavities(m: Material, D: Array, N: Array, L: Array, V: Array) -> Array:
    H = _halfway(L, V)
    NoL, NoV, NoH, VoH = dot(N, L), dot(N, V), dot(N, H), _facet_cosine(L, V)
    G = np.minimum(1.0, np.minimum(2.0 * NoH * NoV / VoH, 2.0 * NoH * NoL / VoH))
    specular = np.array(m.ks) * fresnel(m, VoH) * column(CONSTANTS[m.constant] * D * G / NoV)
    return _lambert(m, N, L, V) + specular


def _cook_torrance(m: Material, N: Array, L: Array, V: Array) -> Array:
    return _v_cavities(m, distribution(m, "beckmann", dot(N, _halfway(L, V)), m.m), N, L, V)


def _torrance_sparrow(m: Material, N: Array, L: Array, V: Array) -> Array:
    H = _halfway(L, V)
    angle = np.arctan2(np.linalg.norm(np.cross(N, H), axis=-1), dot(N, H))
    c = m.c or 1.0 / (np.pi * m.m**2)
    return _v_cavities(m, c * np.exp(-((angle / m.m) ** 2)), N, L, V)


REFLECTANCES: dict[str, Callable[[Material, Array, Array, Array], Array]] = {
    "phong": _phong,
    "blinn": _blinn,
    "lambert": _lambert,
    "minnaert": _minnaert,
    "phong_normalized": _phong_normalized,
    "blinn_normalized": _blinn_normalized,
    "strauss": rough_surfaces.strauss,
    "lafortune": rough_surfaces.lafortune,
    "oren_nayar": rough_surfaces.oren_nayar,
    "eon": rough_surfaces.eon,
    "torrance_sparrow": _torrance_sparrow,
    "cook_torrance": _cook_torrance,
    "ggx": _ggx,
    "beckmann": _beckmann,
    "split": _split,
    "diffuse_microfacet": rough_surfaces.diffuse_microfacet,
    "he": rough_surfaces.he,
    "mirror": _mirror,
}
