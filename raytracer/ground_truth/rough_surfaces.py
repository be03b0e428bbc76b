"""Reflectance models of rough surfaces, and empirical ones, for `reflectance.py`.

These are the models of Strauss, Lafortune, Oren and Nayar, EON, Lambertian microfacets, and He's wave optics. The code
follows each published definition, and uses angles if the definition does.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.ground_truth.microfacets import dot, fresnel, masking
from raytracer.scene.materials.material import Material

Array = NDArray[np.float64]


def _angle(N: Array, W: Array) -> Array:
    """Return the angle between unit vectors, accurate also for small angles, for which the cosine is not."""
    return np.arctan2(np.linalg.norm(np.cross(N, W), axis=-1), dot(N, W))


def _azimuth(N: Array, L: Array, V: Array) -> Array:
    """Return the angle between the projections of L and V into the surface; 0 if a projection is 0."""
    l, v = np.cross(N, L), np.cross(N, V)
    return np.arctan2(np.linalg.norm(np.cross(l, v), axis=-1), dot(l, v))


def strauss(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return the model of Strauss (1990), in his notation."""
    F = lambda x: (1 / (x - m.kf) ** 2 - 1 / m.kf**2) / (1 / (1 - m.kf) ** 2 - 1 / m.kf**2)  # noqa: E731
    G = lambda x: (1 / (1 - m.kg) ** 2 - 1 / (x - m.kg) ** 2) / (1 / (1 - m.kg) ** 2 - 1 / m.kg**2)  # noqa: E731
    alpha, gamma = _angle(N, L) * 2 / np.pi, _angle(N, V) * 2 / np.pi
    R = 2 * dot(N, L)[:, None] * N - L
    # (R.V)^h from the angle between R and V. The power of a float64 cosine would have a relative error of h 2^-53.
    between = np.arctan2(np.linalg.norm(np.cross(R, V), axis=-1), dot(R, V))
    h = 3 / (1 - m.smoothness)
    lobe = np.where(dot(R, V) > 0, np.exp(h * np.log(np.maximum(np.cos(between), 1e-300))), 0.0)

    r_d = (1 - m.smoothness**3) * (1 - m.transparency)
    d = 1 - m.metalness * m.smoothness
    r_n = (1 - m.transparency) - r_d
    j = F(alpha) * G(alpha) * G(gamma)
    r_j = np.minimum(1.0, r_n + (r_n + m.kj) * j)
    color = np.array(m.color)
    C_s = 1 + m.metalness * (1 - F(alpha))[:, None] * (color - 1)
    return (dot(N, L) * d * r_d)[:, None] * color + (r_j * lobe)[:, None] * C_s


