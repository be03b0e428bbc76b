"""Terms of the microfacet models in float64 NumPy: Fresnel reflectance, distributions of normals, masking.

Arrays have one entry per ray: [R], or [R, 3] for vectors and colours.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.scene.materials.material import Material

Array = NDArray[np.float64]


def dot(a: Array, b: Array) -> Array:
    """Return the dot products of vectors [..., 3]."""
    return np.sum(a * b, axis=-1)


def column(values: Array) -> Array:
    """Reshape [R] to [R, 1], to multiply numbers with colours."""
    return np.asarray(values)[..., None]


def schlick(f0: Array, c: Array) -> Array:
    """Return Schlick's approximation (1994) of the Fresnel reflectance [R, 3], by the cosine of the angle [R]."""
    return f0 + (1.0 - f0) * column(1.0 - c) ** 5


def fresnel(m: Material, c: Array) -> Array:
    """Return the Fresnel reflectance of a facet [R, 3], by the cosine of the angle of incidence [R]."""
    if m.fresnel == "schlick":
        return schlick(np.array(m.f0), c)
    # Amplitudes for a complex index of refraction (Born and Wolf, Principles of Optics). A dielectric's index is real.
    index = np.array(m.n) + 1j * np.array(m.k) if m.fresnel == "conductor" else np.array([m.ior] * 3, complex)
    c3 = column(c)
    inside = np.sqrt(index**2 - 1.0 + c3**2)
    s = (c3 - inside) / (c3 + inside)
    p = (index**2 * c3 - inside) / (index**2 * c3 + inside)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2.0


def distribution(m: Material, kind: str, cosine: Array, alpha: float | None = None) -> Array:
    """Return the distribution D of microfacet normals [R].

    Args:
        m: the material, for its `alpha`.
        kind: "ggx" or "beckmann".
        cosine: the cosine between microfacet normal and N [R].
        alpha: the roughness. Default: `m.alpha`.
    """
    a2 = (m.alpha if alpha is None else alpha) ** 2
    tan2 = (1.0 - cosine**2) / cosine**2
    if kind == "ggx":
        return 1.0 / (np.pi * a2 * cosine**4 * (1.0 + tan2 / a2) ** 2)
    return np.exp(-tan2 / a2) / (np.pi * a2 * cosine**4)


def smith_lambda(m: Material, kind: str, cosine: Array) -> Array:
    """Return Smith's Lambda [R] of directions with these cosines to N [R], for the distribution `kind`."""
    tan = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / cosine
    if kind == "ggx":
        return (np.sqrt(1.0 + (m.alpha * tan) ** 2) - 1.0) / 2.0
    a = 1.0 / np.maximum(m.alpha * tan, 1e-100)
    if m.smith == "rational":
        g1 = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1.0 + 2.276 * a + 2.577 * a**2), 1.0)
        return 1.0 / g1 - 1.0
    erfc = np.array([math.erfc(x) for x in a.ravel()]).reshape(a.shape)
    return np.exp(-(a**2)) / (2.0 * a * math.sqrt(np.pi)) - erfc / 2.0


def masking(m: Material, kind: str, NoL: Array, NoV: Array) -> Array:
    """Return the masking-shadowing function G [R] for the distribution `kind`."""
    l, v = smith_lambda(m, kind, NoL), smith_lambda(m, kind, NoV)
    return 1.0 / ((1.0 + l) * (1.0 + v) if m.masking == "separable" else 1.0 + l + v)
