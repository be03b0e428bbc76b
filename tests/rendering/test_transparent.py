"""Transparent pictures: their coverage, by closed forms and in float64, and what remains as in opaque pictures."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.glsl.shaders import program_sources
from raytracer.ground_truth.converged import trace_converged
from raytracer.rendering.renderer import Renderer
from tests.compiled import compiled
from tests.shader_text import code

SIZE = (64, 40)
BACKGROUND = (0.5, 0.25, 0.75)


def crowd() -> rt.Scene:
    """Many objects, so that programs read lists and draw objects of common shapes one by one, above a half-space."""
    rng = np.random.default_rng(4)
    balls = [rt.Sphere(tuple(place), 0.2) for place in rng.uniform((-3, 0, -3), (3, 3, 3), (60, 3))]
    camera = rt.Camera((0, 2.5, 8), (0, 1, 0))
    floor = rt.Plane((0, 1, 0), -0.5)
    return rt.Scene([*balls, floor], [rt.PointLight((4, 7, 4))], camera, background=BACKGROUND)


def ball_and_floor() -> rt.Scene:
    """A ball with a dent above a half-space, in whose pictures cells of all kinds are."""
    ball = rt.Sphere((0, 1, 0), 1) - rt.Sphere((0, 1.5, 1), 0.7)
    light = rt.PointLight((4, 7, 4), radius=0.5)
    camera = rt.Camera((0, 1.1, 6), (0, 1, 0))
    return rt.Scene([ball, rt.Plane((0, 1, 0), 0)], [light], camera, background=BACKGROUND)


@pytest.fixture(scope="module")
def truth() -> rt.Image:
    return trace_converged(ball_and_floor(), SIZE, samples=1024, transparent=True, cache=False, workers=1)


def renderings(renderer: Renderer, scene: rt.Scene, **settings: Any) -> tuple[rt.Image, rt.Image]:
    """Return the opaque and the transparent picture."""
    opaque, transparent = (
        renderer.render(scene, SIZE, rt.Settings(**settings), transparent=transparent) for transparent in (False, True)
    )
    return opaque, transparent


SETTINGS: dict[str, dict[str, Any]] = {
    "one sample": {},
    "several at once and a rest": {"samples": 18},
    "more than one sum": {"samples": 260},
    "diluted shadows": {"samples": 4, "shadows": "diluted"},
    "soft shadows": {"samples": 4, "shadows": "soft"},
    "walk": {"samples": 4, "evaluator": "walk"},
    "roth": {"samples": 4, "evaluator": "roth"},
    "64 bits": {"samples": 4, "precision": 64},
    **{name: {"samples": 4, "sequence": name} for name in ("r2", "random", "grid", "rotated", "corners")},
}


@pytest.mark.gl
@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_over_the_background_a_transparent_picture_is_the_opaque_one(
    renderer: Renderer, settings: dict[str, Any]
) -> None:
    opaque, transparent = renderings(renderer, ball_and_floor(), **settings)
    assert opaque.alpha is None and transparent.alpha is not None
    assert 0 < np.count_nonzero(transparent.alpha == 0) < transparent.alpha.size // 2  # empty cells, too
    over = transparent.radiance + (1 - transparent.alpha[..., None]) * np.float32(BACKGROUND)
    np.testing.assert_allclose(over, opaque.radiance, rtol=3e-6, atol=1e-6)


@pytest.mark.gl
@pytest.mark.parametrize("tile", [2048, 16])
def test_pictures_of_lists_and_of_many_tiles_are_transparent_in_the_same_way(renderer: Renderer, tile: int) -> None:
    settings = rt.Settings(samples=8)
    opaque = renderer.render(crowd(), SIZE, settings)
    transparent = renderer.render(crowd(), SIZE, settings, transparent=True, tile=tile)
    assert transparent.alpha is not None
    over = transparent.radiance + (1 - transparent.alpha[..., None]) * np.float32(BACKGROUND)
    np.testing.assert_allclose(over, opaque.radiance, rtol=3e-6, atol=1e-6)


@pytest.mark.gl
@pytest.mark.parametrize("settings", [{"adaptive": 0.01, "samples": 300}, {"max_error": 0.01}, {"time": 0.2}])
def test_the_alpha_of_each_pixel_counts_its_own_samples(
    renderer: Renderer, truth: rt.Image, settings: dict[str, Any]
) -> None:
    image = renderer.render(ball_and_floor(), SIZE, rt.Settings(**settings), transparent=True)
    assert image.alpha is not None and image.samples is not None
    hits = image.alpha.astype(float) * image.samples
    np.testing.assert_allclose(hits, np.rint(hits), atol=1e-4)
    edges = (image.alpha > 0) & (image.alpha < 1)
    assert edges.any() and (image.radiance[image.alpha == 0] == 0).all()
    assert image.estimate and image.estimate.rmse and truth.alpha is not None
    assert np.sqrt(np.mean((image.alpha - truth.alpha) ** 2)) < 0.02
    assert truth.estimate and truth.estimate.rmse
    off = np.sqrt(np.mean((image.radiance - truth.radiance) ** 2))
    assert off == pytest.approx(np.hypot(image.estimate.rmse, truth.estimate.rmse), rel=0.5)


@pytest.mark.gl
def test_the_alpha_of_an_edge_is_the_covered_share_of_its_pixels(renderer: Renderer) -> None:
    # The edge of a box at x = 0.3 pixels to the right of the left side of column 5, seen from the front.
    width, height = 16, 8
    unit = 1.0 / height
    edge = (5.3 - width / 2) * unit
    box = rt.Box((edge, -9, -1), (9, 9, 0))
    camera = rt.Camera((0, 0, 5), (0, 0, 0), projection="orthographic", height=1.0)
    scene = rt.Scene([box], [], camera, ambient=(1, 1, 1), background=BACKGROUND)
    image = renderer.render(scene, (width, height), rt.Settings(samples=256), transparent=True)
    expected = np.clip(np.arange(1, width + 1) - 5.3, 0, 1)
    assert image.alpha is not None
    np.testing.assert_allclose(image.alpha, np.broadcast_to(expected, (height, width)), atol=1.5 / 256)


@pytest.mark.gl
def test_a_mirror_still_reflects_the_background(renderer: Renderer) -> None:
    mirror = rt.Sphere((0, 0, 0), 1, rt.Material("mirror"))
    scene = rt.Scene([mirror], [], rt.Camera((0, 0, 5), (0, 0, 0)), background=BACKGROUND)
    opaque, transparent = renderings(renderer, scene)
    assert transparent.alpha is not None
    inside = transparent.alpha == 1
    assert inside.any()
    np.testing.assert_array_equal(transparent.radiance[inside], opaque.radiance[inside])
    assert transparent.radiance[inside].min() > 0.1


@pytest.mark.gl
def test_opaque_and_transparent_pictures_alternate(renderer: Renderer) -> None:
    first, second = (renderings(renderer, ball_and_floor(), samples=4) for _ in range(2))
    for before, after in zip(first, second, strict=True):
        np.testing.assert_array_equal(before.radiance, after.radiance)
    np.testing.assert_array_equal(first[1].alpha, second[1].alpha)


@pytest.mark.parametrize("scene", [ball_and_floor(), crowd()])
def test_without_a_request_no_shader_has_a_coverage(scene: rt.Scene) -> None:
    opaque, transparent = (
        program_sources(compiled(scene), "picture", several=True, transparent=transparent)
        for transparent in (False, True)
    )
    assert opaque.keys() == transparent.keys()
    for name, source in opaque.items():
        assert "coverage" not in code(source.fragment) and source.vertex.text == transparent[name].vertex.text
    shades = [name for name, source in transparent.items() if "coverage" in code(source.fragment)]
    assert {*shades} == {*opaque} - {"see", "shapes"}


@pytest.mark.gl
def test_only_a_transparent_picture_has_a_target_for_the_coverage(renderer: Renderer) -> None:
    for transparent in (False, True, False):
        renderer.render(ball_and_floor(), SIZE, rt.Settings(), transparent=transparent)
        assert renderer._kept and renderer._kept.tiles.player.has_texture("coverage") == transparent


@pytest.mark.gl
def test_the_alpha_and_the_camera_are_pickled(renderer: Renderer) -> None:
    image = renderer.render(ball_and_floor(), (16, 10), rt.Settings(), transparent=True)
    again = pickle.loads(pickle.dumps(image))
    np.testing.assert_array_equal(again.alpha, image.alpha)
    np.testing.assert_array_equal(again.planar_depth, image.planar_depth)
