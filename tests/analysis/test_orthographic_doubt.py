"""Rounding error bounds of orthographic pictures: no pixel is wrong outside the doubtful ones, near and far away."""

import numpy as np
import pytest

import raytracer as rt
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.pictures import assert_agrees_with_truth

pytestmark = pytest.mark.gl

RED, BLUE, GREEN, GREY = scenes.COLORS


@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("distance", [3.0, 1e6])
def test_random_solids_agree_with_the_ground_truth_at_any_distance(
    renderer: Renderer, distance: float, precision: int
) -> None:
    rng = np.random.default_rng(8)
    for _ in range(2):
        turn = tuple(rng.normal(size=3).tolist())
        box = rt.Box((-1, -0.5, -0.7), (1, 0.5, 0.7), GREEN).rotate(turn, 50)
        bite = rt.Sphere(tuple(rng.uniform(-1, 1, 3).tolist()), 0.7, BLUE)
        pipe = rt.Cylinder((0, -1, 0), (0, 1, 0), 0.3, RED).rotate(turn, 110).translate((1, 0.5, 0))
        cone = rt.Cone((0, 0, 0), (0, 1, 0), 0.5, 0.1, RED).translate(tuple(rng.uniform(-1, 1, 3).tolist()))
        view = np.abs(rng.normal(size=3)) + 0.3
        eye = tuple((distance * view / np.linalg.norm(view)).tolist())
        camera = rt.Camera(eye, (0, 0, 0), projection="orthographic", height=3.0)
        objects = [box - bite, pipe, cone - bite, rt.Plane((0, 1, 0), -1.2, GREY)]
        scene = rt.Scene(objects, [rt.PointLight((4, 7, 4))], camera)
        settings = Settings(shadows="hard", precision=precision)  # pyright: ignore[reportArgumentType]
        assert_agrees_with_truth(renderer, scene, (64, 40), settings)
