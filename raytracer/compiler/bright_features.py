"""The bright things of a scene that samples of a picture may miss, as they are smaller than the distance of samples.

They are emitting spheres, glints (where a surface with a narrow highlight mirrors a light), and hot spots (surfaces
close to an attenuated light). All are found from the numbers of the scene, and known to a factor of about 2. What is
hidden by others is among them; what is seen in mirrors, on the inside of spheres, or of lobes of measured materials is
not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.features import Features
from raytracer.compiler.narrow_lobes import diffuse, lobe
from raytracer.compiler.view_space import pixel_scale, rotation
from raytracer.core.validation import MAX_COLOR
from raytracer.scene.lights import PointLight
from raytracer.scene.scene_objects import SceneObjects

Array = NDArray[np.float64]

# Solid angles of highlights above which none is smaller than a pixel, on balls of 15 pixels and more: exponents below
# 160 to 630, and alpha above 0.056.
_NARROW = 0.01
# Square pixels of the largest feature: two samples meet it four times.
_LARGEST = 2.0
# Halvings of the angle in which a mirror point is: its 2000th part is at most half a pixel on balls of 400 pixels.
_HALVINGS = 11
# Pairs of a surface and a light that are looked at together: their arrays fit a processor's cache.
_PAIRS = 2**14
# The least cosine between a normal and a view, so that nothing is infinite.
_GRAZING = 1e-3


class _Materials(NamedTuple):
    """What is bright of M materials."""

    emission: Array  # (M, 3)
    diffuse: Array  # (M, 3)
    sizes: Array  # (M,): of narrow lobes, else 0; see Lobe
    around_mirror: NDArray[np.bool_]  # (M,)
    peaks: Array  # (M, 3)
    powers: Array  # (M,)
    f0: Array  # (M, 3)


class _Eye(NamedTuple):
    """A camera and its picture."""

    position: Array
    rotation: Array
    focal: float  # in pixels
    size: tuple[int, int]

    def sees(self, centers: Array, radii: Array) -> NDArray[np.bool_]:
        """(N,): which spheres, not around the camera, may be in the picture."""
        x, y, z = self.rotation @ (centers - self.position).T
        seen = -z > -radii
        for side, pixels in ((x, self.size[0]), (y, self.size[1])):
            slope = pixels / (2.0 * self.focal)
            seen &= np.abs(side) <= slope * -z + radii * math.hypot(1.0, slope)
        return seen & (x * x + y * y + z * z > radii * radii)

    def features(self, points: Array, solid_angles: Array, images: Array, radiance: Array) -> Features:
        """The features at `points` (..., 3), with `radiance` (..., 3), that are in the picture and small.

        `solid_angles` and `images` (...) become areas and pixels.
        """
        lit = (solid_angles > 0.0) & radiance.any(axis=-1)
        points, solid_angles, images, radiance = points[lit], solid_angles[lit], images[lit], radiance[lit]
        x, y, z = self.rotation @ (points - self.position).T
        depth = -z
        columns = self.size[0] / 2.0 + self.focal * x / depth
        rows = self.size[1] / 2.0 - self.focal * y / depth
        # A pixel off the middle takes less of the solid angle.
        scale = self.focal**2 * np.power(1.0 + (x * x + y * y) / (depth * depth), 1.5)
        areas = scale * solid_angles
        chosen = (depth > 0.0) & (columns >= 0) & (rows >= 0) & (columns < self.size[0]) & (rows < self.size[1])
        chosen &= areas < _LARGEST
        return Features(
            columns[chosen],
            rows[chosen],
            areas[chosen],
            np.maximum((scale * images)[chosen], 1.0),
            radiance[chosen],
        )


class _Faces(NamedTuple):
    """Points of surfaces, N of them for each of K lights."""

    points: Array  # (K, N, 3)
    normals: Array  # (K, N, 3), or (N, 3): unit, towards the light
    bend: Array  # (N,): the curvature, 1 / radius


def bright_features(compiled: CompiledScene, size: tuple[int, int]) -> Features:
    """The small bright features of a picture of `size` (width, height). They live as long as the scene's objects."""
    objects = compiled.scene.objects
    assert isinstance(objects, SceneObjects)
    of_objects = compiled.surfaces, compiled.materials
    materials = objects.derive("bright materials", of_objects, lambda: _materials(compiled))
    key = *of_objects, compiled.lights, compiled.scene.camera, size
    return objects.derive("bright features", key, lambda: _features(compiled, materials, size))


