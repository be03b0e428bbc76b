"""Rows of the ledger on solids: shells, coincident faces, deep trees, cameras inside solids."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import MATTE, measure_scene
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.compiler.limits import MAX_ROTH_LOOPS
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.formats.image import Image
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.options import Evaluator
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere

SIZE = (64, 48)
_RED, _BLUE, _GREEN, _GREY = MATTE
_LIGHT = PointLight((4, 7, 4))
EVALUATORS: tuple[Evaluator, ...] = ("cells", "walk", "roth")


def _evaluators(short: bool) -> tuple[Evaluator, ...]:
    """Return the evaluators of a row. The short form skips walk, which `cells` uses for all but plane-only cells."""
    return ("cells", "roth") if short else EVALUATORS


def _scene(*objects: Solid, eye: tuple[float, float, float] = (0.4, 0.7, 5.0)) -> Scene:
    return Scene(objects, [_LIGHT], Camera(eye, (0, 0, 0), vertical_fov=50))


def shells(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Concentric spheres of radii 1 and 1 + 2^-k. From a distance of 5 the outer sphere is visible. The view from
    inside
    their difference, a hollow shell, is dark, because no light enters it."""
    for k in (8, 16, 20, 23) if short else range(1, 24):
        outer, inner = Sphere((0, 0, 0), 1.0 + 2.0**-k, _RED), Sphere((0, 0, 0), 1.0, _BLUE)
        at = f"2^-{k}"
        # From 2^-18 on, the shell is thinner than the errors of both roots, 8 u each at a depth of 4.
        doubt, dark = 0.01 if k <= 17 else math.inf, 0.05 if k <= 15 else math.inf
        seen = _scene(inner, outer)
        yield from measure_scene(renderer, "shells", f"from outside, {at}", seen, SIZE, doubt=doubt, dark=dark)
        inside = Scene([outer - inner], [_LIGHT], Camera((0.2, 0.1, 0.3), (-0.3, -0.1, -1), vertical_fov=100))
        for bits in renderer.device.limits.precisions:
            image = renderer.render(inside, SIZE, Settings(precision=bits))
            resolved = find_pixel_doubt(inside, SIZE, bits)
            lit, doubtful = (image.radiance > 0.0).any(axis=2), resolved.unlit | resolved.doubtful
            place = f"from inside, {at}"
            most = 0.05 if k <= 15 or bits == 64 else math.inf
            yield Finding("shells", place, bits, "lit pixels", int(np.sum(lit & ~doubtful)), 0)
            yield Finding("shells", place, bits, "lit pixels in fact, doubtful or not", int(np.sum(lit)), math.inf)
            yield Finding("shells", place, bits, "doubtful pixels and shadows", float(doubtful.mean()), most)


def _coincident_solids() -> dict[str, tuple[Solid, Solid | None]]:
    """Return solids with coincident parts, each with an equal simpler solid; None: the solid is empty."""
    a, a2 = Sphere((0, 0, 0), 1, _RED), Sphere((0, 0, 0), 1, _BLUE)
    b = Sphere((0.5, 0.25, 0.5), 1, _GREEN)
    left, left2 = Plane((1, 2, 3), 0, _GREY), Plane((2, 4, 6), 0, _BLUE)  # through the centre of a
    right = Plane((-3, -6, -9), 0, _GREEN)
    low, middle, high = Plane((0, 1, 0), -1, _RED), Plane((0, 1, 0), 0, _RED), Plane((0, 1, 0), 0.5, _RED)
    above = Plane((0, -1, 0), 0, _RED)  # y >= 0
    return {
        "A - A": (a - a2, None),
        "A | A": (a | a2, a),
        "A & A": (a & a2, a),
        "A & ~A": (a & ~a2, None),
        "A - ~A": (a - ~a2, a),
        "A | ~A": (a | ~a2, None),
        "~~A": (~~a, a),
        "~(~A | ~A)": (~(~a | ~a2), a),
        "(A - B) | (A & B)": ((a - b) | (a & b), a),
        "(A | B) - B | (B & A)": (((a | b) - b) | (b & a), a),
        "H - H": (left - left2, None),
        "H | H": (left | left2, left),
        "H & H'": (left & right, None),
        "H | H'": (left | right, None),
        "H - H'": (left - right, left),
        "A cut through its centre and joined": ((a & left) | (a & right), a),
        "A cut through its centre twice": ((a & left) & left2, a & left),
        "two slabs that touch": ((middle - low) | (above & high), high - low),
        "a slab and its top taken off": ((high - low) - above, middle - low),
        "A in B | A": (b | a | b, b | a),
    }


