"""Rounding error bounds of walls along rays, and of the roots and normals of rays with round walls.

They are the bounds in `shaders/geometry/wall.glsl` and `round_wall.glsl`.
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


def unknown_ends(t: Array) -> Ends:
    """Return the intervals of rays whose ends, rounded to t (2, R), may be anywhere."""
    return Ends(t, np.full_like(t, -np.inf), np.full_like(t, np.inf))


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


class UnitLine(NamedTuple):
    """Rays in the space of the forms: their unit directions, the errors of these, and the scale of t."""

    speed: Array  # |d| (R,)
    e: Array
    e_error: Array
    scale: Array  # bound of the relative error of 1 / |d| (R,)


def unit_directions(along: FormsAlong, u: float) -> UnitLine:
    """Return the unit directions of rays in the space of the forms."""
    speed = np.linalg.norm(along.d, axis=1)
    least = np.maximum(speed - np.linalg.norm(along.d_error, axis=1), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        e = along.d / speed[:, None]
        scale = np.linalg.norm(along.d_error, axis=1) / least + _OF_UNIT * u
        e_error = along.d_error / least[:, None] + np.abs(e) * scale[:, None]
    return UnitLine(speed, e, e_error, scale)


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


class _Chord(NamedTuple):
    """The chords of rays in a round wall. Numbers come with the bounds of their |error|."""

    line: UnitLine
    middle: tuple[Array, Array]  # the place of the chord's middle on the ray
    moment: tuple[Array, Array]  # the distance of the chord from the centre
    square: tuple[Array, Array]  # the square of half the chord


def _chord(along: FormsAlong, u: float) -> _Chord:
    r, r_error = along.p[:, 0], along.p_error[:, 0]
    p, dp = along.p[:, 1:], along.p_error[:, 1:]
    line = unit_directions(along, u)
    e, de = line.e[:, 1:], line.e_error[:, 1:]
    power, power_error = -along.power, along.power_error
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
    return _Chord(line, (middle, middle_error), (moment, moment_error), (square, error))


def _round_ends(along: FormsAlong, u: float) -> Ends:
    r, r_error = along.p[:, 0], along.p_error[:, 0]
    p, dp = along.p[:, 1:], along.p_error[:, 1:]
    power, power_error = -along.power, along.power_error  # the product of both roots
    line, (middle, middle_error), _, (square, error) = _chord(along, u)
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


def scaled(ends: Ends, line: UnitLine, u: float) -> Ends:
    """Return the ends s / |d|, with the error of the division and of |d|.

    A ray gets unknown ends if one of them is NaN, from a quotient such as 0 / 0: with NaN, its interval would count as
    empty.
    """
    has_nan = np.any(np.isnan([*ends.low, *ends.high]), axis=0)
    ends = choose(has_nan, unknown_ends(ends.t), ends)
    t, low, high = (s / line.speed for s in ends)
    more = line.scale + 2.0 * u
    low, high = low - np.abs(low) * more, high + np.abs(high) * more
    return Ends(t, np.where(np.isinf(ends.low), ends.low, low), np.where(np.isinf(ends.high), ends.high, high))


def choose(mask: Mask, first: Ends, second: Ends) -> Ends:
    """Return for each ray the ends in `first` where `mask` holds, and else those in `second`."""
    return Ends(*(np.where(mask, a, b) for a, b in zip(first, second, strict=True)))


def round_point_errors(along: FormsAlong, u: float) -> Array:
    """Return the bounds of |error| (R,) of the forms from which a normal comes, where rays meet the wall."""
    with np.errstate(all="ignore"):
        chord = _chord(along, u)
        half, half_error = square_root_error(*chord.square, u)
        turned = np.linalg.norm(chord.line.e_error, axis=1) + 4.0 * u
        return chord.moment[1] + half_error + (chord.moment[0] + half) * turned
