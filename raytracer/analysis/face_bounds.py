"""Rounding error bounds of the crossings of rays with half-spaces, spheres and walls: where, and whether in doubt."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from raytracer.analysis.rounding_bounds import FEW_ROUNDINGS, Array, Mask, Rays, Roots, RoundedView
from raytracer.analysis.wall_bounds import Ends


class Crossings(NamedTuple):
    """The crossings of each ray with a surface: intervals that hold its roots, and where more may be or not be."""

    low: Array  # the lower ends (2, R), inf: no root
    high: Array  # the upper ends (2, R), inf: no root
    unsure: Mask  # whether the existence of roots is in doubt (R,)
    first: Array  # if so, they are between `first` and `last` (R,)
    last: Array


def crossings_of_roots(roots: Roots) -> Crossings:
    """Return the crossings with a surface of known roots."""
    known = np.isfinite(roots.t)
    t = np.where(known, roots.t, 0.0)
    low, high = np.where(known, t - roots.error, np.inf), np.where(known, t + roots.error, np.inf)
    return Crossings(low, high, roots.tangent, roots.middle - roots.reach, roots.middle + roots.reach)


def crossings_of_ends(ends: Ends) -> Crossings:
    """Return the crossings with the boundary of an interval. Ends without error are known: they cross nothing else."""
    empty = ~(ends.low[0] <= ends.high[1])
    unsure = ~empty & ~(ends.high[0] < ends.low[1])
    is_root = ~empty & ~unsure & (ends.low < ends.high)
    low, high = (np.where(is_root, x, np.inf) for x in (ends.low, ends.high))
    return Crossings(low, high, unsure, ends.low[0], ends.high[1])


def crossings_within(crossings: Crossings, first: Array, last: Array) -> Crossings:
    """Keep only the crossings that may be between `first` and `last` (R,). Without any, first > last."""
    is_near = (crossings.low <= last) & (crossings.high >= first) & (first <= last)
    unsure = crossings.unsure & (crossings.first <= last) & (crossings.last >= first) & (first <= last)
    low, high = (np.where(is_near, x, np.inf) for x in (crossings.low, crossings.high))
    return Crossings(low, high, unsure, crossings.first, crossings.last)


def merged(one: Crossings, other: Crossings) -> Crossings:
    """Return the crossings of either, for the same roots in the same rows, of which either may leave some out."""
    take = one.low <= other.low
    return Crossings(
        np.where(take, one.low, other.low),
        np.where(take, one.high, other.high),
        one.unsure | other.unsure,
        np.minimum(np.where(one.unsure, one.first, np.inf), np.where(other.unsure, other.first, np.inf)),
        np.maximum(np.where(one.unsure, one.last, -np.inf), np.where(other.unsure, other.last, -np.inf)),
    )


def turned(crossings: Crossings) -> Crossings:
    """Return the crossings of a half-space in the rows of its complement: an entry is an exit."""
    return crossings._replace(low=crossings.low[::-1], high=crossings.high[::-1])


def order_in_doubt(surfaces: list[Crossings], end: Array) -> Mask:
    """Return for each ray whether rounding may change the order or number of its roots between 0 and `end` (R,)."""
    doubt = np.zeros(len(end), bool)
    for each in surfaces:
        doubt |= each.unsure & (each.last >= 0.0) & (each.first <= end)
    low, high = (np.concatenate([each[i] for each in surfaces]) for i in range(2))
    # A root of exactly 0, for a camera on a surface, is in no doubt.
    doubt |= np.any((low <= 0.0) & (high >= 0.0) & (low < high), axis=0)
    # In the order of their lower ends, an interval overlaps an earlier one if it begins before the largest upper end so
    # far.
    order = np.argsort(low, axis=0)
    low, high = np.take_along_axis(low, order, axis=0), np.take_along_axis(high, order, axis=0)
    furthest = np.maximum.accumulate(high, axis=0)[:-1]
    overlap = (low[1:] <= furthest) & (low[1:] <= end) & (furthest > 0.0) & np.isfinite(low[1:])
    return doubt | np.any(overlap, axis=0)


def half_space_ends(view: RoundedView, normal: Array, depth: float, rays: Rays) -> Ends:
    """Return the interval of each ray in a half-space with this unit normal in view space, and the camera's depth."""
    u = view.u
    slope, below = rays.rd @ normal, depth - rays.ro @ normal
    if rays.camera:
        slope_error: Any = FEW_ROUNDINGS * u * np.abs(slope) + view.linear(1.0)
        below_error = u * np.abs(below)
    else:
        slope_error = rays.rd_error + 4.0 * u
        below_error = u * (np.abs(below) + abs(depth) + 4.0 * np.linalg.norm(rays.ro, axis=1)) + rays.ro_error
    with np.errstate(divide="ignore", invalid="ignore"):
        t = below / slope
        error = (below_error + np.abs(t) * slope_error) / np.maximum(np.abs(slope) - slope_error, 0.0)
        error += 2.0 * u * np.abs(t)
    # A ray that may be parallel to the face has its root far out on either side, or none. Only the side ahead of the
    # ray counts.
    parallel = ~(np.abs(slope) > slope_error)
    far = (np.abs(below) - below_error) / np.maximum(np.abs(slope) + slope_error, np.finfo(float).tiny)
    inside, outside = below > below_error, below < -below_error
    leaves, count = slope > 0.0, len(slope)
    with np.errstate(invalid="ignore"):  # a root without a meaning is not chosen
        roots = t, t - error, t + error
    first = [np.where(leaves, -np.inf, root) for root in roots]
    last = [np.where(leaves, root, np.inf) for root in roots]
    low = np.where(parallel, [np.where(outside, far, -np.inf), np.where(inside, far, -np.inf)], [first[1], last[1]])
    high = np.where(parallel, [np.where(inside, -far, np.inf), np.full(count, np.inf)], [first[2], last[2]])
    begins = np.where(slope == 0.0, np.where(below < 0.0, np.inf, -np.inf), first[0])
    return Ends(np.array([begins, last[0]]), low, high)


def known_ends(at: Array, slope: Array, slope_error: Array) -> Ends:
    """Return the interval of each ray in a half-space whose face it meets at the known distance `at`."""
    infinite = np.full(len(at), np.inf)
    ends = np.where(slope > 0.0, [-infinite, at], [at, infinite])
    unsure = np.abs(slope) <= slope_error
    return Ends(ends, np.where(unsure, -infinite, ends), np.where(unsure, infinite, ends))


def meet(faces: list[Ends]) -> Ends:
    """Return the common part of the intervals of faces: the last beginning and the first end."""
    return Ends(*(
        np.array([np.max([t[0] for t in each], axis=0), np.min([t[1] for t in each], axis=0)])
        for each in zip(*faces, strict=True)
    ))  # fmt: skip
