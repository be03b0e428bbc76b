"""Small bright features: areas and light against closed forms and pictures, and the effect on error estimates."""

from __future__ import annotations

import math

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import bright_features as module
from raytracer.compiler.bright_features import bright_features
from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.features import Features
from raytracer.compiler.narrow_lobes import diffuse_reflectance
from raytracer.formats.estimate import UNSEEN
from raytracer.ground_truth.reflectance import reflected
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import CompileOptions
from raytracer.scene.settings import Settings

SIZE = 96, 72
CAMERA = rt.Camera((0.5, 1.0, 6.0), (0.0, 0.2, 0.0), vertical_fov=40.0)
FOCAL = SIZE[1] / 2.0 / math.tan(math.radians(20.0))
BLACK = (0.0, 0.0, 0.0)
LIGHT = rt.PointLight((4.0, 4.0, 5.0), (3.0, 2.0, 1.0))


def features_in(
    *objects: rt.Solid | rt.Instances, lights: tuple[rt.PointLight, ...] = (), camera: rt.Camera = CAMERA
) -> Features:
    scene = rt.Scene(objects, lights, camera, background=BLACK, ambient=BLACK)
    return bright_features(compile(scene, CompileOptions(shadows="soft")), SIZE)


def glow(radius: float, center: tuple[float, float, float], le: tuple[float, float, float]) -> rt.Sphere:
    return rt.Sphere(center, radius, rt.Material(kd=0.0, ks=0.0, ka=0.0, le=le))


def test_an_emitter_has_the_area_of_its_disc_in_the_pixel_that_shows_it() -> None:
    camera = rt.Camera((0.0, 0.0, 5.0), BLACK, vertical_fov=40.0)
    features = features_in(
        glow(0.01, (0.0, 0.0, 0.0), (5.0, 6.0, 7.0)),
        glow(0.01, (1.0, 1.0, 0.0), (1.0, 0.0, 0.0)),
        glow(0.01, (0.0, 9.0, 0.0), (1.0, 1.0, 1.0)),  # outside the picture
        glow(0.01, (0.0, 0.0, 9.0), (1.0, 1.0, 1.0)),  # behind the camera
        glow(0.5, (0.0, 0.0, -1.0), (1.0, 1.0, 1.0)),  # too large for a small feature
        camera=camera,
    )
    disc = math.pi * (0.01 * FOCAL / 5.0) ** 2
    # A sphere off the middle of the picture is projected to an ellipse, stretched by 1 / cosine.
    np.testing.assert_allclose(features.areas, [disc, disc * math.hypot(1.0, 0.2, 0.2)], rtol=1e-3)
    np.testing.assert_array_equal(features.radiance, [(5.0, 6.0, 7.0), (1.0, 0.0, 0.0)])
    np.testing.assert_allclose(features.x, [48.0, 48.0 + FOCAL / 5.0])
    np.testing.assert_allclose(features.y, [36.0, 36.0 - FOCAL / 5.0])


def test_the_radius_of_a_hot_spot_is_the_distance_of_its_light() -> None:
    camera = rt.Camera((0.0, 5.0, 0.0), BLACK, (0.0, 0.0, 1.0), vertical_fov=40.0)
    floor = rt.Plane((0.0, 1.0, 0.0), 0.0, rt.Material("lambert", rho=0.5))
    light = rt.PointLight((0.0, 0.01, 0.0), falloff="inverse_square")
    features = features_in(floor, lights=(light,), camera=camera)
    np.testing.assert_allclose(features.areas, [math.pi * (0.01 * FOCAL / 5.0) ** 2])
    np.testing.assert_allclose(features.radiance, [(0.5 / math.pi / 0.01**2,) * 3])
    assert not len(features_in(floor, lights=(LIGHT,), camera=camera).areas)


@pytest.mark.parametrize(
    "material",
    [
        rt.Material("phong", kd=0.6, ks=0.0),
        rt.Material("lambert", rho=0.6),
        rt.Material("strauss", color=0.6, smoothness=0.0),
    ],
    ids=lambda material: material.model,
)
def test_the_diffuse_part_of_a_matt_material_is_its_reflectance(material: rt.Material) -> None:
    up, slanted = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, 0.8]])
    # A Strauss material without smoothness still has a highlight of 0.2 %.
    np.testing.assert_allclose(diffuse_reflectance(material), reflected(material, up, slanted, up)[0] / 0.8, rtol=2e-3)


