"""The rough and the empirical models of `reference_brdf.py`: Strauss, Lafortune, Oren and Nayar, EON, Lambertian
microfacets, and He's wave optics; each from its published definition, with angles where that has angles.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.material import Material

Array = NDArray[np.float64]


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)


def _angle(N: Array, W: Array) -> Array:
    """Between unit vectors, also where its cosine has lost it."""
    return np.arctan2(np.linalg.norm(np.cross(N, W), axis=-1), _dot(N, W))


def _azimuth(N: Array, L: Array, V: Array) -> Array:
    """Between the parts of L and V in the surface; 0 where one has none."""
    l, v = np.cross(N, L), np.cross(N, V)
    return np.arctan2(np.linalg.norm(np.cross(l, v), axis=-1), _dot(l, v))


def strauss(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Strauss 1990, with his names."""
    F = lambda x: (1 / (x - m.kf) ** 2 - 1 / m.kf**2) / (1 / (1 - m.kf) ** 2 - 1 / m.kf**2)  # noqa: E731
    G = lambda x: (1 / (1 - m.kg) ** 2 - 1 / (x - m.kg) ** 2) / (1 / (1 - m.kg) ** 2 - 1 / m.kg**2)  # noqa: E731
    alpha, gamma = _angle(N, L) * 2 / np.pi, _angle(N, V) * 2 / np.pi
    R = 2 * _dot(N, L)[:, None] * N - L
    # (R.V)^h, from the angle between them: the power of a float64 cosine is off by h 2^-53, this is not.
    between = np.arctan2(np.linalg.norm(np.cross(R, V), axis=-1), _dot(R, V))
    h = 3 / (1 - m.smoothness)
    lobe = np.where(_dot(R, V) > 0, np.exp(h * np.log(np.maximum(np.cos(between), 1e-300))), 0.0)

    r_d = (1 - m.smoothness**3) * (1 - m.transparency)
    d = 1 - m.metalness * m.smoothness
    r_n = (1 - m.transparency) - r_d
    j = F(alpha) * G(alpha) * G(gamma)
    r_j = np.minimum(1.0, r_n + (r_n + m.kj) * j)
    color = np.array(m.color)
    C_s = 1 + m.metalness * (1 - F(alpha))[:, None] * (color - 1)
    return (_dot(N, L) * d * r_d)[:, None] * color + (r_j * lobe)[:, None] * C_s


def lafortune(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Lafortune et al. 1997. Where the tangent is parallel to the normal, the light is in the plane of x and z."""
    tangent = np.array(m.tangent) / np.linalg.norm(m.tangent)
    l = L - _dot(N, L)[:, None] * N
    x = tangent - _dot(N, np.broadcast_to(tangent, N.shape))[:, None] * N
    x = np.where(np.linalg.norm(x, axis=-1, keepdims=True) > 1e-6, x, l)
    x = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-300)
    y = np.cross(N, x)
    parts = np.stack([_dot(L, axis) * _dot(V, axis) for axis in (x, y, N)], axis=-1)
    f = np.tile(np.array(m.rho) / np.pi, (len(N), 1))
    for lobe in m.lobes:
        c, n = np.array([lobe.cx, lobe.cy, lobe.cz]), np.array(lobe.n)
        largest = np.abs(c).max(axis=0)
        peak = np.array(lobe.scale) * largest**n
        inside = np.maximum(parts @ (c / np.where(largest > 0, largest, 1.0)), 0.0)
        f += peak * inside**n
    return _dot(N, L)[:, None] * f


def oren_nayar(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Oren and Nayar 1994, appendix A, or without interreflection; 0 where the former is negative."""
    theta_i, theta_r, phi = _angle(N, L), _angle(N, V), _azimuth(N, L, V)
    a, b, c = np.maximum(theta_i, theta_r), np.minimum(theta_i, theta_r), np.cos(phi)
    s2 = math.radians(m.sigma) ** 2
    rho = np.array(m.rho)
    C1 = 1 - 0.5 * s2 / (s2 + 0.33)
    C2 = 0.45 * s2 / (s2 + 0.09)
    if m.form == "short":
        f = rho / np.pi * (C1 + C2 * np.maximum(0, c) * np.sin(a) * np.tan(b))[:, None]
    else:
        C2 = C2 * np.where(c >= 0, np.sin(a), np.sin(a) - (2 * b / np.pi) ** 3)
        C3 = 0.125 * s2 / (s2 + 0.09) * (4 * a * b / np.pi**2) ** 2
        f_1 = C1 + c * C2 * np.tan(b) + (1 - np.abs(c)) * C3 * np.tan((a + b) / 2)
        f_2 = 0.17 * s2 / (s2 + 0.13) * (1 - c * (2 * b / np.pi) ** 2)
        f = np.maximum(rho / np.pi * f_1[:, None] + rho**2 / np.pi * f_2[:, None], 0.0)
    return f * _dot(N, L)[:, None]


def eon(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Portsmouth, Kutz and Hill 2025, with the exact E."""
    mu_i, mu_o, r, rho = _dot(N, L), _dot(N, V), m.roughness, np.array(m.rho)
    if r == 0.0:
        return mu_i[:, None] * rho / np.pi
    A = 1 / (1 + (0.5 - 2 / (3 * np.pi)) * r)
    s = np.sin(_angle(N, L)) * np.sin(_angle(N, V)) * np.cos(_azimuth(N, L, V))
    t = np.where(s > 0, np.maximum(mu_i, mu_o), 1.0)
    mean = eon_mean_albedo(r)
    rho_ms = rho**2 * mean / (1 - rho * (1 - mean))
    several = (1 - eon_albedo(_angle(N, L), r)) * (1 - eon_albedo(_angle(N, V), r)) / (1 - mean)
    f = rho / np.pi * (A * (1 + r * s / t))[:, None] + rho_ms / np.pi * several[:, None]
    return f * mu_i[:, None]


def eon_albedo(theta: Array, r: float) -> Array:
    """E: the albedo of the first bounce for rho = 1."""
    A, sine, cosine = 1 / (1 + (0.5 - 2 / (3 * np.pi)) * r), np.sin(theta), np.cos(theta)
    G = sine * (theta - sine * cosine) + 2 / 3 * (sine / np.maximum(cosine, 1e-300) * (1 - sine**3) - sine)
    return A + r * A / np.pi * G


def eon_mean_albedo(r: float) -> float:
    """<E>: its mean over all directions."""
    return (1 + (2 / 3 - 28 / (15 * np.pi)) * r) / (1 + (0.5 - 2 / (3 * np.pi)) * r)
