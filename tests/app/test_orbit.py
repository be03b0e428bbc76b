"""Moving a light and the camera on spheres around the camera's target, at every scale."""

from __future__ import annotations

import math

import numpy as np
import pytest

import raytracer as rt
from raytracer.app.viewer.orbit import scale_camera, scale_light, turn_camera, turn_light
from raytracer.core.validation import MAX_LENGTH

BALL = rt.Sphere((1.0, 2.0, 3.0), 0.5)
CAMERA = rt.Camera(position=(4.0, 6.0, 9.0), look_at=(1.0, 2.0, 3.0))
LOOK_AT = np.array(CAMERA.look_at)
RIGHT, UP, FORWARD = np.array(CAMERA.axes())


def light_at(*offset: float) -> rt.Scene:
    """Return a scene whose first light is at look_at + offset, along the camera's right, level and up directions."""
    level = np.cross(RIGHT, CAMERA.up)  # towards the camera
    position = LOOK_AT + np.array(offset) @ (RIGHT, level, CAMERA.up)
    return rt.Scene([BALL], [rt.PointLight(tuple(position)), rt.PointLight((0, 9, 0))], CAMERA)


def offset(scene: rt.Scene) -> np.ndarray:
    level = np.cross(RIGHT, CAMERA.up)
    return (RIGHT, level, CAMERA.up) @ (np.array(scene.lights[0].position) - LOOK_AT)


@pytest.mark.parametrize("radius", [1e-6, 5.0, 1e6])
def test_a_light_turns_around_the_target_and_rises(radius: float) -> None:
    front = light_at(0.0, radius, 0.0)
    quarter = turn_light(front, 0, math.pi / 2, 0.0)
    rounding = 1e-9 * radius + 1e-15
    np.testing.assert_allclose(offset(quarter), (radius, 0, 0), atol=rounding)
    np.testing.assert_allclose(offset(turn_light(quarter, 0, math.pi / 2, 0.0)), (0, -radius, 0), atol=rounding)
    raised = offset(turn_light(front, 0, 0.0, math.pi / 6))
    np.testing.assert_allclose(raised, (0, math.sqrt(3) / 2 * radius, radius / 2), rtol=1e-8, atol=rounding)
    np.testing.assert_allclose(offset(scale_light(front, 0, 3.0)), (0, 3 * radius, 0), rtol=1e-8, atol=rounding)
    assert quarter.lights[1:] == front.lights[1:]
    assert turn_light(front, 1, 1.0, 0.0).lights[0] == front.lights[0] != turn_light(front, 0, 1.0, 0.0).lights[0]


def test_successive_turns_add_up_and_never_pass_the_pole() -> None:
    scene = light_at(1.0, 2.0, 1.0)
    heights = []
    for _ in range(20):
        scene = turn_light(scene, 0, 0.3, 0.2)
        heights.append(offset(scene)[2])
    assert heights == sorted(heights) and heights[-1] < math.sqrt(6.0)
    assert np.linalg.norm(offset(scene)) == pytest.approx(math.sqrt(6.0))
    np.testing.assert_allclose(offset(turn_light(light_at(1, 2, 1), 0, 6 * math.pi, 0)), (1, 2, 1), rtol=1e-12)


def test_a_light_straight_above_can_be_brought_down() -> None:
    lowered = offset(turn_light(light_at(0.0, 0.0, 3.0), 0, 0.0, -math.pi / 3))
    assert lowered[1] > 2.0 and 0.0 < lowered[2] < 2.0


@pytest.mark.parametrize("position", [(MAX_LENGTH, 0.0, 0.0), CAMERA.look_at])
def test_a_light_at_the_extremes_can_be_moved(position: tuple[float, float, float]) -> None:
    scene = rt.Scene([BALL], [rt.PointLight(position)], CAMERA)
    for angle in np.linspace(-7.0, 7.0, 57):
        scale_light(turn_light(scene, 0, 2.0, float(angle)), 0, 1.1)  # must not raise an exception
    if position != CAMERA.look_at:
        assert turn_light(scene, 0, 0.0, 0.0).lights[0].position == pytest.approx(position)


def test_a_light_at_the_target_can_be_moved_away() -> None:
    middle = light_at(0.0, 0.0, 0.0)
    for out in (scale_light(middle, 0, 1.1), turn_light(middle, 0, 0.1, 0.1)):
        assert 0.05 < math.dist(out.lights[0].position, LOOK_AT) / math.dist(CAMERA.position, LOOK_AT) < 0.2


def test_a_scene_without_lights_stays_the_same_object() -> None:
    scene = rt.Scene([BALL], [], CAMERA)
    assert turn_light(scene, 0, 1.0, 1.0) is scene is scale_light(scene, 0, 2.0)


def test_the_view_turns_with_the_mouse_and_keeps_the_target_in_the_middle() -> None:
    scene = light_at(0.0, 5.0, 0.0)
    ahead = LOOK_AT - 0.1 * FORWARD  # a point between the camera and its target

    def in_camera_axes(scene: rt.Scene) -> np.ndarray:
        return np.array(scene.camera.axes()) @ (ahead - scene.camera.position)

    level = 0.1 * math.hypot(FORWARD[0], FORWARD[2])
    assert in_camera_axes(turn_camera(scene, 0.1, 0.0))[0] == pytest.approx(level * math.sin(0.1)), "to the right"
    assert in_camera_axes(turn_camera(scene, 0.0, 0.1))[1] == pytest.approx(0.1 * math.sin(0.1)), "up"
    for moved in (turn_camera(scene, 2.0, -0.3), scale_camera(scene, 1e-3), scale_camera(scene, 1e3)):
        right, up, forward = np.array(moved.camera.axes()) @ (LOOK_AT - moved.camera.position)
        np.testing.assert_allclose((right, up), 0.0, atol=1e-12 * forward)
    distance = math.dist(CAMERA.position, CAMERA.look_at)
    for factor in (1e-3, 1.0, 1e3):
        camera = turn_camera(scale_camera(scene, factor), 2.0, -0.3).camera
        assert math.dist(camera.position, camera.look_at) == pytest.approx(factor * distance)


def test_an_orthographic_camera_comes_nearer_by_a_smaller_height_and_turns_as_any_other() -> None:
    scene = rt.Scene([BALL], [], CAMERA.replace(projection="orthographic", height=3.0))
    near = scale_camera(scene, 0.5).camera
    assert near == scene.camera.replace(height=1.5)
    assert (
        turn_camera(scene, 0.3, 0.1).camera.position
        == turn_camera(scene.replace(camera=CAMERA), 0.3, 0.1).camera.position
    )
    assert scale_camera(scene, 1e-30).camera.height == 1e-12


def test_the_camera_stays_valid_after_any_number_of_moves() -> None:
    near = far = steep = light_at(0.0, 5.0, 0.0)
    for _ in range(1000):
        near, far, steep = scale_camera(near, 1 / 1.1), scale_camera(far, 1.1), turn_camera(steep, 0.1, 0.1)
    assert 0.0 < math.dist(near.camera.position, LOOK_AT) < 1e-9
    assert max(map(abs, far.camera.position)) <= MAX_LENGTH
    assert steep.camera.axes()[2][1] == pytest.approx(math.sin(math.radians(89)), abs=1e-6)
