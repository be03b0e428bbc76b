"""Spans of rays in a torus, from the eigenvalues of the companion matrix of its quartic.

Points are in units of the torus' major radius, relative to its centre, with its axis along z. Then the torus is the
set (rho - 1)^2 + z^2 <= k^2 with rho = hypot(x, y), for the ratio k < 1 of its radii. Rays are origins `p` and
directions `d` [R, 3]. The two spans of a ray are pairs of distances (entry, exit) [R] on its whole line, in order and
in units of its direction; (inf, -inf) for a span that is missing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Spans = list[tuple[Array, Array]]

# The most steps of Newton's method. From eigenvalues, a few suffice; a bisection of [-4, 4] to the last bit takes 55.
_STEPS = 64
# Half a bracket of all roots, from the point of the line nearest to the centre. The torus has a radius below 2.
_REACH = 4.0


def spans(p: Array, d: Array, k: float) -> Spans:
    """Return the two spans of rays."""
    length = np.linalg.norm(d, axis=1)
    d = d / length[:, None]
    moves = np.zeros(len(p))
    for _ in range(2):  # the second time, the rounding error of the first
        move = -(p * d).sum(axis=1)
        p, moves = p + move[:, None] * d, moves + move
    roots = np.full((len(p), 4), np.inf)
    near = (p**2).sum(axis=1) < (1.0 + k) ** 2
    if near.any():
        q, e = p[near], d[near]

        def level(t: Array) -> tuple[Array, Array]:
            return _level(q, e, k, t)

        roots[near] = _roots(_real_parts(_quartic(q, e, k)), level, True) + moves[near, None]
    return _pairs(roots / length[:, None])


def spans_from_surface(p: Array, d: Array, k: float) -> Spans:
    """Return the two spans of rays whose origins lie on the surface: one of the distances is exactly 0.

    Without the root 0, the quartic is a cubic.
    """
    length = np.linalg.norm(d, axis=1)
    d = d / length[:, None]
    cubic = _quartic(p, d, k)[:, :4]

    def level(t: Array) -> tuple[Array, Array]:
        one, three, two, first = cubic.T[..., None]
        return ((one * t + three) * t + two) * t + first, (3.0 * one * t + 2.0 * three) * t + two

    others = _roots(_real_parts(cubic), level, False)
    roots = np.sort(np.hstack((others, np.zeros((len(p), 1)))), axis=1)[:, :4]
    return _pairs(roots / length[:, None])


def outward(p: Array) -> Array:
    """Return the outward gradients of (rho - 1)^2 + z^2, halved, at points [R, 3]."""
    rho = np.hypot(p[:, 0], p[:, 1])
    radial = 1.0 - 1.0 / np.where(rho == 0.0, 1.0, rho)
    return np.stack((p[:, 0] * radial, p[:, 1] * radial, p[:, 2]), axis=1)


def _quartic(p: Array, d: Array, k: float) -> Array:
    """Return the coefficients of (|x|^2 + 1 - k^2)^2 - 4 rho^2 at x = p + t d, for t^4 first [R, 5]."""
    along = (p * d).sum(axis=1)
    power = (p**2).sum(axis=1) + (1.0 - k) * (1.0 + k)
    a, b, c = ((x[:, :2] * y[:, :2]).sum(axis=1) for x, y in ((d, d), (p, d), (p, p)))
    square = 4.0 * along**2 + 2.0 * power - 4.0 * a
    return np.stack((np.ones(len(p)), 4.0 * along, square, 4.0 * along * power - 8.0 * b, power**2 - 4.0 * c), axis=1)


def _real_parts(polynomial: Array) -> Array:
    """Return the real parts of the roots of monic polynomials, sorted, by their companion matrices [R, degree]."""
    degree = polynomial.shape[1] - 1
    companion = np.zeros((len(polynomial), degree, degree))
    companion[:, 0] = -polynomial[:, 1:]
    companion[:, range(1, degree), range(degree - 1)] = 1.0
    return np.sort(np.linalg.eigvals(companion).real.astype(np.float64), axis=1)


def _level(p: Array, d: Array, k: float, t: Array) -> tuple[Array, Array]:
    """Return (rho - 1)^2 + z^2 - k^2 at x = p + t d, and its derivative [R, n]."""
    x, y, z = (p[:, i, None] + t * d[:, i, None] for i in range(3))
    rho = np.hypot(x, y)
    toward = (x * d[:, 0, None] + y * d[:, 1, None]) / np.where(rho == 0.0, 1.0, rho)
    return (rho - 1.0) ** 2 - (k - z) * (k + z), 2.0 * ((rho - 1.0) * toward + z * d[:, 2, None])


def _roots(guesses: Array, level: Callable[[Array], tuple[Array, Array]], is_positive_before: bool) -> Array:
    """Return the roots of a function of t, from guesses in ascending order, one for each root or pair [R, n].

    Between the middles of neighbouring guesses, a change of the sign shows a root, which Newton's method polishes
    within this bracket. The function is positive at +inf, and at -inf if `is_positive_before`. A missing root is inf.
    """
    ends = np.full((len(guesses), 1), _REACH)
    low, high = np.minimum(-ends, guesses[:, :1] - 1.0), np.maximum(ends, guesses[:, -1:] + 1.0)
    edges = np.hstack((low, (guesses[:, 1:] + guesses[:, :-1]) / 2.0, high))
    is_positive = level(edges)[0] > 0.0
    is_positive[:, 0], is_positive[:, -1] = is_positive_before, True
    has_root = is_positive[:, 1:] != is_positive[:, :-1]
    low, high, t = edges[:, :-1].copy(), edges[:, 1:].copy(), guesses.copy()
    rises = is_positive[:, 1:]
    for _ in range(_STEPS):
        value, slope = level(t)
        is_above = (value > 0.0) == rises
        low, high = np.where(is_above, low, t), np.where(is_above, t, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = t - value / slope
        step = np.where((step >= low) & (step <= high), step, (low + high) / 2.0)
        done = ~has_root | (np.abs(step - t) <= 2.0**-52 * np.maximum(np.abs(step), 1.0)) | (value == 0.0)
        if done.all():
            break
        t = np.where(done, t, step)
    return np.sort(np.where(has_root, t, np.inf), axis=1)


def _pairs(roots: Array) -> Spans:
    """Return the spans between each first and second root of four [R, 4]."""
    return [(roots[:, i], np.where(np.isinf(roots[:, i + 1]), -np.inf, roots[:, i + 1])) for i in (0, 2)]
