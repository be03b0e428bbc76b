"""The small bright features of a scene, which samples may miss because they are smaller than the samples' distance.

Features are emitting spheres and bodies (bodies.py), glints (a surface with a narrow lobe mirrors a light), and hot
spots (surfaces close to an attenuated light). Their areas and radiance follow from the scene's numbers, to a factor of
about 2. Hidden features count, and so do features in mirroring planes, and emitters in mirroring balls. Not counted:
features in other mirrors, on the inside of spheres, on curved faces of bodies, and of the lobes of measured materials.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.eyes import MOST_EYES, Eye, Mirror, eyes
from raytracer.compiler.feature_surfaces import FeatureSurfaces, all_surfaces
from raytracer.compiler.features import NO_FEATURES, Features
from raytracer.compiler.narrow_lobes import Lobe, diffuse_reflectance, highlight_lobe, mirrored_share
from raytracer.core.validation import MAX_COLOR
from raytracer.scene.lights import PointLight
from raytracer.scene.scene_objects import SceneObjects

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Ints = NDArray[np.intp]

# The largest solid angle of a lobe, in sr, that counts as narrow: its glint may be smaller than a pixel on balls of 15
# pixels and more. This holds for exponents above 160 to 630 (by model), and for alpha up to 0.056.
_NARROW = 0.01
# The number of bisection steps for a mirror point: 1/2000 of the angle is at most half a pixel on balls of 400 pixels.
_HALVINGS = 11
# The number of pairs of a surface and a light in one array: arrays of this size fit a processor's cache.
_PAIRS = 2**14
# The smallest cosine between a normal and a direction, so that no quotient is infinite.
_GRAZING = 1e-3

_BLACK = (0.0, 0.0, 0.0)
_NO_LOBE = Lobe(0.0, 0.0, _BLACK, 0.0, _BLACK)


class _Lobes(NamedTuple):
    """The narrow lobes of N materials (see Lobe). A material without a narrow lobe has the size 0."""

    sizes: Array  # (N,)
    widening: Array  # (N,)
    peaks: Array  # (N, 3)
    powers: Array  # (N,)
    f0: Array  # (N, 3)


class _Materials(NamedTuple):
    """The light that M materials emit and reflect."""

    emission: Array  # (M, 3)
    diffuse: Array  # (M, 3)
    mirrored: Array  # (M, 3)
    lobes: _Lobes


class _Lights(NamedTuple):
    """K lights."""

    positions: Array  # (K, 3)
    colors: Array  # (K, 1, 3)
    radii: Array  # (K, 1)
    is_attenuated: Mask  # (K, 1, 1)

    def irradiance(self, distances: Array) -> Array:
        """Return the irradiance (K, N, 3) of surfaces that face the lights, at `distances` (K, N), as
        irradiance.glsl."""
        squares = np.square(np.maximum(distances, self.radii))[..., None]
        return np.where(self.is_attenuated, np.minimum(self.colors / squares, MAX_COLOR), self.colors)


class _Reflections(NamedTuple):
    """The reflections of K lights or emitters in N surfaces, at the mirror points."""

    is_lit: Mask  # (K, N): whether the eye and the light are in front of the surface
    cosine: Array  # (K, N): of the angle between each direction and the normal, at least _GRAZING
    away: Array  # (K, N): the light's distance
    scale: Array  # (K, N): the solid angle of a patch, seen from the eye, over the solid angle of the patch's normals

    def images(self, radii: Array) -> Array:
        """Return the solid angles (K, N) of the mirror images of lights with `radii` (K, 1)."""
        # The light's angle around the mirror direction is twice the angle around the normal.
        return self.scale * math.pi / 4.0 * np.square(np.minimum(radii / self.away, 1.0)) / self.cosine


def bright_features(compiled: CompiledScene, size: tuple[int, int]) -> Features:
    """Compute the small bright features of a picture of `size` (width, height).

    The result is cached with the scene's objects.
    """
    objects = compiled.scene.objects
    assert isinstance(objects, SceneObjects)
    key = compiled.surfaces, compiled.materials
    materials = objects.derive("bright materials", key, lambda: _materials(compiled))
    key = *key, compiled.lights, compiled.options.bounces, compiled.scene.camera, size
    return objects.derive("bright features", key, lambda: _features(compiled, materials, size))


def _features(compiled: CompiledScene, materials: _Materials, size: tuple[int, int]) -> Features:
    """Compute the features for all eyes."""
    surfaces = compiled.surfaces
    lights = [light for light in compiled.lights if any(light.color)]
    near = [light for light in lights if light.falloff == "inverse_square"]
    emits, is_narrow = materials.emission.max(axis=1) > 0.0, materials.lobes.sizes > 0.0
    if not (near or emits.any() or (lights and is_narrow.any())):
        return NO_FEATURES
    everything = all_surfaces(surfaces)
    rows, bounded = everything.materials, surfaces.bounded
    emits, is_narrow = emits[rows], is_narrow[rows]
    is_mirror = np.any(materials.mirrored, axis=1)[rows] & compiled.has_mirrors
    # The balls in place of bodies only emit. Of the faces of bodies, none counts as a mirror.
    emits[bounded:] = False
    is_exact = np.ones(len(rows), bool)
    is_exact[surfaces.spheres : bounded] = False
    is_narrow &= is_exact
    is_mirror &= is_exact
    is_mirror[bounded:] &= everything.planes.owners < 0
    emitters = everything.choose(emits, 1)
    flat = _flat_mirrors(everything.choose(is_mirror, 1), materials.mirrored)
    parts = [NO_FEATURES]
    with np.errstate(all="ignore"):  # Eye.features() leaves out overflowing features
        for eye in eyes(compiled.scene.camera, size, flat, compiled.options.bounces):
            seen = np.ones(len(rows), bool)
            seen[:bounded] = eye.sees(everything.centers, everything.radii)
            parts.append(_emitters(eye, everything.choose(seen & emits, 1), materials.emission))
            mirrors = everything.choose(seen & is_mirror, len(emitters.radii))
            parts += _emitters_in_balls(eye, emitters, mirrors, materials)
            narrow = everything.choose(seen & is_narrow, len(lights))
            lobes = _Lobes(*(column[narrow.materials] for column in materials.lobes))
            parts += [_glints(eye, portion, narrow, lobes) for portion in _portions(lights, narrow)]
            shown = everything.choose(seen & is_exact, len(near))
            parts += [_hot_spots(eye, portion, shown, materials.diffuse) for portion in _portions(near, shown)]
    return Features(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _materials(compiled: CompiledScene) -> _Materials:
    """Collect the light of all materials in use."""
    used = [compiled.materials[i] for i in compiled.surfaces.used]
    lobes = [made if made and made.size < _NARROW else _NO_LOBE for made in map(highlight_lobe, used)]
    return _Materials(
        np.array([material.get("le", _BLACK) for material in used]),
        np.array([diffuse_reflectance(material) for material in used]),
        np.array([mirrored_share(material) for material in used]),
        _Lobes(*map(np.array, zip(*lobes, strict=True))),
    )


def _flat_mirrors(mirrors: FeatureSurfaces, mirrored: Array) -> list[Mirror]:
    """Return the planes among `mirrors`, at most MOST_EYES. `mirrored` (M, 3) has the share that materials mirror."""
    factors = mirrored[mirrors.materials[len(mirrors.radii) :]]
    return [*map(Mirror, mirrors.planes.normals, mirrors.planes.offsets.tolist(), factors)][:MOST_EYES]


def _portions(lights: Sequence[PointLight], surfaces: FeatureSurfaces) -> Iterator[_Lights]:
    """Yield the lights in portions, each with at most _PAIRS pairs with the surfaces (or one light)."""
    for portion in _slices(len(lights), len(surfaces.materials)):
        chosen = lights[portion]
        yield _Lights(
            np.array([light.position for light in chosen]),
            np.array([light.color for light in chosen])[:, None],
            np.array([light.radius for light in chosen])[:, None],
            np.array([light.falloff == "inverse_square" for light in chosen])[:, None, None],
        )


def _slices(lights: int, surfaces: int) -> Iterator[slice]:
    """Yield slices of `lights` lights, each with at most _PAIRS pairs with `surfaces` surfaces, or one light."""
    step = max(1, _PAIRS // max(surfaces, 1))
    yield from (slice(i, i + step) for i in range(0, lights if surfaces else 0, step))


def _emitters(eye: Eye, balls: FeatureSurfaces, emission: Array) -> Features:
    """Return the emitting balls. `emission` (M, 3) is the radiance that materials emit."""
    solid_angles = math.pi * balls.radii**2 / np.square(balls.centers - eye.position).sum(axis=1)
    return eye.features(balls.centers, solid_angles, solid_angles, emission[balls.materials])


def _emitters_in_balls(
    eye: Eye, emitters: FeatureSurfaces, mirrors: FeatureSurfaces, materials: _Materials
) -> Iterator[Features]:
    """Yield the mirror images of emitting balls in the balls among `mirrors`."""
    emission = materials.emission[emitters.materials][:, None]
    factors = materials.mirrored[mirrors.materials[: len(mirrors.radii)]]
    for portion in _slices(len(emitters.radii), len(mirrors.radii)):
        centers = emitters.centers[portion]
        points, normals = _mirror_points(eye, centers, mirrors)
        reflections = _reflections(eye, centers, points, normals, 1.0 / mirrors.radii)
        images = reflections.images(emitters.radii[portion, None])
        yield eye.features(points, images, images, emission[portion] * factors * reflections.is_lit[..., None])


def _glints(eye: Eye, lights: _Lights, surfaces: FeatureSurfaces, lobes: _Lobes) -> Features:
    """Return the glints: the mirror images of K lights in N surfaces with N `lobes`."""
    places = lights.positions
    on_balls, on_planes = _mirror_points(eye, places, surfaces), _plane_mirror_points(eye, places, surfaces)
    points, normals = (np.concatenate(pair, axis=1) for pair in zip(on_balls, on_planes, strict=True))
    curvature = np.append(1.0 / surfaces.radii, np.zeros(len(surfaces.planes.offsets)))
    reflections = _reflections(eye, places, points, normals, curvature)
    c = reflections.cosine
    sizes = reflections.scale * lobes.sizes / c**lobes.widening
    fresnel = lobes.f0 + (1.0 - lobes.f0) * (1.0 - c[..., None]) ** 5
    peaks = lobes.peaks * fresnel * (c**lobes.powers)[..., None]
    is_lit = reflections.is_lit & surfaces.are_held(points)
    radiance = lights.irradiance(reflections.away) * peaks * is_lit[..., None]
    return eye.features(points, sizes, sizes + reflections.images(lights.radii), radiance)


def _reflections(eye: Eye, lights: Array, points: Array, normals: Array, curvature: Array) -> _Reflections:
    """Compute the reflections of lights at (K, 3) in N surfaces.

    The mirror points are `points` (K, N, 3), with the `normals` (K, N, 3) and the `curvature` (N,).
    """
    to_eye, to_light = eye.position - points, lights[:, None] - points
    far, away = _length(to_eye), _length(to_light)
    cosine = np.minimum(_dot(normals, to_eye) / far, _dot(normals, to_light) / away)
    c = np.clip(cosine, _GRAZING, 1.0)
    # Per unit of length along the surface, the halfway vector turns by c * turn in the plane of both directions, and by
    # turn / c across that plane. The normal turns by the curvature.
    turn = 0.5 * (1.0 / far + 1.0 / away)
    scale = c / (far**2 * (curvature + c * turn) * (curvature + turn / c))
    return _Reflections(cosine > 0.0, c, away, scale)


def _mirror_points(eye: Eye, lights: Array, balls: FeatureSurfaces) -> tuple[Array, Array]:
    """Find the points in which B balls mirror lights at (K, 3), and the normals there: (K, B, 3) each.

    Lights and eye must be outside the balls. The normal lies between the directions from the centre to the eye and to
    the light. Bisection of the angle between them finds it, in their plane, with the first axis towards the eye.
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
        # Compare the tangents of the angles between the normal and both directions.
        is_high = distance * y * (a * x + b * y - radii) > (b * x - a * y) * (distance * x - radii)
        low = np.where(is_high, low[0], x), np.where(is_high, low[1], y)
        high = np.where(is_high, x, high[0]), np.where(is_high, y, high[1])
    x, y = low
    normals = x[..., None] * first + (y / np.maximum(b, np.finfo(float).tiny))[..., None] * across
    return centers + radii[:, None] * normals, normals


