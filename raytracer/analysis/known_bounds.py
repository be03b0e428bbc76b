"""Rounding error bounds of rays whose start or end is known to lie on a curved wall."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from raytracer.analysis.rounding_bounds import Array, Mask
from raytracer.analysis.wall_bounds import Ends, Forms, FormsAlong
from raytracer.ground_truth.microfacets import dot


class Chord(NamedTuple):
    """Rays at known points of a wall."""

    slope: Array  # the cosines of rays and the outward normal (R,)
    slope_error: Array


def chord_ends(forms: Forms, along: FormsAlong, chord: Chord, known: Array, u: float) -> Ends:
    """Return the intervals of rays in a convex wall, which they meet at the distances `known` (R,).

    `along` are the forms at the known points. The other end is 2 |g| slope / <d, d> further, with the gradient g.
    """
    w = forms.w * np.array([-1.0, 1.0, 1.0, 1.0])[:, None]
    gradient = np.linalg.norm(along.p @ w, axis=1)
    # The shader rescales the point to the wall, so the error of its forms counts once more.
    gradient_error = 2.0 * along.p_error @ np.linalg.norm(w, axis=1) + 8.0 * u * gradient
    power = along.d**2 @ np.array([1.0, -1.0, -1.0, -1.0])
    power_error = 2.0 * dot(np.abs(along.d), along.d_error) + dot(along.d_error, along.d_error)
    power_error += 8.0 * u * dot(along.d, along.d)
    slope = np.abs(chord.slope)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = np.where(power < 0.0, 2.0 * gradient * slope / -power, np.inf)
        least = 2.0 * np.maximum(gradient - gradient_error, 0.0) * np.maximum(slope - chord.slope_error, 0.0)
        least = least / np.maximum(power_error - power, 0.0) * (1.0 - 8.0 * u)
        most = 2.0 * (gradient + gradient_error) * (slope + chord.slope_error)
        most = np.where(power < -power_error, most / (-power - power_error) * (1.0 + 8.0 * u), np.inf)
    least = np.nan_to_num(least, nan=0.0, posinf=np.inf)
    leaves = chord.slope > 0.0
    unsure = slope <= chord.slope_error
    ends = np.where(leaves, [known - t, known], [known, known + t])
    low = np.where(leaves, [known - most, known], [known, known + least])
    high = np.where(leaves, [known - least, known], [known, known + most])
    low = np.where(unsure, [known - most, known], low)
    high = np.where(unsure, [known, known + most], high)
    return Ends(ends, low, high)


def with_known_root(parts: list[Ends], on: Mask, known: Array, leaves: Mask) -> list[Ends]:
    """Return the intervals of rays in a torus, of which the root nearest to the distances `known` (R,) is exact there.

    It is an exit where the rays leave the torus, else an entry. `on`: the rays with such a root.
    """
    off = np.array([np.abs(np.where(leaves, part.t[1], part.t[0]) - known) for part in parts])
    nearest = np.argmin(np.nan_to_num(off, nan=np.inf), axis=0)
    result: list[Ends] = []
    for i, part in enumerate(parts):
        is_here = on & (nearest == i) & np.isfinite(off[i])
        t, low, high = (x.copy() for x in part)
        for x in (t, low, high):
            x[0] = np.where(is_here & ~leaves, known, x[0])
            x[1] = np.where(is_here & leaves, known, x[1])
        # The other end is on the other side of the known one.
        high[0] = np.where(is_here & leaves, np.minimum(high[0], np.nextafter(known, -np.inf)), high[0])
        low[1] = np.where(is_here & ~leaves, np.maximum(low[1], np.nextafter(known, np.inf)), low[1])
        result.append(Ends(t, low, high))
    return result
