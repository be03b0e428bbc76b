"""The small bright features of a scene: samples of a picture may miss them, as they are smaller than the distance of
samples.

Features are emitting spheres, glints (where a surface with a narrow lobe mirrors a light), and hot spots (surfaces
close to an attenuated light). Their areas and radiance follow from the numbers of the scene, to a factor of about 2.
Hidden features count, and so do features in flat mirrors, and emitters in mirroring balls. Features in other mirrors,
on the inside of spheres, or of lobes of measured materials do not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.eyes import MOST_EYES, Eye, Mirror, eyes
from raytracer.compiler.features import NO_FEATURES, Features
from raytracer.compiler.narrow_lobes import Lobe, diffuse, lobe, mirrored
from raytracer.compiler.surfaces import Surfaces
from raytracer.core.validation import MAX_COLOR
from raytracer.scene.lights import PointLight
from raytracer.scene.scene_objects import SceneObjects

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Ints = NDArray[np.intp]

# The solid angle of the widest lobe whose glint may be smaller than a pixel, on balls of 15 pixels and more: exponents
# from 160 to 630 on, and alpha up to 0.056.
_NARROW = 0.01
# Halvings of the angle in which a mirror point is: its 2000th part is at most half a pixel on balls of 400 pixels.
_HALVINGS = 11
# Pairs of a surface and a light in one array: arrays of this size fit a processor's cache.
_PAIRS = 2**14
# The most pairs of a surface and a light for one eye. They take a tenth of a second; of more pairs, some stand for all.
_MOST_PAIRS = 2**18
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
    mirrored: Array  # (M, 3)
    lobes: _Lobes


class _Surfaces(NamedTuple):
    """Some of a scene's surfaces: B balls, then P planes."""

    centers: Array  # (B, 3)
    radii: Array  # (B,)
    normals: Array  # (P, 3)
    offsets: Array  # (P,)
    materials: Ints  # (B + P,): the row of each one's material in _Materials


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


class _Reflections(NamedTuple):
    """K lights, or emitters, in the mirror points of N surfaces."""

    is_lit: Mask  # (K, N): whether the eye and the light are before the surface
    cosine: Array  # (K, N): of the angles to the normal, at least _GRAZING
    away: Array  # (K, N): the light's distance
    scale: Array  # (K, N): the solid angle of a patch as the eye sees it, over the solid angle of the patch's normals

    def images(self, radii: Array) -> Array:
        """(K, N): the solid angles of the mirror images of lights with `radii` (K, 1)."""
        # A light takes part of the solid angle around the mirror direction, half as wide around the normal.
        return self.scale * math.pi / 4.0 * np.square(np.minimum(radii / self.away, 1.0)) / self.cosine


def bright_features(compiled: CompiledScene, size: tuple[int, int]) -> Features:
    """The small bright features of a picture of `size` (width, height). They live as long as the scene's objects."""
    objects = compiled.scene.objects
    assert isinstance(objects, SceneObjects)
    key = compiled.surfaces, compiled.materials
    materials = objects.derive("bright materials", key, lambda: _materials(compiled))
    key = *key, compiled.lights, compiled.options.bounces, compiled.scene.camera, size
    return objects.derive("bright features", key, lambda: _features(compiled, materials, size))


