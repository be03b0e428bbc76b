"""Rows of the ledger on light: self-shadows, highlights, where a shadow ray ends, what is never NaN."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer import glsl
from raytracer.extremes.comparison import MATTE, findings, precisions
from raytracer.extremes.ledger import Finding
from raytracer.renderer import Renderer
from raytracer.resolution import UNIT
from raytracer.scene import Camera, Material, Plane, PointLight, Scene, Solid, Sphere
from raytracer.settings import Settings

Array = NDArray[np.float64]
_RED, _BLUE, _GREEN, _GREY = MATTE


def self_shadow(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The re-intersection test of pbrt-v4 (shapes_test.cpp, FullSphere.Reintersect), through the renderer.

    Spheres of radius 10^U(-4, 4), seen from 10^U(-8, 8) away in each coordinate; from each hit point
    rays to lights in all directions, near and far. A ball alone never shades what faces a light on its side.
    """
    seeds = 40 if short else 1000
    for bits in precisions(renderer):
        shaded = rays = 0
        for seed in range(seeds):
            rng = np.random.default_rng(seed)
            radius = 10.0 ** rng.uniform(-4, 4)
            eye = rng.choice((-1, 1), 3) * 10.0 ** rng.uniform(-8, 8, 3)
            look_at = rng.uniform(-radius, radius, 3)
            distance = np.linalg.norm(eye)
            outside = distance > radius
            fov = 2.2 * math.degrees(math.atan(radius / distance)) if outside else 170.0
            # Eight near lights and eight far ones; where the camera is inside, the lights are.
            reach = np.repeat((2.0, 10.0 ** rng.uniform(1, 6)) if outside else (0.3, 0.95), 8)
            places = _unit(rng.normal(size=(16, 3))) * radius * reach[:, None]
            lights = [PointLight(tuple(place), (2.0**i, 0, 0)) for i, place in enumerate(places.tolist())]
            up = (0.3, 1.0, 0.1) if abs(eye[1]) < 0.9 * distance else (1.0, 0.1, 0.3)
            camera = Camera(tuple(eye), tuple(look_at), up, min(fov, 170.0))
            scene = Scene([Sphere((0, 0, 0), radius, _RED)], lights, camera)
            lit, free = (
                renderer.render(scene, (14, 14), Settings(precision=bits, shadows=shadows))
                for shadows in ("hard", "off")
            )
            assert free.material is not None
            shaded += int(np.sum(lit.radiance != free.radiance))
            rays += int(np.sum(free.material >= 0)) * len(lights)
        note = f"{seeds} seeds, {rays / seeds:.0f} pairs of point and light each"
        yield Finding("self-shadow", "radius 1e-4 to 1e4, from up to 1e8", bits, "self-hits", shaded, 0, note)


