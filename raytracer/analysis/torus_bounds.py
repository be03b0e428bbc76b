"""Rounding error bounds of the roots of rays with a torus, those in `shaders/geometry/torus_wall.glsl`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from raytracer.analysis.rounding_bounds import Array, Mask
from raytracer.analysis.wall_bounds import (
    Ends,
    FormsAlong,
    UnitLine,
    choose,
    cross_error,
    empty_ends,
    scaled,
    unit_directions,
)
from raytracer.ground_truth.microfacets import dot

# Steps of Newton's method from the eigenvalues of float64, whose error may be the root of 2^-53.
_POLISHING = 6


def torus_ends(along: FormsAlong, u: float) -> tuple[Ends, Ends]:
    """Return the two intervals of rays in a torus. If their number is in doubt, both may be anywhere near the torus."""
    with np.errstate(all="ignore"):  # numbers without a meaning are not chosen
        return _torus_ends(along, u)


class _TorusLine(NamedTuple):
    """Rays in the frame of a torus. Numbers come with the bounds of their |error|."""

    line: UnitLine
    minor: tuple[Array, Array]
    m: tuple[Array, Array]  # the point nearest to the centre (R, 3); its error is a length (R,)
    middle: tuple[Array, Array]  # its place on the ray
    reach: Array  # the torus is within +-reach of it


def _torus_line(along: FormsAlong, u: float) -> _TorusLine:
    minor, minor_error = along.p[:, 0], along.p_error[:, 0]
    p, dp = along.p[:, 1:], along.p_error[:, 1:]
    line = unit_directions(along, u)
    e, de = line.e[:, 1:], line.e_error[:, 1:]
    moment = np.cross(p, e)
    m = np.cross(e, moment)
    m_error = np.linalg.norm(cross_error(e, moment, de, cross_error(p, e, dp, de, u), u), axis=1)
    middle = -dot(p, e)
    middle_error = dot(np.abs(p), de) + dot(dp, np.abs(e)) + dot(dp, de) + 4.0 * u * dot(np.abs(p), np.abs(e))
    reach = np.sqrt(np.maximum(np.square(1.0 + minor + m_error + minor_error) - dot(m, m), 0.0)) + 8.0 * u
    return _TorusLine(line, (minor, minor_error), (m, m_error), (middle, middle_error), reach)


class _Zeros(NamedTuple):
    """The zeros of the quartic of each ray, from the middle (4, R), inf: none, and where their number is in doubt."""

    s: Array
    off: Array  # bounds of their |error|, without that of the middle
    slope: Array  # half the derivatives of F there
    doubt: Mask


def _quartic_zeros(ray: _TorusLine, u: float) -> _Zeros:
    line, (minor, minor_error), (m, m_error), _, reach = ray
    e, de = line.e[:, 1:], line.e_error[:, 1:]
    # The quartic s^4 + 2 P s^2 + 4 K s + C, its zeros, and those of its derivative.
    P = dot(m, m) + (1.0 - minor) * (1.0 + minor) - 2.0 * dot(e[:, :2], e[:, :2])
    K = 2.0 * m[:, 2] * e[:, 2]
    C = np.square(dot(m, m) + (1.0 - minor) * (1.0 + minor)) - 4.0 * dot(m[:, :2], m[:, :2])
    turns = _real_zeros(np.array([np.zeros(len(P)), P, K]).T, reach)
    zeros = _real_zeros(np.array([np.zeros(len(P)), 2.0 * P, 4.0 * K, C]).T, reach)
    for _ in range(_POLISHING):
        F, slope, _, _ = _value(m, e, minor, zeros)
        step = 0.5 * F / slope
        zeros = np.where(np.abs(step) < 0.1 * minor, zeros - step, zeros)
    zeros = np.sort(zeros, axis=0)

    errors = m_error, np.linalg.norm(de, axis=1), minor_error, u
    F, _, _, height = _value(m, e, minor, turns)
    doubt = np.any(np.abs(F) <= _value_error(m, minor, turns, height, errors), axis=0)
    F, slope, _, height = _value(m, e, minor, zeros)
    F_error = _value_error(m, minor, zeros, height, errors)
    # Near a root, |F''| is at most `bend`. So F is beyond its error within `off` of the root, if F' is large enough.
    bend = 2.0 / (1.0 - minor)
    steep = np.square(2.0 * slope) - 2.0 * bend * F_error
    off = (np.abs(2.0 * slope) - np.sqrt(np.maximum(steep, 0.0))) / bend
    known = np.isfinite(zeros)
    doubt |= np.any(known & ~(steep > 0.0), axis=0)
    doubt |= known.sum(axis=0) % 2 == 1
    return _Zeros(zeros, off, slope, doubt)


def _torus_ends(along: FormsAlong, u: float) -> tuple[Ends, Ends]:
    ray = _torus_line(along, u)
    line, _, _, (middle, middle_error), reach = ray
    zeros, off, _, doubt = _quartic_zeros(ray, u)
    off = off + 4.0 * u * np.abs(zeros) + middle_error + u * np.abs(middle)
    count = np.isfinite(zeros).sum(axis=0)
    doubt = doubt | (line.speed <= np.linalg.norm(along.d_error, axis=1))
    s = zeros + middle
    anywhere = Ends(
        np.array([np.full(len(middle), np.inf), np.full(len(middle), -np.inf)]),
        np.array([middle - reach - middle_error, np.full(len(middle), -np.inf)]),
        np.array([np.full(len(middle), np.inf), middle + reach + middle_error]),
    )
    parts = []
    for i in (0, 2):
        pair = s[i : i + 2]
        ends = choose(count > i, Ends(pair, pair - off[i : i + 2], pair + off[i : i + 2]), empty_ends(len(middle)))
        t = ends.t
        parts.append(scaled(choose(doubt, anywhere._replace(t=t), ends), line, u))
    return parts[0], parts[1]


def torus_point_errors(along: FormsAlong, t: Array, u: float) -> Array:
    """Return the bounds of |error| (R,) of the forms from which a normal comes, where rays meet the torus at t."""
    with np.errstate(all="ignore"):
        ray = _torus_line(along, u)
        zeros, off, slope, _ = _quartic_zeros(ray, u)
        middle, middle_error = ray.middle
        s = t * ray.line.speed - middle
        nearest = np.argmin(np.nan_to_num(np.abs(zeros - s), nan=np.inf), axis=0), np.arange(len(s))
        # The shader takes one more step of Newton's method from the rounded root.
        rounded = off[nearest] + middle_error + 4.0 * u * (np.abs(s) + np.abs(middle))
        after = 2.0 * off[nearest] + np.square(rounded) / ((1.0 - ray.minor[0]) * np.abs(slope[nearest]))
        s_off = np.where(rounded < 0.1 * ray.minor[0], np.minimum(after, 2.0 * rounded), 2.0 * rounded)
        e_error = np.linalg.norm(ray.line.e_error[:, 1:], axis=1)
        return ray.m[1] + s_off + np.abs(s) * (e_error + 4.0 * u) + 4.0 * u


def _real_zeros(coefficients: Array, reach: Array) -> Array:
    """Return the real zeros s of s^n + a s^(n-1) + b s^(n-2) + .. within +-reach, in order, inf after them (n, R).

    `coefficients` are a, b, .. (R, n). Zeros are eigenvalues of companion matrices.
    """
    count, degree = coefficients.shape
    companion = np.zeros((count, degree, degree))
    companion[:, 0, :] = -coefficients
    companion[:, range(1, degree), range(degree - 1)] = 1.0
    zeros = np.linalg.eigvals(np.nan_to_num(companion)).T
    # A double zero may come as a pair with imaginary parts of the root of 2^-53.
    real = (np.abs(zeros.imag) <= 2.0**-24) & (np.abs(zeros.real) <= reach)
    return np.sort(np.where(real, zeros.real, np.inf), axis=0)


def _value(m: Array, e: Array, minor: Array, s: Array) -> tuple[Array, Array, Array, Array]:
    """Return F at s (n, R), half its derivative, the distance from the axis, and |rho - 1| + |z|."""
    finite = np.where(np.isfinite(s), s, 0.0)
    x = m + finite[..., None] * e
    rho = np.hypot(x[..., 0], x[..., 1])
    off, z = rho - 1.0, x[..., 2]
    growth = (x[..., 0] * e[:, 0] + x[..., 1] * e[:, 1]) / np.maximum(rho, np.finfo(float).tiny)
    F = np.where(np.isfinite(s), off * off - (minor - z) * (minor + z), np.nan)
    return F, off * growth + z * e[:, 2], rho, np.abs(off) + np.abs(z)


def _value_error(m: Array, minor: Array, s: Array, height: Array, errors: tuple[Array, Array, Array, float]) -> Array:
    """Return the bound of the |error| of F at s (n, R), for `height` |rho - 1| + |z|."""
    m_error, e_error, minor_error, u = errors
    finite = np.abs(np.where(np.isfinite(s), s, 0.0))
    moved = m_error + finite * (e_error + u) + 3.0 * u * (np.linalg.norm(m, axis=1) + finite) + u
    error = (2.0 * height + moved) * moved + 2.0 * minor * minor_error
    return error + 5.0 * u * (np.square(height) + np.square(minor))
