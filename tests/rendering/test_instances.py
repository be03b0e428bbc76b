"""Pictures of rotated instances, against the float64 ground truth of solids that are moved one by one."""

from __future__ import annotations

import numpy as np
import pytest

import raytracer as rt
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer

pytestmark = pytest.mark.gl

SIZE = (64, 40)
MATERIALS = [rt.Material(kd=kd) for kd in ((0.8, 0.2, 0.2), (0.2, 0.7, 0.3), (0.2, 0.3, 0.8), 0.6)]


def random_dice(rng: np.random.Generator, count: int) -> tuple[rt.Instances, list[rt.Solid]]:
    """Return rotated copies of a die, as instances and as single solids made by hand."""
    die: rt.Solid = rt.Box((-1, -1, -1), (1, 1, 1), MATERIALS[0]) & rt.Sphere((0, 0, 0), 1.45, MATERIALS[1])
    for center in ((0, 0, 1.1), (0.5, 1.1, 0.5), (-0.5, 1.1, -0.5)):
        die = die - rt.Sphere(center, 0.3, MATERIALS[2])
    places, scales = rng.uniform((-4, -2, -3), (4, 3, 2), (count, 3)), rng.uniform(0.2, 0.6, count)
    axes, degrees = rng.normal(size=(count, 3)), rng.uniform(0, 360, count)
    half = np.radians(degrees) / 2
    unit = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    turns = np.column_stack([np.cos(half), np.sin(half)[:, None] * unit]) * rng.uniform(0.1, 9, (count, 1))
    by_hand = [
        die.scale(scale).rotate(axis, angle).translate(place)
        for scale, axis, angle, place in zip(scales, axes, degrees, places, strict=True)
    ]
    return rt.Instances(die, places, scales, turns), by_hand


def test_rotated_instances_are_those_of_the_ground_truth_made_by_hand(renderer: Renderer) -> None:
    dice, by_hand = random_dice(np.random.default_rng(21), 50)
    ground = rt.Plane((0, 1, 0), -2.5, MATERIALS[3])
    scene = rt.Scene([dice, ground], [rt.PointLight((4, 7, 4))], rt.Camera((0.5, 2, 8), (0, 0.3, 0)))
    image = renderer.render(scene, SIZE, rt.Settings(samples=1))
    truth = ray_tracer.trace(scene.replace(objects=[*by_hand, ground]), SIZE, rt.Settings(samples=1))
    # Pixels at edges of shadows: float32 may be on the other side.
    assert np.count_nonzero(np.abs(image.radiance - truth.radiance).max(axis=-1) > 2e-3) <= 2
    assert truth.material is not None and len(np.unique(truth.material)) == 5


def test_evaluators_give_the_same_bits_for_rotated_instances(renderer: Renderer) -> None:
    dice, _ = random_dice(np.random.default_rng(22), 6)
    scene = rt.Scene([dice], [rt.PointLight((4, 7, 4))], rt.Camera((0.5, 2, 8), (0, 0.3, 0)))
    cells, walk = (
        renderer.render(scene, SIZE, rt.Settings(samples=1, evaluator=e)).radiance for e in ("cells", "walk")
    )
    assert np.array_equal(cells, walk) and cells.any()