def _features(compiled: CompiledScene, materials: _Materials, size: tuple[int, int]) -> Features:
    lights = [light for light in compiled.lights if any(light.color)]
    near = [light for light in lights if light.falloff == "inverse_square"]
    emits, is_narrow = materials.emission.max(axis=1) > 0.0, materials.sizes > 0.0
    nothing = np.zeros(0)
    none = Features(nothing, nothing, nothing, nothing, np.zeros((0, 3)))
    if not (near or emits.any() or (lights and is_narrow.any())):
        return none
    camera, surfaces = compiled.scene.camera, compiled.surfaces
    eye = _Eye(np.array(camera.position), rotation(camera), 0.5 / pixel_scale(camera, size[1]), size)
    rows = np.searchsorted(surfaces.used, surfaces.material)
    seen = np.append(eye.sees(surfaces.centers, surfaces.radii), np.ones(len(surfaces.planes), bool))
    parts = [none]
    with np.errstate(all="ignore"):  # what overflows is not chosen
        emitters = np.flatnonzero((seen & emits[rows])[: surfaces.spheres])
        parts.append(_emitters(eye, compiled, emitters, materials.emission[rows[emitters]]))
        narrow = np.flatnonzero(seen & is_narrow[rows])
        for some in _portions(lights, len(narrow)):
            parts += _glints(eye, compiled, some, narrow, materials, rows)
        shown = np.flatnonzero(seen)
        for some in _portions(near, len(shown)):
            parts.append(_hot_spots(eye, compiled, some, shown, materials.diffuse[rows[shown]]))
    return Features(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _materials(compiled: CompiledScene) -> _Materials:
    used = [compiled.materials[i] for i in compiled.surfaces.used]
    lobes = [each if each and each.size < _NARROW else None for each in map(lobe, used)]
    black = (0.0, 0.0, 0.0)
    return _Materials(
        np.array([material.get("le", black) for material in used], float),
        np.array([diffuse(material) for material in used], float),
        np.array([each.size if each else 0.0 for each in lobes]),
        np.array([each is not None and each.around_mirror for each in lobes]),
        np.array([each.peak if each else black for each in lobes], float),
        np.array([each.power if each else 0.0 for each in lobes]),
        np.array([each.f0 if each else black for each in lobes], float),
    )


def _portions(lights: Sequence[PointLight], surfaces: int) -> Iterator[Sequence[PointLight]]:
    """The lights, so many at a time that the arrays of their pairs with so many surfaces are not too large."""
    step = max(1, _PAIRS // max(surfaces, 1))
    yield from (lights[i : i + step] for i in range(0, len(lights) if surfaces else 0, step))


def _emitters(eye: _Eye, compiled: CompiledScene, spheres: NDArray[np.intp], radiance: Array) -> Features:
    centers, radii = compiled.surfaces.centers[spheres], compiled.surfaces.radii[spheres]
    solid_angles = math.pi * radii**2 / np.square(centers - eye.position).sum(axis=1)
    return eye.features(centers, solid_angles, solid_angles, radiance)


def _glints(
    eye: _Eye,
    compiled: CompiledScene,
    lights: Sequence[PointLight],
    chosen: NDArray[np.intp],
    materials: _Materials,
    rows: NDArray[np.intp],
) -> Iterator[Features]:
    """The mirror images of lights in `chosen` surfaces. The material of each surface of all is in `rows`."""
    surfaces = compiled.surfaces
    balls, planes = _kinds(compiled, chosen)
    places = np.array([light.position for light in lights])
    if len(balls):
        faces = _mirror_points(eye, places, surfaces.centers[balls], surfaces.radii[balls])
        yield _images(eye, lights, faces, materials, rows[balls])
    if len(planes):
        faces = _plane_mirror_points(eye, places, surfaces.normals[planes], surfaces.offsets[planes])
        yield _images(eye, lights, faces, materials, rows[planes + surfaces.spheres])


def _kinds(compiled: CompiledScene, chosen: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The `chosen` surfaces among the spheres, and among the planes."""
    spheres = compiled.surfaces.spheres
    return chosen[chosen < spheres], chosen[chosen >= spheres] - spheres


def _images(
    eye: _Eye, lights: Sequence[PointLight], faces: _Faces, materials: _Materials, rows: NDArray[np.intp]
) -> Features:
    """The images of lights around the mirror points on N surfaces, whose materials are in `rows` (N,)."""
    to_eye = eye.position - faces.points
    to_light = np.array([light.position for light in lights])[:, None] - faces.points
    far, away = _length(to_eye), _length(to_light)
    cosine = np.minimum(_dot(faces.normals, to_eye) / far, _dot(faces.normals, to_light) / away)
    c = np.clip(cosine, _GRAZING, 1.0)
    # How fast the normal turns against the halfway vector: in the plane of both directions, and across.
    turn = 0.5 * (1.0 / far + 1.0 / away)
    # Solid angles that the eye sees, over those of normals.
    scale = c / (far**2 * (faces.bend + c * turn) * (faces.bend + turn / c))
    sizes = materials.sizes[rows] / np.where(materials.around_mirror[rows], c, 1.0)
    # A lamp takes part of the solid angle around the mirror direction, half as wide around the normal.
    lamps = math.pi / 4.0 * np.square(np.minimum(_radii(lights) / away, 1.0)) / c
    f0 = materials.f0[rows]
    fresnel = f0 + (1.0 - f0) * (1.0 - c[..., None]) ** 5
    peaks = materials.peaks[rows] * fresnel * (c ** materials.powers[rows])[..., None]
    radiance = _irradiance(lights, away) * peaks * (cosine > 0.0)[..., None]
    return eye.features(faces.points, scale * sizes, scale * (sizes + lamps), radiance)


def _mirror_points(eye: _Eye, lights: Array, centers: Array, radii: Array) -> _Faces:
    """Where balls (N,) mirror lights (K, 3), if neither these nor the eye are inside.

    In the plane of both directions from the centre, with the first axis towards the eye, the normal is between them.
    It is looked for by halving.
    """
    to_eye = eye.position - centers
    distance = _length(to_eye)
    first = to_eye / distance[:, None]
    to_light = lights[:, None] - centers
    a = _dot(to_light, first)
    across = to_light - a[..., None] * first
    b = _length(across)
    away = np.hypot(a, b)
    low = np.ones_like(a), np.zeros_like(a)
    high = a / away, b / away
    for _ in range(_HALVINGS):
        x, y = low[0] + high[0], low[1] + high[1]
        length = np.sqrt(x * x + y * y)
        x, y = x / length, y / length
        # By the tangents of the angles between the normal and both directions.
        is_high = distance * y * (a * x + b * y - radii) > (b * x - a * y) * (distance * x - radii)
        low = np.where(is_high, low[0], x), np.where(is_high, low[1], y)
        high = np.where(is_high, x, high[0]), np.where(is_high, y, high[1])
    x, y = low
    normals = x[..., None] * first + (y / np.maximum(b, np.finfo(float).tiny))[..., None] * across
    return _Faces(centers + radii[:, None] * normals, normals, 1.0 / radii)


def _plane_mirror_points(eye: _Eye, lights: Array, normals: Array, offsets: Array) -> _Faces:
    """Where planes (N,) mirror lights (K, 3) that are on the eye's side."""
    height, heights = normals @ eye.position - offsets, lights @ normals.T - offsets
    sides = np.sign(height)[:, None] * normals
    share = height / (height + heights)
    foot, feet = eye.position - height[:, None] * normals, lights[:, None] - heights[..., None] * normals
    return _Faces(foot + share[..., None] * (feet - foot), sides, np.zeros(len(offsets)))


def _hot_spots(
    eye: _Eye, compiled: CompiledScene, lights: Sequence[PointLight], chosen: NDArray[np.intp], diffuse: Array
) -> Features:
    """The points of `chosen` surfaces that are nearest to lights, which are as wide as the lights are near."""
    surfaces = compiled.surfaces
    balls, planes = _kinds(compiled, chosen)
    places = np.array([light.position for light in lights])
    outward = places[:, None] - surfaces.centers[balls]
    distance = _length(outward)
    outward /= distance[..., None]
    # A light in a ball leaves its outside dark.
    heights = np.where(distance > surfaces.radii[balls], distance - surfaces.radii[balls], np.inf)
    above = places @ surfaces.normals[planes].T - surfaces.offsets[planes]
    normals = np.concatenate([outward, np.sign(above)[..., None] * surfaces.normals[planes]], axis=1)
    heights = np.concatenate([heights, np.abs(above)], axis=1)
    # No wider than the ball.
    widths = np.maximum(heights, _radii(lights))
    widths[:, : len(balls)] = np.minimum(widths[:, : len(balls)], surfaces.radii[balls])
    points = places[:, None] - heights[..., None] * normals
    to_eye = eye.position - points
    far = _length(to_eye)
    cosine = _dot(normals, to_eye) / far
    solid_angles = math.pi * np.square(widths / far) * np.maximum(cosine, 0.0)
    return eye.features(points, solid_angles, solid_angles, _irradiance(lights, heights) * diffuse)


def _irradiance(lights: Sequence[PointLight], distances: Array) -> Array:
    """(K, N, 3): of surfaces that face K lights from `distances` (K, N), as irradiance.glsl has it."""
    colors = np.array([light.color for light in lights])[:, None]
    is_attenuated = np.array([light.falloff != "none" for light in lights])[:, None]
    squares = np.square(np.maximum(distances, _radii(lights)))
    return np.where(is_attenuated[..., None], np.minimum(colors / squares[..., None], MAX_COLOR), colors)


def _radii(lights: Sequence[PointLight]) -> Array:
    """(K, 1): the radii of K lights."""
    return np.array([light.radius for light in lights])[:, None]


def _length(vectors: Array) -> Array:
    return np.sqrt(_dot(vectors, vectors))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i->...", *np.broadcast_arrays(a, b))
