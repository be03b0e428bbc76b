"""Roots of cells in float64 are those of their faces, and their bounds hold them."""

import math

import numpy as np
from raytracer.analysis.cell_bounds import placed_roots

from raytracer.analysis.rounding_bounds import UNIT, Rays, RoundedView
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.box import Box


def test_roots_of_a_turned_box_are_those_of_the_box_for_turned_rays() -> None:
    rng = np.random.default_rng(2)
    count, eye = 5000, (0.3, -0.2, 4.0)
    c, s = math.cos(0.7), math.sin(0.7)
    matrix = (c, -s, 0.0, 0.5), (s, c, 0.0, -0.25), (0.0, 0.0, 1.0, 0.125)
    leaf = Placed(Box((-1, -2, -0.5), (1, 0.5, 0.75)), matrix)
    rd = np.array([0.1, 0.0, -4.0]) + rng.normal(size=(count, 3))
    rd /= np.linalg.norm(rd, axis=1)[:, None]
    none = np.zeros(count)
    rays = Rays(np.zeros((count, 3)), rd, none, none, True)
    roots = placed_roots(RoundedView(np.eye(3), eye, 3000, UNIT[32]), leaf, rays)
    # In the space of the box, by the formula for a box with sides along the axes (Kay and Kajiya 1986).
    turn = np.array(matrix)[:, :3]
    ro, rd = (np.array(eye) - np.array(matrix)[:, 3]) @ turn, rd @ turn
    a, b = (np.array([-1, -2, -0.5]) - ro) / rd, (np.array([1, 0.5, 0.75]) - ro) / rd
    first, last = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    hit = first < last
    assert 0.3 < hit.mean() < 0.9
    np.testing.assert_array_equal(np.isfinite(roots.t[0][~roots.tangent]), hit[~roots.tangent])
    sure = hit & ~roots.tangent
    np.testing.assert_allclose(roots.t[:, sure], [first[sure], last[sure]], rtol=1e-13)
    assert np.all(roots.error[:, sure] > UNIT[32]) and np.median(roots.error[:, sure]) < 1e-5
    assert roots.tangent.mean() < 1e-3
