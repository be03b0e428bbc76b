"""The float64 ray tracer, compared with closed forms."""

import math

import numpy as np
import pytest

import raytracer as rt
from raytracer.formats.srgb import encode_srgb8
from raytracer.ground_truth import ray_tracer
from raytracer.scene.options import Shadows
from raytracer.scene.sequences import SEQUENCES, sample_points
from tests import scenes

LIGHT = rt.PointLight((0, 3, 4), (1, 0.5, 0.25))
CAMERA = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=40)


def centre(scene: rt.Scene, settings: rt.Settings | None = None) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the radiance, the depth and the normal of the ray through the centre."""
    image = ray_tracer.trace(scene, (1, 1), settings)
    assert image.depth is not None and image.normal is not None
    return image.radiance[0, 0], float(image.depth[0, 0]), image.normal[0, 0]


def test_phong_and_blinn_are_correct_at_the_middle_of_a_sphere() -> None:
    material = rt.Material(ka=(0.1, 0.2, 0.3), kd=(0.5, 0.6, 0.7), ks=(0.9, 0.8, 0.4), h=8)
    radiance, depth, normal = centre(rt.Scene([rt.Sphere((0, 0, 0), 1, material)], [LIGHT], CAMERA))
    assert depth == 4 and tuple(normal) == (0, 0, 1)
    # P = (0, 0, 1), L = (0, 3, 3) / (3 sqrt 2): N.L = R.V = cos 45, N.H = cos 22.5
    cos45, cos22 = math.sqrt(0.5), math.cos(math.radians(22.5))
    phong = [
        a + i * (d * cos45 + s * cos45**8)
        for a, d, s, i in zip(material.ka, material.kd, material.ks, LIGHT.color, strict=True)
    ]
    np.testing.assert_allclose(radiance, phong, rtol=1e-14)
    blinn = [
        a + i * (d * cos45 + s * cos22**32)
        for a, d, s, i in zip(material.ka, material.kd, material.ks, LIGHT.color, strict=True)
    ]
    settings = rt.Settings(shading="blinn")
    radiance, _, _ = centre(rt.Scene([rt.Sphere((0, 0, 0), 1, material)], [LIGHT], CAMERA), settings)
    np.testing.assert_allclose(radiance, blinn, rtol=1e-13)


def test_an_occluded_light_is_dark_or_diluted_by_the_ratio_of_distances() -> None:
    material = rt.Material(ka=(0, 0, 0), kd=(1, 1, 1), ks=(0, 0, 0))
    wall = rt.Plane((0, 0, 1), 0, material)
    # A ball of radius 1 halfway from (0, 0, 0) to the light at (0, 6, 8): the ray hits it at a distance of 4 of 10.
    scene = rt.Scene([wall, rt.Sphere((0, 3, 4), 1)], [rt.PointLight((0, 6, 8))], CAMERA)
    cases: list[tuple[Shadows, float]] = [("off", 1.0), ("hard", 0.0), ("diluted", 0.4)]
    for shadows, S in cases:
        radiance, _, _ = centre(scene, rt.Settings(shadows=shadows))
        np.testing.assert_allclose(radiance, S * 0.8, rtol=1e-14)


def test_a_bowl_shows_the_material_and_the_normal_of_its_cut_face() -> None:
    bowl = rt.Sphere((0, 0, 0), 1, scenes.COLORS[0]) - rt.Sphere((0, 0, 1), 1, scenes.COLORS[1])
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=1)
    image = ray_tracer.trace(rt.Scene([bowl], [], camera), (1, 1))
    assert image.depth is not None and image.material is not None and image.normal is not None
    assert image.depth[0, 0] == pytest.approx(5) and image.material[0, 0] == 1
    np.testing.assert_allclose(image.normal[0, 0], (0, 0, 1), atol=1e-14)


def test_the_first_operand_owns_coincident_faces() -> None:
    a, b = rt.Sphere((0, 0, 0), 1, scenes.COLORS[0]), rt.Sphere((0, 0, 0), 1, scenes.COLORS[1])
    for solid, material in ((a | b, 0), (b | a, 0), (a & b, 0), (~(~a | ~b), 0)):
        image = ray_tracer.trace(scenes.lit_scene(solid), (1, 1))
        assert image.material is not None and image.material[0, 0] == material
    empty = ray_tracer.trace(scenes.lit_scene(a - b), (9, 9))
    assert empty.material is not None and (empty.material == -1).all()


@pytest.mark.parametrize(("n", "o"), [((1, 1, 1), 1), ((1, 2, 7), 5), ((-3, 1, 2), -2)])
def test_half_spaces_coincide_for_normals_of_any_length(n: tuple[int, int, int], o: int) -> None:
    one, three = rt.Plane(n, o), rt.Plane((3 * n[0], 3 * n[1], 3 * n[2]), 3 * o)
    other_side = rt.Plane((-7 * n[0], -7 * n[1], -7 * n[2]), -7 * o)
    for nothing in (one - three, one & other_side, three & ~one):
        assert (ray_tracer.trace(scenes.lit_scene(nothing), (33, 33)).material == -1).all()


def test_camera_rays_have_the_directions_of_the_formula() -> None:
    rays = ray_tracer.camera_rays(rt.Camera((0, 0, 0), (0, 0, -1), vertical_fov=90), (4, 2))
    np.testing.assert_allclose(rays[0, 0] / -rays[0, 0, 2], (-1.5, 0.5, -1), rtol=1e-14)
    np.testing.assert_allclose(rays[1, 3] / -rays[1, 3, 2], (1.5, -0.5, -1), rtol=1e-14)


def test_the_first_sample_is_the_centre_and_later_samples_spread_evenly() -> None:
    for sequence in list(SEQUENCES)[:2]:
        np.testing.assert_array_equal(sample_points(0, (3, 2), sequence), (0.5, 0.5))
    points = np.array([sample_points(k, (1, 1), samples=256)[0, 0] for k in range(256)])
    assert points.min() >= 0 and points.max() < 1
    # Each of 8 x 8 cells holds 4 of 256 points on average. Random points would leave some cells empty.
    counts, _, _ = np.histogram2d(*points.T, bins=8, range=[(0, 1), (0, 1)])
    assert counts.min() >= 2 and counts.max() <= 6


def test_srgb_follows_the_curve_of_the_standard() -> None:
    linear = np.array([[[-1, -0.0, 0.0031308], [0.2158605, 0.5, 1.0], [2.0, 1e30, 0.0021]]], np.float32)
    np.testing.assert_array_equal(encode_srgb8(linear), [[[0, 0, 10], [128, 188, 255], [255, 255, 7]]])
