"""How far a picture may be from the exact one by the rounding of its numbers, for each pixel.

The error bounds that `shaders/sphere.glsl` and `plane.glsl` state, evaluated along the rays of a
picture. A pixel is doubtful where two answers lie within them: a ray that is tangent to a sphere, two
roots that may come in the other order, a camera or a light that may be on the other side of a surface.
Everywhere else, what is seen and what is lit must be exactly right, and depth and normal within the
bounds. First-order forward error analysis (Higham, "Accuracy and Stability of Numerical Algorithms",
2002), in view space, of the exact numbers' rounding and of every operation's after that.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer import reference, view_space
from raytracer.scene import PointLight, Primitive, Scene, Sphere
from raytracer.settings import Precision

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

UNIT = {32: 2.0**-24, 64: 2.0**-53}  # half a unit in the last place of 1
# Roundings, of half a unit each, in a number made by a handful of operations: those of what is
# given (1), a direction (sum, scale, product, and a common factor of up to 2 units: 4), a product
# and a sum (2), and one to spare for functions that GLSL lets be off by a unit.
_FEW = 8.0


class Resolution(NamedTuple):
    """What rounding may change in a picture of one sample: arrays (H, W)."""

    doubtful: Mask  # what is seen may be another surface, or none
    depth: Array  # |error| of the depth, elsewhere
    normal: Array  # |error| of the normal
    unlit: Mask  # which lights reach the point may differ
    radiance: Array  # |error| of the radiance, where neither is in doubt; inf where it has no bound


class _Roots(NamedTuple):
    """Both roots of every ray with a leaf, inf where there is none; and where whether there are any is in doubt."""

    t: Array  # (2, R)
    error: Array
    tangent: Mask  # (R,)
    middle: Array  # where along the ray that would be, and how far around it
    reach: Array
    half: Array  # |error| of half the chord between the roots


class _Rays(NamedTuple):
    """Rays in view space, (R, 3), with the error of their origins and directions, (R,)."""

    ro: Array
    rd: Array
    ro_error: Array
    rd_error: Array
    camera: bool


def resolution(scene: Scene, size: tuple[int, int], precision: Precision = 32) -> Resolution:
    """The resolution of a picture of `scene` at `size` (width, height), one ray through each pixel's centre."""
    return _Analysis(scene, size, precision).run()


