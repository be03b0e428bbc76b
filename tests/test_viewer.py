"""The window, on an X server of its own: what it shows, what a drag and the keys do, how it ends."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import ImageGrab

import raytracer as rt
from raytracer.scene import MAX_LENGTH
from raytracer.viewer import dragged

from .displays import environment, x_server
from .scenes import CHECKOUT

SCENE = "assets/scenes/assignment.toml"
SIZE = (1280, 720)
COMMAND = (sys.executable, "-m", "raytracer", "view", SCENE)
# For what takes a few seconds on two slow cores.
TIMEOUT = 180.0

BALL = rt.Sphere((1.0, 2.0, 3.0), 0.5)
CAMERA = rt.Camera(position=(4.0, 6.0, 9.0), look_at=(1.0, 2.0, 3.0))
LOOK_AT = np.array(CAMERA.look_at)
RIGHT, UP, FORWARD = np.array(CAMERA.axes())


def differ(a: np.ndarray, b: np.ndarray) -> bool:
    """Another device may see a few pixels on edges differently: less than 16 samples and 1 do, whose mean is 0.06."""
    return bool(np.abs(a.astype(int) - b.astype(int)).mean() > 0.02)


@pytest.fixture
def display() -> Iterator[str]:
    """A display as large as the window; without a window manager the window fills it."""
    with x_server(*SIZE) as name:
        yield name


@pytest.mark.window
def test_the_window_shows_what_render_makes_and_follows_drags_and_keys_until_escape(display: str) -> None:
    scene = rt.load(CHECKOUT / SCENE)
    turned = dragged(scene, math.radians(180 * 400 / SIZE[1]), math.radians(180 * -60 / SIZE[1]))
    drag = "mousemove 640 360 mousedown 1 mousemove 700 370 mousemove 1040 420 mouseup 1"
    steps = (
        ("mousemove 640 360", rt.render(scene, SIZE, geometry=False)),
        (drag, rt.render(turned, SIZE, geometry=False)),
        ("key b", rt.render(turned, SIZE, shading="blinn", geometry=False)),
        ("key s", rt.render(turned, SIZE, shading="blinn", shadows="diluted", geometry=False)),
        ("key s", rt.render(turned, SIZE, shading="blinn", shadows="off", geometry=False)),
        ("key s key b", rt.render(turned, SIZE, geometry=False)),
        ("key a", rt.render(turned, SIZE, samples=16, geometry=False)),
    )
    variables = environment(DISPLAY=display)
    shown = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    with subprocess.Popen(COMMAND, cwd=CHECKOUT, env=variables, stderr=subprocess.PIPE, text=True) as viewer:
        try:
            for actions, image in steps:
                wanted, deadline = image.srgb8(), time.monotonic() + TIMEOUT
                assert differ(shown, wanted), f"{actions!r} would be seen in no picture"
                subprocess.run(("xdotool", *actions.split()), env=variables, check=True)
                while differ(shown, wanted):
                    assert viewer.poll() is None, viewer.communicate()[1]
                    assert time.monotonic() < deadline, f"not the picture that is due after {actions!r}"
                    time.sleep(0.2)
                    shown = np.asarray(ImageGrab.grab(xdisplay=display).convert("RGB"))
            subprocess.run(("xdotool", "key", "Escape"), env=variables, check=True)
            assert viewer.communicate(timeout=TIMEOUT)[1] == ""
            assert viewer.returncode == 0
        finally:
            viewer.kill()


@pytest.mark.skipif(sys.platform != "linux", reason="a display is always there")
def test_without_a_display_the_message_is_plain_and_names_render() -> None:
    done = subprocess.run(COMMAND, cwd=CHECKOUT, env=environment(), capture_output=True, text=True, timeout=TIMEOUT)
    assert done.returncode == 1
    assert done.stderr.startswith("raytracer: there is no window here: ")
    assert "`raytracer render" in done.stderr
    assert "Traceback" not in done.stderr and "b'" not in done.stderr


def light_at(*offset: float) -> rt.Scene:
    """A scene whose first light is at look_at + offset in the camera's right, level and up directions."""
    level = np.cross(RIGHT, CAMERA.up)  # towards the camera
    position = LOOK_AT + np.array(offset) @ (RIGHT, level, CAMERA.up)
    return rt.Scene([BALL], [rt.PointLight(tuple(position)), rt.PointLight((0, 9, 0))], CAMERA)


def offset(scene: rt.Scene) -> np.ndarray:
    level = np.cross(RIGHT, CAMERA.up)
    return (RIGHT, level, CAMERA.up) @ (np.array(scene.lights[0].position) - LOOK_AT)


@pytest.mark.parametrize("radius", [1e-6, 5.0, 1e6])
def test_a_drag_turns_the_light_around_the_scene_and_raises_it(radius: float) -> None:
    front = light_at(0.0, radius, 0.0)
    quarter = dragged(front, math.pi / 2, 0.0)
    np.testing.assert_allclose(offset(quarter), (radius, 0, 0), atol=1e-9 * radius + 1e-15)
    np.testing.assert_allclose(offset(dragged(quarter, math.pi / 2, 0.0)), (0, -radius, 0), atol=1e-9 * radius + 1e-15)
    raised = offset(dragged(front, 0.0, math.pi / 6))
    np.testing.assert_allclose(raised, (0, math.sqrt(3) / 2 * radius, radius / 2), rtol=1e-8, atol=1e-9 * radius)
    assert quarter.lights[1:] == front.lights[1:]


def test_one_drag_after_another_goes_on_from_there_and_never_over_the_pole() -> None:
    scene = light_at(1.0, 2.0, 1.0)
    heights = []
    for _ in range(20):
        scene = dragged(scene, 0.3, 0.2)
        heights.append(offset(scene)[2])
    assert heights == sorted(heights) and heights[-1] < math.sqrt(6.0)
    assert np.linalg.norm(offset(scene)) == pytest.approx(math.sqrt(6.0))
    np.testing.assert_allclose(offset(dragged(light_at(1, 2, 1), 6 * math.pi, 0)), (1, 2, 1), rtol=1e-12)


def test_a_light_straight_above_can_be_brought_down() -> None:
    lowered = offset(dragged(light_at(0.0, 0.0, 3.0), 0.0, -math.pi / 3))
    assert lowered[1] > 2.0 and 0.0 < lowered[2] < 2.0


@pytest.mark.parametrize("position", [(MAX_LENGTH, 0.0, 0.0), CAMERA.look_at])
def test_a_light_at_the_extremes_can_be_dragged(position: tuple[float, float, float]) -> None:
    scene = rt.Scene([BALL], [rt.PointLight(position)], CAMERA)
    for angle in np.linspace(-7.0, 7.0, 57):
        dragged(scene, 2.0, float(angle))  # raises nothing
    assert dragged(scene, 0.0, 0.0).lights[0].position == pytest.approx(position)


def test_without_lights_a_drag_changes_nothing() -> None:
    scene = rt.Scene([BALL], [], CAMERA)
    assert dragged(scene, 1.0, 1.0) is scene
