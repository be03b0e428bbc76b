"""Pairs of directions for tests of reflectance models, in float32 like on the GPU."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


def above_horizon(rng: np.random.Generator, count: int, least: float = 1e-3) -> Array:
    """Return unit directions whose cosines are at least `least` [count, 3].

    Half of the cosines are evenly distributed, and half of them by logarithm.
    """
    low = least ** rng.random(count)
    cosine = np.where(np.arange(count) % 2, rng.uniform(least, 1.0, count), low)
    phi = rng.uniform(0.0, 2.0 * np.pi, count)
    sine = np.sqrt((1.0 - cosine) * (1.0 + cosine))
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], -1).astype(np.float32)


def direction_pairs(count: int = 4000, seed: int = 0, least: float = 1e-3) -> tuple[Array, Array]:
    """Return (wi, wo) with cosines of at least `least`, each [N, 3].

    Half of the pairs are random; in the other half, wo is 1e-5 to 1 away from the mirror direction of wi.
    """
    rng = np.random.default_rng(seed)
    wi, wo = above_horizon(rng, count, least), above_horizon(rng, count, least)
    near = wi * (-1, -1, 1) + rng.normal(size=(count, 3)) * 10.0 ** -rng.uniform(0, 5, (count, 1))
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    wo[::2] = near[::2]
    wo[:, 2] = np.abs(wo[:, 2])
    return wi[wo[:, 2] > least], wo[wo[:, 2] > least]


def extreme_pairs() -> tuple[Array, Array]:
    """Return (wi, wo), each [N, 3]: all pairs of directions at the pole, at grazing angles and next to each other."""
    directions = [(0.0, 0.0, 1.0)]
    for cosine in (1.0 - 1e-7, 0.7, 1e-3, 1e-7, 1e-20, 0.0):
        sine = np.sqrt(1.0 - cosine**2)
        directions += [(sine, 0.0, cosine), (-sine, 0.0, cosine), (0.6 * sine, 0.8 * sine, cosine)]
    d = np.array(directions, np.float32)
    return np.repeat(d, len(d), axis=0), np.tile(d, (len(d), 1))
