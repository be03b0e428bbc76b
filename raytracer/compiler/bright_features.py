"""The small bright features of a scene: samples of a picture may miss them, as they are smaller than the distance of
samples.

Features are emitting spheres, glints (where a surface with a narrow lobe mirrors a light), and hot spots (surfaces
close to an attenuated light). Their areas and radiance follow from the numbers of the scene, to a factor of about 2.
Hidden features count. Features in mirrors, on the inside of spheres, or of lobes of measured materials do not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.features import Features
from raytracer.compiler.narrow_lobes import Lobe, diffuse, lobe
from raytracer.compiler.surfaces import Surfaces
from raytracer.compiler.view_space import pixel_scale, rotation
from raytracer.core.validation import MAX_COLOR
from raytracer.scene.lights import PointLight
from raytracer.scene.scene_objects import SceneObjects

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# The solid angle of the widest lobe whose glint may be smaller than a pixel, on balls of 15 pixels and more: exponents
# from 160 to 630 on, and alpha up to 0.056.
_NARROW = 0.01
# Square pixels of the largest feature: two samples meet it four times.
_LARGEST = 2.0
# Halvings of the angle in which a mirror point is: its 2000th part is at most half a pixel on balls of 400 pixels.
_HALVINGS = 11
# Pairs of a surface and a light that are looked at together: their arrays fit a processor's cache.
_PAIRS = 2**14
# The least cosine between a normal and a view, so that nothing is infinite.
_GRAZING = 1e-3

_BLACK = (0.0, 0.0, 0.0)
_NO_LOBE = Lobe(0.0, 0.0, _BLACK, 0.0, _BLACK)


class _Lobes(NamedTuple):
    """The narrow lobes of N materials, a Lobe each; of size 0 where there is none."""

    sizes: Array  # (N,)
    widening: Array  # (N,)
    peaks: Array  # (N, 3)
    powers: Array  # (N,)
    f0: Array  # (N, 3)


class _Materials(NamedTuple):
    """The light of M materials."""

    emission: Array  # (M, 3)
    diffuse: Array  # (M, 3)
    lobes: _Lobes


class _Surfaces(NamedTuple):
    """Some of a scene's surfaces: B balls, then P planes."""

    centers: Array  # (B, 3)
    radii: Array  # (B,)
    normals: Array  # (P, 3)
    offsets: Array  # (P,)
    materials: NDArray[np.intp]  # (B + P,): the row of each one's material in _Materials


class _Lights(NamedTuple):
    """K lights."""

    positions: Array  # (K, 3)
    colors: Array  # (K, 1, 3)
    radii: Array  # (K, 1)
    is_attenuated: Mask  # (K, 1, 1)

    def irradiance(self, distances: Array) -> Array:
        """(K, N, 3): of surfaces that face the lights from `distances` (K, N), as irradiance.glsl has it."""
        squares = np.square(np.maximum(distances, self.radii))[..., None]
        return np.where(self.is_attenuated, np.minimum(self.colors / squares, MAX_COLOR), self.colors)


class _Eye(NamedTuple):
    """A camera and its picture."""

    position: Array
    rotation: Array
    focal: float  # in pixels
    size: tuple[int, int]

    def sees(self, centers: Array, radii: Array) -> Mask:
        """(N,): which spheres may be in the picture; none that the camera is in."""
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


def bright_features(compiled: CompiledScene, size: tuple[int, int]) -> Features:
    """The small bright features of a picture of `size` (width, height). They live as long as the scene's objects."""
    objects = compiled.scene.objects
    assert isinstance(objects, SceneObjects)
    key = compiled.surfaces, compiled.materials
    materials = objects.derive("bright materials", key, lambda: _materials(compiled))
    key = *key, compiled.lights, compiled.scene.camera, size
    return objects.derive("bright features", key, lambda: _features(compiled, materials, size))


