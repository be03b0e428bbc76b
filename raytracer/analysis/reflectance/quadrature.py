"""Quadrature over the hemisphere of directions, which resolves lobes of any width around a known direction.

A rule consists of directions (K, 3) float64 above the horizon and weights (K,): the sum of weights times values is the
integral over the solid angle.

All rules are in polar coordinates about an axis, with Gauss-Legendre nodes in the azimuth and in panels of the angle to
the axis. The azimuth covers only directions above the horizon, because reflectances jump to 0 there. Panels grow by a
constant factor from `_INNERMOST` on, because lobes of all widths, and their tails, are equally smooth in the logarithm
of the angle. So no rule depends on the width of a lobe.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import msgspec
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rule = tuple[Array, Array]

# The end of the innermost panel, an angle to the axis in radians: a tenth of the width of the narrowest lobes in the
# models' ranges (alpha = 1e-4).
_INNERMOST = 1e-5
# The growth factor of panels. A lobe spans three panels or more.
_GROWTH = 2.7

NORMAL = np.array([0.0, 0.0, 1.0])


class Fineness(msgspec.Struct, frozen=True):
    """The numbers of nodes of a rule."""

    panel: int  # nodes of a panel of the angle
    azimuths: int  # nodes of half a circle of the azimuth
    whole: bool = False  # whether the azimuth covers whole circles, because the integrand is not symmetric

    def times(self, factor: float) -> Fineness:
        """Multiply the numbers of nodes by a factor."""
        return Fineness(max(2, round(self.panel * factor)), max(2, round(self.azimuths * factor)), self.whole)


def halfway_rule(w: Array, fine: Fineness) -> Rule:
    """Return a rule in polar coordinates of the halfway vector H between its directions and a unit direction `w` (3,).

    In these coordinates, lobes in N.H have the same shape for any `w`; in coordinates of the directions themselves they
    become long and thin at grazing angles. A solid angle of directions is 4 w.H times the solid angle of H: equation
    (xx) of the article "Microfacet BRDFs from Scratch".
    """
    tilt = _tilt(w)
    x, y = _across(w)
    # The other direction, 2 (w.H) H - w, is above the horizon where cos(azimuth) > -cot(2 angle) cot(tilt).
    angle, width = _angles([(np.pi / 2 - tilt) / 2, (np.pi / 2 + tilt) / 2], fine.panel)
    azimuth, share = _azimuths(_visible(2.0 * angle, tilt), fine, ())
    H = _spherical(angle[:, None], azimuth, x, y, NORMAL)
    w_h = H @ w
    directions = 2.0 * w_h[..., None] * H - w
    return _keep_above(directions, 4.0 * w_h * np.sin(angle)[:, None] * width[:, None] * share)


def polar_rule(axis: Array, fine: Fineness, kinks: Array | None = None) -> Rule:
    """Return a rule in polar coordinates about a unit direction (3,), which may be below the horizon.

    `kinks` is a direction at which the integrand may have kinks: at its angle to the axis, and at right angles to its
    azimuth.
    """
    tilt = _tilt(axis)
    x, y = _across(axis if tilt > 0.0 or kinks is None else kinks)
    first = abs(np.pi / 2 - tilt)
    # Powers of the cosine of the angle to the axis end at a right angle.
    edges = [first, np.pi - first, *([np.pi / 2] if tilt <= np.pi / 2 else [np.pi])]
    if kinks is not None:
        edges.append(float(np.arccos(np.clip(axis @ kinks, -1.0, 1.0))))
    angle, width = _angles(edges, fine.panel)
    azimuth, share = _azimuths(_visible(angle, tilt), fine, () if kinks is None else (np.pi / 2,))
    if tilt > 0.0:
        x = NORMAL * np.sin(tilt) - np.cos(tilt) * x  # at right angles to the axis, upwards
    directions = _spherical(angle[:, None], azimuth, x, y, axis)
    return _keep_above(directions, np.sin(angle)[:, None] * width[:, None] * share)


def union_rule(axes: Sequence[Array], fine: Fineness) -> Rule:
    """Return a rule that resolves lobes around several axes: the union of polar rules about each axis.

    Weights are combined by the balance heuristic (Veach and Guibas 1995), from the densities of the rules' directions.
    """

    def density(axis: Array, directions: Array) -> Array:
        apart = directions - axis  # the length is nearly the angle
        return 1.0 / np.maximum(np.sum(apart * apart, axis=-1), _INNERMOST**2)

    parts = []
    for axis in axes:
        directions, weights = polar_rule(axis, fine)
        whole = np.sum([density(other, directions) for other in axes], axis=0)
        parts.append((directions, weights * density(axis, directions) / whole))
    return np.concatenate([d for d, _ in parts]), np.concatenate([w for _, w in parts])


def facing_rule(w: Array, fine: Fineness) -> Rule:
    """Return a rule over directions above the horizon that face a unit direction `w` (3,), polar about the normal."""
    tilt = _tilt(w)
    x, y = _across(w)
    angle, width = _angles([np.pi / 2 - tilt, np.pi / 2], fine.panel)
    azimuth, share = _azimuths(_visible(angle, tilt), fine, ())
    directions = _spherical(angle[:, None], azimuth, x, y, NORMAL)
    return _keep_above(directions, np.sin(angle)[:, None] * width[:, None] * share)


_legendre = cache(np.polynomial.legendre.leggauss)


def _tilt(w: Array) -> float:
    return float(np.arctan2(np.hypot(w[0], w[1]), w[2]))


def _across(w: Array) -> tuple[Array, Array]:
    """Return two horizontal unit vectors: one towards `w`, and one at right angles to it."""
    sine = float(np.hypot(w[0], w[1]))
    x, y = (w[0] / sine, w[1] / sine) if sine > 0.0 else (1.0, 0.0)
    return np.array([x, y, 0.0]), np.array([-y, x, 0.0])


def _spherical(angle: Array, azimuth: Array, x: Array, y: Array, axis: Array) -> Array:
    across = np.cos(azimuth)[..., None] * x + np.sin(azimuth)[..., None] * y
    return np.sin(angle)[..., None] * across + np.cos(angle)[..., None] * axis


def _visible(angle: Array, tilt: float) -> Array:
    """Return the azimuth, from its highest point, up to which a circle around a tilted axis is above the horizon."""
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = -(np.cos(angle) * np.cos(tilt)) / (np.sin(angle) * np.sin(tilt))
    return np.arccos(np.clip(np.nan_to_num(bound, nan=1.0, posinf=1.0, neginf=-1.0), -1.0, 1.0))


def _angles(edges: Sequence[float], count: int) -> Rule:
    """Return nodes and weights in [0, last of the edges], with `count` nodes in each panel.

    At an edge, the length of the circles above the horizon begins to shrink, or ends, like a square root. Panels at an
    edge have a squared variable, in which the integrand is smooth.
    """
    x, w = _legendre(count)
    u, du = (x + 1.0) / 2.0, w / 2.0
    nodes, weights = [], []
    edges = sorted({0.0, *edges})
    for low, high in pairwise(edges):
        inner = max(low, _INNERMOST)
        number = max(2, int(np.ceil(np.log(high / inner) / np.log(_GROWTH)))) if high > inner else 1
        panels = np.geomspace(min(inner, high), high, number + 1) if high > inner else np.array([high])
        panels = np.array([low, *panels[panels > low]])
        for i, (a, b) in enumerate(pairwise(panels)):
            if i == len(panels) - 2:
                part = b - (b - a) * u * u, 2.0 * u * du
            elif i == 0 and low > 0.0:
                part = a + (b - a) * u * u, 2.0 * u * du
            else:
                part = a + (b - a) * u, du
            nodes.append(part[0])
            weights.append((b - a) * part[1])
    return np.concatenate(nodes), np.concatenate(weights)


def _azimuths(limit: Array, fine: Fineness, kinks: Sequence[float]) -> Rule:
    """Return azimuths and weights (A, K), from minus to plus the limits (A,), which are in [0, pi].

    If the integrand is symmetric, only one side has nodes, with doubled weights.
    """
    x, w = _legendre(-(-fine.azimuths // (len(kinks) + 1)))
    ends = [np.zeros_like(limit), *(np.minimum(kink, limit) for kink in kinks), limit]
    halves = [(b - a)[:, None] / 2.0 for a, b in pairwise(ends)]
    nodes = np.concatenate([h * (x + 1.0) + a[:, None] for h, a in zip(halves, ends, strict=False)], axis=1)
    weights = np.concatenate([h * w for h in halves], axis=1)
    if not fine.whole:
        return nodes, 2.0 * weights
    return np.concatenate([nodes, -nodes], axis=1), np.concatenate([weights, weights], axis=1)


def _keep_above(directions: Array, weights: Array) -> Rule:
    directions, weights = directions.reshape(-1, 3), weights.ravel()
    keep = (directions[:, 2] > 0.0) & (weights > 0.0)
    return directions[keep], weights[keep]
