"""Row of the ledger on solids that might shade themselves."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import PixelErrors, compare_pictures, normalize
from raytracer.analysis.numerics.specimens import KINDS, random_map, specimen
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.options import Precision
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

_ROW = "self-shadow of solids"
# In full, the seeds and the pictures show 1.6 million pairs of a point and a light for each kind and precision.
_SEEDS, _SIZE, _LIGHTS = 800, (28, 28), 16
_TORUS_SEEDS, _TORUS_SIZE = 1600, (80, 80)
# The doubtful pixels of one in so many pictures of a torus are counted, even if it agrees with the reference.
_SAMPLED = 16


def solids_self_shadow(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The test of `self-shadow` for solids of all kinds, of sizes 1e-4 to 1e4 and condition numbers up to 100, from up
    to 1e4 sizes away, with lights up to 1e6 sizes away.

    A convex solid never shades points of its surface that face a light. A torus may, and each light's shadow is
    compared with float64. With 32 bits, its shadows are in doubt from a distance of some 100 sizes on.
    """
    for kind in KINDS:
        if kind == "torus":
            yield from _torus_shadows(renderer, 20 if short else _TORUS_SEEDS, (40, 40) if short else _TORUS_SIZE)
            continue
        for bits in renderer.device.limits.precisions:
            shaded = rays = 0
            seeds = 8 if short else _SEEDS
            for seed in range(seeds):
                scene = _lit_solid(kind, seed, _LIGHTS)
                lit, free = (
                    renderer.render(scene, _SIZE, Settings(precision=bits, shadows=shadows))
                    for shadows in ("hard", "off")
                )
                assert free.material is not None
                shaded += int(np.sum(lit.radiance != free.radiance))
                rays += int(np.sum(free.material >= 0)) * len(scene.lights)
            note = f"{seeds} seeds, {rays} pairs of point and light"
            yield Finding(_ROW, kind, bits, "self-hits", shaded, 0, note)


def _lit_solid(kind: str, seed: int, lights: int) -> Scene:
    """Return a random specimen that fills a picture, and lights around it, near and far."""
    rng = np.random.default_rng((5, seed))
    size = 10.0 ** rng.uniform(-4, 4)
    solid = specimen(kind).transform(random_map(rng, 100.0)).scale(size)
    corners = np.array(solid.bounds())
    center, radius = corners.mean(axis=0), float(np.linalg.norm(corners[1] - corners[0])) / 2.0
    eye = center + normalize(rng.normal(size=3)) * radius * 10.0 ** rng.uniform(0.01, 4)
    distance = float(np.linalg.norm(eye - center))
    fov = min(2.0 * math.degrees(math.asin(min(0.95, radius / distance))), 150.0)
    reach = np.repeat((2.0, 10.0 ** rng.uniform(1, 6)), (lights + 1) // 2)[:lights]
    places = center + normalize(rng.normal(size=(lights, 3))) * radius * reach[:, None]
    look_at = center + 0.1 * radius * normalize(rng.normal(size=3))
    sources = [PointLight(tuple(place), (2.0**i, 0, 0)) for i, place in enumerate(places.tolist())]
    return Scene([solid], sources, Camera(tuple(eye.tolist()), tuple(look_at.tolist()), vertical_fov=fov))


def _torus_shadows(renderer: Renderer, seeds: int, size: tuple[int, int]) -> Iterator[Finding]:
    precisions = renderer.device.limits.precisions
    counted: dict[Precision, list[PixelErrors]] = {bits: [] for bits in precisions}
    sampled: dict[Precision, list[PixelErrors]] = {bits: [] for bits in precisions}
    pairs = 0
    for seed in range(seeds):
        scene = _lit_solid("torus", seed, 1)
        exact = ray_tracer.trace(scene, size)
        assert exact.material is not None
        pairs += int(np.sum(exact.material >= 0))
        is_dark = (exact.radiance == 0.0).all(axis=2)
        for bits in precisions:
            image = renderer.render(scene, size, Settings(precision=bits))
            if seed % _SAMPLED and np.array_equal(is_dark, (image.radiance == 0.0).all(axis=2)):
                continue  # all shadows are right
            errors = compare_pictures(image, exact, find_pixel_doubt(scene, size, bits))
            counted[bits].append(errors)
            if not seed % _SAMPLED:
                sampled[bits].append(errors)
    for bits, errors in counted.items():
        note = f"{seeds} seeds, {pairs} pairs of point and light"
        yield Finding(_ROW, "torus", bits, "wrong shadows", sum(e.lit for e in errors), 0, note)
        yield Finding(_ROW, "torus", bits, "falsely dark", sum(e.dark for e in errors), 0)
        in_fact = sum(e.dark_in_fact for e in errors)
        yield Finding(_ROW, "torus", bits, "falsely dark in fact, doubtful or not", in_fact, math.inf)
        shown = sum(e.shown for e in sampled[bits])
        unlit = sum(e.unlit * e.shown for e in sampled[bits]) / max(1, shown)
        # Half of the distances are beyond 100 sizes.
        most = 0.6 if bits == 32 else 0.01
        yield Finding(_ROW, "torus", bits, "doubtful shadows, of those hit", unlit, most)
