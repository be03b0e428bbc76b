"""Rows of the ledger on solids of all kinds but spheres and half-spaces: random trees, extremes, self-shadow."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import (
    MATTE,
    PixelErrors,
    compare_pictures,
    measure_pixel_errors,
    measure_scene,
    normalize,
)
from raytracer.analysis.numerics.scene_transforms import enlarge_scene, move_scene
from raytracer.analysis.numerics.solids import count_different_pixels
from raytracer.analysis.numerics.specimens import KINDS, lit_scene, random_map, random_solids_scene, specimen
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.compiler.limits import MAX_ROTH_LOOPS
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.core.validation import Vec3
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.options import Evaluator
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.box import Box
from raytracer.scene.solids.cone import Cone
from raytracer.scene.solids.cylinder import Cylinder
from raytracer.scene.solids.paraboloid import Paraboloid
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere
from raytracer.scene.solids.torus import Torus

SIZE = (64, 40)
_RED, _BLUE, _GREEN, _GREY = MATTE
# Spheres and boxes that candidate lists need: the evaluator `cells` lists the primitives of larger scenes.
_LISTED = 13


def random_solids(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """300 random scenes: 1 to 12 solids of all kinds under maps with condition numbers up to 100, in random trees, over
    a ground.

    All evaluators and precisions, and `cells` with candidate lists besides. All pictures of a precision have equal
    bits.
    """
    row = "random solids"
    worst: dict[tuple[str, int], list[PixelErrors]] = {}
    different = dict.fromkeys(renderer.device.limits.precisions, 0)
    for seed in range(8 if short else 300):
        for extra in (0, _LISTED) if seed % 4 == 0 else (0,):
            scene = random_solids_scene(seed, extra=extra)
            exact = ray_tracer.trace(scene, SIZE)
            for bits in renderer.device.limits.precisions:
                if short and bits == 64 and seed % 4:
                    continue
                pixel_doubt = find_pixel_doubt(scene, SIZE, bits)
                first = None
                for evaluator in _evaluators(scene, extra, short and seed % 4 != 1):
                    image = renderer.render(scene, SIZE, Settings(precision=bits, evaluator=evaluator))
                    first = first or image
                    different[bits] += count_different_pixels(image, first)
                    name = f"{evaluator} with lists" if extra and evaluator == "cells" and bits == 32 else evaluator
                    worst.setdefault((name, bits), []).append(compare_pictures(image, exact, pixel_doubt))
    for (at, bits), all_errors in worst.items():
        count = len(all_errors)
        for measure, values, bound in (
            ("wrong pixels", sum(e.wrong for e in all_errors), 0),
            ("wrong shadows", sum(e.lit for e in all_errors), 0),
            ("wrong in fact, doubtful or not", sum(e.wrong_or_doubtful for e in all_errors), math.inf),
            ("NaN, infinite or negative values", sum(e.bad for e in all_errors), 0),
            ("largest share of doubtful pixels", max(e.doubtful for e in all_errors), 0.01),
            ("mean share of doubtful pixels", sum(e.doubtful for e in all_errors) / count, 0.001),
            ("largest share of doubtful shadows", max(e.unlit for e in all_errors), 0.05),
            ("depth error, share of its bound", max(e.depth_share for e in all_errors), 1),
            ("normal error, share of its bound", max(e.normal_share for e in all_errors), 1),
            ("radiance error, share of its bound", max(e.radiance_share for e in all_errors), 1),
        ):
            yield Finding(row, at, bits, measure, values, bound, f"{count} pictures" if measure[0] == "w" else "")
    for bits, count in different.items():
        yield Finding(row, "all evaluators", bits, "pixels with other bits than the first", count, 0)


def _evaluators(scene: Scene, extra: int, without_roth: bool) -> tuple[Evaluator, ...]:
    if extra or without_roth or roth_loops(scene) > MAX_ROTH_LOOPS:
        return "cells", "walk"
    return "cells", "walk", "roth"


def _turned(kind: str) -> Solid:
    return specimen(kind).rotate((1, 2, 3), 40)


def _still(kind: str) -> Scene:
    """Return a scene with a solid, a ball that shades it, and a ground that both shade."""
    return lit_scene(_turned(kind), Sphere((0.9, 0.9, 0.9), 0.4, _BLUE), Plane((0, 1, 0), -1.2, _GREY), eye=(0.4, 2, 4))


def solids_scale(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids of all kinds with a ball and a ground, 1e-6 to 1e6 times their size."""
    for kind in KINDS:
        for power in (-6, 6) if short else range(-6, 7, 2):
            scene = enlarge_scene(_still(kind), 10.0**power)
            yield from measure_scene(renderer, "scale of solids", f"{kind}, 1e{power}", scene, SIZE)


