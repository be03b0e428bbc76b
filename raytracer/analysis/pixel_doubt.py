"""Rounding error bounds of a picture, for each pixel: the largest difference from the exact picture.

Evaluates the error bounds in `shaders/geometry/sphere.glsl` and `plane.glsl` along the rays of a picture. A pixel is
doubtful if the bounds allow two answers: a ray may hit or miss a sphere, two roots may come in the other order, a
camera or a light may be on the other side of a surface. In all other pixels, the visible surface and the lights that
reach it must be exactly right, and depth and normal within their bounds. The method is first-order forward error
analysis (Higham, "Accuracy and Stability of Numerical Algorithms", 2002), in view space. It counts one rounding for
each exact number of the scene, and one for each operation.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.rounding_bounds import (
    FEW_ROUNDINGS,
    UNIT,
    Rays,
    Roots,
    RoundedView,
    interval,
    moment_error,
    order_in_doubt,
    root_errors,
)
from raytracer.compiler import view_space
from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.microfacets import dot
from raytracer.scene.lights import PointLight
from raytracer.scene.options import Precision
from raytracer.scene.scene import Scene
from raytracer.scene.solids.sphere import Sphere

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class PixelDoubt(NamedTuple):
    """The largest errors by rounding in a picture of one sample. Arrays are (H, W)."""

    doubtful: Mask  # the pixel may show another surface, or none
    depth: Array  # bound of the depth's |error|, in pixels that are not doubtful
    normal: Array  # bound of the normal's |error|
    unlit: Mask  # a light may reach the point or not
    radiance: Array  # bound of the radiance's |error|, in pixels that are neither doubtful nor unlit; inf: no bound


def find_pixel_doubt(scene: Scene, size: tuple[int, int], precision: Precision = 32) -> PixelDoubt:
    """Compute the rounding error bounds of a picture of `scene`, with one ray through the centre of each pixel."""
    return _Analysis(scene, size, precision).run()


class _Analysis:
    def __init__(self, scene: Scene, size: tuple[int, int], precision: Precision) -> None:
        self._scene, self._size = scene, size
        self._u = UNIT[precision]
        self._tracer = ray_tracer.Tracer(scene)
        self._R = view_space.rotation(scene.camera)
        self._eye = np.array(scene.camera.position)
        self._leaves = self._tracer.leaves
        self._view = RoundedView(self._R, scene.camera.position, sum(size), self._u)

    def run(self) -> PixelDoubt:
        world = ray_tracer.camera_rays(self._scene.camera, self._size).reshape(-1, 3)
        count = len(world)
        none = np.zeros(count)
        t, surface = self._tracer.first(np.zeros(world.shape), world)
        hit = surface >= 0
        rays = Rays(np.zeros((count, 3)), world @ self._R.T, none, none, True)
        roots = {k: self._roots(k, rays) for k in self._distinct_surfaces()}
        depth = np.zeros(count)
        for k in range(len(self._leaves)):
            leaf_roots = roots[self._first_coincident(k)]
            nearer = np.argmin(np.abs(leaf_roots.t - np.where(hit, t, 0.0)), axis=0)
            depth = np.where(surface == k, leaf_roots.error[nearer, np.arange(count)], depth)
        doubtful = order_in_doubt(list(roots.values()), np.where(hit, t + depth, np.inf))
        normal, point = self._normal_errors(rays, roots, surface, t, depth)
        unlit = np.zeros(count, bool)
        ambient = [max(leaf.material.ka) * max(self._scene.ambient) for leaf in self._leaves]
        radiance = FEW_ROUNDINGS * UNIT[32] * np.array([*ambient, max(self._scene.background)])[surface]
        sure = np.flatnonzero(hit & ~doubtful)
        for light in self._scene.lights:
            doubt, error = self._light_errors(light, world[sure], t[sure], surface[sure], normal[sure], point[sure])
            unlit[sure] |= doubt
            radiance[sure] += error
        # Pictures store float32, and normals are rotated to world space in float32.
        depth = depth + UNIT[32] * np.where(hit, t, 0.0)
        normal = normal + FEW_ROUNDINGS * UNIT[32] * hit
        shape = self._size[::-1]
        return PixelDoubt(
            doubtful.reshape(shape),
            depth.reshape(shape),
            normal.reshape(shape),
            unlit.reshape(shape),
            radiance.reshape(shape),
        )

    def _first_coincident(self, k: int) -> int:
        """Return the first leaf whose surface coincides with leaf k's: their roots are identical numbers."""
        return int(np.argmax(self._tracer.surface == self._tracer.surface[k]))

    def _distinct_surfaces(self) -> list[int]:
        return sorted({self._first_coincident(k) for k in range(len(self._leaves))})

    def _roots(self, k: int, rays: Rays) -> Roots:
        return root_errors(self._view, self._leaves[k], rays)

    def _normal_errors(
        self, rays: Rays, roots: dict[int, Roots], surface: Any, t: Array, depth: Array
    ) -> tuple[Array, Array]:
        """Return the bounds of |error| of the normals at the hit points, and of the hit points (R,)."""
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
            # The normal is the sum of two legs, from the centre to the chord's middle, and along half the chord.
            half = np.abs(t[on] - rd @ c)
            legs = moment_error(c, rd, u) + roots[self._first_coincident(k)].half[on] + FEW_ROUNDINGS * u * half
            normal[on] = legs / leaf.radius + FEW_ROUNDINGS * u
            by_center = u * np.linalg.norm(c) + leaf.radius * (normal[on] + 2.0 * u) + 2.0 * u * t[on]
            point[on] = np.where(leaf.radius < t[on], by_center, by_depth)
        return normal, point

    def _light_errors(
        self, light: PointLight, world: Array, t: Array, surface: Any, normal: Array, point: Array
    ) -> tuple[Mask, Array]:
        """Return where it is in doubt whether a light reaches the hit points, and the bound of its light's |error|."""
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
        on = self._leaf_at_light(light)
        grazes = np.zeros(len(t), bool)
        if on is not None and not isinstance(self._leaves[on], Sphere):
            grazes = self._tracer.surface[surface] == self._tracer.surface[on]
        doubt = ~np.isfinite(L_error) | (~(np.abs(dot(n, L)) > normal + L_error + 4.0 * u) & ~grazes)
        rays = Rays(P, np.nan_to_num(L), point, np.nan_to_num(L_error, posinf=1.0), False)
        all_roots = [
            self._light_ray_roots(k, rays, surface, n, normal, light, distance, k == on)
            for k in self._distinct_surfaces()
        ]
        end = distance - moved - 2.0 * u * distance, distance + moved + 2.0 * u * distance
        doubt |= order_in_doubt(all_roots, end[1])
        for roots in all_roots:
            low, high = interval(roots)
            doubt |= np.any((high >= end[0]) & (low <= end[1]), axis=0)
        # The lecture's models: a cosine has the error of its vectors. The error of a lobe is at most sqrt(h) times as
        # large, for h >= 1. The error of Blinn's H is larger by 1 / |(L + V) / 2|.
        vectors = normal + L_error + FEW_ROUNDINGS * UNIT[32]
        materials = [leaf.material for leaf in self._leaves]
        kd, ks, h = (
            np.array([value(m) for m in materials])[surface]
            for value in (
                lambda m: max(m.get("kd", (np.inf,))),
                lambda m: max(m.get("ks", (0.0,))),
                lambda m: m.get("h", 0.0),
            )
        )
        halfway = np.maximum(np.linalg.norm(L - world @ self._R.T, axis=1) / 2.0, np.finfo(float).tiny)
        blinn = np.array([m.model == "blinn" for m in materials])[surface]
        steep = np.where(h == 0.0, 0.0, np.where(h < 1.0, np.inf, np.sqrt(h))) * np.where(blinn, 1.0 / halfway, 2.0)
        with np.errstate(invalid="ignore"):
            lobe = np.where(ks > 0.0, ks * (steep * vectors + 4.0 * FEW_ROUNDINGS * UNIT[32]), 0.0)
        return doubt & ~grazes, max(light.color) * (kd * vectors + lobe)

    def _light_ray_roots(
        self, k: int, rays: Rays, surface: Any, n: Array, normal: Array, light: PointLight, distance: Array, lit: bool
    ) -> Roots:
        """Return the roots of leaf k for rays that leave `surface` towards a light.

        Two roots are exact, and so in no doubt: 0 at the start of a ray, if `surface` coincides with the leaf, and the
        distance of the light, if the light lies on the leaf (`lit`).
        """
        leaf = self._leaves[k]
        roots = self._roots(k, rays)
        starts = self._tracer.surface[surface] == self._tracer.surface[k]
        ends = np.full(len(starts), lit)
        t = np.full((2, len(starts)), np.inf)
        error = t.copy()
        if isinstance(leaf, Sphere):
            at_light = np.subtract(light.position, leaf.center) @ self._R.T / leaf.radius
            outward = np.where(starts[:, None], n, at_light)
            chord = -2.0 * leaf.radius * dot(outward, rays.rd)
            other = np.where(starts, chord, distance + chord)
            t[0] = np.where((other > 0.0) & ~(starts & ends), other, np.inf)
            inexact = normal + rays.rd_error + FEW_ROUNDINGS * self._u
            error[0] = 2.0 * leaf.radius * inexact + np.where(starts, 0.0, FEW_ROUNDINGS * self._u * distance)
        known = starts | ends
        return roots._replace(
            t=np.where(known, t, roots.t), error=np.where(known, error, roots.error), tangent=roots.tangent & ~known
        )

    def _leaf_at_light(self, light: PointLight) -> int | None:
        """Return the number in _distinct_surfaces() of the first leaf on which the light lies, spheres first."""
        order = sorted(range(len(self._leaves)), key=lambda k: not isinstance(self._leaves[k], Sphere))
        return next((self._first_coincident(k) for k in order if self._leaves[k].touches(light.position)), None)
