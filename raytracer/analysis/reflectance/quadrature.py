"""Quadrature over the hemisphere of directions that resolves lobes of any width around a known direction.

A rule is directions (K, 3) float64 above the horizon and weights (K,), such that the sum of weights times values is
the integral over the solid angle.

All rules are in polar coordinates about an axis: Gauss-Legendre in the azimuth, over just what is above the
horizon, where reflectances jump to 0; and in panels of the angle to the axis. These panels grow by a constant factor
from `_INNERMOST` on: a lobe of any width, and any tail it has, is as smooth in the logarithm of the angle as any
other. No rule needs to know how wide a lobe is.
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

# The angle to the axis, in radians, within which there is one panel: a tenth of the width of the narrowest lobes that
# the models' ranges allow (alpha = 1e-4).
_INNERMOST = 1e-5
# Panels grow by this factor. A lobe spans three of them or more.
_GROWTH = 2.7

NORMAL = np.array([0.0, 0.0, 1.0])


class Fineness(msgspec.Struct, frozen=True):
    """Nodes of a panel of the angle, and of the azimuth's half circle; `whole` circles for what has no symmetry."""

    panel: int
    azimuths: int
    whole: bool = False

    def times(self, factor: float) -> Fineness:
        """The fineness with this times as many nodes of either."""
        return Fineness(max(2, round(self.panel * factor)), max(2, round(self.azimuths * factor)), self.whole)


def halfway(w: Array, fine: Fineness) -> Rule:
    """A rule in polar coordinates of the halfway vector between its directions and the unit direction `w` (3,).

    Lobes of (N.H) have the same shape there wherever `w` is, while in the directions themselves they get long
    and thin at grazing angles. The solid angle of directions is 4 w.H that of H: the article's equation (xx).
    """
    tilt = _tilt(w)
    x, y = _across(w)
    # The other direction, 2 (w.H) H - w, is above the horizon where cos(azimuth) > -cot(2 angle) cot(tilt).
    angle, width = _angles([(np.pi / 2 - tilt) / 2, (np.pi / 2 + tilt) / 2], fine.panel)
    azimuth, share = _azimuths(_visible(2.0 * angle, tilt), fine, ())
    H = _spherical(angle[:, None], azimuth, x, y, NORMAL)
    w_h = H @ w
    directions = 2.0 * w_h[..., None] * H - w
    return _above(directions, 4.0 * w_h * np.sin(angle)[:, None] * width[:, None] * share)


def polar(axis: Array, fine: Fineness, kinks: Array | None = None) -> Rule:
    """A rule in polar coordinates about a unit direction (3,), which may be below the horizon.

    `kinks`: a direction at whose angle to the axis, and square to whose azimuth, what is integrated may have kinks.
    """
    tilt = _tilt(axis)
    x, y = _across(axis if tilt > 0.0 or kinks is None else kinks)
    first = abs(np.pi / 2 - tilt)
    # Powers of the cosine of the angle to the axis end where that is a right one.
    edges = [first, np.pi - first, *([np.pi / 2] if tilt <= np.pi / 2 else [np.pi])]
    if kinks is not None:
        edges.append(float(np.arccos(np.clip(axis @ kinks, -1.0, 1.0))))
    angle, width = _angles(edges, fine.panel)
    azimuth, share = _azimuths(_visible(angle, tilt), fine, () if kinks is None else (np.pi / 2,))
    if tilt > 0.0:
        x = NORMAL * np.sin(tilt) - np.cos(tilt) * x  # square to the axis, upwards
    directions = _spherical(angle[:, None], azimuth, x, y, axis)
    return _above(directions, np.sin(angle)[:, None] * width[:, None] * share)


def about_all(axes: Sequence[Array], fine: Fineness) -> Rule:
    """A rule that has the polar coordinates of each axis around it.

    Each part's weights are its share by the balance heuristic (Veach 1995), of how dense its directions are.
    """

    def density(axis: Array, directions: Array) -> Array:
        apart = directions - axis  # as long as the angle, nearly
        return 1.0 / np.maximum(np.sum(apart * apart, axis=-1), _INNERMOST**2)

    parts = []
    for axis in axes:
        directions, weights = polar(axis, fine)
        whole = np.sum([density(other, directions) for other in axes], axis=0)
        parts.append((directions, weights * density(axis, directions) / whole))
    return np.concatenate([d for d, _ in parts]), np.concatenate([w for _, w in parts])


def facing(w: Array, fine: Fineness) -> Rule:
    """A rule over the directions above the horizon that face the unit direction `w` (3,): polar about the normal."""
    tilt = _tilt(w)
    x, y = _across(w)
    angle, width = _angles([np.pi / 2 - tilt, np.pi / 2], fine.panel)
    azimuth, share = _azimuths(_visible(angle, tilt), fine, ())
    directions = _spherical(angle[:, None], azimuth, x, y, NORMAL)
    return _above(directions, np.sin(angle)[:, None] * width[:, None] * share)


_legendre = cache(np.polynomial.legendre.leggauss)


def _tilt(w: Array) -> float:
    return float(np.arctan2(np.hypot(w[0], w[1]), w[2]))


def _across(w: Array) -> tuple[Array, Array]:
    """Horizontal unit vectors: towards `w`, and square to that."""
    sine = float(np.hypot(w[0], w[1]))
    x, y = (w[0] / sine, w[1] / sine) if sine > 0.0 else (1.0, 0.0)
    return np.array([x, y, 0.0]), np.array([-y, x, 0.0])


def _spherical(angle: Array, azimuth: Array, x: Array, y: Array, axis: Array) -> Array:
    across = np.cos(azimuth)[..., None] * x + np.sin(azimuth)[..., None] * y
    return np.sin(angle)[..., None] * across + np.cos(angle)[..., None] * axis


def _visible(angle: Array, tilt: float) -> Array:
    """Up to which azimuth from its highest point a circle at an angle to an axis of that tilt is above the horizon."""
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = -(np.cos(angle) * np.cos(tilt)) / (np.sin(angle) * np.sin(tilt))
    return np.arccos(np.clip(np.nan_to_num(bound, nan=1.0, posinf=1.0, neginf=-1.0), -1.0, 1.0))


def _angles(edges: Sequence[float], count: int) -> Rule:
    """Nodes and weights in [0, last of the edges], `count` a panel.

    At an edge the length of the circles above the horizon begins to shrink, or ends, as a square root: which the
    squared variable of the panels that end there makes smooth.
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
    """(A, K) azimuths and weights: up to the limits (A,), which are in [0, pi], and as far to the other side.

    Where that is a mirror image, it is counted by the weights.
    """
    x, w = _legendre(-(-fine.azimuths // (len(kinks) + 1)))
    ends = [np.zeros_like(limit), *(np.minimum(kink, limit) for kink in kinks), limit]
    halves = [(b - a)[:, None] / 2.0 for a, b in pairwise(ends)]
    nodes = np.concatenate([h * (x + 1.0) + a[:, None] for h, a in zip(halves, ends, strict=False)], axis=1)
    weights = np.concatenate([h * w for h in halves], axis=1)
    if not fine.whole:
        return nodes, 2.0 * weights
    return np.concatenate([nodes, -nodes], axis=1), np.concatenate([weights, weights], axis=1)


def _above(directions: Array, weights: Array) -> Rule:
    directions, weights = directions.reshape(-1, 3), weights.ravel()
    keep = (directions[:, 2] > 0.0) & (weights > 0.0)
    return directions[keep], weights[keep]
