"""Rows of the ledger on light: self-shadows, highlights, ends of shadow rays, lights on surfaces, valid values."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import MATTE, count_invalid, measure_scene, normalize
from raytracer.analysis.rounding_bounds import UNIT
from raytracer.gpu import glsl_call
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere

Array = NDArray[np.float64]
_RED, _BLUE, _GREEN, _GREY = MATTE


def self_shadow(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The re-intersection test of pbrt-v4 (shapes_test.cpp, FullSphere.Reintersect), through the renderer.

    Spheres of radius 10^U(-4, 4), seen from a distance of 10^U(-8, 8) in each coordinate. Rays from each hit point go
    to lights in all directions, near and far. A single ball never shades points of its surface that face a light.
    """
    seeds = 40 if short else 1000
    for bits in renderer.device.limits.precisions:
        shaded = rays = 0
        for seed in range(seeds):
            rng = np.random.default_rng(seed)
            radius = 10.0 ** rng.uniform(-4, 4)
            eye = rng.choice((-1, 1), 3) * 10.0 ** rng.uniform(-8, 8, 3)
            look_at = rng.uniform(-radius, radius, 3)
            distance = np.linalg.norm(eye)
            outside = distance > radius
            fov = 2.2 * math.degrees(math.atan(radius / distance)) if outside else 170.0
            # Eight near lights and eight far lights, inside the sphere if the camera is inside.
            reach = np.repeat((2.0, 10.0 ** rng.uniform(1, 6)) if outside else (0.3, 0.95), 8)
            places = normalize(rng.normal(size=(16, 3))) * radius * reach[:, None]
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
    """Highlights with exponents 0 to 1e6: values down to 1e-8 for single vectors, and pictures."""
    u = UNIT[32]
    for h in (0.0, 32.0, 1e6) if short else (0.0, 0.1, 1.0, 10.0, 32.0, 100.0, 1e3, 1e4, 1e5, 1e6):
        for model in ("phong", "blinn"):
            at = f"{model}, h = {h:g}"
            N, L, V = _near_highlight(model, h, 4000)
            value = glsl_call.call(
                "mirrorLobe" if model == "phong" else "halfwayLobe", N, L, V, h, device=renderer.device
            )
            n, l, v = (normalize(vectors.astype(float)) for vectors in (N, L, V))
            a, b = (2.0 * _dot(n, l)[:, None] * n - l, v) if model == "phong" else (n, l + v)
            tangent = np.linalg.norm(np.cross(a, b), axis=1) / _dot(a, b)
            exact = np.exp(-0.5 * h * np.log1p(tangent**2))
            error = np.abs(value / exact - 1.0)
            # The bound of cosine_lobe.glsl.
            bound = (8.0 + 8.0 * h * tangent * (1.0 + tangent) + 4.0 * np.abs(np.log(exact))) * u
            yield Finding("exponent", at, 32, "relative error, share of its bound", float((error / bound).max()), 1)
            yield Finding("exponent", at, 32, "relative error", float(error.max()), float(bound.max()))
            scene = _highlight_on_a_ball(model, h)
            truth = ray_tracer.trace(scene, (64, 64)).radiance
            for bits in renderer.device.limits.precisions:
                image = renderer.render(scene, (64, 64), Settings(precision=bits))
                off = float(np.abs(image.radiance - truth).max())
                # The error of the functions, and the effect of an error of 16 u in all vectors where a lobe is
                # steepest.
                most = (32.0 + 16.0 * math.exp(-0.5) * math.sqrt(h)) * u
                yield Finding("exponent", at, bits, "error in a picture, of the highlight's peak", off, most)


def _near_highlight(model: str, h: float, count: int) -> list[NDArray[np.float32]]:
    """Return random N, L, V, (count, 3) each, with a highlight of 10^-U(0, 8), or as near to it as a lobe allows."""
    rng = np.random.default_rng(11)
    cosine = np.maximum(10.0 ** (-rng.uniform(0, 8, (count, 1)) / max(h, 1e-9)), 0.02)

    def turned(v: Array) -> Array:
        return cosine * v + np.sqrt(1.0 - cosine**2) * normalize(np.cross(v, rng.normal(size=v.shape)))

    N = normalize(rng.normal(size=(count, 3)))
    if model == "phong":
        L = normalize(N + 0.8 * normalize(rng.normal(size=(count, 3))))
        V = turned(2.0 * _dot(N, L)[:, None] * N - L)
    else:
        H = turned(N)
        L = normalize(H + 0.5 * normalize(rng.normal(size=(count, 3))))
        V = 2.0 * _dot(H, L)[:, None] * H - L
    return [vector.astype(np.float32) for vector in (N, L, V)]


