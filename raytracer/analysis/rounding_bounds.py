"""Rounding error bounds of rays, and of their roots with spheres, those in `shaders/geometry/sphere.glsl`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.ground_truth.microfacets import dot
from raytracer.scene.solids.sphere import Sphere

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

UNIT = {32: 2.0**-24, 64: 2.0**-53}  # half a unit in the last place of 1
# The number of roundings, of half a unit each, in the result of a few operations: the input (1), a direction (sum,
# scale, product, and a common factor of up to 2 units: 4), a product and a sum (2), and one more, because GLSL allows
# an error of a unit in some functions.
FEW_ROUNDINGS = 8.0


class RoundedView(NamedTuple):
    """The view in which rays are traced."""

    R: Array  # rotation to view space
    eye: Vec3  # position of the camera
    pixels: int  # W + H
    u: float  # unit of the arithmetic

    def linear(self, length: Any) -> Any:
        """Return the error of cameraSlope() that is not relative to its result, plus float64's error on the host."""
        return (self.pixels * 2.0**-22 * self.u + FEW_ROUNDINGS * UNIT[64]) * length


class Roots(NamedTuple):
    """Both roots of each ray with a leaf, and their error bounds."""

    t: Array  # the roots (2, R), inf: none
    error: Array  # bounds of their |error| (2, R)
    tangent: Mask  # whether the existence of the roots is in doubt (R,)
    middle: Array  # if so, the middle between the possible roots (R,)
    reach: Array  # and their largest distance from the middle (R,)
    half: Array  # bound of the |error| of half the chord between the roots (R,)


class Rays(NamedTuple):
    """Rays in view space: origins and directions (R, 3), and the bounds of their errors (R,). `camera`: camera rays."""

    ro: Array
    rd: Array
    ro_error: Array
    rd_error: Array
    camera: bool


def sphere_roots(view: RoundedView, sphere: Sphere, rays: Rays) -> Roots:
    """Compute the roots of a sphere and their error bounds."""
    u, r = view.u, sphere.radius
    c = view.R @ np.subtract(sphere.center, view.eye)
    to_center = c - rays.ro
    along = dot(to_center, rays.rd)
    p = np.linalg.norm(np.cross(to_center, rays.rd), axis=1)
    distance = np.linalg.norm(to_center, axis=1)
    if rays.camera:
        p_error = moment_error(c, rays.rd, u) + FEW_ROUNDINGS * UNIT[64] * np.linalg.norm(c)
        along_error = FEW_ROUNDINGS * u * np.abs(along) + view.linear(np.linalg.norm(c))
        power = np.full(len(p), sphere.power(view.eye))
        power_error = u * np.abs(power)
    else:
        moved = rays.ro_error + u * np.linalg.norm(c) + u * distance
        p_error = along_error = moved + distance * rays.rd_error + FEW_ROUNDINGS * u * distance
        power = (distance - r) * (distance + r)
        origin = np.linalg.norm(rays.ro, axis=1)
        at_eye = abs(sphere.power(view.eye))
        by_eye = u * at_eye + origin * np.linalg.norm(c + to_center, axis=1) * FEW_ROUNDINGS * u
        by_center = (distance + r) * (u * np.linalg.norm(c) + FEW_ROUNDINGS * u * (distance + r))
        power_error = 2.0 * distance * rays.ro_error + np.where(origin < distance, by_eye, by_center) * 2.0
    # The shader uses one of two forms of the discriminant. If it is in doubt which one, the larger bound counts.
    q_error = p_error + u * r + 2.0 * u * (r + p)
    by_moment = (r + p + np.abs(r - p) + q_error) * q_error
    by_power = (2.0 * np.abs(along) + along_error) * along_error + power_error + 2.0 * u * (along**2 + np.abs(power))
    nearer = np.abs(along) < r
    square = np.where(nearer, along**2 - power, (r - p) * (r + p))
    error = np.where(nearer, by_power, by_moment)
    either = np.abs(np.abs(along) - r) <= along_error + u * r
    error = np.where(either, np.maximum(by_power, by_moment), error)

    half = np.sqrt(np.maximum(square, 0.0))
    most = np.sqrt(np.maximum(square + error, 0.0))
    half_error = np.maximum(most - half, half - np.sqrt(np.maximum(square - error, 0.0))) + 2.0 * u * half
    outer = along + np.copysign(half, along)
    outer_error = along_error + half_error + u * np.abs(outer)
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = power / outer
        inner_error = (power_error + np.abs(inner) * outer_error) / np.maximum(np.abs(outer) - outer_error, 0.0)
        inner_error += 2.0 * u * np.abs(inner)
    missed = square + error <= 0.0
    t = np.where(missed, np.inf, [np.minimum(inner, outer), np.maximum(inner, outer)])
    inner_first = inner < outer
    errors = np.where(inner_first, [inner_error, outer_error], [outer_error, inner_error])
    return Roots(t, np.nan_to_num(errors, nan=np.inf), np.abs(square) <= error, along, most + along_error, half_error)


def moment_error(c: Array, rd: Array, unit: float) -> Array:
    """Return the bound of |error| of the length of cross(c, rd) (R,), by the errors of all products.

    The vectors are (R, 3) or (3,). `unit` is the unit of the arithmetic.
    """
    a, b = np.abs(np.broadcast_to(c, rd.shape)), np.abs(rd)
    products = np.roll(a, -1, axis=1) * np.roll(b, -2, axis=1) + np.roll(a, -2, axis=1) * np.roll(b, -1, axis=1)
    return FEW_ROUNDINGS * unit * (np.linalg.norm(products, axis=1) + np.linalg.norm(np.cross(c, rd), axis=1))