def _features(compiled: CompiledScene, materials: _Materials, size: tuple[int, int]) -> Features:
    lights = [light for light in compiled.lights if any(light.color)]
    near = [light for light in lights if light.falloff == "inverse_square"]
    emits, is_narrow = materials.emission.max(axis=1) > 0.0, materials.lobes.sizes > 0.0
    zeros = np.zeros(0)
    none = Features(zeros, zeros, zeros, zeros, np.zeros((0, 3)))
    if not (near or emits.any() or (lights and is_narrow.any())):
        return none
    camera, surfaces = compiled.scene.camera, compiled.surfaces
    eye = _Eye(np.array(camera.position), rotation(camera), 0.5 / pixel_scale(camera, size[1]), size)
    rows = np.searchsorted(surfaces.used, surfaces.material)
    parts = [none]
    with np.errstate(all="ignore"):  # _Eye.features() leaves out what overflows
        balls = eye.sees(surfaces.centers, surfaces.radii)
        emitters = _choose(surfaces, rows, np.append(balls, np.zeros(len(surfaces.planes), bool)) & emits[rows])
        parts.append(_emitters(eye, emitters, materials.emission[emitters.materials]))
        seen = np.append(balls, np.ones(len(surfaces.planes), bool))
        narrow = _choose(surfaces, rows, seen & is_narrow[rows])
        lobes = _Lobes(*(each[narrow.materials] for each in materials.lobes))
        parts += [_glints(eye, some, narrow, lobes) for some in _portions(lights, narrow)]
        shown = _choose(surfaces, rows, seen)
        parts += [_hot_spots(eye, some, shown, materials.diffuse[shown.materials]) for some in _portions(near, shown)]
    return Features(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _materials(compiled: CompiledScene) -> _Materials:
    used = [compiled.materials[i] for i in compiled.surfaces.used]
    lobes = [each if each and each.size < _NARROW else _NO_LOBE for each in map(lobe, used)]
    return _Materials(
        np.array([material.get("le", _BLACK) for material in used]),
        np.array([diffuse(material) for material in used]),
        _Lobes(*map(np.array, zip(*lobes, strict=True))),
    )


def _choose(surfaces: Surfaces, rows: NDArray[np.intp], mask: Mask) -> _Surfaces:
    """The surfaces that are True in `mask` (S + P,), of whose materials `rows` (S + P,) has the rows."""
    balls, planes = mask[: surfaces.spheres], mask[surfaces.spheres :]
    return _Surfaces(
        surfaces.centers[balls], surfaces.radii[balls], surfaces.normals[planes], surfaces.offsets[planes], rows[mask]
    )


def _portions(lights: Sequence[PointLight], surfaces: _Surfaces) -> Iterator[_Lights]:
    """The lights, so many at a time that the arrays of their pairs with the surfaces are not too large."""
    count = len(surfaces.materials)
    step = max(1, _PAIRS // max(count, 1))
    for i in range(0, len(lights) if count else 0, step):
        some = lights[i : i + step]
        yield _Lights(
            np.array([light.position for light in some]),
            np.array([light.color for light in some])[:, None],
            np.array([light.radius for light in some])[:, None],
            np.array([light.falloff == "inverse_square" for light in some])[:, None, None],
        )


def _emitters(eye: _Eye, balls: _Surfaces, radiance: Array) -> Features:
    solid_angles = math.pi * balls.radii**2 / np.square(balls.centers - eye.position).sum(axis=1)
    return eye.features(balls.centers, solid_angles, solid_angles, radiance)


def _glints(eye: _Eye, lights: _Lights, surfaces: _Surfaces, lobes: _Lobes) -> Features:
    """The mirror images of K lights in N surfaces with N `lobes`."""
    on_balls, on_planes = _mirror_points(eye, lights, surfaces), _plane_mirror_points(eye, lights, surfaces)
    points, normals = (np.concatenate(pair, axis=1) for pair in zip(on_balls, on_planes, strict=True))
    curvature = np.append(1.0 / surfaces.radii, np.zeros(len(surfaces.offsets)))
    to_eye, to_light = eye.position - points, lights.positions[:, None] - points
    far, away = _length(to_eye), _length(to_light)
    cosine = np.minimum(_dot(normals, to_eye) / far, _dot(normals, to_light) / away)
    c = np.clip(cosine, _GRAZING, 1.0)
    # How fast the halfway vector turns along the surface: in the plane of both directions by c times that, and across
    # by that over c. The normal turns besides, by the curvature.
    turn = 0.5 * (1.0 / far + 1.0 / away)
    # Solid angles that the eye sees, over those of normals.
    scale = c / (far**2 * (curvature + c * turn) * (curvature + turn / c))
    sizes = lobes.sizes / c**lobes.widening
    # A lamp takes part of the solid angle around the mirror direction, half as wide around the normal.
    lamps = math.pi / 4.0 * np.square(np.minimum(lights.radii / away, 1.0)) / c
    fresnel = lobes.f0 + (1.0 - lobes.f0) * (1.0 - c[..., None]) ** 5
    peaks = lobes.peaks * fresnel * (c**lobes.powers)[..., None]
    radiance = lights.irradiance(away) * peaks * (cosine > 0.0)[..., None]
    return eye.features(points, scale * sizes, scale * (sizes + lamps), radiance)


def _mirror_points(eye: _Eye, lights: _Lights, balls: _Surfaces) -> tuple[Array, Array]:
    """Where B balls mirror K lights, and the normals there, (K, B, 3) each, if neither lights nor the eye are inside.

    In the plane of both directions from the centre, with the first axis towards the eye, the normal is between both.
    Halving the angle between them finds it.
    """
    centers, radii = balls.centers, balls.radii
    to_eye = eye.position - centers
    distance = _length(to_eye)
    first = to_eye / distance[:, None]
    to_light = lights.positions[:, None] - centers
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
    return centers + radii[:, None] * normals, normals


def _plane_mirror_points(eye: _Eye, lights: _Lights, planes: _Surfaces) -> tuple[Array, Array]:
    """Where P planes mirror those of K lights that are on the eye's side, and the normals there: (K, P, 3) each."""
    normals, offsets = planes.normals, planes.offsets
    height, heights = normals @ eye.position - offsets, lights.positions @ normals.T - offsets
    share = height / (height + heights)
    foot = eye.position - height[:, None] * normals
    feet = lights.positions[:, None] - heights[..., None] * normals
    points = foot + share[..., None] * (feet - foot)
    return points, np.broadcast_to(np.sign(height)[:, None] * normals, points.shape)


def _hot_spots(eye: _Eye, lights: _Lights, surfaces: _Surfaces, diffuse: Array) -> Features:
    """The points of N surfaces that are nearest to K lights: spots as wide as the lights are near."""
    balls = len(surfaces.radii)
    outward = lights.positions[:, None] - surfaces.centers
    distance = _length(outward)
    outward /= distance[..., None]
    # A light in a ball leaves its outside dark.
    heights = np.where(distance > surfaces.radii, distance - surfaces.radii, np.inf)
    above = lights.positions @ surfaces.normals.T - surfaces.offsets
    normals = np.concatenate([outward, np.sign(above)[..., None] * surfaces.normals], axis=1)
    heights = np.concatenate([heights, np.abs(above)], axis=1)
    widths = np.maximum(heights, lights.radii)
    # No wider than the ball.
    widths[:, :balls] = np.minimum(widths[:, :balls], surfaces.radii)
    points = lights.positions[:, None] - heights[..., None] * normals
    to_eye = eye.position - points
    far = _length(to_eye)
    cosine = _dot(normals, to_eye) / far
    solid_angles = math.pi * np.square(widths / far) * np.maximum(cosine, 0.0)
    return eye.features(points, solid_angles, solid_angles, lights.irradiance(heights) * diffuse)


def _length(vectors: Array) -> Array:
    return np.sqrt(_dot(vectors, vectors))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i->...", a, b)
