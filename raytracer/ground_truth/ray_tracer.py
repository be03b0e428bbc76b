"""The same ray tracer in float64 NumPy, from the definitions: the shaders are tested against it.

intersection.py has the surfaces that rays meet, light_rays.py the rays to lights, reflectance.py the materials. The
axes are the world's, the origin is the camera: far from the world's own origin float64 runs out of bits, too. Slow.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.formats.image import Image
from raytracer.ground_truth.intersection import Tracer
from raytracer.ground_truth.light_rays import ends_on, light_rays
from raytracer.ground_truth.microfacets import dot
from raytracer.ground_truth.reflectance import mirrored, reflected
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import sample_points
from raytracer.scene.settings import Settings
from raytracer.scene.solids import Sphere

Array = NDArray[np.float64]

_ROWS = 64  # of pixels traced at once


def trace(scene: Scene, size: tuple[int, int], settings: Settings | None = None, *, rays: int = 8) -> Image:
    """Trace the image of `scene` at `size` (width, height): the same as `raytracer.render` draws, but in float64.

    Under soft shadows each sample sends `rays` x `rays` rays to each light that has a radius.
    """
    settings = settings or Settings()
    width, height = size
    image = Image(
        radiance=np.zeros((height, width, 3)),
        depth=np.empty((height, width)),
        normal=np.empty((height, width, 3)),
        material=np.empty((height, width), np.int32),
    )
    tracer = Tracer(scene)
    for k in range(settings.samples):
        directions = camera_rays(scene.camera, size, sample_points(k, size, settings.sequence, settings.samples))
        for top in range(0, height, _ROWS):
            rows = slice(top, min(top + _ROWS, height))
            shape = directions[rows].shape[:2]
            results = trace_rays(scene, settings, tracer, directions[rows].reshape(-1, 3), rays)
            image.radiance[rows] += results.radiance.reshape(*shape, 3)
            if k == 0:
                if settings.samples > 1:
                    centers = camera_rays(scene.camera, size)[rows].reshape(-1, 3)
                    results = trace_rays(scene, settings, tracer, centers, rays)
                assert image.depth is not None and image.normal is not None and image.material is not None
                image.depth[rows] = results.depth.reshape(shape)
                image.normal[rows] = results.normal.reshape(*shape, 3)
                image.material[rows] = results.material.reshape(shape)
    image.radiance[...] /= settings.samples
    return image


def camera_rays(camera: Camera, size: tuple[int, int], point: ArrayLike = (0.5, 0.5)) -> Array:
    """(H, W, 3) unit directions through `point` (from the top left, in [0, 1)) of every pixel: (2,), or (H, W, 2)."""
    width, height = size
    y, x = np.mgrid[:height, :width]
    offset = np.asarray(point)
    return rays_through(camera, size, x + offset[..., 0], y + offset[..., 1])


def rays_through(camera: Camera, size: tuple[int, int], x: Array, y: Array) -> Array:
    """(..., 3) unit directions through points of the picture, in pixels from its top left corner."""
    width, height = size
    right, up, forward = (np.array(axis) for axis in camera.axes())
    tangent = math.tan(math.radians(camera.vertical_fov) / 2.0)
    x = (2.0 * x / width - 1.0) * tangent * width / height
    y = (1.0 - 2.0 * y / height) * tangent
    rd = forward + x[..., None] * right + y[..., None] * up
    return rd / np.linalg.norm(rd, axis=-1, keepdims=True)


class RayResults(NamedTuple):
    """Results of R rays from the camera: all as in Image."""

    radiance: Array  # (R, 3)
    depth: Array  # (R,)
    normal: Array  # (R, 3)
    material: NDArray[np.int32]  # (R,)


def trace_rays(
    scene: Scene, settings: Settings, tracer: Tracer, rd: Array, rays: int, shifts: Array | None = None
) -> RayResults:
    """Trace the rays from the camera along unit vectors `rd` (R, 3); `tracer` is that of `scene`.

    Under soft shadows `rays` x `rays` rays go from each hit point to each light that has a radius. `shifts`
    (R, lights, 2) in [0, 1) says through which places of the light's parts, see light_rays(); without, through the
    middles.
    """
    ro = np.zeros(rd.shape)
    t, surface = tracer.first(ro, rd)
    normal = tracer.normals(np.where(np.isfinite(t), t, 0.0)[:, None] * rd, surface)
    radiance = _radiance(scene, settings, tracer, ro, rd, t, surface, normal, rays, shifts)
    return RayResults(radiance, t, -np.sign(dot(normal, rd))[:, None] * normal, tracer.material_index[surface])


def _radiance(
    scene: Scene,
    settings: Settings,
    tracer: Tracer,
    ro: Array,
    rd: Array,
    t: Array,
    surface: NDArray[np.int32],
    normal: Array,
    rays: int,
    shifts: Array | None,
    bounce: int = 0,
) -> Array:
    """The light along each ray, Le + ka Ia + sum of S Il f cos(theta_i), (R, 3), and what mirrors reflect.

    The sum is over all rays to all lights.
    """
    result = np.empty(rd.shape)
    result[...] = scene.background
    hit = surface >= 0
    ro, rd, t, surface, n = ro[hit], rd[hit], t[hit], surface[hit], normal[hit]
    P = ro + t[:, None] * rd
    N = -np.sign(dot(n, rd))[:, None] * n
    V = -rd
    shifts = shifts if shifts is None else shifts[hit]

    options = settings.compile_options
    materials = [options.shaded(leaf.material) for leaf in tracer.leaves]
    leaves_of = {m: [k for k, other in enumerate(materials) if other == m] for m in dict.fromkeys(materials)}
    groups = {material: np.isin(surface, leaves) for material, leaves in leaves_of.items()}
    I = np.zeros(P.shape)
    for material, on in groups.items():
        I[on] = np.multiply(material.ka, scene.ambient) + np.array(material.le)

    def rays_to(k: int, light: PointLight) -> Iterator[tuple[PointLight, Array, Array, Array]]:
        own = np.array([light.radius > 0.0 and ends_on(leaf, light) for leaf in tracer.leaves])[surface]
        place = np.subtract(light.position, scene.camera.position)
        shift = shifts if shifts is None else shifts[:, k]
        return ((light, *ray) for ray in light_rays(light, place - P, own, n, rays, shift))

    lights = map(settings.cast, scene.lights)
    for light, L, distance, irradiance in itertools.chain.from_iterable(itertools.starmap(rays_to, enumerate(lights))):
        NoL = dot(N, L)
        S = np.ones(len(P))
        if settings.shadows != "off":
            blocked_at, _ = tracer.first(P, L, surface, n, light, distance)
            blocked = blocked_at < distance
            diluted = np.divide(blocked_at, distance, out=np.zeros(len(P)), where=blocked)
            S = np.where(blocked, diluted if settings.shadows == "diluted" else 0.0, 1.0)
        # A light in the plane itself grazes it: N.L is 0, whatever rounding makes of it.
        on = np.array([ends_on(leaf, light) and not isinstance(leaf, Sphere) for leaf in tracer.leaves])
        grazes = np.any(tracer.coincide & on, axis=1)[surface]
        lit = (NoL > 0.0) & (distance > 0.0) & ~grazes
        light_in = (S * lit)[:, None] * irradiance
        for material, on in groups.items():
            on = on & lit
            I[on] += light_in[on] * reflected(material, N[on], L[on], V[on])
    for material, on in groups.items():
        if MODELS[material.model].mirrors and bounce < settings.bounces and on.any():
            start, R = P[on], rd[on] - 2.0 * dot(rd[on], N[on])[:, None] * N[on]
            t, met = tracer.first(start, R, surface[on], n[on])
            normals = tracer.normals(start + np.where(np.isfinite(t), t, 0.0)[:, None] * R, met)
            shift = shifts if shifts is None else shifts[on]
            seen = _radiance(scene, settings, tracer, start, R, t, met, normals, rays, shift, bounce + 1)
            I[on] += mirrored(material, N[on], V[on]) * seen
    result[hit] = I
    return result
