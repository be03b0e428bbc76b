"""Spans of rays in second-order cones: balls, cylinders and cones without their ends, under any affine map.

A second-order cone is the convex set of all points x with |(l1, l2, l3)(x)| <= l0(x), for four affine forms l. A ray is
two arrays: the forms at its origin, `p` [R, 4], and their slopes along it, `d` [R, 4]. The span of a ray is the pair of
distances (entry, exit) [R] on its whole line, in units of its direction; (inf, -inf) if the line misses the set.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Span = tuple[Array, Array]


def span(p: Array, d: Array) -> Span:
    """Return the spans of rays. The origin moves to the point nearest to the axis first, so that little cancels."""
    square = (d[:, 1:] ** 2).sum(axis=1)
    moves = np.zeros(len(p))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(2):  # the second time, the rounding error of the first
            move = np.where(square > 0.0, -(p[:, 1:] * d[:, 1:]).sum(axis=1) / square, 0.0)
            p, moves = p + move[:, None] * d, moves + move
        p0, d0 = p[:, 0], d[:, 0]
        length = np.linalg.norm(p[:, 1:], axis=1)
        # Along the line, l0^2 - l1^2 - l2^2 - l3^2 is a t^2 + 2 b t + c. The sum l.d is 0 after the move.
        a = _difference_of_squares(d0, np.sqrt(square))
        b = p0 * d0
        c = _difference_of_squares(p0, length)
        square_root = np.sqrt(np.maximum(square * c + (d0 * length) ** 2, 0.0))
        q = -(b + np.copysign(square_root, b))
        # q is 0 only if both b and the root are.
        first, second = q / a, np.where(q == 0.0, 0.0, c / q)
        low, high = np.fmin(first, second), np.fmax(first, second)
        between = (a < 0.0) & (square_root > 0.0) & (p0 - b / a * d0 > 0.0)
        # The line meets the other half of the double cone as well, at the root that does not count.
        onwards = (a > 0.0) & (d0 > 0.0)
        back = (a > 0.0) & (d0 < 0.0)
        along = (a == 0.0) & (d0 != 0.0) & (b != 0.0)  # parallel to a generator: one root
        whole = (square == 0.0) & (d0 == 0.0) & (c >= 0.0) & (p0 > 0.0)  # parallel to a cylinder's axis
        entry = np.select([between | onwards, along & (d0 > 0.0), back | along & (d0 < 0.0) | whole],
                          [np.where(onwards, high, low), second, -np.inf], np.inf)  # fmt: skip
        exit = np.select([between | back, along & (d0 < 0.0), onwards | along & (d0 > 0.0) | whole],
                         [np.where(back, low, high), second, np.inf], -np.inf)  # fmt: skip
    return entry + moves, exit + moves


def span_from_surface(p: Array, d: Array) -> Span:
    """Return the spans of rays whose origins lie on the surface: one of the two distances is exactly 0.

    A ray that stays inside for ever, in one of its directions, does so from any point of the surface. At the apex of a
    cone only this is known: b is 0 or a rounding error there.
    """
    a = d[:, 0] ** 2 - (d[:, 1:] ** 2).sum(axis=1)
    b = p[:, 0] * d[:, 0] - (p[:, 1:] * d[:, 1:]).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        other = -2.0 * b / a
    stays = a > 0.0
    enters, leaves = np.where(stays, d[:, 0] > 0.0, b > 0.0), np.where(stays, d[:, 0] < 0.0, b < 0.0)
    entry = np.select([enters, leaves], [0.0, np.where(a < 0.0, other, -np.inf)], np.inf)
    exit = np.select([leaves, enters], [0.0, np.where(a < 0.0, other, np.inf)], -np.inf)
    return entry, exit


def outward(p: Array) -> Array:
    """Return the outward gradients of |(l1, l2, l3)|^2 - l0^2, halved, by the forms l [R, 4]."""
    return p * (-1.0, 1.0, 1.0, 1.0)


def _difference_of_squares(x: Any, y: Any) -> Array:
    return (x - y) * (x + y)
