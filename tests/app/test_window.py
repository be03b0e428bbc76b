"""The window on an X server of its own, driven by a synthetic mouse and keys: its pictures, files and messages."""

from __future__ import annotations

import ctypes
import io
import itertools
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import glfw
import numpy as np
import pytest
from PIL import Image

import raytracer as rt
import raytracer.app.viewer.window as window_module
from raytracer.app.viewer.events import Cursor, Event, HintShown, Key, NoticeShown, Press, Wheel
from raytracer.app.viewer.file_watcher import Files
from raytracer.app.viewer.orbit import scale_camera, scale_light, turn_camera, turn_light
from raytracer.app.viewer.window import _CHECK_SECONDS, Viewer
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.progressive import Pace
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch
from tests.displays import SIZE, TIMEOUT, Window, environment, grab_picture, window, x_server
from tests.processes import run_for_output, run_to_end
from tests.scenes import ASSIGNMENT, CHECKOUT, assignment, copy_checkout

BALL = """\
[camera]
position = [0, 1, 6]
look_at = [0, 0, 0]
[[lights]]
position = [0, 4, 8]
[materials.red]
kd = [0.5, 0.1, 0.1]
h = 100
[shapes.ball]
sphere = { center = [0, 0, 0], radius = 2 }
material = "red"
[objects]
ball = "ball"
"""


def render_pixels(scene: rt.Scene, size: tuple[int, int] = SIZE, samples: int = 1, **settings: object) -> np.ndarray:
    return rt.render(scene, size, samples=samples, geometry=False, **settings).srgb8().astype(int)  # pyright: ignore[reportArgumentType]


def half_turns(pixels: float) -> float:
    """Return the angle of a drag over so many pixels, in radians."""
    return math.pi * pixels / SIZE[1]


@pytest.mark.window
def test_each_key_shows_the_picture_of_render_and_then_restores_the_first_picture() -> None:
    scene = assignment()
    plain = render_pixels(scene, samples=16)
    soft = ("soft",) if any(light.radius for light in scene.lights) else ()
    all_shadows = ("diluted", *soft, "off")
    with window(CHECKOUT, str(ASSIGNMENT), "--samples", "16") as view:
        view.act("key l")
        view.wait_until_shown(plain, "hiding the marker, with as many samples as render takes")
        for key, back, others in (
            ("b", "v", [render_pixels(scene, samples=16, shading="blinn")]),
            ("s", "s", [render_pixels(scene, samples=16, shadows=shadows) for shadows in all_shadows]),
            ("a", "a", [render_pixels(scene), render_pixels(scene, samples=4)]),
        ):
            for k, other in enumerate(others):
                assert np.abs(other - plain).max() > 5, f"the test needs pictures in which {key} makes a difference"
                view.act(f"key {key}")
                view.wait_until_shown(other, f"{key}, pressed {k + 1} times")
            view.act(f"key {back}")
            view.wait_until_shown(plain, f"{key}, back again")
        for key in "nzmhl":
            view.act(f"key {key}")
            view.wait_until(lambda: bool(np.abs(view.grab_picture() - plain).max() > 10), f"{key} changes nothing")
            view.act(f"key {key}")
            view.wait_until_shown(plain, f"{key}, back again")
        assert view.close() == "" and view.read_output(view.errors) == ""


@pytest.mark.window
def test_dragging_moves_the_highlight_to_its_place_in_the_reference(tmp_path: Path) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(BALL)
    scene = rt.load(file)

    def highlight(picture: np.ndarray) -> np.ndarray:
        """Return the middle of the highlight, which alone is bright green outside the sky."""
        sky = (picture[..., 2] > 200) & (picture[..., 1] < 230) & (picture[..., 0] < 200)
        rows, columns = np.nonzero((picture[..., 1] > 0.8 * picture[..., 1][~sky].max()) & ~sky)
        return np.array([columns.mean(), rows.mean()])

    with window(tmp_path, str(file), "--samples", "1") as view:
        view.act("key l")
        view.wait_until_shown(render_pixels(scene), "opening")
        places = [highlight(view.grab_picture())]
        for right, down in ((40, 0), (-60, 15), (10, -30)):
            view.act(
                f"mousedown 1 mousemove_relative -- {right // 2} {down} mousemove_relative -- {right - right // 2} 0"
            )
            view.act("mouseup 1")
            scene = turn_light(scene, 0, half_turns(right), half_turns(-down))
            truth = ray_tracer.trace(scene, SIZE, Settings()).srgb8().astype(int)
            view.wait_until(
                lambda truth=truth: bool((np.abs(view.grab_picture() - truth).max(axis=2) > 1).mean() < 1e-3),
                "not the reference's picture",
            )
            places.append(highlight(view.grab_picture()))
            np.testing.assert_allclose(places[-1], highlight(truth), atol=0.5)
            assert np.hypot(*(places[-1] - places[-2])) > 5, "the highlight has moved"
        assert places[1][0] > places[0][0] > places[2][0], "right and left, like the mouse"
        assert view.close() == ""


