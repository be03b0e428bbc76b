"""Boxes around solids, with sides along the axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from raytracer.core.validation import Vec3


class Bounds(NamedTuple):
    """A box around a solid, with sides along the axes. Infinite numbers are sides without a bound.

    An empty box has min > max along some axis.
    """

    min: Vec3
    max: Vec3

    def union(self, other: Bounds) -> Bounds:
        """Return the smallest box around both."""
        return Bounds(_each(min, self.min, other.min), _each(max, self.max, other.max))

    def common(self, other: Bounds) -> Bounds:
        """Return the common part of both."""
        return Bounds(_each(max, self.min, other.min), _each(min, self.max, other.max))


def _each(choose: Callable[[float, float], float], a: Vec3, b: Vec3) -> Vec3:
    return choose(a[0], b[0]), choose(a[1], b[1]), choose(a[2], b[2])


EVERYWHERE = Bounds((-math.inf, -math.inf, -math.inf), (math.inf, math.inf, math.inf))


def extent(support: Callable[[Vec3], float]) -> Bounds:
    """Return the smallest box around a solid, by its largest dot(direction, x) for a direction."""
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    high = [support(axis) + 0.0 for axis in axes]
    low = [0.0 - support((-x, -y, -z)) for x, y, z in axes]
    return Bounds((low[0], low[1], low[2]), (high[0], high[1], high[2]))
