"""Rounding error bounds of the roots of rays with round walls and cone walls.

They are the bounds in `shaders/geometry/round_wall.glsl` and `cone_wall.glsl`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from raytracer.analysis.rounding_bounds import FEW_ROUNDINGS, UNIT, Array, Mask, Rays, RoundedView
from raytracer.ground_truth.microfacets import dot

# The roundings of one component of d / |d|: the product, the sum, the root, and the quotient.
_OF_UNIT = 4.0


class Forms(NamedTuple):
    """The forms l(x) = w.x + c of a wall (wall.glsl) in view space, of any common scale: l0, l1, l2, l3.

    They are the same for all rays, or others for each ray.
    """

    w: Array  # (4, 3) or (R, 4, 3)
    c: Array  # (4,) or (R, 4)


class FormsAlong(NamedTuple):
    """Forms along rays, l(t) = p + t d, and the bounds of the errors of p and d, each (R, 4)."""

    p: Array
    d: Array
    p_error: Array
    d_error: Array
    power: Array  # l0^2 - |(l1, l2, l3)|^2 at the rays' origins (R,)
    power_error: Array


class Ends(NamedTuple):
    """The interval of each ray's line in the space within a face, (2, R) each: where it begins, and where it ends.

    The rounded ends are within [low, high]. The interval is empty if it ends before it begins.
    """

    t: Array
    low: Array
    high: Array


def empty_ends(count: int) -> Ends:
    """Return the empty intervals of rays that surely miss."""
    t = np.repeat([[np.inf], [-np.inf]], count, axis=1)
    return Ends(t, t, t)


def forms_along(view: RoundedView, forms: Forms, rays: Rays) -> FormsAlong:
    """Compute forms along rays, with the errors that the compiler and the shader make."""
    u = view.u
    p, d = _products(forms.w, rays.ro) + forms.c, _products(forms.w, rays.rd)
    length = np.linalg.norm(forms.w, axis=-1)
    power = 2.0 * p[:, 0] ** 2 - dot(p, p)
    if rays.camera:
        p_error = (u + FEW_ROUNDINGS * UNIT[64]) * np.abs(p)
        d_error = FEW_ROUNDINGS * u * np.abs(d) + view.linear(length)
        power_error = u * np.abs(power) + FEW_ROUNDINGS * UNIT[64] * dot(p, p)
    else:
        p_error = u * (4.0 * _products(np.abs(forms.w), np.abs(rays.ro)) + 2.0 * np.abs(forms.c))
        p_error += rays.ro_error[:, None] * length
        d_error = 4.0 * u * _products(np.abs(forms.w), np.abs(rays.rd)) + rays.rd_error[:, None] * length
        power_error = 2.0 * dot(np.abs(p), p_error) + dot(p_error, p_error) + 4.0 * u * dot(p, p)
    return FormsAlong(p, d, p_error, d_error, power, power_error)


def _products(w: Array, vectors: Array) -> Array:
    """Return w.v of each form and each ray's vector (R, 4)."""
    return (w @ vectors[:, :, None])[..., 0]


class _Unit(NamedTuple):
    """Rays in the space of the forms: their unit directions, the errors of these, and the scale of t."""

    speed: Array  # |d| (R,)
    e: Array
    e_error: Array
    scale: Array  # bound of the relative error of 1 / |d| (R,)


