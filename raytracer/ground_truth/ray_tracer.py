"""Float64 ray tracer in NumPy, written from the definitions, against which the shaders are tested.

intersection.py intersects rays with surfaces, light_rays.py makes shadow rays, and reflectance.py evaluates materials.
Coordinates are relative to the camera, with the axes of the world, because float64 loses precision far from the world's
origin. The ray tracer is slow.
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
from raytracer.ground_truth.light_rays import light_rays
from raytracer.ground_truth.microfacets import dot
from raytracer.ground_truth.reflectance import mirrored, reflected
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import sample_points
from raytracer.scene.settings import Settings

Array = NDArray[np.float64]

_ROWS = 64  # rows of pixels that are traced at once


def trace(scene: Scene, size: tuple[int, int], settings: Settings | None = None, *, rays: int = 8) -> Image:
    """Trace a picture with the same samples as `raytracer.render`, but in float64.

    Args:
        scene: the scene.
        size: (width, height) in pixels.
        settings: the settings. Precision, evaluator and stopping rules do not count. Default: Settings().
        rays: with soft shadows, the square root of the number of rays from each sample to each light with a radius.
            Default: 8.
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
        point = sample_points(k, size, settings.sequence, settings.samples)
        directions, origins = camera_rays(scene.camera, size, point), camera_origins(scene.camera, size, point)
        for top in range(0, height, _ROWS):
            rows = slice(top, min(top + _ROWS, height))
            shape = directions[rows].shape[:2]
            ro, rd = origins[rows].reshape(-1, 3), directions[rows].reshape(-1, 3)
            results = trace_rays(scene, settings, tracer, ro, rd, rays)
            image.radiance[rows] += results.radiance.reshape(*shape, 3)
            if k == 0:
                if settings.samples > 1:
                    rd = camera_rays(scene.camera, size)[rows].reshape(-1, 3)
                    ro = camera_origins(scene.camera, size)[rows].reshape(-1, 3)
                    results = trace_rays(scene, settings, tracer, ro, rd, rays)
                assert image.depth is not None and image.normal is not None and image.material is not None
                image.depth[rows] = results.depth.reshape(shape)
                image.normal[rows] = results.normal.reshape(*shape, 3)
                image.material[rows] = results.material.reshape(shape)
    image.radiance[...] /= settings.samples
    return image


def camera_rays(camera: Camera, size: tuple[int, int], point: ArrayLike = (0.5, 0.5)) -> Array:
    """Return unit vectors along the camera's rays through a point of every pixel [H, W, 3].

    `point` is the position in the pixel, from the top left, in [0, 1): the same for all pixels [2], or one for each
    pixel [H, W, 2]. Default: the centre.
    """
    return rays_through(camera, size, *_places(size, point))


def camera_origins(camera: Camera, size: tuple[int, int], point: ArrayLike = (0.5, 0.5)) -> Array:
    """Return the origins of camera_rays(), relative to the camera's position [H, W, 3]."""
    return origins_through(camera, size, *_places(size, point))


def _places(size: tuple[int, int], point: ArrayLike) -> tuple[Array, Array]:
    width, height = size
    y, x = np.mgrid[:height, :width]
    offset = np.asarray(point)
    return x + offset[..., 0], y + offset[..., 1]


def rays_through(camera: Camera, size: tuple[int, int], x: Array, y: Array) -> Array:
    """Return unit vectors along the camera's rays through points of the picture [..., 3].

    `x` and `y` are in pixels from the picture's top left corner.
    """
    width, height = size
    right, up, forward = (np.array(axis) for axis in camera.axes())
    if camera.projection == "orthographic":
        return np.broadcast_to(forward, (*x.shape, 3))
    tangent = math.tan(math.radians(camera.vertical_fov) / 2.0)
    x = (2.0 * x / width - 1.0) * tangent * width / height
    y = (1.0 - 2.0 * y / height) * tangent
    rd = forward + x[..., None] * right + y[..., None] * up
    return rd / np.linalg.norm(rd, axis=-1, keepdims=True)


def origins_through(camera: Camera, size: tuple[int, int], x: Array, y: Array) -> Array:
    """Return the origins of rays_through(), relative to the camera's position [..., 3]."""
    if camera.height is None:
        return np.zeros((*x.shape, 3))
    width, height = size
    right, up, _ = (np.array(axis) for axis in camera.axes())
    scale = camera.height / height
    return scale * ((x - width / 2.0)[..., None] * right + (height / 2.0 - y)[..., None] * up)


