"""Random scenes of solids of all kinds, measured with all evaluators and precisions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import MATTE, PixelErrors, compare_pictures
from raytracer.analysis.numerics.solids import count_different_pixels
from raytracer.analysis.numerics.specimens import KINDS, random_map, specimen
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.compiler.limits import MAX_ROTH_LOOPS
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.options import Evaluator, Precision
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid

SIZE = (64, 40)
_ROW = "random solids"
# The largest condition number of the map of a random solid.
_CONDITION = 100.0
# Boxes that a scene needs for candidate lists: the evaluator `cells` lists the primitives of larger scenes.
_LISTED = 13
# The scenes of the ledger, in full and in the short form.
_FULL, _SHORT = 40, 12


def random_solids_scene(seed: int, *, extra: int = 0) -> Scene:
    """Return a ground and random trees over 1 to 12 moved solids of all kinds, and `extra` small boxes."""
    rng = np.random.default_rng((11, seed))
    kinds = (*KINDS, "sphere")
    leaves = [
        specimen(kinds[rng.integers(len(kinds))], MATTE[rng.integers(4)]).transform(random_map(rng, _CONDITION))
        for _ in range(rng.integers(1, 13))
    ]
    objects: list[Solid] = [Plane((0, 1, 0), -2, MATTE[3])]
    while leaves:
        solid = leaves.pop()
        while leaves and rng.random() < 0.6:
            other = leaves.pop()
            solid = (solid | other, solid - other, solid & other, solid - ~other)[rng.integers(4)]
        if rng.random() < 0.3:
            half_space = Plane((0, 1, 0), 0.25, MATTE[rng.integers(4)]).transform(random_map(rng, _CONDITION))
            solid = solid - half_space if rng.random() < 0.5 else solid & half_space
        objects.append(solid)
    for k in range(extra):
        turned = specimen("box", MATTE[k % 4]).scale(0.2).rotate((1, 2, 3), 20.0 * k)
        objects.append(turned.translate((k / 3 - 2, 1.2, 0)))
    eye = rng.normal(size=3)
    x, y, z = (eye * rng.uniform(3.0, 6.0) / np.linalg.norm(eye)).tolist()
    return Scene(objects, [PointLight((4, 7, 4))], Camera((x, abs(y + 2.0), z), (0, 0, 0)))


def random_solids(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Random scenes: 1 to 12 solids of all kinds under maps with condition numbers up to 100, in random trees that
    half-spaces cut, over a ground.

    All evaluators and precisions, and `cells` with candidate lists besides. All pictures of a precision have equal
    bits. `python -m benchmarks.oracle` measures 300 scenes.
    """
    yield from measure_random_solids(renderer, range(_SHORT if short else _FULL), short=short)


def measure_random_solids(
    renderer: Renderer, seeds: Iterable[int], *, short: bool = False, progress: Callable[[int], None] | None = None
) -> list[Finding]:
    """Measure the scenes of some seeds, with all evaluators and precisions.

    Args:
        renderer: the renderer
        seeds: the seeds
        short: whether most scenes have a single picture, by turns with each evaluator. Default: False.
        progress: called with the number of scenes after each of them
    """
    precisions = renderer.device.limits.precisions
    pictures: dict[tuple[str, Precision], list[tuple[int, PixelErrors]]] = {}
    different: dict[Precision, list[int]] = {bits: [] for bits in precisions}
    for count, seed in enumerate(seeds):
        for extra in (0, _LISTED) if seed % 6 == 0 else (0,):
            scene = random_solids_scene(seed, extra=extra)
            exact = ray_tracer.trace(scene, SIZE)
            for bits, evaluators in _runs(precisions, scene, seed, extra, short).items():
                pixel_doubt = find_pixel_doubt(scene, SIZE, bits)
                first = None
                for evaluator in evaluators:
                    image = renderer.render(scene, SIZE, Settings(precision=bits, evaluator=evaluator))
                    if first is None:
                        first = image
                    elif count_different_pixels(image, first):
                        different[bits].append(seed)
                    name = f"{evaluator} with lists" if extra and evaluator == "cells" and bits == 32 else evaluator
                    errors = compare_pictures(image, exact, pixel_doubt)
                    pictures.setdefault((name, bits), []).append((seed, errors))
        if progress:
            progress(count + 1)
    findings = [finding for (at, bits), some in pictures.items() for finding in _summary(at, bits, some)]
    for bits, bad in different.items():
        measure = "pictures with other bits than the first evaluator's"
        findings.append(Finding(_ROW, "all evaluators", bits, measure, len(bad), 0, _seeds(bad)))
    return findings


def _runs(
    precisions: Iterable[Precision], scene: Scene, seed: int, extra: int, short: bool
) -> dict[Precision, tuple[Evaluator, ...]]:
    """Return the evaluators of a scene for each precision."""
    evaluators: tuple[Evaluator, ...] = "cells", "walk", "roth"
    if extra or roth_loops(scene) > MAX_ROTH_LOOPS:
        evaluators = evaluators[:2]
    if not short:
        return dict.fromkeys(precisions, evaluators)
    if seed % 6 == 0:
        return {32: evaluators}
    return {64 if seed % 4 == 1 and 64 in precisions else 32: (evaluators[seed // 2 % len(evaluators)],)}


def _summary(at: str, bits: Precision, pictures: list[tuple[int, PixelErrors]]) -> Iterator[Finding]:
    errors = [each for _, each in pictures]
    wrong = _seeds([seed for seed, each in pictures if each.wrong or each.lit])
    for measure, values, bound, note in (
        ("wrong pixels", sum(e.wrong for e in errors), 0, wrong or f"{len(pictures)} pictures"),
        ("wrong shadows", sum(e.lit for e in errors), 0, ""),
        ("wrong in fact, doubtful or not", sum(e.wrong_or_doubtful for e in errors), math.inf, ""),
        ("NaN, infinite or negative values", sum(e.bad for e in errors), 0, ""),
        ("largest share of doubtful pixels", max(e.doubtful for e in errors), 0.01, ""),
        ("mean share of doubtful pixels", sum(e.doubtful for e in errors) / len(errors), 0.001, ""),
        ("largest share of doubtful shadows", max(e.unlit for e in errors), 0.05, ""),
        ("depth error, share of its bound", max(e.depth_share for e in errors), 1, ""),
        ("normal error, share of its bound", max(e.normal_share for e in errors), 1, ""),
        ("radiance error, share of its bound", max(e.radiance_share for e in errors), 1, ""),
    ):
        yield Finding(_ROW, at, bits, measure, values, bound, note)


def _seeds(bad: list[int]) -> str:
    return f"seeds {', '.join(map(str, sorted(set(bad))))}" if bad else ""