@pytest.mark.window
def test_wheel_and_right_button_move_light_and_camera_and_e_writes_a_scene_that_render_reproduces(
    tmp_path: Path,
) -> None:
    scene = assignment()
    (tmp_path / "assignment-1.toml").write_text("mine")
    with window(tmp_path, "assignment", "--samples", "4") as view:
        view.act("key l click 4 click 4 keydown Shift_L click 5 keyup Shift_L")
        moved = scale_camera(scale_light(scene, 0, 1.1**-2), 1.1)
        view.wait_until_shown(render_pixels(moved, samples=4), "the wheel")
        view.act("mousedown 3 mousemove_relative -- 20 10 mouseup 3")
        moved = turn_camera(moved, half_turns(20), half_turns(-10))
        picture = render_pixels(moved, samples=4, shading="blinn")
        view.act("key b")
        view.wait_until_shown(picture, "the right button")
        view.act("key p key e")
        view.wait_until(
            lambda: (tmp_path / "assignment-2.toml").exists() and (tmp_path / "assignment-1.png").exists(), "E"
        )
        view.act("key Home")
        back = scale_light(scene, 0, 1.1**-2)
        view.wait_until_shown(render_pixels(back, samples=4, shading="blinn"), "Home")
        said = view.close()
    with Image.open(tmp_path / "assignment-1.png") as screenshot:
        assert np.abs(np.asarray(screenshot).astype(int) - picture).max() <= 1
    assert (tmp_path / "assignment-1.toml").read_text() == "mine", "no file is overwritten"
    lines = said.splitlines()
    assert lines[0].startswith("wrote assignment-1.png: 320x180") or lines[1].startswith("wrote assignment-1.png: ")
    (command,) = (line.partition("its picture: ")[2] for line in lines if "assignment-2.toml" in line)
    program, *arguments = command.split()
    assert program == "raytracer"
    run_for_output(sys.executable, "-m", "raytracer", *arguments, cwd=tmp_path, env=view.variables)
    with Image.open(tmp_path / "assignment-2-rendered.png") as again:
        assert np.abs(np.asarray(again).astype(int) - picture).max() <= 1