class RayResults(NamedTuple):
    """Results of R rays from the camera, with the meaning of the arrays in Image."""

    radiance: Array  # (R, 3)
    depth: Array  # (R,)
    normal: Array  # (R, 3)
    material: NDArray[np.int32]  # (R,)


def trace_rays(
    scene: Scene, settings: Settings, tracer: Tracer, ro: Array, rd: Array, rays: int, shifts: Array | None = None
) -> RayResults:
    """Trace rays from the camera.

    Args:
        scene: the scene.
        settings: the settings: shading, shadows and bounces count.
        tracer: the Tracer of the scene.
        ro: the rays' origins, relative to the camera [R, 3].
        rd: unit vectors [R, 3].
        rays: with soft shadows, the square root of the number of rays from a hit point to each light with a radius.
        shifts: positions of these rays in their parts of each light, in [0, 1) [R, lights, 2], see light_rays(). None:
            the middles.
    """
    t, face = tracer.first(ro, rd)
    normal = tracer.normals(ro + np.where(np.isfinite(t), t, 0.0)[:, None] * rd, face)
    radiance = _radiance(scene, settings, tracer, ro, rd, t, face, normal, rays, shifts)
    return RayResults(radiance, t, -np.sign(dot(normal, rd))[:, None] * normal, tracer.material_index[face])


def _radiance(
    scene: Scene,
    settings: Settings,
    tracer: Tracer,
    ro: Array,
    rd: Array,
    t: Array,
    face: NDArray[np.int32],
    normal: Array,
    rays: int,
    shifts: Array | None,
    bounce: int = 0,
) -> Array:
    """Return the radiance along each ray: Le + ka Ia + sum of S Il f cos(theta_i), and mirror reflections [R, 3].

    The sum is over all rays to all lights. S is 0 or less than 1 in shadow, Il the irradiance, f the reflectance.
    """
    result = np.empty(rd.shape)
    result[...] = scene.background
    hit = face >= 0
    ro, rd, t, face, n = ro[hit], rd[hit], t[hit], face[hit], normal[hit]
    P = ro + t[:, None] * rd
    N = -np.sign(dot(n, rd))[:, None] * n
    V = -rd
    shifts = shifts if shifts is None else shifts[hit]

    options = settings.compile_options
    materials = [options.shaded(leaf.material) for leaf in tracer.leaves]
    leaf_indices = {m: [k for k, other in enumerate(materials) if other == m] for m in dict.fromkeys(materials)}
    groups = {material: np.isin(tracer.leaf[face], leaves) for material, leaves in leaf_indices.items()}
    I = np.zeros(P.shape)
    for material, on in groups.items():
        I[on] = np.multiply(material.ka, scene.ambient) + np.array(material.le)

    def rays_to(k: int, light: PointLight) -> Iterator[tuple[PointLight, Array, Array, Array]]:
        own = tracer.is_bulb(light, face)
        position = np.subtract(light.position, scene.camera.position)
        shift = shifts if shifts is None else shifts[:, k]
        return ((light, *ray) for ray in light_rays(light, position - P, own, n, rays, shift))

    lights = map(settings.cast, scene.lights)
    for light, L, distance, irradiance in itertools.chain.from_iterable(itertools.starmap(rays_to, enumerate(lights))):
        NoL = dot(N, L)
        S = np.ones(len(P))
        if settings.shadows != "off":
            blocked_at, _ = tracer.first(P, L, face, n, light, distance)
            blocked = blocked_at < distance
            diluted = np.divide(blocked_at, distance, out=np.zeros(len(P)), where=blocked)
            S = np.where(blocked, diluted if settings.shadows == "diluted" else 0.0, 1.0)
        # A light that lies in a plane does not illuminate it: N.L is 0, although rounding may give another value.
        lit = (NoL > 0.0) & (distance > 0.0) & ~tracer.is_in_plane(light, face)
        light_in = (S * lit)[:, None] * irradiance
        for material, on in groups.items():
            on = on & lit
            I[on] += light_in[on] * reflected(material, N[on], L[on], V[on])
    for material, on in groups.items():
        if MODELS[material.model].mirrors and bounce < settings.bounces and on.any():
            start, R = P[on], rd[on] - 2.0 * dot(rd[on], N[on])[:, None] * N[on]
            t, hit_face = tracer.first(start, R, face[on], n[on])
            normals = tracer.normals(start + np.where(np.isfinite(t), t, 0.0)[:, None] * R, hit_face)
            shift = shifts if shifts is None else shifts[on]
            incoming = _radiance(scene, settings, tracer, start, R, t, hit_face, normals, rays, shift, bounce + 1)
            I[on] += mirrored(material, N[on], V[on]) * incoming
    result[hit] = I
    return result