def highlight(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Highlights of exponents 0 to 1e6 at values from 1 down to 1e-8, for float32 vectors as they are given."""
    u = UNIT[32]
    for h in (0.0, 32.0, 1e6) if short else (0.0, 0.1, 1.0, 10.0, 32.0, 100.0, 1e3, 1e4, 1e5, 1e6):
        rng = np.random.default_rng(11)
        count = 4000
        # Where the lobe has a value 10^-U(0, 8), or anywhere on the hemisphere if it is that broad.
        cosine = np.maximum(10.0 ** (-rng.uniform(0, 8, count) / max(h, 1e-9)), 0.02)
        N, other = (_unit(v) for v in rng.normal(size=(2, count, 3)))
        side = _unit(np.cross(N, other))
        axis = N * cosine[:, None] + side * np.sqrt(1.0 - cosine**2)[:, None]
        L = _unit(N + 0.8 * other)
        for model in ("phong", "blinn"):
            if model == "phong":  # V at that angle from R
                R = 2.0 * _dot(N, L)[:, None] * N - L
                across = _unit(np.cross(R, other))
                V = R * cosine[:, None] + across * np.sqrt(1.0 - cosine**2)[:, None]
                given = [v.astype(np.float32) for v in (N, L, V)]
            else:  # H at that angle from N, V its mirror image of L; all nearly along `axis`
                L2 = _unit(axis + 0.5 * _unit(np.cross(axis, other)))
                V = 2.0 * _dot(axis, L2)[:, None] * axis - L2
                given = [v.astype(np.float32) for v in (N, L2, V)]
            value = glsl.call(model, *given, h, renderer=renderer)
            n, l, v = (_unit(g.astype(float)) for g in given)
            a, b = (2.0 * _dot(n, l)[:, None] * n - l, v) if model == "phong" else (n, l + v)
            sine, cos = np.linalg.norm(np.cross(a, b), axis=1), _dot(a, b)
            exact = np.exp(-0.5 * h * np.log1p((sine / cos) ** 2))
            sure = (cos > 0.01) & (exact > 1e-9)
            error = np.abs(value[sure] / exact[sure] - 1.0)
            # cosine_lobe.glsl's bound: the angle's error, that of vectors rounded to u, and the function's own.
            tangent = (sine / cos)[sure]
            bound = (8.0 + 8.0 * h * tangent * (1.0 + tangent) + 4.0 * np.abs(np.log(exact[sure]))) * u
            at = f"{model}, h = {h:g}"
            note = f"{sure.sum()} triples, share of its bound at most {(error / bound).max():.2f}"
            yield Finding(
                "exponent", at, 32, "relative error of the highlight", float(error.max()), float(bound.max()), note
            )


def shadow_end(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """An occluder 1e-6 before and behind the light, for light one and ten units from a wall."""
    wall = Plane((0, 0, 1), 0, _GREY)
    for distance, side in itertools.product((1.0, 10.0), (-1.0, 1.0)):
        light = PointLight((0.3, 0.2, distance))
        z = distance + side * 1e-6
        occluders: dict[str, Solid] = {
            "half-space": Plane((0, 0, -1), -z, _RED),
            "sphere": Sphere((0.3, 0.2, z + 2.0 * distance), 2.0 * distance, _RED),
        }
        camera = Camera((0.1, 0.0, 0.8 * distance), (0.0, 0.1, 0.0), vertical_fov=80)
        for name, occluder in occluders.items():
            where = "before" if side < 0 else "behind"
            scene = Scene([wall, occluder], [light], camera)
            at = f"{name} 1e-6 {where}, light at {distance:g}"
            for finding in findings(renderer, "shadow end", at, scene, (64, 48)):
                if finding.measure == "wrong shadows":
                    settings = Settings(precision=64 if finding.bits == 64 else 32)
                    image = renderer.render(scene, (64, 48), settings)
                    wrong = int(np.sum((image.radiance.max(axis=2) > 0.0) != (side > 0)))
                    yield dataclasses.replace(finding, note=f"{wrong} of {64 * 48} with the doubtful ones")


def valid_scenes(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Lights and colours at their ends: no output is NaN, no radiance infinite or negative."""
    ball, floor = Sphere((0, 0, 0), 1, _RED), Plane((0, 1, 0), -1, _GREY)
    eye = (0.5, 0.4, 3.0)
    lights = {
        "on a sphere": (0.0, 0.0, 1.0),
        "on a plane": (0.3, -1.0, 0.7),
        "inside a solid": (0.1, 0.2, 0.3),
        "at a sphere's centre": (0.0, 0.0, 0.0),
        "at the camera": eye,
        "behind the camera": (1.0, 0.8, 6.0),
        "at 1e6": (6e5, 8e5, 1e5),
        "at 1e12": (6e11, 7e11, 1e11),
        "in the floor's plane": (40.0, -1.0, 0.0),
    }
    exponents, colors = (0.0, 1e6), (0.0, 1e-12, 1e6, 1e12)
    if short:
        exponents, colors = (1e6,), (0.0, 1e12)
    for model, (where, position) in itertools.product(("phong", "blinn"), lights.items()):
        for bits in precisions(renderer):
            bad = 0
            for h, color, shadows in itertools.product(exponents, colors, ("off", "hard", "diluted")):
                c = (color, color, color)
                material = Material(ka=c, kd=c, ks=c, h=h, model=model)
                objects = [Sphere(ball.center, 1, material), Plane(floor.normal, -1, material)]
                scene = Scene(objects, [PointLight(position, c)] * 3, Camera(eye, (0, 0, 0), vertical_fov=70), c, c)
                image = renderer.render(scene, (32, 24), Settings(precision=bits, shadows=shadows))
                assert image.normal is not None and image.depth is not None
                bad += int(np.sum(~(image.radiance >= 0.0) | np.isinf(image.radiance)))
                bad += int(np.sum(~np.isfinite(image.normal)) + np.sum(~(image.depth > 0.0)))
            at = f"{model}, light {where}"
            yield Finding("valid scenes", at, bits, "NaN, infinite or negative values", bad, 0, "colours 0 to 1e12")


def _unit(v: Any) -> Array:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)