def unit_directions(along: FormsAlong, u: float) -> _Unit:
    """Return the unit directions of rays in the space of the forms."""
    speed = np.linalg.norm(along.d, axis=1)
    least = np.maximum(speed - np.linalg.norm(along.d_error, axis=1), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        e = along.d / speed[:, None]
        scale = np.linalg.norm(along.d_error, axis=1) / least + _OF_UNIT * u
        e_error = along.d_error / least[:, None] + np.abs(e) * scale[:, None]
    return _Unit(speed, e, e_error, scale)


def cross_error(a: Array, b: Array, a_error: Array, b_error: Array, u: float) -> Array:
    """Return the bound of the |error| of each component of a x b (R, 3)."""
    a, b, total = np.abs(a), np.abs(b), np.zeros(a.shape)
    for i, j in ((-1, -2), (-2, -1)):
        p, dp = np.roll(a, i, axis=1), np.roll(a_error, i, axis=1)
        q, dq = np.roll(b, j, axis=1), np.roll(b_error, j, axis=1)
        total += p * dq + q * dp + dp * dq + 3.0 * u * p * q
    return total


def square_root_error(square: Array, error: Array, u: float) -> tuple[Array, Array]:
    """Return the root of max(square, 0), and the bound of its |error|."""
    root = np.sqrt(np.maximum(square, 0.0))
    most, least = np.sqrt(np.maximum(square + error, 0.0)), np.sqrt(np.maximum(square - error, 0.0))
    return root, np.maximum(most - root, root - least) + 2.0 * u * root


def round_ends(along: FormsAlong, u: float) -> Ends:
    """Return the intervals of rays in a round wall."""
    with np.errstate(all="ignore"):  # numbers without a meaning are not chosen
        return _round_ends(along, u)


def _round_ends(along: FormsAlong, u: float) -> Ends:
    r, r_error = along.p[:, 0], along.p_error[:, 0]
    p, dp = along.p[:, 1:], along.p_error[:, 1:]
    line = unit_directions(along, u)
    e, de = line.e[:, 1:], line.e_error[:, 1:]
    power, power_error = -along.power, along.power_error  # the product of both roots
    middle = -dot(p, e)
    middle_error = dot(np.abs(p), de) + dot(dp, np.abs(e)) + dot(dp, de) + 4.0 * u * dot(np.abs(p), np.abs(e))
    moment = np.linalg.norm(np.cross(p, e), axis=1)
    moment_error = np.linalg.norm(cross_error(p, e, dp, de, u), axis=1)
    # The shader uses one of two forms of the discriminant. If it is in doubt which one, the larger bound counts.
    by_moment = (2.0 * moment + moment_error) * moment_error + (2.0 * r + r_error) * r_error
    by_moment += 5.0 * u * (r * r + moment * moment)
    by_power = (2.0 * np.abs(middle) + middle_error) * middle_error + power_error
    by_power += 2.0 * u * (middle**2 + np.abs(power))
    error = np.where(np.abs(middle) < r, by_power, by_moment)
    either = np.abs(np.abs(middle) - r) <= middle_error + r_error
    error = np.where(either, np.maximum(by_power, by_moment), error)
    square = np.where(np.abs(middle) < r, middle**2 - power, (r - moment) * (r + moment))

    half, half_error = square_root_error(square, error, u)
    outer = middle + np.copysign(half, middle)
    outer_error = middle_error + half_error + u * np.abs(outer)
    inner = power / outer
    inner_error = (power_error + np.abs(inner) * outer_error) / np.maximum(np.abs(outer) - outer_error, 0.0)
    inner_error += 2.0 * u * np.abs(inner)
    s = np.array([np.minimum(inner, outer), np.maximum(inner, outer)])
    s_error = np.where(inner < outer, [inner_error, outer_error], [outer_error, inner_error])
    # A chord in doubt is within these ends, or not there.
    reach = np.sqrt(np.maximum(square + error, 0.0)) + middle_error + u * np.abs(middle)
    doubt = ~(np.abs(square) > error)
    low = np.where(doubt, [middle - reach, np.full(len(reach), -np.inf)], s - s_error)
    high = np.where(doubt, [np.full(len(reach), np.inf), middle + reach], s + s_error)
    ends = scaled(Ends(s, low, high), line, u)
    ends = choose(square + error <= 0.0, empty_ends(len(r)), ends)
    # Along the axis of a cylinder, all of the line is inside, or nothing of it.
    axial = line.speed <= np.linalg.norm(along.d_error, axis=1)
    unbounded = np.repeat([[-np.inf], [np.inf]], len(r), axis=1)
    # The distance at which a ray may have crossed the wall, if it is inside or outside now.
    gap = np.abs(r - np.linalg.norm(p, axis=1)) - np.linalg.norm(dp, axis=1) - r_error - 4.0 * u * r
    far = np.maximum(gap, 0.0) / (line.speed + np.linalg.norm(along.d_error, axis=1))
    sure, inside = gap > 0.0, along.power > 0.0
    low = np.array([np.where(sure & ~inside, far, -np.inf), np.where(sure & inside, far, -np.inf)])
    high = np.array([np.where(sure & inside, -far, np.inf), np.full(len(r), np.inf)])
    return choose(axial, Ends(np.where(inside, unbounded, -unbounded), low, high), ends)


def scaled(ends: Ends, line: _Unit, u: float) -> Ends:
    """Return the ends s / |d|, with the error of the division and of |d|."""
    t, low, high = (s / line.speed for s in ends)
    more = line.scale + 2.0 * u
    low, high = low - np.abs(low) * more, high + np.abs(high) * more
    return Ends(t, np.where(np.isinf(ends.low), ends.low, low), np.where(np.isinf(ends.high), ends.high, high))


def choose(mask: Mask, first: Ends, second: Ends) -> Ends:
    """Return for each ray the ends in `first` where `mask` holds, and else those in `second`."""
    return Ends(*(np.where(mask, a, b) for a, b in zip(first, second, strict=True)))


def cone_ends(along: FormsAlong, u: float) -> Ends:
    """Return the intervals of rays in a cone wall."""
    with np.errstate(all="ignore"):  # numbers without a meaning are not chosen
        return _cone_ends(along, u)


def _cone_ends(along: FormsAlong, u: float) -> Ends:
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
    root, root_error = square_root_error(square, error, u)

    middle, middle_error = -dot(p, e), products
    m = np.concatenate([dot(E, ev)[:, None], np.cross(ev, B) - e0 * E], axis=1)
    m_error = np.linalg.norm([E_off, B_off], axis=0) + np.sqrt(EE + BB) * (np.linalg.norm(de, axis=1) + 6.0 * u)
    near_b = 2.0 * m[:, 0] * e[:, 0]
    near_b_error = 2.0 * (m_error + np.abs(m[:, 0]) * (de[:, 0] + u))
    near_power = m**2 @ sign
    near_power_error = (2.0 * np.sqrt(dot(m, m)) + m_error) * m_error + 4.0 * u * dot(m, m)
    far, far_off = _cone_roots((A, A_error), (b, products), (along.power, along.power_error), (root, root_error), u)
    near, near_off = _cone_roots(
        (A, A_error), (near_b, near_b_error), (near_power, near_power_error), (root, root_error), u
    )
    shifted, shifted_off = near + middle, near_off + middle_error + u * np.abs(near + middle)
    take = np.abs(near) < 0.5 * np.abs(middle)
    either = np.abs(np.abs(near) - 0.5 * np.abs(middle)) <= near_off + middle_error
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
    flat = choose(np.abs(near_b) <= near_b_error, Ends(flat.t, -np.abs(everywhere), np.abs(everywhere)), flat)
    ends = choose(is_across, across, choose(is_inwards, inwards, flat))
    unknown = line.speed <= np.linalg.norm(along.d_error, axis=1)
    return scaled(choose(unknown, Ends(ends.t, -np.abs(everywhere), np.abs(everywhere)), ends), line, u)


def _cone_roots(
    A: tuple[Array, Array], b: tuple[Array, Array], c: tuple[Array, Array], r: tuple[Array, Array], u: float
) -> tuple[Array, Array]:
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