@pytest.mark.window
def test_a_saved_file_is_shown_and_a_mistake_keeps_the_picture_and_names_the_line(tmp_path: Path) -> None:
    copy_checkout(tmp_path)
    file, shader, camera = (
        tmp_path / name for name in ("ball.toml", "shaders/shading/lighting.glsl", "shaders/geometry/camera.glsl")
    )
    file.write_text(BALL)
    plain = render_pixels(rt.load(file))
    upper = plain[: SIZE[1] // 4]  # the part above the message

    def saved(path: Path, old: str, new: str) -> None:
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    with window(tmp_path, file.name, "--samples", "1") as view:
        view.act("key l")
        view.wait_until_shown(plain, "opening")

        def until_wrong(says: str) -> None:
            view.wait_until(lambda: says in view.read_output(view.errors), f"the terminal does not say {says!r}")

            def shows_both() -> bool:
                # Both are checked on one grab of the display: half a file, read while it is being written, may cause
                # a longer message first.
                shown = view.grab_picture()
                return bool(np.abs(shown - plain).max() > 50 and np.abs(shown[: len(upper)] - upper).max() <= 1)

            view.wait_until(shows_both, "the window does not show the mistake and above it the last good picture")

        line = shader.read_text().partition("m.ka * ambient")[0].count("\n") + 1
        saved(shader, "m.ka * ambient", "m.ka * ambience")
        until_wrong(f"shading/lighting.glsl:{line}: ")
        saved(shader, "m.ka * ambience", "m.kd * ambient")
        file.write_text(BALL.replace("kd = [0.5, 0.1, 0.1]", "kd = [0.5, 0.1, 0.1]\nka = [0.5, 0.1, 0.1]"))
        bright = render_pixels(rt.load(file))
        file.write_text(BALL)
        view.wait_until_shown(bright, "mending and changing the shader")
        saved(shader, "m.kd * ambient", "m.ka * ambient")
        view.wait_until_shown(plain, "changing it back")
        (tmp_path / "shaders/shading/.#lighting.glsl").symlink_to("nowhere")  # the lock file of an editor
        line = camera.read_text().partition("halfPixels() {")[0].count("\n") + 1
        saved(camera, "halfPixels() {", "halfPixels() { oops;")
        until_wrong(f"geometry/camera.glsl:{line}: ")
        saved(camera, "halfPixels() { oops;", "halfPixels() {")
        view.wait_until_shown(plain, "mending the other file")

        saved(file, "radius = 2", "radius = -2")
        until_wrong("ball.toml:10: shapes.ball.sphere.radius: expected a number above 0")
        saved(file, "radius = -2", "radius = 1")
        view.wait_until_shown(render_pixels(rt.load(file)), "mending the scene file")
        view.act("mousedown 1 mousemove_relative 40 0 mouseup 1")
        saved(file, "radius = 1", "radius = 2")
        turned = turn_light(rt.load(file), 0, half_turns(40), 0.0)
        view.wait_until_shown(render_pixels(turned), "saving the scene: the light stays where it was moved")
        assert view.close() == ""


@pytest.mark.window
def test_a_resized_window_shows_the_picture_in_its_new_size() -> None:
    with window(CHECKOUT, "assignment", "--samples", "8", display=(640, 480)) as view:
        view.act("key l")
        for size in ((320, 180), (400, 301), (200, 480), (37, 23)):
            view.act(f"search --name assignment windowsize {size[0]} {size[1]}")
            view.wait_until_shown(render_pixels(assignment(), size, samples=8), f"a resize to {size}")


@pytest.mark.window
def test_at_display_scale_2_the_window_and_its_text_are_twice_as_large_in_pixels() -> None:
    def table(view: Window, size: tuple[int, int]) -> int:
        """Return the number of pixels that the key H changes."""
        plain = render_pixels(assignment(), size)
        view.act("key l")
        view.wait_until_shown(plain, "opening")
        view.act("key h")
        view.wait_until(lambda: bool(np.abs(view.grab_picture(size) - plain).max() > 10), "no table")
        changed = (np.abs(view.grab_picture(size) - plain) > 1).any(axis=2)
        return int(changed.sum())

    small, large = (640, 440), (1280, 880)
    with window(CHECKOUT, "assignment", "--samples", "1", size=small, display=small) as view:
        once = table(view, small)
    with window(CHECKOUT, "assignment", "--samples", "1", size=small, display=large, scale=2) as view:
        twice = table(view, large)
    assert twice == pytest.approx(4 * once, rel=0.15)


class OpenedWindow:
    """A window of this process, with the number of its buffer swaps."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self.swaps = 0

    def frame(self, *events: Event) -> float:
        """Handle events, and draw a frame if one is due; return the seconds until the next frame."""
        glfw.poll_events()
        for event in events:
            self.viewer.handle(event)
        return self.viewer.frame()

    def draw_until_idle(self) -> None:
        while (wait := self.frame()) != _CHECK_SECONDS:
            time.sleep(wait)

    def grab_picture(self) -> np.ndarray:
        """Return the picture on the display as int [H, W, 3]."""
        return grab_picture(os.environ["DISPLAY"])

    def wait_until_shows(self, right: Callable[[np.ndarray], bool]) -> None:
        """Wait until the display shows the right picture, which takes a moment after the swap of the buffers."""
        deadline = time.monotonic() + TIMEOUT
        while not right(self.grab_picture()):
            assert time.monotonic() < deadline
            time.sleep(0.02)


@pytest.fixture
def open_window(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., OpenedWindow]]:
    """Open windows in this process, on a display of their own. While one is open, EGL cannot render."""
    opened: list[OpenedWindow] = []

    def swap(window: object, original: Callable[..., None] = glfw.swap_buffers) -> None:
        opened[0].swaps += 1
        original(window)

    # A window must close before its display does: the loss of the display would end this process.
    with x_server(640, 480) as display, ExitStack() as windows:
        for name, value in environment(DISPLAY=display).items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(glfw, "swap_buffers", swap)
        monkeypatch.setattr(window_module, "_TOGETHER", 0.0)
        monkeypatch.setattr(window_module, "_HINT", FOREVER)

        def open_here(
            scene: Path = ASSIGNMENT,
            size: tuple[int, int] | None = SIZE,
            samples: int = 4,
            budget: float = 1e9,
        ) -> OpenedWindow:
            viewer = window_module.open_viewer(scene, SettingsPatch(samples=samples), size, budget)
            opened.append(OpenedWindow(windows.enter_context(viewer)))
            return opened[0]

        yield open_here
        errors = []
        for view in opened:
            view.viewer.close()
            errors.append(view.viewer.context.error)
    assert errors == ["GL_NO_ERROR"] * len(opened)


# Seconds: no machine draws so fast, or waits so long.
AT_ONCE, FOREVER = 1e-9, 1e9


@pytest.mark.window
def test_a_moving_picture_has_one_sample_per_frame_with_enlarged_pixels_and_then_sharpens(
    open_window: Callable[..., OpenedWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    view = open_window(samples=400, budget=AT_ONCE)
    live = view.viewer.picture
    view.frame(Press("left"))
    for k in range(1, 5):
        view.frame(Cursor(0.1 * k, 0.5))
        assert live.samples == 1 and live.enlarged > 1
    monkeypatch.setattr(window_module, "_STILL", 0.0)
    view.frame()
    assert live.samples == 1 and live.enlarged == 1
    for k in range(2, 5):
        view.frame()
        assert live.samples == k and live.enlarged == 1, "each sample takes longer than the budget"


@pytest.mark.window
def test_a_picture_waits_while_it_may_move_again_and_then_gets_as_many_samples_per_frame_as_the_budget_allows(
    open_window: Callable[..., OpenedWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    view = open_window(samples=400, size=(16, 9), budget=FOREVER)
    live = view.viewer.picture
    view.frame(Press("left"))
    view.frame(Cursor(0.1, 0.5))
    swaps = view.swaps
    for _ in range(3):
        assert view.frame() > 1.0 and (live.samples, live.estimate(), view.swaps) == (1, None, swaps)
    view.frame(Key("H"))
    assert live.samples == 1 and view.swaps == swaps + 1, "the overlay is drawn over the same picture"
    monkeypatch.setattr(window_module, "_STILL", 0.0)
    view.frame()
    assert live.samples == 1 and not live.is_done
    view.frame()
    assert live.samples == 400 and live.estimate()


@pytest.mark.window
def test_a_mistake_in_the_shader_of_the_error_estimate_is_shown_and_the_picture_gets_its_samples(
    open_window: Callable[..., OpenedWindow], shaders: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = shaders / "sampling/movement.frag"
    file.write_text(file.read_text().replace("vec3 moved =", "vec2 moved ="))
    view = open_window(samples=8)
    for _ in range(2):
        view.draw_until_idle()
        assert view.viewer.picture.samples == 8 and view.viewer.picture.estimate() is None
        assert "sampling/movement.frag:" in view.viewer.state.error
        assert "8 of 8 samples, phong" in glfw.get_window_title(view.viewer.window)
        view.viewer.handle(Wheel(1.0, True))
    assert capsys.readouterr().err.count("raytracer: sampling/movement.frag:") == 1


@pytest.mark.window
def test_the_title_states_the_error_and_a_still_picture_stops_at_the_requested_error(
    open_window: Callable[..., OpenedWindow],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "ball.toml"
    file.write_text(BALL + "[settings]\nmax_error = 0.004\nsize = [64, 36]\n")
    view = open_window(scene=file, size=None, samples=1000)
    view.draw_until_idle()
    drawn, window = view.viewer.picture, view.viewer.window
    estimate = drawn.estimate()
    assert drawn.size == (64, 36) and 4 <= drawn.samples < 1000 and estimate and estimate.reached
    assert f"{drawn.samples} of 1000 samples, error {estimate.in_words}, " in glfw.get_window_title(window)
    view.frame(Key("P"))
    view.draw_until_idle()
    with Image.open("ball-1.png") as screenshot:
        assert screenshot.info["Error"].startswith(f"error {estimate.in_words} ")
        assert f"samples={drawn.samples}, " in screenshot.info["Description"]
    few = drawn.samples
    for settings, is_expected in (("max_error = 0.0004", lambda n: n > few), ("sequence = 'grid'", lambda n: n > few)):
        file.write_text(f"{BALL}[settings]\n{settings}\n")
        time.sleep(0.1)
        view.viewer.reload_changed_files()
        view.draw_until_idle()
        assert is_expected(drawn.samples)
    assert f"{file}: settings.sequence: expected one of sobol, r2, random" in view.viewer.state.error
    assert capsys.readouterr().err.count(f"raytracer: {file}: settings.sequence") == 1


@pytest.mark.window
def test_nothing_is_drawn_for_a_still_picture_or_a_minimised_window(
    open_window: Callable[..., OpenedWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    view = open_window()
    view.draw_until_idle()
    assert glfw.get_window_title(view.viewer.window).startswith("assignment - ")
    title = glfw.get_window_title(view.viewer.window)
    assert "4 of 4 samples, error about 0.00" in title and title.endswith("phong, hard shadows, H for help")
    swaps = view.swaps
    for _ in range(20):
        assert view.frame() == _CHECK_SECONDS
    assert view.swaps == swaps
    view.frame(Key("H"))
    assert view.swaps == swaps + 1 and view.viewer.picture.samples == 4, "the overlay is drawn over the same picture"

    for name, instead in (("get_framebuffer_size", lambda _: (0, 0)), ("get_window_attrib", lambda *_: 1)):
        with monkeypatch.context() as patch:
            patch.setattr(glfw, name, instead)
            for _ in range(5):
                assert view.frame(Wheel(1.0, False)) == _CHECK_SECONDS
            assert view.swaps == swaps + 1
    view.draw_until_idle()
    assert view.swaps > swaps + 1, "a restored window shows the changes"


@pytest.mark.window
def test_the_window_shows_a_hint_about_help_for_a_while_but_a_screenshot_does_not(
    open_window: Callable[..., OpenedWindow], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    picture = render_pixels(assignment())
    picture[: SIZE[1] // 2] = 0  # the half with the marker

    def difference(shown: np.ndarray) -> int:
        return int(np.abs(shown - picture)[SIZE[1] // 2 :].max())

    view = open_window(samples=1)
    view.draw_until_idle()
    assert view.viewer.state.hint == "H: help" and difference(view.grab_picture()) > 50
    view.viewer.handle(Key("P"))  # which removes the hint
    view.viewer.handle(HintShown("H: help"))
    view.draw_until_idle()
    view.viewer.handle(NoticeShown(""))
    view.viewer.handle(HintShown("H: help"))
    view.draw_until_idle()
    assert difference(view.grab_picture()) > 50 and difference(read_pixels("assignment-1.png")) <= 1
    monkeypatch.setattr(window_module, "_HINT", 0.0)
    view.draw_until_idle()
    assert view.viewer.state.hint == ""
    view.wait_until_shows(lambda shown: difference(shown) <= 1)


@pytest.mark.window
def test_after_several_keys_the_title_names_the_last_setting_and_only_its_programs_are_compiled(
    open_window: Callable[..., OpenedWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_module, "_TOGETHER", FOREVER)
    pictures = render_pixels(assignment(), samples=4), render_pixels(assignment(), samples=4, shading="minnaert")
    half = slice(SIZE[1] // 3, 2 * SIZE[1] // 3)  # the rows without marker and text
    view = open_window(samples=4)
    programs = view.viewer.picture._device._programs
    view.viewer.handle(Key("L"))
    view.draw_until_idle()
    compiled = len(programs)
    title = lambda: glfw.get_window_title(view.viewer.window)  # noqa: E731
    assert title().startswith("assignment - ") and "phong, hard shadows" in title()
    for model in ("blinn", "lambert", "minnaert"):
        view.frame(Key("B"))
        assert title() == f"assignment - compiling {model}, hard shadows ..., H for help"
        view.wait_until_shows(lambda shown: np.abs(shown - pictures[0])[half].max() <= 1)
        assert np.abs(view.grab_picture() - pictures[0]).max() > 50, (
            "an overlay over the last picture names the settings, too"
        )
    assert len(programs) == compiled
    monkeypatch.setattr(window_module, "_TOGETHER", 0.0)
    view.draw_until_idle()
    once = len(programs) - compiled
    assert "minnaert, hard shadows" in title() and "compiling" not in title()
    view.wait_until_shows(lambda shown: np.abs(shown - pictures[1]).max() <= 1)
    monkeypatch.setattr(window_module, "_TOGETHER", FOREVER)
    view.frame(Key("V"))
    assert "compiling lambert, " in title()
    view.frame(Key("B"))
    view.draw_until_idle()
    assert "4 of 4 samples" in title() and "minnaert, hard shadows" in title(), "compiled programs are used at once"
    assert once > 0 and len(programs) == compiled + once


def read_pixels(name: str) -> np.ndarray:
    with Image.open(name) as picture:
        return np.asarray(picture).astype(int)


@pytest.mark.window
def test_a_screenshot_has_all_samples_or_those_drawn_before_the_picture_changed(
    open_window: Callable[..., OpenedWindow],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    pictures = render_pixels(assignment(), samples=4), render_pixels(assignment(), samples=2, shadows="diluted")
    view = open_window(samples=4)
    view.frame()
    view.frame(Key("P"))
    assert "4 samples" in view.viewer.state.notice and list(tmp_path.iterdir()) == []
    monkeypatch.setattr(window_module, "_STILL", 0.0)
    view.draw_until_idle()
    monkeypatch.setattr(view.viewer, "_budget", 0.0)  # one sample per frame
    for key in ("S", "", ""):  # a new picture, the first sample of the picture at rest, and the second
        view.frame(Key(key))
    view.viewer.handle(Key("P"))
    view.frame(Key("N"))  # another picture before the last one had all its samples
    for key in ("", "", "P"):
        view.frame(Key(key))
    view.viewer.close()
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["assignment-1.png", "assignment-2.png", "assignment-3.png"]
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(", ")[2] for line in lines] == [f"{k} of 4 samples" for k in (4, 2, 3)]
    for name, picture in zip(names[:2], pictures, strict=True):
        assert np.abs(read_pixels(name) - picture).max() <= 1
    with Image.open(names[2]) as screenshot:
        assert "showing normal" in screenshot.info["Description"]


@pytest.mark.window
@pytest.mark.parametrize(("samples", "budget"), [(4, FOREVER), (4, AT_ONCE), (1, FOREVER), (1, AT_ONCE)])
def test_a_screenshot_of_a_picture_with_one_sample_equals_the_picture_of_render(
    open_window: Callable[..., OpenedWindow],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    samples: int,
    budget: float,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    pictures = render_pixels(assignment()), render_pixels(turn_light(assignment(), 0, half_turns(0.1 * SIZE[1]), 0.0))
    view = open_window(samples=samples, budget=budget)
    live = view.viewer.picture
    view.frame(Cursor(0.0, 0.5), Press("left"))
    view.frame(Wheel(1.0, True))
    view.frame(Wheel(-1.0, True))
    assert (live.enlarged > 1) == (budget == AT_ONCE)
    view.viewer.handle(Key("P"))
    view.frame(Cursor(0.1, 0.5))
    assert live.samples == 1 and (live.enlarged > 1) == (budget == AT_ONCE)
    if samples > 1:  # the first sample of a still picture
        monkeypatch.setattr(window_module, "_STILL", 0.0)
        view.frame(Key("P"))
        assert live.samples == 1 and live.enlarged == 1
    else:
        view.viewer.handle(Key("P"))
    view.viewer.close()
    for k, picture in enumerate(pictures):
        with Image.open(f"assignment-{k + 1}.png") as screenshot:
            assert "320x180, Settings(samples=1, " in screenshot.info["Description"]
        assert np.abs(read_pixels(f"assignment-{k + 1}.png") - picture).max() <= 1


@pytest.mark.window
def test_a_screenshot_shows_the_picture_from_before_a_file_was_saved(
    open_window: Callable[..., OpenedWindow], shaders: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    picture = render_pixels(assignment())
    view = open_window()
    view.frame()
    file = shaders / "shading/lighting.glsl"
    file.write_text(file.read_text().replace("m.ka * ambient", "oops"))
    view.viewer.handle(Key("P"))
    time.sleep(0.1)
    view.viewer.reload_changed_files()
    view.frame()
    assert "shading/lighting.glsl:" in view.viewer.state.error
    assert np.abs(read_pixels("assignment-1.png") - picture).max() <= 1


@pytest.mark.window
def test_a_change_that_the_driver_cannot_draw_is_reverted_and_the_message_names_the_file(
    open_window: Callable[..., OpenedWindow], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(BALL.replace("h = 100", "h = 3e5"))
    view = open_window(scene=file)
    view.draw_until_idle()
    view.frame(Key("B"))  # Blinn's exponent, 4 h, would be too large
    assert view.viewer.state.settings.shading is None and f"{file}: shading: expected" in view.viewer.state.notice
    view.draw_until_idle()
    file.write_text(BALL + "[[lights]]\nposition = [1, 2, 3]\n" * 5000)
    time.sleep(0.1)
    view.viewer.reload_changed_files()
    view.frame()
    assert f"{file}: expected at most" in view.viewer.state.error and len(view.viewer.state.scene.lights) == 1
    file.write_text(BALL)
    time.sleep(0.1)
    view.viewer.reload_changed_files()
    view.draw_until_idle()
    assert view.viewer.state.error == "" and view.viewer.state.scene == rt.load(file)
    assert capsys.readouterr().err.count(f"raytracer: {file}: ") == 2


@pytest.mark.window
def test_the_window_names_a_written_file_even_if_standard_output_is_full(
    open_window: Callable[..., OpenedWindow], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    view = open_window()

    class Full(io.StringIO):
        def write(self, _: str) -> int:
            raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", Full())
        view.frame(Key("E"))
    assert view.viewer.state.notice.startswith("wrote assignment-1.toml") and (tmp_path / "assignment-1.toml").exists()


@pytest.mark.window
def test_a_file_that_is_saved_while_the_window_opens_is_shown_as_saved(
    open_window: Callable[..., OpenedWindow], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(BALL)

    def save(path: Path) -> Files:
        file.write_text(BALL.replace("radius = 2", "radius = 1"))
        return Files(path)

    monkeypatch.setattr(window_module, "Files", save)
    assert open_window(scene=file).viewer.state.scene == rt.load(file)


@pytest.mark.slow
@pytest.mark.window
def test_two_thousand_frames_with_toggles_and_resizes_leak_no_objects_and_no_memory(
    open_window: Callable[..., OpenedWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Whether a sample takes longer than the budget decides on enlarged pixels, whose first picture makes an object.
    sides = itertools.cycle((1, 2))
    monkeypatch.setattr(Pace, "enlarged", lambda pace, pixels: next(sides))
    view = open_window(size=(96, 54), budget=0.033)
    kinds = ("Buffer", "Texture", "Framebuffer", "VertexArray", "Program", "Shader")
    prototype = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)
    exist = [prototype(glfw.get_proc_address(f"glIs{kind}")) for kind in kinds]  # pyright: ignore

    def objects() -> list[int]:
        return [sum(is_one(name) for name in range(1, 100_000)) for is_one in exist]

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    keys = "BSSSANZMHLABNZMHLB"
    left, memory = [], 0
    view.viewer.handle(Press("left"))
    for k in range(2000):
        view.frame(
            Cursor(0.01 * k, 0.5),
            Wheel(1.0 if k % 2 else -1.0, k % 4 < 2),
            NoticeShown(f"frame {k}"),
            Key(keys[k % len(keys)]),
        )
        if k % 10 == 0:
            glfw.set_window_size(view.viewer.window, 96 + k % 7, 54 + k % 5)
            view.viewer.picture.reread()
        view.frame()
        if k == 199:
            left, memory = objects(), resident()
    assert objects() == left
    assert resident() - memory < 4 * 2**20


@pytest.mark.skipif(sys.platform != "linux", reason="these systems always have a display")
def test_without_a_display_the_message_is_plain_and_names_render() -> None:
    command = (sys.executable, "-m", "raytracer", "view", str(ASSIGNMENT))
    done = run_to_end(*command, cwd=CHECKOUT, env=environment())
    assert done.returncode == 1
    assert done.stderr.startswith("raytracer: no window opens on this machine: ")
    assert "`raytracer render" in done.stderr
    assert "Traceback" not in done.stderr and "b'" not in done.stderr
