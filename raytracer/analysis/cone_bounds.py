"""Rounding error bounds of roots and normals of rays with cone walls, those in `shaders/geometry/cone_wall.glsl`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from raytracer.analysis.rounding_bounds import Array, Mask
from raytracer.analysis.wall_bounds import (
    Ends,
    FormsAlong,
    UnitLine,
    choose,
    cross_error,
    empty_ends,
    scaled,
    square_root_error,
    unit_directions,
    unknown_ends,
)
from raytracer.ground_truth.microfacets import dot

Bounded = tuple[Array, Array]  # numbers, and the bounds of their |error|


class _ConeLine(NamedTuple):
    """Rays in the space of the forms. The names are those in the shader."""

    line: UnitLine
    A: Bounded
    b: Bounded
    middle: Bounded  # the place of m on the ray
    m: Bounded  # the point nearest to the apex (R, 4); its error is a length (R,)
    near_b: Bounded  # b about m
    near_power: Bounded
    square: Bounded
    root: Bounded


def _cone_line(along: FormsAlong, u: float) -> _ConeLine:
    p, dp = along.p, along.p_error
    line = unit_directions(along, u)
    e, de = line.e, line.e_error
    p0, e0, dp0, de0 = (x[:, :1] for x in (p, e, dp, de))
    pv, ev, dpv, dev = (x[:, 1:] for x in (p, e, dp, de))
    sign = np.array([1.0, -1.0, -1.0, -1.0])
    A, b = e**2 @ sign, (p * e) @ sign
    A_error = 2.0 * dot(np.abs(e), de) + dot(de, de) + 5.0 * u * dot(e, e)
    products = dot(np.abs(p), de) + dot(dp, np.abs(e)) + dot(dp, de) + 5.0 * u * dot(np.abs(p), np.abs(e))
    E, B = p0 * ev - e0 * pv, np.cross(pv, ev)
    E_error = np.abs(p0) * dev + np.abs(ev) * dp0 + np.abs(e0) * dpv + np.abs(pv) * de0 + dp0 * dev + de0 * dpv
    E_error += 3.0 * u * (np.abs(p0 * ev) + np.abs(e0 * pv))
    B_error = cross_error(pv, ev, dpv, dev, u)
    EE, BB = dot(E, E), dot(B, B)
    E_off, B_off = (np.linalg.norm(x, axis=1) for x in (E_error, B_error))
    by_moment = (2.0 * np.sqrt(EE) + E_off) * E_off + (2.0 * np.sqrt(BB) + B_off) * B_off + 5.0 * u * (EE + BB)
    by_power = (2.0 * np.abs(b) + products) * products + np.abs(A) * along.power_error + np.abs(along.power) * A_error
    by_power += A_error * along.power_error + 3.0 * u * (b * b + np.abs(A * along.power))
    # The shader uses one of two forms of the discriminant. If it is in doubt which one, the larger bound counts.
    unsure = np.abs(np.abs(b) - np.sqrt(EE)) <= products + E_off + 4.0 * u * np.sqrt(EE)
    error = np.where(b * b < EE, by_power, by_moment)
    error = np.where(unsure, np.maximum(by_power, by_moment), error)
    square = EE - BB

    m = np.concatenate([dot(E, ev)[:, None], np.cross(ev, B) - e0 * E], axis=1)
    m_error = np.linalg.norm([E_off, B_off], axis=0) + np.sqrt(EE + BB) * (np.linalg.norm(de, axis=1) + 6.0 * u)
    near_b = 2.0 * m[:, 0] * e[:, 0]
    near_b_error = 2.0 * (m_error + np.abs(m[:, 0]) * (de[:, 0] + u))
    near_power = m**2 @ sign
    near_power_error = (2.0 * np.sqrt(dot(m, m)) + m_error) * m_error + 4.0 * u * dot(m, m)
    return _ConeLine(
        line,
        (A, A_error),
        (b, products),
        (-dot(p, e), products),
        (m, m_error),
        (near_b, near_b_error),
        (near_power, near_power_error),
        (square, error),
        square_root_error(square, error, u),
    )


def cone_ends(along: FormsAlong, u: float) -> Ends:
    """Return the intervals of rays in a cone wall."""
    with np.errstate(all="ignore"):  # numbers without a meaning are not chosen
        return _cone_ends(along, u)


def _cone_ends(along: FormsAlong, u: float) -> Ends:
    cone = _cone_line(along, u)
    line, e = cone.line, cone.line.e
    (A, A_error), (m, m_error), (middle, middle_error) = cone.A, cone.m, cone.middle
    (square, error), (near_b, near_b_error), (root, root_error) = cone.square, cone.near_b, cone.root
    far, far_off = _cone_roots(cone.A, cone.b, (along.power, along.power_error), cone.root, u)
    near, near_off = _cone_roots(cone.A, cone.near_b, cone.near_power, cone.root, u)
    shifted, shifted_off = near + middle, near_off + middle_error + u * np.abs(near + middle)
    starts = (along.power == 0.0) & (along.power_error == 0.0)  # on the wall
    take = (np.abs(near) < 0.5 * np.abs(middle)) & ~starts
    either = (np.abs(np.abs(near) - 0.5 * np.abs(middle)) <= near_off + middle_error) & ~starts
    s = np.where(take, shifted, far)
    s_error = np.where(take, shifted_off, far_off)
    s_error = np.where(either, np.maximum(shifted_off, far_off), s_error)
    low, high = s - s_error, s + s_error

    # Across the cone: both roots, on one nappe. If it is in doubt whether there are any, they are within `reach`.
    least = np.maximum(np.abs(A) - A_error, 0.0)
    center = middle - near_b / A
    reach = np.sqrt(np.maximum(square + error, 0.0)) / least + middle_error + 4.0 * u * np.abs(center)
    reach += (near_b_error + np.abs(near_b / A) * A_error) / least
    everywhere = np.repeat([[-np.inf], [np.inf]], len(A), axis=1)
    doubt = (np.abs(square) <= error) | (np.abs(m[:, 0]) <= m_error)
    across = Ends(
        s,
        np.where(doubt, [center - reach, everywhere[0]], low),
        np.where(doubt, [everywhere[1], center + reach], high),
    )
    across = choose((square + error <= 0.0) | (m[:, 0] < -m_error), empty_ends(len(A)), across)
    # Along the cone: inside from one root on, in the direction in which l0 grows.
    grows = e[:, 0] > 0.0
    inwards = Ends(*(np.where(grows, [x[0], everywhere[1]], [everywhere[0], x[1]]) for x in (s, low, high)))
    # Nearly along a generator: the other root is beyond `floor`, or it is not there.
    floor = np.maximum(np.abs(near_b) + root - near_b_error - root_error, 0.0) / (np.abs(A) + A_error)
    floor = floor * (1.0 - 4.0 * u) - middle_error
    crosses = (near_b > 0.0) == grows
    flat = Ends(
        np.where(A >= 0.0, inwards.t, np.where(crosses, s, empty_ends(len(A)).t)),
        np.where(
            grows,
            np.where(crosses, [low[0], middle + floor], [middle + floor, everywhere[0]]),
            np.where(crosses, [everywhere[0], low[1]], everywhere[0]),
        ),
        np.where(
            grows,
            np.where(crosses, [high[0], everywhere[1]], everywhere[1]),
            np.where(crosses, [middle - floor, high[1]], [everywhere[1], middle - floor]),
        ),
    )
    is_across, is_inwards = A_error < -A, A_error < A
    flat = choose(np.abs(near_b) <= near_b_error, unknown_ends(flat.t), flat)
    ends = choose(is_across, across, choose(is_inwards, inwards, flat))
    unknown = line.speed <= np.linalg.norm(along.d_error, axis=1)
    return scaled(choose(unknown, unknown_ends(ends.t), ends), line, u)


def _cone_roots(A: Bounded, b: Bounded, c: Bounded, r: Bounded, u: float) -> Bounded:
    """Return the roots of A s^2 + 2 b s + c where it grows and where it falls, and their bounds, (2, R) each.

    Each number comes with the bound of its |error|; r^2 is b^2 - A c.
    """
    q = np.where(b[0] < 0.0, r[0] - b[0], -r[0] - b[0])
    q_error = b[1] + r[1] + u * np.abs(q)
    inner, outer = c[0] / q, q / A[0]
    inner_error = (c[1] + np.abs(inner) * q_error) / np.maximum(np.abs(q) - q_error, 0.0) + 2.0 * u * np.abs(inner)
    outer_error = (q_error + np.abs(outer) * A[1]) / np.maximum(np.abs(A[0]) - A[1], 0.0) + 2.0 * u * np.abs(outer)
    falls = b[0] < 0.0
    return np.where(falls, [outer, inner], [inner, outer]), np.where(
        falls, [outer_error, inner_error], [inner_error, outer_error]
    )


def cone_point_errors(along: FormsAlong, enters: Mask, u: float) -> Array:
    """Return the bounds of |error| (R,) of the forms from which a normal comes, where rays enter or leave the wall."""
    with np.errstate(all="ignore"):
        cone = _cone_line(along, u)
        near, near_off = _cone_roots(cone.A, cone.near_b, cone.near_power, cone.root, u)
        s, s_off = (np.where(enters, x[0], x[1]) for x in (near, near_off))
        size = np.sqrt(dot(cone.m[0], cone.m[0])) + np.abs(s)
        return cone.m[1] + s_off + np.abs(s) * np.linalg.norm(cone.line.e_error, axis=1) + 4.0 * u * size
