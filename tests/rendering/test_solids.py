"""Pictures of all kinds of solids, of random trees under random maps, against the float64 ground truth."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

import raytracer as rt
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from tests.solids import EXAMPLES

pytestmark = pytest.mark.gl

SIZE = (64, 40)
EVALUATORS: tuple[Literal["walk", "cells", "roth"], ...] = "walk", "cells", "roth"
MATERIALS = [rt.Material(kd=kd) for kd in ((0.8, 0.2, 0.2), (0.2, 0.7, 0.3), (0.2, 0.3, 0.8), 0.6)]
# The largest share of wrong pixels: a 32-bit ray may be on the other side of an outline or of a shadow's
# edge. Edges take a tenth of these small pictures, and float32 moves them by 1e-4 of a pixel.
MOST_WRONG = 1e-3
KINDS = [*EXAMPLES]


def random_map(rng: np.random.Generator) -> np.ndarray:
    """Return a map with a condition number of up to 100, whose image of the unit ball has the size 1."""
    u, _, v = np.linalg.svd(rng.normal(size=(3, 3)))
    stretch = np.exp(rng.uniform(-np.log(100), 0, 3)) if rng.random() < 0.3 else rng.uniform(0.4, 1, 3)
    linear = u @ np.diag(np.maximum(stretch / stretch.max(), 0.01)) @ v
    return np.column_stack([linear, rng.uniform(-1.2, 1.2, 3)])


def primitive(kind: str, material: rt.Material) -> rt.Solid:
    """Return a primitive of about the size 1 around the origin."""
    return EXAMPLES[kind].with_material(material)


def random_scene(seed: int, most: int) -> rt.Scene:
    """Return a scene of a ground and a few trees over 1 to `most` moved primitives."""
    rng = np.random.default_rng((11, seed))
    leaves = [
        primitive(KINDS[rng.integers(len(KINDS))], MATERIALS[rng.integers(4)]).transform(random_map(rng))
        for _ in range(rng.integers(1, most + 1))
    ]
    objects: list[rt.Solid] = [rt.Plane((0, 1, 0), -2, MATERIALS[3])]
    while leaves:
        solid = leaves.pop()
        while leaves and rng.random() < 0.6:
            other = leaves.pop()
            solid = (solid | other, solid - other, solid & other, solid - ~other)[rng.integers(4)]
        objects.append(solid)
    eye = rng.normal(size=3)
    eye *= rng.uniform(3, 6) / np.linalg.norm(eye)
    x, y, z = eye.tolist()
    return rt.Scene(
        objects,
        [rt.PointLight((4, 7, 4)), rt.PointLight((-5, 3, 2), (0.4, 0.4, 0.4))],
        rt.Camera((x, abs(y + 2.0), z), (0, 0, 0)),
    )


@pytest.mark.parametrize("most", [6, 12])
def test_pictures_of_random_solids_are_those_of_the_ground_truth(renderer: Renderer, most: int) -> None:
    wrong = 0
    for seed in range(15):
        scene = random_scene(100 * most + seed, most)
        image = renderer.render(scene, SIZE, rt.Settings(samples=1))
        truth = ray_tracer.trace(scene, SIZE, rt.Settings(samples=1))
        wrong += np.count_nonzero(np.abs(image.radiance - truth.radiance).max(axis=-1) > 2e-3)
    assert wrong <= MOST_WRONG * 15 * SIZE[0] * SIZE[1]


def test_all_evaluators_give_the_same_bits(renderer: Renderer) -> None:
    for seed in range(4):
        scene = random_scene(seed, 5)
        # More than 12 primitives, so that the evaluator cells uses candidate lists.
        many = scene.replace(
            objects=[
                *scene.objects,
                *(
                    primitive("box", MATERIALS[k % 4])
                    .scale(0.2)
                    .rotate((1, 2, 3), 20 * k)
                    .translate((k / 3 - 2, 1.2, 0))
                    for k in range(13)
                ),
            ]
        )
        for one, evaluators in ((scene, EVALUATORS), (many, EVALUATORS[:2])):
            pictures = [renderer.render(one, SIZE, rt.Settings(samples=1, evaluator=e)).radiance for e in evaluators]
            assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:])


def test_64_bits_agree_with_the_ground_truth(renderer: Renderer) -> None:
    for seed in range(4):
        scene = random_scene(seed, 5)
        image = renderer.render(scene, SIZE, rt.Settings(samples=1, precision=64))
        truth = ray_tracer.trace(scene, SIZE, rt.Settings(samples=1))
        assert np.count_nonzero(np.abs(image.radiance - truth.radiance).max(axis=-1) > 1e-4) <= 1


@pytest.mark.parametrize("kind", KINDS)
def test_a_solid_less_itself_is_empty(renderer: Renderer, kind: str) -> None:
    solid = primitive(kind, MATERIALS[0]).rotate((1, 2, 3), 40).scale((1, 2, 0.5)).translate((0.3, 0.1, 0))
    again = primitive(kind, MATERIALS[1]).rotate((1, 2, 3), 40).scale((1, 2, 0.5)).translate((0.3, 0.1, 0))
    scene = rt.Scene([solid - again], [rt.PointLight((4, 7, 4))], rt.Camera((1, 1, 5), (0, 0, 0)))
    image = renderer.render(scene, (160, 90), rt.Settings(samples=1))
    assert image.material is not None and (image.material == -1).all()


def test_a_box_less_its_half_spaces_is_empty(renderer: Renderer) -> None:
    box = rt.Box((-1, -0.5, -0.7), (1, 0.5, 0.7), MATERIALS[0])
    sides = [
        *(rt.Plane((sign, 0, 0), 1) for sign in (1, -1)),
        *(rt.Plane((0, sign, 0), 0.5) for sign in (1, -1)),
        *(rt.Plane((0, 0, sign), 0.7) for sign in (1, -1)),
    ]
    planes = sides[0] & sides[1] & sides[2] & sides[3] & sides[4] & sides[5]
    for solid in (box - planes, box.rotate((1, 2, 3), 40) - planes.rotate((1, 2, 3), 40)):
        scene = rt.Scene([solid], [rt.PointLight((4, 7, 4))], rt.Camera((1, 1, 5), (0, 0, 0)))
        image = renderer.render(scene, (160, 90), rt.Settings(samples=1))
        assert image.material is not None and (image.material == -1).all()
