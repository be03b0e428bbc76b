"""Rounding error bounds of a picture, for each pixel: the largest difference from the exact picture.

Evaluates the error bounds in `shaders/geometry/` along the rays of a picture. A pixel is doubtful if the bounds allow
two answers: a ray may hit or miss a sphere or a wall, two roots may come in the other order, a camera or a light may be
on the other side of a surface. In all other pixels, the visible surface and the lights that reach it must be exactly
right, and depth and normal within their bounds. The method is first-order forward error analysis (Higham, "Accuracy and
Stability of Numerical Algorithms", 2002), in view space. It counts one rounding for each exact number of the scene, and
one for each operation.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.face_bounds import Crossings, order_in_doubt
from raytracer.analysis.rounding_bounds import FEW_ROUNDINGS, UNIT, Rays, RoundedView
from raytracer.analysis.surface_bounds import ShadowEnds, SurfaceBounds
from raytracer.compiler import view_space
from raytracer.compiler.surfaces import make_surfaces
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
        # An orthographic camera may come nearer without a change of its picture, as in view space.
        camera = scene.camera
        self._advance = view_space.view_origin(make_surfaces(scene), camera, size)[1]
        self._shift = 0.0  # the bound of the |error| of the place where the rays begin, which the host rounds
        if self._advance:
            self._shift = FEW_ROUNDINGS * UNIT[64] * (float(np.linalg.norm(camera.position)) + self._advance)
            ahead = self._advance * np.array(camera.axes()[2])
            position, look_at = (tuple((place + ahead).tolist()) for place in (camera.position, camera.look_at))
            scene = scene.replace(camera=camera.replace(position=position, look_at=look_at))
        self._scene, self._size = scene, size
        self._u = UNIT[precision]
        self._tracer = ray_tracer.Tracer(scene)
        self._R = view_space.rotation(scene.camera)
        self._eye = np.array(scene.camera.position)
        view = RoundedView(self._R, scene.camera.position, sum(size), self._u)
        self._surfaces = SurfaceBounds(self._tracer, view)
        self._materials = [leaf.material for leaf in self._tracer.leaves]

    def run(self) -> PixelDoubt:
        camera = self._scene.camera
        world = ray_tracer.camera_rays(camera, self._size).reshape(-1, 3)
        origins = ray_tracer.camera_origins(camera, self._size).reshape(-1, 3)
        count = len(world)
        t, face = self._tracer.first(origins, world)
        hit = face >= 0
        moved = 4.0 * self._u * np.linalg.norm(origins, axis=1) + self._shift
        is_camera = camera.projection == "perspective"
        rays = Rays(origins @ self._R.T, world @ self._R.T, moved, np.zeros(count), is_camera)
        all_crossings = self._surfaces.crossings(rays)
        depth = np.where(hit, _error_of_root(all_crossings, np.where(hit, t, 0.0)), 0.0)
        doubtful = order_in_doubt(all_crossings, np.where(hit, t + depth, np.inf))
        P = origins + np.where(hit, t, 0.0)[:, None] * world
        normal, point = self._normal_errors(rays, self._tracer.normals(P, face), face, t, depth)
        unlit = np.zeros(count, bool)
        ambient = [max(material.ka) * max(self._scene.ambient) for material in self._materials]
        radiance = FEW_ROUNDINGS * UNIT[32] * np.array([*ambient, max(self._scene.background)])[self._tracer.leaf[face]]
        sure = np.flatnonzero(hit & ~doubtful)
        for light in self._scene.lights:
            doubt, error = self._light_errors(light, P[sure], world[sure], face[sure], normal[sure], point[sure])
            unlit[sure] |= doubt
            radiance[sure] += error
        # Pictures store float32, and normals are rotated to world space in float32. If the camera has come nearer, its
        # distance is added to a depth that is float32 already.
        stored = t + (t + self._advance if self._advance else 0.0)
        depth = depth + UNIT[32] * np.where(hit, stored, 0.0)
        normal = normal + FEW_ROUNDINGS * UNIT[32] * hit
        shape = self._size[::-1]
        return PixelDoubt(
            doubtful.reshape(shape),
            depth.reshape(shape),
            normal.reshape(shape),
            unlit.reshape(shape),
            radiance.reshape(shape),
        )

    def _normal_errors(self, rays: Rays, normals: Array, face: Any, t: Array, depth: Array) -> tuple[Array, Array]:
        """Return the bounds of |error| of the normals at the hit points, and of the hit points (R,)."""
        u = self._u
        normal, point = np.zeros(len(t)), np.zeros(len(t))
        enters = dot(normals, rays.rd @ self._R) < 0.0
        surface = self._tracer.surface[face]
        for k in np.unique(surface[face >= 0]):
            on = surface == k
            some = Rays(rays.ro[on], rays.rd[on], rays.ro_error[on], rays.rd_error[on], rays.camera)
            normal[on] = self._surfaces.normal_errors(int(k), some, t[on], enters[on])
        for k, leaf in enumerate(self._tracer.leaves):
            on = self._tracer.leaf[face] == k
            point[on] = depth[on] + rays.ro_error[on] + 4.0 * u * t[on]
            if isinstance(leaf, Sphere):
                c = self._R @ np.subtract(leaf.center, self._eye)
                by_center = u * np.linalg.norm(c) + leaf.radius * (normal[on] + 2.0 * u) + 2.0 * u * t[on]
                point[on] = np.where(leaf.radius < t[on], by_center, point[on])
        return normal, point

    def _light_errors(
        self, light: PointLight, hits: Array, world: Array, face: Any, normal: Array, point: Array
    ) -> tuple[Mask, Array]:
        """Return where it is in doubt whether a light reaches the hit points, and the bound of its light's |error|."""
        u = self._u
        P = hits @ self._R.T
        n = self._tracer.normals(hits, face) @ self._R.T
        surface = self._tracer.surface[face]
        place = self._R @ np.subtract(light.position, self._eye)
        to_light = place - P
        distance = np.linalg.norm(to_light, axis=1)
        moved = point + u * (np.linalg.norm(place) + distance)
        with np.errstate(divide="ignore", invalid="ignore"):
            L = to_light / distance[:, None]
            L_error = moved / np.maximum(distance - moved, 0.0) + 4.0 * u
        lit = self._surfaces.surface_at_light(light)
        grazes = np.zeros(len(P), bool)
        if lit is not None and self._surfaces.is_flat(lit):
            grazes = surface == lit
        doubt = ~np.isfinite(L_error) | (~(np.abs(dot(n, L)) > normal + L_error + 4.0 * u) & ~grazes)
        rays = Rays(P, np.nan_to_num(L), point, np.nan_to_num(L_error, posinf=1.0), False)
        known = ShadowEnds(surface, n, normal, light, lit, distance)
        all_crossings = self._surfaces.crossings(rays, known)
        end = distance - moved - 2.0 * u * distance, distance + moved + 2.0 * u * distance
        doubt |= order_in_doubt(all_crossings, end[1])
        for crossings in all_crossings:
            doubt |= np.any((crossings.high >= end[0]) & (crossings.low <= end[1]), axis=0)
        # The lecture's models: a cosine has the error of its vectors. The error of a lobe is at most sqrt(h) times as
        # large, for h >= 1. The error of Blinn's H is larger by 1 / |(L + V) / 2|.
        vectors = normal + L_error + FEW_ROUNDINGS * UNIT[32]
        leaf = self._tracer.leaf[face]
        kd, ks, h = (
            np.array([value(m) for m in self._materials])[leaf]
            for value in (
                lambda m: max(m.get("kd", (np.inf,))),
                lambda m: max(m.get("ks", (0.0,))),
                lambda m: m.get("h", 0.0),
            )
        )
        halfway = np.maximum(np.linalg.norm(L - world @ self._R.T, axis=1) / 2.0, np.finfo(float).tiny)
        blinn = np.array([m.model == "blinn" for m in self._materials])[leaf]
        steep = np.where(h == 0.0, 0.0, np.where(h < 1.0, np.inf, np.sqrt(h))) * np.where(blinn, 1.0 / halfway, 2.0)
        with np.errstate(invalid="ignore", over="ignore"):
            lobe = np.where(ks > 0.0, ks * (steep * vectors + 4.0 * FEW_ROUNDINGS * UNIT[32]), 0.0)
            error = max(light.color) * (kd * vectors + lobe)
        return doubt & ~grazes, error


def _error_of_root(surfaces: list[Crossings], t: Array) -> Array:
    """Return the bound of the |error| of the roots at t (R,): the largest of the crossings that hold it."""
    result = np.zeros(len(t))
    for crossings in surfaces:
        with np.errstate(invalid="ignore"):
            off = np.where(
                (crossings.low <= t) & (t <= crossings.high), np.maximum(t - crossings.low, crossings.high - t), 0.0
            )
        result = np.maximum(result, off.max(axis=0))
    return result