def lafortune(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return the model of Lafortune et al. (1997).

    If the tangent is parallel to the normal, the direction of the light, projected into the surface, is the x axis.
    """
    tangent = np.array(m.tangent) / np.linalg.norm(m.tangent)
    l = L - dot(N, L)[:, None] * N
    x = tangent - dot(N, np.broadcast_to(tangent, N.shape))[:, None] * N
    x: Array = np.where(np.linalg.norm(x, axis=-1, keepdims=True) > 1e-6, x, l)
    x /= np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-300)
    y = np.cross(N, x)
    parts = np.stack([dot(L, axis) * dot(V, axis) for axis in (x, y, N)], axis=-1)
    f = np.tile(np.array(m.rho) / np.pi, (len(N), 1))
    for lobe in m.lobes:
        c, n = np.array([lobe.cx, lobe.cy, lobe.cz]), np.array(lobe.n)
        largest = np.abs(c).max(axis=0)
        peak = np.array(lobe.scale) * largest**n
        inside = np.maximum(parts @ (c / np.where(largest > 0, largest, 1.0)), 0.0)
        f += peak * inside**n
    return dot(N, L)[:, None] * f


def oren_nayar(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return the full form of Oren and Nayar's model (1994) with negative values set to 0, or its short form."""
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
    return f * dot(N, L)[:, None]


def eon(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return the model of Portsmouth, Kutz and Hill (2025), with the exact albedo E."""
    mu_i, mu_o, r, rho = dot(N, L), dot(N, V), m.roughness, np.array(m.rho)
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
    """Return E, the albedo of the first bounce for rho = 1, by the angle of incidence."""
    A, sine, cosine = 1 / (1 + (0.5 - 2 / (3 * np.pi)) * r), np.sin(theta), np.cos(theta)
    G = sine * (theta - sine * cosine) + 2 / 3 * (sine / np.maximum(cosine, 1e-300) * (1 - sine**3) - sine)
    return A + r * A / np.pi * G


def eon_mean_albedo(r: float) -> float:
    """Return <E>, the mean of E over all directions."""
    return (1 + (2 / 3 - 28 / (15 * np.pi)) * r) / (1 + (0.5 - 2 / (3 * np.pi)) * r)


def diffuse_microfacet(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return the model by the shader's quadrature rule of m.nodes nodes, so that differences are rounding only.

    The model is equation (xxiii) of the article "Microfacet BRDFs from Scratch": Lambertian facets.
    """
    parts = max(int(math.sqrt(m.nodes / 120)), 1)
    x, weights = np.polynomial.legendre.leggauss(5)
    x = ((x + 1) / 2 + np.arange(parts)[:, None]).ravel() / parts
    return _diffuse_microfacet(m, N, L, V, max(m.nodes // (20 * parts), 2), x, np.tile(weights / 2 / parts, parts))


def diffuse_microfacet_integral(m: Material, N: Array, L: Array, V: Array, nodes: int = 100) -> Array:
    """Return the model of Lambertian facets, see diffuse_microfacet(), by an accurate quadrature of 8 nodes^2 nodes."""
    x, weights = np.polynomial.legendre.leggauss(2 * nodes)
    return _diffuse_microfacet(m, N, L, V, nodes, (x + 1) / 2, weights / 2)


def _diffuse_microfacet(
    m: Material, N: Array, L: Array, V: Array, azimuths: int, elevations: Array, weights: Array
) -> Array:
    """Return rho / (NoL NoV) G 1/pi int <L.m> <V.m> D(m) dm, for m along (r alpha cos phi, r alpha sin phi, 1).

    The quadrature over phi, from the light's azimuth, has four parts, each in Sidi's variable. For each phi it runs
    over atan(r) or atan(r / 2).
    """
    theta_i, theta_o, phi = _angle(N, L), _angle(N, V), _azimuth(N, L, V)
    scale, last = (1.0, np.inf) if m.distribution == "ggx" else (2.0, 4.0)
    t = (np.arange(azimuths) + 0.5) / azimuths
    sidi, dsidi = t - np.sin(2 * np.pi * t) / (2 * np.pi), (1 - np.cos(2 * np.pi * t)) / azimuths
    total = np.zeros(len(N))
    for k, ends in enumerate(np.stack([phi - np.pi / 2, 0 * phi + np.pi / 2, phi + np.pi / 2, 0 * phi + 1.5 * np.pi])):
        width = (np.pi - phi) if k % 2 == 0 else phi
        azimuth = ends[:, None] + width[:, None] * sidi
        lit = np.sin(theta_i)[:, None] * np.cos(azimuth) * m.alpha
        seen = np.sin(theta_o)[:, None] * np.cos(azimuth - phi[:, None]) * m.alpha
        with np.errstate(divide="ignore"):
            limit_i = np.where(lit < 0, np.cos(theta_i)[:, None] / -lit, np.inf)
            limit_o = np.where(seen < 0, np.cos(theta_o)[:, None] / -seen, np.inf)
        end = np.arctan(np.minimum(np.minimum(limit_i, limit_o), last) / scale)
        for x, weight in zip(elevations, weights, strict=True):
            r = scale * np.tan(end * x)
            dr = scale * (1 + np.tan(end * x) ** 2) * end * weight
            p22 = np.exp(-(r**2)) / np.pi if m.distribution == "beckmann" else 1 / (np.pi * (1 + r**2) ** 2)
            cosines = np.maximum(np.cos(theta_i)[:, None] + r * lit, 0) * np.maximum(
                np.cos(theta_o)[:, None] + r * seen, 0
            )
            # D(m) dm = P22 / cos(theta_m) dslopes, and each of the two cosines has a factor cos(theta_m).
            total += (cosines / np.sqrt(1 + (r * m.alpha) ** 2) * p22 * r * dr) @ dsidi * width
    G = masking(m, m.distribution, np.cos(theta_i), np.cos(theta_o))
    return (G * total / np.pi / np.cos(theta_o))[:, None] * np.array(m.rho)


_erfc = np.vectorize(math.erfc, otypes=[float])


def he(m: Material, N: Array, L: Array, V: Array) -> Array:
    """Return the model of He et al. (1991), corrected as in Westin's implementation, without the mirror term.

    The products of the polarisation vectors are those printed in the paper.
    """
    theta_i, theta_r, v = _angle(N, L), _angle(N, V), L + V
    v_z, v_xy = dot(N, v), np.linalg.norm(np.cross(N, v), axis=-1)
    lambdas = np.array(m.wavelength)
    k_i, k_r = -L, V
    s_i, s_r = np.cross(k_i, N), np.cross(k_r, N)
    s_i, s_r = (s / np.maximum(np.linalg.norm(s, axis=-1, keepdims=True), 1e-300) for s in (s_i, s_r))
    p_i, p_r = np.cross(s_i, k_i), np.cross(s_r, k_r)
    products = (dot(s_r, k_i) ** 2 + dot(p_r, k_i) ** 2) * (dot(s_i, k_r) ** 2 + dot(p_i, k_r) ** 2)
    crossed = np.linalg.norm(np.cross(k_r, k_i), axis=-1) ** 4
    # The quotient of products is 1 up to rounding. Where it is 0 / 0 (directions along one line or along the normal),
    # its limit is used.
    defined = (crossed > 1e-12) & (np.sin(theta_i) > 1e-6) & (np.sin(theta_r) > 1e-6)
    G = (dot(v, v) / v_z) ** 2 * np.where(defined, products / np.maximum(crossed, 1e-300), 1.0)
    g = (2 * np.pi / lambdas * (he_height(m, theta_i, theta_r) * v_z)[:, None]) ** 2
    b = (np.pi * m.tau * v_xy[:, None] / lambdas) ** 2
    D = np.pi**2 * m.tau**2 / (4 * lambdas**2) * he_series(g, b)
    S = _he_shadowing(m, theta_i) * _he_shadowing(m, theta_r)
    f = np.array(m.ks) * fresnel(m, np.linalg.norm(v, axis=-1) / 2) * D * (G * S / np.pi / np.cos(theta_r))[:, None]
    return f + np.cos(theta_i)[:, None] * np.array(m.rho) / np.pi


def he_mirrored(m: Material, N: Array, V: Array) -> Array:
    """Return the factor of the radiance from the mirror direction, ks F e^-g S [R, 3]."""
    theta = _angle(N, V)
    g = (4 * np.pi / np.array(m.wavelength) * (he_height(m, theta, theta) * np.cos(theta))[:, None]) ** 2
    F = fresnel(m, np.cos(theta))
    return np.array(m.ks) * F * np.exp(-g) * _he_shadowing(m, theta)[:, None] ** 2


def he_height(m: Material, theta_i: Array, theta_r: Array) -> Array:
    """Return sigma, the effective roughness of the unshadowed surface [R].

    It is sigma0 / sqrt(1 + x^2), where x solves x exp(x^2 / 2) = (K_i + K_r) / sqrt(8 pi).
    """
    if m.sigma0 == 0:
        return 0 * theta_i
    K = sum(np.tan(t) * _erfc(m.tau / (2 * m.sigma0 * np.maximum(np.tan(t), 1e-300))) for t in (theta_i, theta_r))
    low, high = 0 * theta_i, 0 * theta_i + 20
    for _ in range(60):
        x = (low + high) / 2
        above = x * np.exp(x**2 / 2) > K / np.sqrt(8 * np.pi)
        low, high = np.where(above, low, x), np.where(above, x, high)
    return m.sigma0 / np.sqrt(1 + low**2)


def he_series(g: Array, b: Array) -> Array:
    """Return the sum of g^m e^-g / (m! m) exp(-b / m) over m >= 1, term by term."""
    if not g.size:
        return np.zeros(g.shape)
    # The largest term is where m^2 log(m / g) = b, so m < g + sqrt(b).
    most = g + np.sqrt(b)
    m = np.arange(1, int(np.max(2 * most + 12 * np.sqrt(most))) + 40.0)
    log_factorials = np.cumsum(np.log(m))
    result = np.zeros(g.shape)
    for i in np.ndindex(g.shape):
        if g[i] > 0:
            k = slice(0, int(2 * most[i] + 12 * np.sqrt(most[i])) + 40)
            terms = m[k] * np.log(g[i]) - g[i] - log_factorials[k] - np.log(m[k]) - b[i] / m[k]
            result[i] = np.exp(terms.max()) * np.sum(np.exp(terms - terms.max()))
    return result


def _he_shadowing(m: Material, theta: Array) -> Array:
    q = m.tau / np.maximum(2 * m.sigma0 * np.tan(theta), 1e-300)
    Lambda = (np.exp(-(np.minimum(q, 40) ** 2)) / (np.sqrt(np.pi) * q) - _erfc(q)) / 2
    return (1 - _erfc(q) / 2) / (1 + Lambda)