def _features(compiled: CompiledScene, materials: _Materials, size: tuple[int, int]) -> Features:
    surfaces = compiled.surfaces
    lights = [light for light in compiled.lights if any(light.color)]
    near = [light for light in lights if light.falloff == "inverse_square"]
    emits, is_narrow = materials.emission.max(axis=1) > 0.0, materials.lobes.sizes > 0.0
    if not (near or emits.any() or (lights and is_narrow.any())):
        return NO_FEATURES
    rows = np.searchsorted(surfaces.used, surfaces.material)
    emits, is_narrow = emits[rows], is_narrow[rows]
    emits[surfaces.spheres :] = False
    is_mirror = np.any(materials.mirrored, axis=1)[rows] & compiled.has_mirrors
    emitters = _choose(surfaces, rows, emits, 1)
    flat = _flat_mirrors(_choose(surfaces, rows, is_mirror, 1), materials.mirrored)
    parts = [NO_FEATURES]
    with np.errstate(all="ignore"):  # Eye.features() leaves out what overflows
        for eye in eyes(compiled.scene.camera, size, flat, compiled.options.bounces):
            balls = eye.sees(surfaces.centers, surfaces.radii)
            seen = np.append(balls, np.ones(len(surfaces.planes), bool))
            parts.append(_emitters(eye, _choose(surfaces, rows, seen & emits, 1), materials.emission))
            mirrors = _choose(surfaces, rows, seen & is_mirror, len(emitters.radii))
            parts += _emitters_in_balls(eye, emitters, mirrors, materials)
            narrow = _choose(surfaces, rows, seen & is_narrow, len(lights))
            lobes = _Lobes(*(each[narrow.materials] for each in materials.lobes))
            parts += [_glints(eye, some, narrow, lobes) for some in _portions(lights, narrow)]
            shown = _choose(surfaces, rows, seen, len(near))
            parts += [_hot_spots(eye, some, shown, materials.diffuse) for some in _portions(near, shown)]
    return Features(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _materials(compiled: CompiledScene) -> _Materials:
    used = [compiled.materials[i] for i in compiled.surfaces.used]
    lobes = [each if each and each.size < _NARROW else _NO_LOBE for each in map(lobe, used)]
    return _Materials(
        np.array([material.get("le", _BLACK) for material in used]),
        np.array([diffuse(material) for material in used]),
        np.array([mirrored(material) for material in used]),
        _Lobes(*map(np.array, zip(*lobes, strict=True))),
    )


def _choose(surfaces: Surfaces, rows: Ints, mask: Mask, lights: int) -> _Surfaces:
    """The surfaces that are True in `mask` (S + P,), of whose materials `rows` (S + P,) has the rows.

    Every so many of them, if they have more than _MOST_PAIRS pairs with so many `lights`.
    """
    chosen = np.flatnonzero(mask)
    chosen = chosen[:: max(1, -(-len(chosen) * lights // _MOST_PAIRS))]
    balls, planes = chosen[chosen < surfaces.spheres], chosen[chosen >= surfaces.spheres] - surfaces.spheres
    return _Surfaces(
        surfaces.centers[balls], surfaces.radii[balls], surfaces.normals[planes], surfaces.offsets[planes], rows[chosen]
    )


def _flat_mirrors(mirrors: _Surfaces, mirrored: Array) -> list[Mirror]:
    """The planes among `mirrors`, as many as eyes() takes; materials mirror as `mirrored` (M, 3) has it."""
    factors = mirrored[mirrors.materials[len(mirrors.radii) :]]
    return [*map(Mirror, mirrors.normals, mirrors.offsets.tolist(), factors)][:MOST_EYES]


def _portions(lights: Sequence[PointLight], surfaces: _Surfaces) -> Iterator[_Lights]:
    """The lights, so many at a time that the arrays of their pairs with the surfaces are not too large."""
    for portion in _slices(len(lights), len(surfaces.materials)):
        some = lights[portion]
        yield _Lights(
            np.array([light.position for light in some]),
            np.array([light.color for light in some])[:, None],
            np.array([light.radius for light in some])[:, None],
            np.array([light.falloff == "inverse_square" for light in some])[:, None, None],
        )


def _slices(lights: int, surfaces: int) -> Iterator[slice]:
    """Slices of so many `lights`, each with at most _PAIRS pairs with so many `surfaces`, but for one light."""
    step = max(1, _PAIRS // max(surfaces, 1))
    yield from (slice(i, i + step) for i in range(0, lights if surfaces else 0, step))


def _emitters(eye: Eye, balls: _Surfaces, emission: Array) -> Features:
    """Emitting balls. Materials emit `emission` (M, 3)."""
    solid_angles = math.pi * balls.radii**2 / np.square(balls.centers - eye.position).sum(axis=1)
    return eye.features(balls.centers, solid_angles, solid_angles, emission[balls.materials])


def _emitters_in_balls(eye: Eye, emitters: _Surfaces, mirrors: _Surfaces, materials: _Materials) -> Iterator[Features]:
    """The mirror images of emitting balls in the balls among `mirrors`."""
    emission = materials.emission[emitters.materials][:, None]
    factors = materials.mirrored[mirrors.materials[: len(mirrors.radii)]]
    for some in _slices(len(emitters.radii), len(mirrors.radii)):
        centers = emitters.centers[some]
        points, normals = _mirror_points(eye, centers, mirrors)
        reflections = _reflections(eye, centers, points, normals, 1.0 / mirrors.radii)
        images = reflections.images(emitters.radii[some, None])
        yield eye.features(points, images, images, emission[some] * factors * reflections.is_lit[..., None])


def _glints(eye: Eye, lights: _Lights, surfaces: _Surfaces, lobes: _Lobes) -> Features:
    """The mirror images of K lights in N surfaces with N `lobes`."""
    places = lights.positions
    on_balls, on_planes = _mirror_points(eye, places, surfaces), _plane_mirror_points(eye, places, surfaces)
    points, normals = (np.concatenate(pair, axis=1) for pair in zip(on_balls, on_planes, strict=True))
    curvature = np.append(1.0 / surfaces.radii, np.zeros(len(surfaces.offsets)))
    reflections = _reflections(eye, places, points, normals, curvature)
    c = reflections.cosine
    sizes = reflections.scale * lobes.sizes / c**lobes.widening
    fresnel = lobes.f0 + (1.0 - lobes.f0) * (1.0 - c[..., None]) ** 5
    peaks = lobes.peaks * fresnel * (c**lobes.powers)[..., None]
    radiance = lights.irradiance(reflections.away) * peaks * reflections.is_lit[..., None]
    return eye.features(points, sizes, sizes + reflections.images(lights.radii), radiance)


def _reflections(eye: Eye, lights: Array, points: Array, normals: Array, curvature: Array) -> _Reflections:
    """Lights at (K, 3) in mirror `points` (K, N, 3) of surfaces with `normals` (K, N, 3) and `curvature` (N,)."""
    to_eye, to_light = eye.position - points, lights[:, None] - points
    far, away = _length(to_eye), _length(to_light)
    cosine = np.minimum(_dot(normals, to_eye) / far, _dot(normals, to_light) / away)
    c = np.clip(cosine, _GRAZING, 1.0)
    # Along the surface the halfway vector turns by c * turn in the plane of both directions, and by turn / c across it.
    # The normal turns by the curvature.
    turn = 0.5 * (1.0 / far + 1.0 / away)
    scale = c / (far**2 * (curvature + c * turn) * (curvature + turn / c))
    return _Reflections(cosine > 0.0, c, away, scale)


def _mirror_points(eye: Eye, lights: Array, balls: _Surfaces) -> tuple[Array, Array]:
    """Where B balls mirror lights at (K, 3), and the normals there: (K, B, 3) each. Lights and eye are not inside.

    In the plane of both directions from the centre, with the first axis towards the eye, the normal is between both.
    Halving the angle between them finds it.
    """
    centers, radii = balls.centers, balls.radii
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
    return centers + radii[:, None] * normals, normals


def _plane_mirror_points(eye: Eye, lights: Array, planes: _Surfaces) -> tuple[Array, Array]:
    """Where P planes mirror lights at (K, 3) that are on the eye's side, and the normals there: (K, P, 3) each."""
    normals, offsets = planes.normals, planes.offsets
    height, heights = normals @ eye.position - offsets, lights @ normals.T - offsets
    share = height / (height + heights)
    foot = eye.position - height[:, None] * normals
    feet = lights[:, None] - heights[..., None] * normals
    points = foot + share[..., None] * (feet - foot)
    return points, np.broadcast_to(np.sign(height)[:, None] * normals, points.shape)


def _hot_spots(eye: Eye, lights: _Lights, surfaces: _Surfaces, diffuse: Array) -> Features:
    """The points of N surfaces that are nearest to K lights: spots as wide as the lights are near.

    Materials have the `diffuse` parts (M, 3).
    """
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
    return eye.features(points, solid_angles, solid_angles, lights.irradiance(heights) * diffuse[surfaces.materials])


def _length(vectors: Array) -> Array:
    return np.sqrt(_dot(vectors, vectors))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...i,...i->...", a, b)
