"""Light on solids under maps that change angles: normals, brushed materials, shadows, mirrors and lights as spheres."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import raytracer as rt
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests.solids import EXAMPLES

pytestmark = pytest.mark.gl

SIZE = (96, 32)
SHEAR = np.array([(1, 0.5, 0, 0.2), (0, 1.2, 0.3, -0.1), (-0.2, 0, 0.8, 0)])
MIRROR = np.array([(-0.7, 0.2, 0, 0), (0.1, 1.3, 0, 0.1), (0.3, 0, 0.9, -0.2)])
PHONG = rt.Material(kd=(0.7, 0.3, 0.2))
BRUSHED = rt.Material("lafortune", lobes=[rt.Lobe(-0.9, 0.8, 12, cy=-0.3, scale=0.6)], tangent=(1, 0.2, 0.3))
SILVER = rt.Material("mirror", f0=(0.9, 0.8, 0.7))
LIGHTS = rt.PointLight((4, 7, 4)), rt.PointLight((-5, 3, 2), (0.4, 0.4, 0.4))
# Behind the row, so that its shadows fall to the front.
BULB = rt.PointLight((1, 5, -5), (30, 30, 30), radius=0.7, falloff="inverse_square")


def row_of_solids(*materials: rt.Material, lights: tuple[rt.PointLight, ...] = LIGHTS) -> rt.Scene:
    """Return a scene of all kinds in a row on a ground, each of which is sheared or mirrored."""
    looks = zip(EXAMPLES.values(), itertools.cycle((SHEAR, MIRROR)), itertools.cycle(materials), strict=False)
    solids = [
        shape.paint(material).transform(matrix).translate((2.2 * k - 7.7, 0, 0))
        for k, (shape, matrix, material) in enumerate(looks)
    ]
    ground = rt.Plane((0, 1, 0), -1.4, rt.Material(kd=0.5))
    return rt.Scene([*solids, ground], lights, rt.Camera((0.5, 4, 14), (0, -0.2, 0), vertical_fov=24))


@pytest.mark.parametrize("kind", ["ellipsoid", "cylinder"])
def test_normals_of_a_sheared_or_mirrored_solid_are_the_gradients_of_its_equation(
    renderer: Renderer, kind: str
) -> None:
    for matrix in (SHEAR, MIRROR):
        eye = np.array((1.5, 2.0, 5.0))
        solid = {
            "ellipsoid": rt.Ellipsoid((0, 0, 0), (1, 0.6, 0.8)),
            "cylinder": rt.Cylinder((0, -9, 0), (0, 9, 0), 0.7),
        }
        scene = rt.Scene([solid[kind].transform(matrix)], LIGHTS, rt.Camera((1.5, 2, 5), (0, 0, 0), vertical_fov=20))
        image = renderer.render(scene, (48, 32), Settings(samples=1))
        assert image.normal is not None and image.depth is not None
        hit = np.isfinite(image.depth)
        P = eye + image.depth[hit][:, None] * ray_tracer.camera_rays(scene.camera, (48, 32))[hit]
        inverse = np.linalg.inv(matrix[:, :3])
        squares = {"ellipsoid": (1.0, 1 / 0.36, 1 / 0.64), "cylinder": (1.0, 0.0, 1.0)}[kind]
        gradient = (P - matrix[:, 3]) @ inverse.T * squares @ inverse
        expected = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
        # Next to an outline, the error of the place turns the normal by more.
        off = np.linalg.norm(image.normal[hit] - expected, axis=1)
        assert hit.sum() > 200 and np.median(off) < 1e-6 and off.max() < 1e-4


@pytest.mark.parametrize(
    ("materials", "shadows", "bounces"),
    [((PHONG, BRUSHED), "hard", 0), ((BRUSHED, PHONG), "diluted", 0), ((SILVER, PHONG, BRUSHED), "hard", 2)],
    ids=["brushed", "diluted shadows", "mirrors"],
)
def test_light_on_solids_of_all_kinds_is_that_of_the_ground_truth(
    renderer: Renderer, materials: tuple[rt.Material, ...], shadows: str, bounces: int
) -> None:
    scene = row_of_solids(*materials)
    settings = Settings(samples=1, shadows=shadows, bounces=bounces)  # pyright: ignore[reportArgumentType]
    image, truth = renderer.render(scene, SIZE, settings), ray_tracer.trace(scene, SIZE, settings)
    # Of the other rays, some are on the other side of an outline.
    wrong = np.abs(image.radiance - truth.radiance).max(axis=-1) > 1e-3
    assert np.mean(wrong) <= 1e-3 * (1 + bounces)
    assert image.normal is not None and truth.normal is not None and image.material is not None
    kinds = np.unique(image.material[image.material >= 0])
    assert len(kinds) == len(materials) + 1, "the solids are in the picture"


def test_soft_shadows_of_solids_from_a_bulb_are_those_of_the_ground_truth(renderer: Renderer) -> None:
    scene = row_of_solids(PHONG, BRUSHED, lights=(BULB,))
    image = renderer.render(scene, SIZE, Settings(samples=256, shadows="soft"))
    truth = ray_tracer.trace(scene, SIZE, Settings(samples=2, shadows="soft"), rays=12)
    hard = ray_tracer.trace(scene, SIZE, Settings(samples=2))
    difference = image.radiance - truth.radiance
    penumbra = np.abs(hard.radiance - truth.radiance).max(axis=-1) > 0.01
    # The noise of two samples of the ground truth, 0.005. Hard shadows differ by 0.02 there.
    assert penumbra.mean() > 0.05 and np.median(np.abs(difference[penumbra])) < 8e-3
    assert abs(difference[penumbra].mean()) < 1.5e-3 and abs(difference.mean()) < 3e-4


def test_light_that_grazes_a_face_is_never_negative_with_64_bits(renderer: Renderer) -> None:
    # The light is on a corner: it lies in the planes of three faces, up to rounding, and one of them knows it.
    scene = rt.Scene([rt.Box((-1, -1, -1), (1, 1, 1))], [rt.PointLight((1, 1, 1))], rt.Camera((3, 3, 5), (0, 0, 0)))
    scene = scene.replace(ambient=(0, 0, 0))
    image = renderer.render(scene, (64, 40), Settings(samples=1, precision=64, shadows="off"))
    assert (image.radiance >= 0.0).all()