def _plane_mirror_points(eye: Eye, lights: Array, planes: FeatureSurfaces) -> tuple[Array, Array]:
    """Find the points in which P planes mirror lights at (K, 3), and the normals there: (K, P, 3) each.

    The points are right for lights on the eye's side of the plane.
    """
    normals, offsets, _ = planes.planes
    height, heights = normals @ eye.position - offsets, lights @ normals.T - offsets
    share = height / (height + heights)
    foot = eye.position - height[:, None] * normals
    feet = lights[:, None] - heights[..., None] * normals
    points = foot + share[..., None] * (feet - foot)
    return points, np.broadcast_to(np.sign(height)[:, None] * normals, points.shape)


def _hot_spots(eye: Eye, lights: _Lights, surfaces: FeatureSurfaces, diffuse: Array) -> Features:
    """Return the hot spots: around the points of N surfaces nearest to K lights, as wide as the light is near.

    `diffuse` (M, 3) is the diffuse reflectance f of the materials.
    """
    balls = len(surfaces.radii)
    outward = lights.positions[:, None] - surfaces.centers
    distance = _length(outward)
    outward /= distance[..., None]
    # A light inside a ball does not light its outside.
    heights = np.where(distance > surfaces.radii, distance - surfaces.radii, np.inf)
    above = lights.positions @ surfaces.planes.normals.T - surfaces.planes.offsets
    normals = np.concatenate([outward, np.sign(above)[..., None] * surfaces.planes.normals], axis=1)
    heights = np.concatenate([heights, np.abs(above)], axis=1)
    widths = np.maximum(heights, lights.radii)
    # A spot is no wider than its ball.
    widths[:, :balls] = np.minimum(widths[:, :balls], surfaces.radii)
    points = lights.positions[:, None] - heights[..., None] * normals
    to_eye = eye.position - points
    far = _length(to_eye)
    cosine = _dot(normals, to_eye) / far
    solid_angles = math.pi * np.square(widths / far) * np.maximum(cosine, 0.0) * surfaces.are_held(points)
    return eye.features(points, solid_angles, solid_angles, lights.irradiance(heights) * diffuse[surfaces.materials])


def _length(vectors: Array) -> Array:
    """Return the lengths of vectors (..., 3)."""
    return np.sqrt(_dot(vectors, vectors))


def _dot(a: Array, b: Array) -> Array:
    """Return the dot products of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, b)