def _highlight_on_a_ball(model: str, h: float) -> Scene:
    """Return a scene with nothing but a highlight, in a picture about twice as wide as the highlight."""
    material = Material(model, ka=0, kd=0, ks=1, h=h)
    P, N, eye = np.array((0.0, 0.0, 1.0)), np.array((0.0, 0.0, 1.0)), np.array((0.3, 0.4, 5.0))
    V = normalize(eye - P)
    light = P + 6.0 * (2.0 * float(N @ V) * N - V)
    # Keep away from the outline, where a lobe with h < 1 is too steep for any bound.
    fov = min(12.0, math.degrees(8.0 / math.sqrt(max(h, 1e-9))) / 5.0)
    camera = Camera(tuple(eye.tolist()), tuple(P.tolist()), vertical_fov=fov)
    return Scene([Sphere((0, 0, 0), 1, material)], [PointLight(tuple(light.tolist()))], camera, background=(0, 0, 0))


def shadow_end(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """An occluder 1e-6 in front of and behind a light that is one or ten units from a wall."""
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
            # All shadows may be in doubt: with 32 bits, 1e-6 is 8 units in the last place of 1, and 1 unit of 10.
            for finding in measure_scene(renderer, "shadow end", at, scene, (64, 48), dark=math.inf):
                if finding.measure.endswith("shadows"):
                    yield finding
                elif finding.measure.startswith("wrong in fact") and (distance == 1.0 or finding.bits == 64):
                    yield dataclasses.replace(finding, bound=0)
                elif finding.measure.startswith("wrong in fact"):
                    yield finding


def light_on_a_surface(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """A light exactly on a sphere, a plane, or the ground. It shines to both sides, and no surface shades itself."""
    objects = [Sphere((0, 1, 0), 1, _RED), Sphere((-2, 0.7, 1), 0.7, _BLUE), Plane((0, 1, 0), 0, _GREY)]
    places = [(1.0, 1.0, 0.0), (0.6, 1.0, 0.8), (0.0, 1.0, -1.0), (-2.0, 1.4, 1.0), (0.0, 0.0, 3.0), (3.0, 0.0, 3.0)]
    for position in places[1::3] if short else places:
        for eye in ((1.0, 2.5, 6.0), (0.2, 1.1, 0.3)):
            scene = Scene(objects, [PointLight(position)], Camera(eye, (0.1, 0.8, 0.0), vertical_fov=60))
            at = f"light at {position}, from {eye}"
            yield from measure_scene(renderer, "light on a surface", at, scene, (64, 48))


def valid_scenes(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Lights and colours at the ends of their ranges. No output is NaN, and no radiance is infinite or negative."""
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
        for bits in renderer.device.limits.precisions:
            bad = 0
            for h, color, shadows in itertools.product(exponents, colors, ("off", "hard", "diluted", "soft")):
                c = (color, color, color)
                material = Material(ka=c, kd=c, ks=c, h=h, model=model)
                objects = [Sphere(ball.center, 1, material), Plane(floor.normal, -1, material)]
                lights = [PointLight(position, c)] * 3
                if shadows == "soft":  # attenuated lights; the last one may be a bulb, as large as the ball
                    lights = [PointLight(position, c, radius, "inverse_square") for radius in (0.0, 1e-6, 1.0)]
                scene = Scene(objects, lights, Camera(eye, (0, 0, 0), vertical_fov=70), c, c)
                image = renderer.render(scene, (32, 24), Settings(precision=bits, shadows=shadows))
                bad += count_invalid(image)
            at = f"{model}, light {where}"
            yield Finding("valid scenes", at, bits, "NaN, infinite or negative values", bad, 0, "colours 0 to 1e12")


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)
