"""The reflectance models in float64 NumPy, from their definitions: the oracle for the files of `shaders/brdf/`.

Each model's function gives f cos(theta_i), (R, 3), for unit vectors N, L, V of shape (R, 3) with N.L > 0 and N.V > 0.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from raytracer import reference_rough
from raytracer.material import Material

Array = NDArray[np.float64]


def reflected(m: Material, N: Array, L: Array, V: Array) -> Array:
    """f cos(theta_i) of a material, (R, 3), for unit vectors (R, 3) with N.L > 0."""
    with np.errstate(under="ignore", over="ignore"):
        return MODELS[m.model](m, N, L, V)


def dot(a: Array, b: Array) -> Array:
    """The scalar products of vectors (..., 3)."""
    return np.sum(a * b, axis=-1)


def _column(values: Array) -> Array:
    return np.asarray(values)[..., None]


def _halfway(L: Array, V: Array) -> Array:
    H = L + V
    return H / np.maximum(np.linalg.norm(H, axis=-1, keepdims=True), np.finfo(float).tiny)


def _mirrored(N: Array, L: Array) -> Array:
    return 2.0 * _column(dot(N, L)) * N - L


def _power(cosine: Array, h: float) -> Array:
    return np.maximum(cosine, 0.0) ** h


def _phong(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.array(m.kd) * _column(dot(N, L)) + np.array(m.ks) * _column(_power(dot(_mirrored(N, L), V), m.h))


def _blinn(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.array(m.kd) * _column(dot(N, L)) + np.array(m.ks) * _column(_power(dot(N, _halfway(L, V)), m.h))


def _lambert(m: Material, N: Array, L: Array, V: Array) -> Array:
    return np.array(m.rho) / np.pi * _column(dot(N, L))


MODELS: dict[str, Callable[[Material, Array, Array, Array], Array]] = {
    "phong": _phong,
    "blinn": _blinn,
    "lambert": _lambert,
    "strauss": reference_rough.strauss,
    "lafortune": reference_rough.lafortune,
    "oren_nayar": reference_rough.oren_nayar,
    "eon": reference_rough.eon,
    "diffuse_microfacet": reference_rough.diffuse_microfacet,
    "he": reference_rough.he,
}