class _Analysis:
    def __init__(self, scene: Scene, size: tuple[int, int], precision: Precision) -> None:
        self._scene, self._size = scene, size
        self._u = UNIT[precision]
        self._tracer = reference.Tracer(scene)
        self._R = view_space.rotation(scene.camera)
        self._eye = np.array(scene.camera.position)
        self._leaves = self._tracer.leaves

    def run(self) -> Resolution:
        world = reference.camera_rays(self._scene.camera, self._size).reshape(-1, 3)
        count = len(world)
        none = np.zeros(count)
        t, surface = self._tracer.first(np.zeros(world.shape), world)
        hit = surface >= 0
        rays = _Rays(np.zeros((count, 3)), world @ self._R.T, none, none, True)
        roots = {k: self._roots(self._leaves[k], rays) for k in self._distinct()}
        depth = np.zeros(count)
        for k in range(len(self._leaves)):
            found = roots[self._same(k)]
            nearer = np.argmin(np.abs(found.t - np.where(hit, t, 0.0)), axis=0)
            depth = np.where(surface == k, found.error[nearer, np.arange(count)], depth)
        doubtful = _doubtful(list(roots.values()), np.where(hit, t + depth, np.inf))
        normal, point = self._normal_errors(rays, roots, surface, t, depth)
        unlit = np.zeros(count, bool)
        ambient = [max(leaf.material.ka) * max(self._scene.ambient) for leaf in self._leaves]
        radiance = _FEW * UNIT[32] * np.array([*ambient, max(self._scene.background)])[surface]
        sure = np.flatnonzero(hit & ~doubtful)
        for light in self._scene.lights:
            doubt, error = self._light_errors(light, world[sure], t[sure], surface[sure], normal[sure], point[sure])
            unlit[sure] |= doubt
            radiance[sure] += error
        # Pictures hold float32, and normals are turned to world space in it.
        depth = depth + UNIT[32] * np.where(hit, t, 0.0)
        normal = normal + _FEW * UNIT[32] * hit
        shape = self._size[::-1]
        return Resolution(
            doubtful.reshape(shape),
            depth.reshape(shape),
            normal.reshape(shape),
            unlit.reshape(shape),
            radiance.reshape(shape),
        )

    def _same(self, k: int) -> int:
        """The first leaf whose surface coincides with leaf k's: their roots are the same numbers."""
        return int(np.argmax(self._tracer.coincide[k]))

    def _distinct(self) -> list[int]:
        return sorted({self._same(k) for k in range(len(self._leaves))})

    def _roots(self, leaf: Primitive, rays: _Rays) -> _Roots:
        if isinstance(leaf, Sphere):
            return self._sphere_roots(leaf, rays)
        return self._plane_roots(leaf, rays)

    def _linear(self, length: Any) -> Any:
        """The error of cameraSlope() that is not relative to what it gives, and float64's, here and in the host."""
        return (sum(self._size) * 2.0**-22 * self._u + _FEW * UNIT[64]) * length

    def _sphere_roots(self, sphere: Sphere, rays: _Rays) -> _Roots:
        u, r = self._u, sphere.radius
        c = self._R @ np.subtract(sphere.center, self._eye)
        to_center = c - rays.ro
        along = _dot(to_center, rays.rd)
        p = np.linalg.norm(np.cross(to_center, rays.rd), axis=1)
        distance = np.linalg.norm(to_center, axis=1)
        if rays.camera:
            p_error = moment_error(c, rays.rd, u) + _FEW * UNIT[64] * np.linalg.norm(c)
            along_error = _FEW * u * np.abs(along) + self._linear(np.linalg.norm(c))
            power = np.full(len(p), sphere.power(self._scene.camera.position))
            power_error = u * np.abs(power)
        else:
            moved = rays.ro_error + u * np.linalg.norm(c) + u * distance
            p_error = along_error = moved + distance * rays.rd_error + _FEW * u * distance
            power = (distance - r) * (distance + r)
            origin = np.linalg.norm(rays.ro, axis=1)
            at_eye = abs(sphere.power(self._scene.camera.position))
            by_eye = u * at_eye + origin * np.linalg.norm(c + to_center, axis=1) * _FEW * u
            by_center = (distance + r) * (u * np.linalg.norm(c) + _FEW * u * (distance + r))
            power_error = 2.0 * distance * rays.ro_error + np.where(origin < distance, by_eye, by_center) * 2.0
        # Either form of the discriminant, and the worse where it is open which one is taken.
        q_error = p_error + u * r + 2.0 * u * (r + p)
        by_moment = (r + p + np.abs(r - p) + q_error) * q_error
        by_power = (
            (2.0 * np.abs(along) + along_error) * along_error + power_error + 2.0 * u * (along**2 + np.abs(power))
        )
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
        return _Roots(
            t, np.nan_to_num(errors, nan=np.inf), np.abs(square) <= error, along, most + along_error, half_error
        )

    def _plane_roots(self, plane: Any, rays: _Rays) -> _Roots:
        u = self._u
        n = self._R @ np.array(plane.unit()[0])
        offset = plane.depth(self._scene.camera.position)
        given = u * abs(offset)
        slope = rays.rd @ n
        depth = offset - rays.ro @ n
        if rays.camera:
            depth_error: Any = given
            slope_error = _FEW * u * np.abs(slope) + self._linear(1.0)
        else:
            depth_error = given + rays.ro_error + 4.0 * u * np.linalg.norm(rays.ro, axis=1) + u * np.abs(depth)
            slope_error = rays.rd_error + 4.0 * u
        with np.errstate(divide="ignore", invalid="ignore"):
            t = depth / slope
            error = (depth_error + np.abs(t) * slope_error) / np.maximum(np.abs(slope) - slope_error, 0.0)
            error += 2.0 * u * np.abs(t)
        parallel = np.abs(slope) <= slope_error
        t = np.where(parallel | ~np.isfinite(t), np.inf, t)
        # Where the slope's sign is open the root may be anywhere far out on either side.
        far = np.abs(depth) / np.maximum(2.0 * slope_error, np.finfo(float).tiny)
        doubt = parallel & ((np.abs(depth) <= depth_error) | (far < 1e30))
        none, zero = np.full(len(t), np.inf), np.zeros(len(t))
        return _Roots(np.array([t, none]), np.nan_to_num([error, none], nan=np.inf), doubt, far, zero, zero)

    def _normal_errors(
        self, rays: _Rays, roots: dict[int, _Roots], surface: Any, t: Array, depth: Array
    ) -> tuple[Array, Array]:
        """|error| of the normals at the hit points, and of these."""
        u = self._u
        normal, point = np.zeros(len(t)), np.zeros(len(t))
        for k, leaf in enumerate(self._leaves):
            on = surface == k
            if not on.any():
                continue
            by_depth = depth[on] + 4.0 * u * t[on]
            if not isinstance(leaf, Sphere):
                normal[on], point[on] = 2.0 * u, by_depth
                continue
            c = self._R @ np.subtract(leaf.center, self._eye)
            rd = rays.rd[on]
            # The normal is made of the two legs to the centre: half the chord, and what is across it.
            half = np.abs(t[on] - rd @ c)
            legs = moment_error(c, rd, u) + roots[self._same(k)].half[on] + _FEW * u * half
            normal[on] = legs / leaf.radius + _FEW * u
            by_center = u * np.linalg.norm(c) + leaf.radius * (normal[on] + 2.0 * u) + 2.0 * u * t[on]
            point[on] = np.where(leaf.radius < t[on], by_center, by_depth)
        return normal, point

    def _light_errors(
        self, light: PointLight, world: Array, t: Array, surface: Any, normal: Array, point: Array
    ) -> tuple[Mask, Array]:
        """Where whether a light reaches the hit points is in doubt, and |error| of what it gives where it does."""
        u = self._u
        P = t[:, None] * (world @ self._R.T)
        n = self._tracer.normals(t[:, None] * world, surface) @ self._R.T
        place = self._R @ np.subtract(light.position, self._eye)
        to_light = place - P
        distance = np.linalg.norm(to_light, axis=1)
        moved = point + u * (np.linalg.norm(place) + distance)
        with np.errstate(divide="ignore", invalid="ignore"):
            L = to_light / distance[:, None]
            L_error = moved / np.maximum(distance - moved, 0.0) + 4.0 * u
        on = self._on(light)
        grazes = np.zeros(len(t), bool)
        if on is not None and not isinstance(self._leaves[on], Sphere):
            grazes = self._tracer.coincide[on][surface]
        doubt = ~np.isfinite(L_error) | (~(np.abs(_dot(n, L)) > normal + L_error + 4.0 * u) & ~grazes)
        rays = _Rays(P, np.nan_to_num(L), point, np.nan_to_num(L_error, posinf=1.0), False)
        found = [self._between(k, rays, surface, n, normal, light, distance) for k in self._distinct()]
        end = distance - moved - 2.0 * u * distance, distance + moved + 2.0 * u * distance
        doubt |= _doubtful(found, end[1])
        for roots in found:
            low, high = _interval(roots)
            doubt |= np.any((high >= end[0]) & (low <= end[1]), axis=0)
        # A cosine is as wrong as its vectors; a lobe at most sqrt(h) times that, for h from 1; Blinn's H
        # by as much more as L + V is short.
        vectors = normal + L_error + _FEW * UNIT[32]
        materials = [leaf.material for leaf in self._leaves]
        kd, ks, h = (
            np.array([value(m) for m in materials])[surface]
            for value in (lambda m: max(m.kd), lambda m: max(m.ks), lambda m: m.h)
        )
        halfway = np.maximum(np.linalg.norm(L - world @ self._R.T, axis=1) / 2.0, np.finfo(float).tiny)
        blinn = np.array([m.model == "blinn" for m in materials])[surface]
        steep = np.where(h == 0.0, 0.0, np.where(h < 1.0, np.inf, np.sqrt(h))) * np.where(blinn, 1.0 / halfway, 2.0)
        with np.errstate(invalid="ignore"):
            lobe = np.where(ks > 0.0, ks * (steep * vectors + 4.0 * _FEW * UNIT[32]), 0.0)
        return doubt & ~grazes, max(light.color) * (kd * vectors + lobe)

    def _between(
        self, k: int, rays: _Rays, surface: Any, n: Array, normal: Array, light: PointLight, distance: Array
    ) -> _Roots:
        """The roots of leaf k for rays that leave `surface` towards a light.

        That at their start is exactly 0, and that at the light, if it lies on the leaf, exactly the distance:
        these are in no doubt.
        """
        leaf = self._leaves[k]
        roots = self._roots(leaf, rays)
        starts = self._tracer.coincide[k][surface]
        ends = np.full(len(starts), self._on(light) == k)
        t = np.full((2, len(starts)), np.inf)
        error = t.copy()
        if isinstance(leaf, Sphere):
            at_light = np.subtract(light.position, leaf.center) @ self._R.T / leaf.radius
            outward = np.where(starts[:, None], n, at_light)
            chord = -2.0 * leaf.radius * _dot(outward, rays.rd)
            other = np.where(starts, chord, distance + chord)
            t[0] = np.where((other > 0.0) & ~(starts & ends), other, np.inf)
            inexact = normal + rays.rd_error + _FEW * self._u
            error[0] = 2.0 * leaf.radius * inexact + np.where(starts, 0.0, _FEW * self._u * distance)
        known = starts | ends
        return roots._replace(
            t=np.where(known, t, roots.t), error=np.where(known, error, roots.error), tangent=roots.tangent & ~known
        )

    def _on(self, light: PointLight) -> int | None:
        """The first leaf, spheres before planes, that the light lies on, as _distinct() numbers it."""
        order = sorted(range(len(self._leaves)), key=lambda k: not isinstance(self._leaves[k], Sphere))
        return next((self._same(k) for k in order if self._leaves[k].touches(light.position)), None)