def coincident_faces(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids whose parts have common faces, compared with equal simpler solids. All pixels agree bit for bit."""
    row = "coincident faces"
    ties = _coincident_solids()
    for evaluator, bits in itertools.product(EVALUATORS, renderer.device.limits.precisions):
        if short and bits != 32:
            continue
        settings = Settings(evaluator=evaluator, precision=bits)
        for name, (solid, simple) in list(ties.items())[:: 4 if short and evaluator == "roth" else 1]:
            image = renderer.render(_scene(solid), SIZE, settings)
            wrong = count_different_pixels(
                image, renderer.render(_scene(simple), SIZE, settings) if simple is not None else None
            )
            yield Finding(row, f"{name}, {evaluator}", bits, "wrong pixels", wrong, 0)
        twins = _scene(Sphere((0, 0, 0), 1, _RED), Sphere((0, 0, 0), 1, _BLUE))
        alone = renderer.render(_scene(Sphere((0, 0, 0), 1, _RED)), SIZE, settings)
        wrong = count_different_pixels(renderer.render(twins, SIZE, settings), alone)
        yield Finding(row, f"two objects A, {evaluator}", bits, "wrong pixels", wrong, 0)
    # If only single rays hit both surfaces, pictures are compared with float64.
    touching = {
        "spheres that touch": Sphere((-1, 0, 0), 1, _RED) | Sphere((1, 0, 0), 1, _BLUE),
        "a sphere on a half-space": Sphere((0, 1, 0), 1, _RED) | Plane((0, 1, 0), 0, _GREY),
        "a sphere tangent from inside, off": Sphere((0, 0, 0), 1, _RED) - Sphere((0.5, 0, 0), 0.5, _BLUE),
        "a sphere tangent from inside, on": Sphere((0.5, 0, 0), 0.5, _BLUE) | Sphere((0, 0, 0), 1, _RED),
        "a sphere cut by a half-space through its centre": Sphere((0, 0, 0), 1, _RED) & Plane((1, 0, 2), 0, _GREY),
    }
    # A half-space cuts one sphere, and its complement another sphere beside it: shadow rays start on both faces.
    half, other_half = Plane((0.1, 0.7, 0.3), 0.1, _GREY), Plane((-0.1, -0.7, -0.3), -0.1, _GREEN)
    cut = [Sphere((0, 0, 0), 1, _RED) & half, Sphere((0.1, 0, 0), 0.9, _BLUE) - other_half]
    for evaluator in _evaluators(short):
        scene = _scene(*cut, eye=(0.4, 3.0, 3.0))
        yield from measure_scene(
            renderer, row, f"cut by both sides of a half-space, {evaluator}", scene, (65, 49), evaluator
        )
    if short:
        return
    for (name, solid), evaluator in itertools.product(touching.items(), EVALUATORS):
        for x in (0.0, 0.4):  # from the front, where the middle ray hits both surfaces, and from the side
            scene = _scene(solid, eye=(x, 0.7 * x + 0.5 * ("half-space" in name), 5.0))
            yield from measure_scene(renderer, row, f"{name}, {evaluator}, from x = {x:g}", scene, (65, 49), evaluator)


def count_different_pixels(image: Image, expected: Image | None) -> int:
    """Count the pixels in which any output differs from the expected picture. None: an empty picture is expected."""
    assert image.material is not None and image.depth is not None and image.normal is not None
    if expected is None:
        return int(np.sum(image.material >= 0))
    assert expected.material is not None and expected.depth is not None and expected.normal is not None
    # Both scenes list the visible material first.
    same = (image.material == expected.material) & (image.depth == expected.depth)
    same &= (image.normal == expected.normal).all(axis=2) & (image.radiance == expected.radiance).all(axis=2)
    return int(np.sum(~same))


def deep_trees(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Chains and balanced trees of up to 64 spheres, with every other operand complemented."""
    rng = np.random.default_rng(3)
    for count in (16,) if short else (4, 16, 32, 64):
        for shape in ("chain", "balanced"):
            solids: list[Solid] = [
                Sphere(tuple(rng.uniform(-1.2, 1.2, 3)), rng.uniform(0.3, 0.9), MATTE[i % 4]) for i in range(count)
            ]
            i = 0
            while len(solids) > 1:
                a, b = solids.pop(0), solids.pop(0)
                i += 1
                # a | b and a - b, both written with complements, none of which may be lost.
                joined = ~(~a & ~b) if i % 2 else ~(~a | b)
                if shape == "chain":
                    solids.insert(0, joined)
                else:
                    solids.append(joined)
            scene = _scene(solids[0])
            for evaluator in _evaluators(short):
                if evaluator != "roth" or roth_loops(scene) <= MAX_ROTH_LOOPS:
                    at = f"{shape} of {count}, {evaluator}"
                    yield from measure_scene(renderer, "deep trees", at, scene, SIZE, evaluator)


def camera_inside(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The camera inside each combination of three overlapping spheres and a half-space."""
    a, b, c = (Sphere(p, 1.0, m) for p, m in zip([(0.5, 0, 0), (-0.4, 0.3, 0), (0, -0.4, 0.3)], MATTE, strict=False))
    h = Plane((0.2, 1.0, 0.4), 0.05, _GREY)
    trees = {
        "(A | B | C) - H": (a | b | c) - h,
        "A & B & C & H": a & b & c & h,
        "(A - B) | (C & H)": (a - b) | (c & h),
        "~((A | ~B) & ~(C - H))": ~((a | ~b) & ~(c - h)),
    }
    rng = np.random.default_rng(5)
    places: dict[tuple[bool, ...], tuple[float, float, float]] = {}
    while len(places) < 16:
        x, y, z = rng.uniform(-1.6, 1.6, 3).tolist()
        subset = (*(s.power((x, y, z)) < 0.0 for s in (a, b, c)), 0.2 * x + y + 0.4 * z < 0.05)
        places.setdefault(subset, (x, y, z))
    names = list(trees)
    for name in names[2:3] if short else names:
        for subset, eye in sorted(places.items()):
            inside = "".join(letter for letter, is_in in zip("ABCH", subset, strict=True) if is_in) or "none"
            scene = Scene([trees[name]], [_LIGHT], Camera(eye, (0.03, -0.08, 0.11), vertical_fov=110))
            for evaluator in ("cells",) if short else EVALUATORS:
                at = f"{name} from {inside}, {evaluator}"
                yield from measure_scene(renderer, "camera inside", at, scene, (48, 36), evaluator)