MATERIALS = (
    rt.Material("phong", kd=0.0, ka=0.0, h=1e4),
    rt.Material("blinn", kd=0.0, ka=0.0, h=1e4),
    rt.Material("phong_normalized", kd=0.0, h=1e5),
    rt.Material("blinn_normalized", kd=0.0, h=1e5),
    rt.Material("strauss", smoothness=1.0 - 1e-4, color=0.6, metalness=1.0),
    rt.Material("torrance_sparrow", m=0.01, constant="cook"),
    rt.Material("cook_torrance", m=0.01),
    rt.Material("ggx", alpha=0.01, fresnel="conductor"),
    rt.Material("ggx", alpha=0.01, fresnel="dielectric"),
    rt.Material("beckmann", alpha=0.01),
    rt.Material("split", alpha=0.01, metalness=1.0),
)


def radiance(renderer: Renderer, solid: rt.Solid, light: rt.PointLight, samples: int) -> np.ndarray:
    scene = rt.Scene((solid,), (light,), CAMERA, background=BLACK, ambient=BLACK)
    return renderer.render(
        scene, SIZE, Settings(samples=samples, shadows="soft"), geometry=False, estimates=False
    ).radiance.astype(float)


@pytest.mark.gl
@pytest.mark.parametrize("material", MATERIALS, ids=lambda material: f"{material.model}-{material.get('fresnel')}")
def test_a_glint_has_as_much_light_as_in_the_picture(renderer: Renderer, material: rt.Material) -> None:
    ball = rt.Sphere(BLACK, 1.0, material)
    for place, radius in (((4.0, 4.0, 5.0), 0.0), ((4.0, 4.0, 5.0), 0.5), ((-6.0, 1.0, -1.5), 0.0)):
        light = rt.PointLight(place, LIGHT.color, radius)
        features = features_in(ball, lights=(light,))
        picture = radiance(renderer, ball, light, 1024)
        assert len(features.areas) == 1 and features.areas[0] < 0.2
        row, column = int(features.y[0]), int(features.x[0])
        part = picture[row - 4 : row + 5, column - 4 : column + 5]
        ratio = features.areas[0] * features.radiance[0] / part.sum(axis=(0, 1))
        assert (ratio > 0.7).all() and (ratio < 1.4).all(), (light, ratio)


TURN = (1, 2, 3), 40
EMITTING: list[rt.Solid] = [
    rt.Box((-0.02, -0.01, -0.01), (0.02, 0.02, 0.01)),
    rt.Cylinder((0, -0.02, 0), (0, 0.02, 0), 0.015),
    rt.Ellipsoid(BLACK, (0.02, 0.01, 0.02)),
    rt.Torus(BLACK, (0, 1, 0), 0.015, 0.007),
    rt.Paraboloid((0, -0.02, 0), (0, 0.01, 0), 0.02),
]


@pytest.mark.gl
@pytest.mark.parametrize("solid", EMITTING, ids=lambda solid: type(solid).__name__)
def test_a_small_emitting_body_has_as_much_light_as_in_the_picture(renderer: Renderer, solid: rt.Solid) -> None:
    lamp = solid.paint(glow(1.0, BLACK, (5.0, 6.0, 7.0)).material).rotate(*TURN)
    features = features_in(lamp)
    ratio = features.areas[0] * features.radiance[0] / radiance(renderer, lamp, LIGHT, 1024).sum(axis=(0, 1))
    assert len(features.areas) == 1 and (ratio > 0.5).all() and (ratio < 2.0).all()


@pytest.mark.gl
def test_a_glint_counts_on_the_face_of_a_body_and_not_beyond_its_edges(renderer: Renderer) -> None:
    light = rt.PointLight((1.0, 1.0, 1.2))
    polished = rt.Material("beckmann", alpha=0.003)
    table = rt.Box((-3.0, -1.0, -1.0), (3.0, -0.2, 4.0), polished).rotate((0, 1, 0), 20)
    [x], [y], [area], _, [color] = features_in(table, lights=(light,))
    ratio = area * color / radiance(renderer, table, light, 1024).sum(axis=(0, 1))
    assert (ratio > 0.8).all() and (ratio < 1.25).all()
    column = rt.Cylinder((0.9, -1.0, 2.1), (0.9, -0.2, 2.1), 3.0, polished)
    np.testing.assert_allclose([features_in(column, lights=(light,))[i][0] for i in (0, 1, 2)], [x, y, area])
    for small in (table.translate((0, 0, -6)), rt.Cylinder((3, -1, 0), (3, -0.2, 0), 0.5, polished)):
        assert not len(features_in(small, lights=(light,)).areas)