def solids_distance(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids of all kinds seen from 10 to 1e7 times their size away, and with the camera up to 1e6 sizes from the
    origin."""
    row = "distance of solids"
    for kind in KINDS:
        for power in (3,) if short else range(1, 8):
            distance = 10.0**power
            x, y, z = (distance * np.array((0.36, 0.48, 0.8))).tolist()
            fov = 2.0 * math.degrees(math.atan(1.3 / distance))
            scene = lit_scene(_turned(kind), eye=(x, y, z), look_at=(0.1, -0.05, 0.02), fov=fov)
            # Pixels whose chord is shorter than the errors of both its ends are doubtful: near edges of faces, a share
            # in proportion to the errors.
            share = 64.0 * 2.0**-24 * distance
            doubt, dark = (0.01 + share, 0.05 + share) if share < 0.1 else (math.inf, math.inf)
            at = f"{kind}, from 1e{power}"
            yield from measure_scene(renderer, row, at, scene, SIZE, doubt=doubt, dark=dark)
        for power in (6,) if short else (2, 4, 6):
            away = 10.0**power
            scene = move_scene(_still(kind), (0.61 * away, 0.37 * away, -0.7 * away))
            yield from measure_scene(renderer, row, f"{kind}, moved by 1e{power}", scene, SIZE)


# Places on the specimens, and names of them.
_PLACES: dict[str, dict[str, Vec3]] = {
    "box": {"inside": (0.125, 0.25, 0), "a face": (0.75, 0.125, 0.25), "an edge": (0.75, 0.5, 0.125)},
    "cylinder": {
        "inside": (0.125, 0.25, 0),
        "a cap": (0.125, 0.75, 0.25),
        "a wall": (0.5, 0.125, 0),
        "an edge": (0.5, 0.75, 0),
    },
    "cone": {"inside": (0.125, 0.25, 0), "a cap": (0.125, 1, 0), "a wall": (0.5, 0, 0), "an edge": (0.75, -1, 0)},
    "ellipsoid": {"inside": (0.125, 0.25, 0), "a wall": (0, 0.5, 0)},
    "torus": {
        "inside": (0.875, 0.125, 0),
        "the hole": (0, 0.125, 0.125),
        "the outer equator": (1, 0, 0),
        "the inner equator": (0.5, 0, 0),
        "the top": (0.75, 0.25, 0),
    },
    "polyhedron": {
        "inside": (0.125, 0.25, 0),
        "a face": (0.25, 0.25, 0.5),
        "an edge": (0.5, 0.5, 0),
        "a corner": (1, 0, 0),
    },
    "paraboloid": {
        "inside": (0.125, -0.25, 0),
        "a cap": (0.125, -0.75, 0),
        "a wall": (0.375, 0.375, 0),
        "an edge": (0.75, -0.75, 0),
        "the vertex": (0, 0.75, 0),
    },
}


def camera_at_solids(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The camera inside solids of all kinds, and exactly on their faces, edges and corners.

    It does not see a surface at its own place.
    """
    for kind, places in _PLACES.items():
        for where, eye in places.items():
            for name, look_at in (("in", (-0.02, -0.3, 0.06)), ("out", (3.0, 2.0, 1.5)), ("along", (1.0, 2.5, -0.25))):
                if short and name != "in":
                    continue
                scene = lit_scene(
                    specimen(kind),
                    Sphere((3, 2, 1), 0.75, _BLUE),
                    Plane((0, 1, 0), -1.25, _GREY),
                    eye=eye,
                    look_at=look_at,
                    fov=90.0,
                )
                at = f"{kind}, {where}, looks {name}"
                # Where rays leave a torus along its tangent plane, a quartic's two roots are near each other.
                doubt = 0.03 if kind == "torus" else 0.01
                yield from measure_scene(renderer, "camera at solids", at, scene, SIZE, doubt=doubt)


def solids_tangents(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Views along generators of cylinders and cones, along the faces of a box, and in tangent planes of a torus.

    The middle row or column of these pictures is exactly tangent.
    """
    slant = np.array((-0.25, 1.0, 0.0))  # of the generator of the cone through (0.75, -1, 0)
    generator = (np.array((0.5, 0.0, 0.0)) + 4.0 * slant).tolist()
    views: dict[str, tuple[str, Vec3, Vec3]] = {
        "along a generator of a cylinder": ("cylinder", (0.5, 5, 0), (0.5, -0.75, 0)),
        "along a generator of a cone": ("cone", tuple(generator), (0.75, -1, 0)),
        "at a cylinder from the side": ("cylinder", (0.5, 0.25, 5), (0.5, 0.25, 0)),
        "in the top plane of a torus": ("torus", (0, 0.25, 5), (0, 0.25, 0)),
        "in the middle plane of a torus, at its hole": ("torus", (0.5, 0, 5), (0.5, 0, 0)),
        "along the axis of a torus, at its hole": ("torus", (0.5, 5, 0), (0.5, 0, 0)),
        "across a torus, along its outer equator": ("torus", (1, 0, 5), (1, 0, 0)),
        "along a face of a box": ("box", (0.25, 0.5, 5), (0.25, 0.5, 0)),
        "along an edge of a box": ("box", (0.75, 0.5, 5), (0.75, 0.5, 0)),
        "at an ellipsoid's outline": ("ellipsoid", (0, 0.5, 5), (0, 0.5, 0)),
        "at the vertex of a paraboloid": ("paraboloid", (0, 0.75, 5), (0, 0.75, 0)),
        "along an edge of a polyhedron": ("polyhedron", (4, -3, 0), (0, 1, 0)),
    }
    for name, (kind, eye, look_at) in views.items():
        for fov in (2.0,) if short else (0.01, 2.0, 40.0):
            solid = specimen(kind)
            camera = Camera(eye, look_at, (0, 0, 1) if abs(eye[1]) > 2.5 else (0, 1, 0), fov)
            scene = Scene([solid, Plane((0.25, 1, 0.5), -2, _GREY)], [PointLight((4, 7, 4))], camera)
            # A row and a column of pixels see a tangent, and float32 resolves an outline to about 1e-6 radians.
            doubt, tangent = 2e-6 / math.radians(fov), 1 / 49 + 1 / 33
            at = f"{name}, {fov:g} degrees"
            yield from measure_scene(renderer, "tangents of solids", at, scene, (49, 33), doubt=doubt, tangent=tangent)


def _coincident() -> dict[str, tuple[Solid, Solid | None]]:
    """Return solids with coincident faces, each with an equal simpler solid; None: the solid is empty."""
    pairs: dict[str, tuple[Solid, Solid | None]] = {}
    for kind in KINDS:
        a, b = specimen(kind, _RED), specimen(kind, _BLUE)
        ball = Sphere((0.5, 0.25, 0.5), 0.75, _GREEN)
        pairs[f"{kind}: A - A"] = a - b, None
        pairs[f"{kind}: A | A"] = a | b, a
        pairs[f"{kind}: A & A"] = a & b, a
        pairs[f"{kind}: A & ~A"] = a & ~b, None
        pairs[f"{kind}: (A - B) | (A & B)"] = (a - ball) | (a & ball), a
        pairs[f"{kind}: A in B | A"] = ball | a | ball, ball | a
    low, high = Box((-0.75, -0.5, -0.5), (0.75, 0, 0.5), _RED), Box((-0.75, 0, -0.5), (0.75, 0.5, 0.5), _RED)
    whole = Box((-0.75, -0.5, -0.5), (0.75, 0.5, 0.5), _RED)
    pairs["two boxes that share a face"] = low | high, whole
    pairs["a box less its upper half"] = whole - high, low
    sides: Solid = Plane((1, 0, 0), 0.75, _RED)
    for normal, offset in (
        ((-1, 0, 0), 0.75),
        ((0, 1, 0), 0.5),
        ((0, -1, 0), 0.5),
        ((0, 0, 1), 0.5),
        ((0, 0, -1), 0.5),
    ):
        sides = sides & Plane(normal, offset, _RED)
    pairs["a box less its half-spaces"] = whole - sides, None
    pairs["half-spaces less their box"] = sides - whole, None
    pole, lower, upper = (Cylinder((0, y, 0), (0, z, 0), 0.5, _RED) for y, z in ((-1, 1), (-1, 0.25), (0.25, 1)))
    pairs["two cylinders on each other"] = lower | upper, pole
    pairs["a cylinder less its upper part"] = pole - upper, lower
    pairs["a cylinder cut by a box"] = pole & Box((-1, -1, -1), (1, 0.25, 1), _RED), lower
    core = Cylinder((0, -1, 0), (0, 1, 0), 0.25, _RED)
    pairs["a pipe and its core"] = (pole - core) | core, pole
    cone, point = Cone((0, -1, 0), (0, 1, 0), 1, 0, _RED), Cone((0, 0, 0), (0, 1, 0), 0.5, 0, _RED)
    stump = Cone((0, -1, 0), (0, 0, 0), 1, 0.5, _RED)
    pairs["a cone less its point"] = cone - point, stump
    pairs["a cone on its stump"] = stump | point, cone
    pairs["a cone cut by a half-space"] = cone & Plane((0, 1, 0), 0, _RED), stump
    tower = Cylinder((0, -1, 0), (0, 0, 0), 0.5, _RED)
    pairs["a cone on a cylinder, taken off"] = (tower | point) - point, tower
    dome, tip = (Paraboloid((0, y, 0), (0, 0.75, 0), r, _RED) for y, r in ((-0.75, 0.75), (0.375, 0.375)))
    pairs["a paraboloid less its tip"] = dome - tip, dome & Plane((0, 1, 0), 0.375, _RED)
    ring = Torus((0, 0, 0), (0, 1, 0), 0.75, 0.25, _RED)
    pairs["a torus in halves"] = (ring & Plane((0, 1, 0), 0, _RED)) | (ring - Plane((0, 1, 0), 0, _RED)), ring
    return pairs


def coincident_solids(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids with common caps, walls and faces, and equal simpler solids, under equal maps. All pixels agree bit for
    bit.

    The rotated pair and the pair under a shear are compared, too.
    """
    shear = ((1.0, 0.3, 0.0, 0.2), (0.1, 0.9, 0.4, 0.0), (0.0, -0.2, 1.1, -0.1))
    moves = {"": lambda s: s, ", rotated": lambda s: s.rotate((1, 2, 3), 40), ", sheared": lambda s: s.transform(shear)}
    for i, (name, (solid, simple)) in enumerate(_coincident().items()):
        for j, (moved, move) in enumerate(moves.items()):
            if short and (i + j) % 3:
                continue
            for k, evaluator in enumerate(("cells", "walk", "roth")):
                if short and (i // 3 + k) % 6:
                    continue
                bits_of = (32,) if short else renderer.device.limits.precisions
                for bits in bits_of:
                    settings = Settings(evaluator=evaluator, precision=bits)
                    image = renderer.render(lit_scene(move(solid)), SIZE, settings)
                    expected = renderer.render(lit_scene(move(simple)), SIZE, settings) if simple is not None else None
                    yield Finding(
                        "coincident solids",
                        f"{name}{moved}, {evaluator}",
                        bits,
                        "wrong pixels",
                        count_different_pixels(image, expected),
                        0,
                    )


def slivers(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids of all kinds under stretches of 1e4 and under nearly singular maps, down to a shortest axis of 1e-9."""
    stretches = {
        "a plate of 1e-4": (1.0, 1e-4, 1.0),
        "a needle of 1e-4": (1e-4, 1.0, 1e-4),
        "axes of 1, 1e-3, 1e-6": (1.0, 1e-3, 1e-6),
        "axes of 1, 1, 1e-9": (1.0, 1.0, 1e-9),
    }
    for kind in KINDS:
        for name, factors in list(stretches.items())[:: 3 if short else 1]:
            solid = specimen(kind).rotate((1, 1, 1), 50).scale(factors).rotate((1, 2, 3), 40)
            scene = lit_scene(solid, Plane((0, 1, 0), -1.5, _GREY), eye=(0.5, 2.0, 4.0))
            # 32 bits do not resolve chords shorter than some 1e-6.
            rough = math.inf if min(factors) < 1e-4 else 0.05
            at = f"{kind}, {name}"
            yield from measure_scene(renderer, "slivers", at, scene, SIZE, doubt=max(rough, 0.01), dark=rough)


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