def moment_error(c: Array, rd: Array, unit: float) -> Array:
    """|error|, (R,), of the length of cross(c, rd) for vectors (R, 3) or (3,): it has that of each of its products."""
    a, b = np.abs(np.broadcast_to(c, rd.shape)), np.abs(rd)
    products = np.roll(a, -1, axis=1) * np.roll(b, -2, axis=1) + np.roll(a, -2, axis=1) * np.roll(b, -1, axis=1)
    return _FEW * unit * (np.linalg.norm(products, axis=1) + np.linalg.norm(np.cross(c, rd), axis=1))


def _interval(roots: _Roots) -> tuple[Array, Array]:
    """(2, R) each: where the roots begin and end to be; inf for none."""
    known = np.isfinite(roots.t)
    t = np.where(known, roots.t, 0.0)
    return np.where(known, t - roots.error, np.inf), np.where(known, t + roots.error, np.inf)


def _doubtful(leaves: list[_Roots], end: Array) -> Mask:
    """Where the order of the roots from 0 to `end`, or how many there are, is in doubt."""
    doubt = np.zeros(len(end), bool)
    for roots in leaves:
        ahead = (roots.middle + roots.reach >= 0.0) & (roots.middle - roots.reach <= end)
        doubt |= roots.tangent & ahead
    low, high = (np.concatenate(ends) for ends in zip(*map(_interval, leaves), strict=True))
    # A root that is 0 exactly, of a camera on a surface, is in no doubt.
    doubt |= np.any((low <= 0.0) & (high >= 0.0) & (low < high), axis=0)
    # Sorted by where they begin, an interval overlaps an earlier one if it begins before the furthest end so far.
    order = np.argsort(low, axis=0)
    low, high = np.take_along_axis(low, order, axis=0), np.take_along_axis(high, order, axis=0)
    furthest = np.maximum.accumulate(high, axis=0)[:-1]
    overlap = (low[1:] <= furthest) & (low[1:] <= end) & (furthest > 0.0) & np.isfinite(low[1:])
    return doubt | np.any(overlap, axis=0)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)