def test_a_hot_spot_of_a_body_is_that_of_its_plane() -> None:
    camera = rt.Camera((0.0, 5.0, 0.0), BLACK, (0.0, 0.0, 1.0), vertical_fov=40.0)
    matt, light = rt.Material("lambert", rho=0.5), rt.PointLight((0.0, 0.01, 0.0), falloff="inverse_square")
    floor, table = rt.Plane((0.0, 1.0, 0.0), 0.0, matt), rt.Box((-1, -1, -1), (1, 0, 1), matt)
    for field in zip(
        features_in(floor, lights=(light,), camera=camera),
        features_in(table, lights=(light,), camera=camera),
        strict=True,
    ):
        np.testing.assert_allclose(*field)
    assert not len(features_in(table.translate((1.5, 0, 0)), lights=(light,), camera=camera).areas)


MIRROR = rt.Material("mirror", f0=0.9)


@pytest.mark.gl
@pytest.mark.parametrize(
    "mirror",
    [rt.Plane((0.2, 0.1, 1.0), -2.0, MIRROR), rt.Sphere((0.0, 0.0, -2.0), 1.5, MIRROR)],
    ids=["flat", "ball"],
)
def test_an_emitter_in_a_mirror_has_as_much_light_as_in_the_picture(renderer: Renderer, mirror: rt.Solid) -> None:
    emitter = glow(0.05, (2.5, 1.0, 6.5), (50.0, 40.0, 30.0))  # behind the camera
    features = features_in(mirror, emitter)
    scene = rt.Scene((mirror, emitter), (), CAMERA, background=BLACK, ambient=BLACK)
    picture = renderer.render(scene, SIZE, Settings(samples=4096), geometry=False, estimates=False).radiance
    row, column = np.unravel_index(int(picture[..., 0].argmax()), picture.shape[:2])
    assert len(features.areas) == 1
    assert abs(features.x[0] - 0.5 - column) < 1.0 and abs(features.y[0] - 0.5 - row) < 1.0
    ratio = features.areas[0] * features.radiance[0] / picture.sum(axis=(0, 1))
    assert (ratio > 0.8).all() and (ratio < 1.25).all()


def test_mirrors_that_face_each_other_show_an_emitter_once_per_bounce() -> None:
    emitter = glow(0.01, (0.1, 0.2, 0.0), (50.0, 50.0, 50.0))
    walls = rt.Plane((0.0, 0.0, 1.0), -2.0, MIRROR), rt.Plane((0.0, 0.0, -1.0), -8.0, MIRROR)
    scene = rt.Scene((*walls, emitter), (), CAMERA, background=BLACK, ambient=BLACK)
    for bounces, images in ((0, 1), (1, 2), (2, 3)):  # the wall behind the camera shows the images of the other wall
        features = bright_features(compile(scene, CompileOptions(bounces=bounces)), SIZE)
        assert len(features.areas) == images
        np.testing.assert_allclose(features.radiance[:, 0], [50.0 * 0.9**k for k in range(images)])


@pytest.mark.gl
def test_a_glint_on_a_floor_has_as_much_light_as_in_the_picture(renderer: Renderer) -> None:
    floor, light = rt.Plane((0.0, 1.0, 0.0), -0.2, rt.Material("beckmann", alpha=0.003)), rt.PointLight((1.0, 1.0, 1.2))
    features = features_in(floor, lights=(light,))
    ratio = features.areas[0] * features.radiance[0] / radiance(renderer, floor, light, 1024).sum(axis=(0, 1))
    assert len(features.areas) == 1 and (ratio > 0.8).all() and (ratio < 1.25).all()


@pytest.mark.gl
def test_the_glint_of_a_light_with_a_radius_spreads_over_the_pixels_of_its_image(renderer: Renderer) -> None:
    ball, light = rt.Sphere(BLACK, 1.0, MATERIALS[-2]), rt.PointLight((2.0, 2.0, 3.0), radius=1.5)
    features = features_in(ball, lights=(light,))
    luminance = radiance(renderer, ball, light, 4096)[..., 0]
    # The number of pixels of equal luminance x with the same sums: (sum x)^2 / sum x^2.
    assert features.pixels[0] == pytest.approx(luminance.sum() ** 2 / np.square(luminance).sum(), rel=0.5)
    assert features.pixels[0] > 5.0


def features_at_one_place(areas: list[float], radiance: list[float], pixels: float = 1.0) -> Features:
    count = len(areas)
    places = np.full(count, 0.5)
    spread = np.maximum(areas, pixels)
    return Features(places, places, np.array(areas), spread, np.repeat(np.array(radiance)[:, None], 3, axis=1))


