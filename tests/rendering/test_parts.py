"""Parts of a picture: drawn alone, they have the bits that they have in the whole picture."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.frame import make_frame
from raytracer.compiler.meshes import Rectangle
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tiles import place
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import LIMITS, compiled

SIZE = 90, 71  # no multiples of a cell
# Bands of one or two cells, and a part from the middle to the right edge.
PARTS = [(0, y, 90, min(32, 71 - y)) for y in (0, 32, 64)] + [(0, 16, 90, 16), (48, 32, 42, 16)]
BALLS = [
    rt.Sphere((x, 0.4 * math.sin(5 * x + y), y), 0.3, scenes.COLORS[0]) for x in range(-4, 5) for y in range(-6, 2)
]
GROUND = rt.Plane((0, 1, 0), -0.8, rt.Material(kd=0.5, ks=0.2))
COPIES = rt.Instances(rt.Sphere((0, 0, 0), 0.25) - rt.Sphere((0.1, 0.2, 0.1), 0.2), [[x, 0, -x] for x in range(-3, 4)])
ORTHOGRAPHIC = rt.Camera((1, 3, 6), (0, 0, 0), projection="orthographic", height=5)
# Objects of common shapes, trees in candidate lists, instances, an orthographic view: all on a ground with shadows.
SCENES = {
    "assignment": scenes.assignment(),
    "balls": scenes.lit_scene(*BALLS, GROUND),
    "trees": scenes.lit_scene(*(scenes.lens(x, 0, -x, 0.5) for x in range(-3, 4)), COPIES, GROUND),
    "orthographic": scenes.lit_scene(*BALLS[::3], GROUND).replace(camera=ORTHOGRAPHIC),
}


def assert_parts_equal(renderer: Renderer, scene: rt.Scene, settings: Settings, parts: list[Rectangle]) -> None:
    whole = renderer.render(scene, SIZE, settings, geometry=False)
    for part in parts:
        image = renderer.render(scene, SIZE, settings, geometry=False, part=part)
        where = place(part, (0, 0, *SIZE))
        np.testing.assert_array_equal(image.radiance, whole.radiance[where], err_msg=str(part))
        if whole.samples is not None:
            assert image.samples is not None
            np.testing.assert_array_equal(image.samples, whole.samples[where], err_msg=str(part))


@pytest.mark.gl
@pytest.mark.parametrize("samples", [1, 16])
@pytest.mark.parametrize("name", SCENES)
def test_a_part_has_the_bits_of_the_whole_picture(renderer: Renderer, name: str, samples: int) -> None:
    settings = Settings(samples=samples, shadows="soft" if samples > 1 else "hard")
    assert_parts_equal(renderer, scenes.with_light_radii(SCENES[name], 0.3), settings, PARTS)


@pytest.mark.gl
@pytest.mark.parametrize("fields", [{"evaluator": "walk"}, {"evaluator": "roth"}, {"precision": 64}])
def test_a_part_has_the_bits_of_the_whole_picture_with_all_evaluators(
    renderer: Renderer, fields: dict[str, object]
) -> None:
    assert_parts_equal(renderer, scenes.assignment(), Settings(samples=2).replace(**fields), PARTS[1:])


@pytest.mark.gl
def test_a_part_has_the_adaptive_samples_of_the_whole_picture(renderer: Renderer) -> None:
    """Samples of a pixel depend on pixels around it, which are drawn for a part, too."""
    assert_parts_equal(renderer, scenes.assignment(), Settings(samples=32, adaptive=0.02), PARTS)


@pytest.mark.gl
def test_with_a_requested_error_a_part_reaches_it_by_itself(renderer: Renderer) -> None:
    settings = Settings(samples=256, max_error=0.01)
    for part in PARTS[:3]:
        estimate = renderer.render(scenes.assignment(), SIZE, settings, geometry=False, part=part).estimate
        assert estimate
        assert estimate.reached
        assert estimate.worst_at
        assert estimate.worst_at[1] < part[3], "a row of the part"


@pytest.mark.gl
def test_the_middle_of_the_largest_picture_is_a_small_picture_of_a_narrow_view(renderer: Renderer) -> None:
    """The edge of a ball passes through the middle of the picture, whose pixels are 14 millionths wide."""
    width, height, side = 48, 32, 65536
    edge = math.asin(1 / 5)
    camera = rt.Camera((0, 0, 5), (5 * math.sin(edge), 0, 5 - 5 * math.cos(edge)), vertical_fov=50)
    scene = scenes.lit_scene(rt.Sphere((0, 0, 0), 1, scenes.COLORS[0])).replace(camera=camera, ambient=(1, 1, 1))
    part = (side - width) // 2 // 16 * 16, (side - height) // 2, width, height
    near = renderer.render(scene, (side, side), Settings(), geometry=False, part=part).radiance
    narrow = math.degrees(2.0 * math.atan(math.tan(math.radians(25)) * height / side))
    scene = scene.replace(camera=camera.replace(vertical_fov=narrow))
    left = width // 2 - ((side - width) // 2 - part[0])
    small = renderer.render(scene, (2 * width, height), Settings(), geometry=False).radiance[:, left : left + width]
    is_ball = np.any(small != small[0, -1], axis=2)
    assert 0.3 < is_ball.mean() < 0.8
    assert np.mean(np.abs(near - small).max(axis=2) > 1e-3) < 0.01, "but for some pixels at the edge"


@pytest.mark.parametrize("name", ["assignment", "balls", "orthographic"])
def test_the_numbers_of_a_part_need_no_memory_for_the_rest_of_the_picture(name: str) -> None:
    """All cells of the picture have 16 million bits and corners, in a few arrays of float64: a gigabyte."""
    scene = compiled(SCENES[name])
    make_frame(scene, (64, 32), LIMITS)  # numbers that all pictures of the scene share
    tracemalloc.start()
    frame = make_frame(scene, (65536, 65536), LIMITS, part=(0, 32768, 65536, 32))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert frame.cells.empty.shape == (2, 4096)
    assert peak < 20e6


def test_a_frame_of_another_part_shares_the_lists_of_lights() -> None:
    scene = compiled(SCENES["trees"])
    one = make_frame(scene, SIZE, LIMITS, part=PARTS[0])
    other = make_frame(scene, SIZE, LIMITS, one, part=PARTS[1])
    assert one.lists
    assert other.lists
    assert all(a is b for a, b in zip(other.lists.own, one.lists.own, strict=True))
    assert other.lists.camera.lists is not one.lists.camera.lists
