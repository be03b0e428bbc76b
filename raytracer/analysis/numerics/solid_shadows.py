"""Row of the ledger on solids that might shade themselves."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import measure_pixel_errors, normalize
from raytracer.analysis.numerics.specimens import KINDS, random_map, specimen
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings


def solids_self_shadow(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The test of `self-shadow` for solids of all kinds, of sizes 1e-4 to 1e4 and condition numbers up to 100, from up
    to 1e8 away.

    A convex solid never shades points of its surface that face a light. A torus may, and each light's shadow is
    compared with float64.
    """
    row = "self-shadow of solids"
    for kind in KINDS:
        for bits in renderer.device.limits.precisions:
            if kind == "torus":
                yield from _torus_shadows(renderer, bits, 20 if short else 1600)
                continue
            shaded = rays = 0
            seeds = 12 if short else 700
            for seed in range(seeds):
                scene = _lit_solid(kind, seed, 16)
                lit, free = (
                    renderer.render(scene, (16, 16), Settings(precision=bits, shadows=shadows))
                    for shadows in ("hard", "off")
                )
                assert free.material is not None
                shaded += int(np.sum(lit.radiance != free.radiance))
                rays += int(np.sum(free.material >= 0)) * len(scene.lights)
            note = f"{seeds} seeds, {rays} pairs of point and light"
            yield Finding(row, kind, bits, "self-hits", shaded, 0, note)


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


def _torus_shadows(renderer: Renderer, bits: int, seeds: int) -> Iterator[Finding]:
    row, size = "self-shadow of solids", (40, 40)
    errors = []
    settings = Settings(precision=bits)  # pyright: ignore[reportArgumentType]
    for seed in range(seeds):
        errors.append(measure_pixel_errors(renderer, _lit_solid("torus", seed, 1), size, settings))
    pairs = sum(e.shown for e in errors)
    note = f"{seeds} seeds, {pairs} pairs of point and light"
    yield Finding(row, "torus", bits, "wrong shadows", sum(e.lit for e in errors), 0, note)
    yield Finding(row, "torus", bits, "falsely dark", sum(e.dark for e in errors), 0)
    yield Finding(
        row, "torus", bits, "falsely dark in fact, doubtful or not", sum(e.dark_in_fact for e in errors), math.inf
    )
    unlit = sum(e.unlit * e.shown for e in errors) / max(1, pairs)
    yield Finding(row, "torus", bits, "doubtful shadows, of those hit", unlit, 0.05)