def test_missed_light_is_the_squared_light_of_features_that_few_samples_hit() -> None:
    one = features_at_one_place([0.01], [50.0])
    assert one.missed_error(4) == pytest.approx(3 * 0.5**2)
    assert one.missed_error(200) == pytest.approx(3 * 0.5**2 / 2.0)
    assert one.missed_error(400) == 0.0
    samples = np.full((2, 2), 400, np.int32)
    assert one.missed_error(samples) == 0.0
    samples[0, 0] = 4
    assert one.missed_error(samples) == one.missed_error(4)
    # The square of the largest number of samples exceeds a 32-bit integer.
    assert features_at_one_place([1e-6], [50.0]).missed_error(np.full((2, 2), 65536, np.int32)) == pytest.approx(
        3 * 5e-5**2
    )
    assert features_at_one_place([0.01], [50.0], 5.0).missed_error(4) == pytest.approx(3 * 0.5**2 / 5.0)
    # Samples hit some of very many features, which then represent the others, unless one is brighter.
    assert features_at_one_place([0.01] * 400, [50.0] * 400).missed_error(4) == 0.0
    assert features_at_one_place([0.01] * 401, [50.0] * 400 + [5e4]).missed_error(4) == pytest.approx(
        3 * 500.0**2, rel=0.01
    )
    assert features_at_one_place([], []).missed_error(4) == 0.0


def test_blocks_with_features_include_all_neighbouring_pixels() -> None:
    features = features_at_one_place([0.01], [50.0])._replace(x=np.array([8.1]), y=np.array([5.0]))
    # The feature and its neighbours have columns 7 and 8, and rows 4 and 5 of 10, counted from the top.
    assert np.argwhere(features.find_missed_blocks(100, 1e-3, (12, 10), (4, 4))).tolist() == [[1, 1], [1, 2]]
    assert not features.find_missed_blocks(400, 1e-3, (12, 10), (4, 4)).any()
    assert not features.find_missed_blocks(100, 1.0, (12, 10), (4, 4)).any()


def test_scenes_without_narrow_highlights_emitters_or_near_lights_are_not_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searches: list[object] = []
    monkeypatch.setattr(module, "eyes", lambda *_: searches.append(None))
    places = np.random.default_rng(1).uniform(-9.0, 9.0, (20000, 3))
    balls = rt.Instances(rt.Sphere(BLACK, 0.1), places)
    assert not len(features_in(balls, rt.Plane((0.0, 1.0, 0.0), 0.0), lights=(LIGHT,) * 20).areas)
    assert not searches


def test_very_many_pairs_of_emitters_and_mirrors_are_thinned_out() -> None:
    places = np.random.default_rng(1).uniform(-1.0, 1.0, (2000, 3))
    emitters, balls = (
        rt.Instances(glow(1e-4, BLACK, (1.0, 1.0, 1.0)), places),
        rt.Instances(rt.Sphere(BLACK, 0.01, MIRROR), places),
    )
    assert 1e4 < len(features_in(emitters, balls).areas) < 3e5


def _small_balls() -> list[tuple[float, float, float]]:
    rng = np.random.default_rng(7)
    return [(float(x), float(y), 0.0) for x, y in rng.uniform((-2.0, -1.2), (2.0, 1.8), (30, 2))]


# Thirty emitters of 0.003 pixels each, and thirty spheres with glints of 0.001 pixels each.
EMITTERS = [glow(0.0019, place, (100.0, 100.0, 100.0)) for place in _small_balls()]
BALLS = [rt.Sphere(place, 0.1, rt.Material("beckmann", alpha=0.01)) for place in _small_balls()]


@pytest.mark.gl
@pytest.mark.parametrize("objects", [EMITTERS, BALLS], ids=["emitters", "glints"])
def test_an_error_estimate_is_uncertain_until_samples_hit_the_features(
    renderer: Renderer, objects: list[rt.Solid]
) -> None:
    backdrop = rt.Sphere((0.0, 0.0, -5.0), 3.0, rt.Material("lambert"))
    scene = rt.Scene((*objects, backdrop), (LIGHT,), CAMERA, background=BLACK, ambient=BLACK)
    few_samples = renderer.render(scene, SIZE, Settings(samples=4, max_error=1e-2), geometry=False)
    assert few_samples.radiance.max() < 1.0 and few_samples.estimate
    assert (
        few_samples.estimate.uncertain
        and few_samples.estimate.reached is False
        and few_samples.estimate.unknown == UNSEEN
    )
    assert few_samples.estimate.rmse
    estimate = renderer.render(scene, SIZE, Settings(samples=4096), geometry=False).estimate
    assert estimate and not estimate.uncertain and estimate.rmse
    requested = renderer.render(
        scene, SIZE, Settings(samples=4096, max_error=2.0 * estimate.rmse), geometry=False
    ).estimate
    assert requested and requested.reached and requested.samples > 100
