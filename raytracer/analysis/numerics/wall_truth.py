"""The intervals of rays in curved walls, in the long double of NumPy: 64 bits or more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.numerics.wall_rays import Kind
from raytracer.analysis.rounding_bounds import Rays
from raytracer.analysis.wall_bounds import Forms

Long = NDArray[np.longdouble]


def exact_intervals(kind: Kind, rays: Rays, forms: Forms) -> list[Long]:
    """Return the ends (2, N) of each interval of the rays: one, or two for tori; the first is above the second if
    empty."""
    w, c, ro, rd = (np.asarray(x, np.longdouble) for x in (forms.w, forms.c, rays.ro, rays.rd))
    # Not by matrix products: BLAS has no long double, and NumPy's loops sum in it.
    p, d = (w * ro[:, None]).sum(axis=2) + c, (w * rd[:, None]).sum(axis=2)
    with np.errstate(all="ignore"):
        return _torus(p, d) if kind == "torus" else [_quadric(p, d)]


def _quadric(p: Long, d: Long) -> Long:
    """Return the interval with |(l1, l2, l3)| <= l0, by the formula for quadratic equations without cancellation."""
    E, B = p[:, :1] * d[:, 1:] - d[:, :1] * p[:, 1:], np.cross(p[:, 1:], d[:, 1:])
    a, b, c = (_minkowski(x, y) for x, y in ((d, d), (p, d), (p, p)))
    square = (E * E).sum(axis=1) - (B * B).sum(axis=1)
    root = np.sqrt(np.maximum(square, 0.0))
    q = np.where(b < 0.0, root - b, -root - b)
    growing, falling = np.where(b < 0.0, [q / a, c / q], [c / q, q / a])
    infinite = np.full(len(a), np.inf)
    along = np.where(d[:, 0] > 0.0, [growing, infinite], [-infinite, falling])
    ends = np.where(a >= 0.0, along, [growing, falling])
    missed = (a < 0.0) & ((square <= 0.0) | ((E * d[:, 1:]).sum(axis=1) <= 0.0))
    # Along a cylinder.
    ends = np.where((d == 0.0).all(axis=1), np.where(c > 0.0, [-infinite, infinite], [infinite, -infinite]), ends)
    return np.where(missed, [infinite, -infinite], ends)


def _minkowski(x: Long, y: Long) -> Long:
    return x[:, 0] * y[:, 0] - (x[:, 1:] * y[:, 1:]).sum(axis=1)


def _torus(p: Long, d: Long) -> list[Long]:
    """Return both intervals by the eigenvalues of the companion matrix, polished by Newton's method."""
    minor, count = p[:, 0], len(p)
    speed = np.sqrt((d[:, 1:] ** 2).sum(axis=1))
    e = d[:, 1:] / speed[:, None]
    middle = -(p[:, 1:] * e).sum(axis=1)
    m = p[:, 1:] + middle[:, None] * e
    square = (m * m).sum(axis=1)
    k = square + (1.0 - minor) * (1.0 + minor)
    P, K = 2.0 * k - 4.0 * (e[:, :2] ** 2).sum(axis=1), 8.0 * m[:, 2] * e[:, 2]
    C = k * k - 4.0 * (m[:, :2] ** 2).sum(axis=1)
    companion = np.zeros((count, 4, 4))
    companion[:, 0, 1:] = -np.stack([P, K, C], axis=1).astype(float)
    companion[:, range(1, 4), range(3)] = 1.0
    # Rays far outside have numbers that are too large for eigenvalues, and no root.
    far = square > 4.0
    companion[far] = 0.0
    zeros = np.linalg.eigvals(companion)
    s = zeros.real.astype(np.longdouble)
    real = (np.abs(zeros.imag) < 1e-4) & ~far[:, None]
    P, K, C = P[:, None], K[:, None], C[:, None]
    for _ in range(60):  # near a double zero, each step only halves the error
        slope = (4.0 * s * s + 2.0 * P) * s + K
        s = np.where(real & (slope != 0.0), s - (((s * s + P) * s + K) * s + C) / np.where(slope == 0.0, 1.0, slope), s)
    real &= np.abs(((s * s + P) * s + K) * s + C) < 1e-15
    s = np.sort(np.where(real, s, np.inf), axis=1)
    # Two eigenvalues may have led to one zero.
    s[:, 1:][np.diff(s, axis=1) < 1e-12] = np.inf
    s = np.sort(s, axis=1)
    number = np.isfinite(s.astype(float)).sum(axis=1)
    t = ((s + middle[:, None]) / speed[:, None]).T
    none = np.repeat(np.array([[np.inf], [-np.inf]], np.longdouble), count, axis=1)
    return [np.where(number >= 2, t[:2], none), np.where(number == 4, t[2:], none)]
