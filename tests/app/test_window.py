"""The window on an X server of its own, with a synthetic mouse and keys: what it shows, and how it ends."""

from __future__ import annotations

import ctypes
import io
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
from raytracer.app.viewer.events import Cursor, Event, Hinted, Key, Press, Told, Wheel
from raytracer.app.viewer.file_watcher import Files
from raytracer.app.viewer.orbit import scale_camera, scale_light, turn_camera, turn_light
from raytracer.app.viewer.window import _LOOK, Viewer
from raytracer.ground_truth import ray_tracer
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch
from tests.displays import SIZE, TIMEOUT, Window, environment, shown, window, x_server
from tests.processes import finished, output_of
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


def rendered(scene: rt.Scene, size: tuple[int, int] = SIZE, samples: int = 1, **settings: object) -> np.ndarray:
    return rt.render(scene, size, samples=samples, geometry=False, **settings).srgb8().astype(int)  # pyright: ignore[reportArgumentType]


def half_turns(pixels: float) -> float:
    """The angle of a drag."""
    return math.pi * pixels / SIZE[1]


@pytest.mark.window
def test_each_key_changes_the_picture_as_render_does_and_brings_it_back() -> None:
    scene = assignment()
    plain = rendered(scene, samples=16)
    soft = ("soft",) if any(light.radius for light in scene.lights) else ()
    all_shadows = ("diluted", *soft, "off")
    with window(CHECKOUT, str(ASSIGNMENT), "--samples", "16") as view:
        view.act("key l")
        view.until_shown(plain, "hiding the marker: as many samples as render takes")
        for key, back, others in (
            ("b", "v", [rendered(scene, samples=16, shading="blinn")]),
            ("s", "s", [rendered(scene, samples=16, shadows=shadows) for shadows in all_shadows]),
            ("a", "a", [rendered(scene), rendered(scene, samples=4)]),
        ):
            for k, other in enumerate(others):
                assert np.abs(other - plain).max() > 5, f"{key} would be seen in no picture"
                view.act(f"key {key}")
                view.until_shown(other, f"{key}, pressed {k + 1} times")
            view.act(f"key {back}")
            view.until_shown(plain, f"{key}, back again")
        for key in "nzmhl":
            view.act(f"key {key}")
            view.until(lambda: bool(np.abs(view.shown() - plain).max() > 10), f"{key} changes nothing")
            view.act(f"key {key}")
            view.until_shown(plain, f"{key}, back again")
        assert view.close() == "" and view.said(view.errors) == ""


@pytest.mark.window
def test_dragging_moves_the_highlight_to_where_the_reference_has_it(tmp_path: Path) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(BALL)
    scene = rt.load(file)

    def highlight(picture: np.ndarray) -> np.ndarray:
        """Its middle: the picture's green is the highlight's own."""
        sky = (picture[..., 2] > 200) & (picture[..., 1] < 230) & (picture[..., 0] < 200)
        rows, columns = np.nonzero((picture[..., 1] > 0.8 * picture[..., 1][~sky].max()) & ~sky)
        return np.array([columns.mean(), rows.mean()])

    with window(tmp_path, str(file), "--samples", "1") as view:
        view.act("key l")
        view.until_shown(rendered(scene), "opening")
        places = [highlight(view.shown())]
        for right, down in ((40, 0), (-60, 15), (10, -30)):
            view.act(
                f"mousedown 1 mousemove_relative -- {right // 2} {down} mousemove_relative -- {right - right // 2} 0"
            )
            view.act("mouseup 1")
            scene = turn_light(scene, 0, half_turns(right), half_turns(-down))
            truth = ray_tracer.trace(scene, SIZE, Settings()).srgb8().astype(int)
            view.until(
                lambda truth=truth: bool((np.abs(view.shown() - truth).max(axis=2) > 1).mean() < 1e-3),
                "not the reference's picture",
            )
            places.append(highlight(view.shown()))
            np.testing.assert_allclose(places[-1], highlight(truth), atol=0.5)
            assert np.hypot(*(places[-1] - places[-2])) > 5, "it has moved"
        assert places[1][0] > places[0][0] > places[2][0], "to the right and to the left, as the mouse"
        assert view.close() == ""


@pytest.mark.window
def test_wheel_and_right_button_move_light_and_camera_and_e_writes_what_render_renders(tmp_path: Path) -> None:
    scene = assignment()
    (tmp_path / "assignment-1.toml").write_text("mine")
    with window(tmp_path, "assignment", "--samples", "4") as view:
        view.act("key l click 4 click 4 keydown Shift_L click 5 keyup Shift_L")
        moved = scale_camera(scale_light(scene, 0, 1.1**-2), 1.1)
        view.until_shown(rendered(moved, samples=4), "the wheel")
        view.act("mousedown 3 mousemove_relative -- 20 10 mouseup 3")
        moved = turn_camera(moved, half_turns(20), half_turns(-10))
        picture = rendered(moved, samples=4, shading="blinn")
        view.act("key b")
        view.until_shown(picture, "the right button")
        view.act("key p key e")
        view.until(lambda: (tmp_path / "assignment-2.toml").exists() and (tmp_path / "assignment-1.png").exists(), "E")
        view.act("key Home")
        back = scale_light(scene, 0, 1.1**-2)
        view.until_shown(rendered(back, samples=4, shading="blinn"), "Home")
        said = view.close()
    with Image.open(tmp_path / "assignment-1.png") as screenshot:
        assert np.abs(np.asarray(screenshot).astype(int) - picture).max() <= 1
    assert (tmp_path / "assignment-1.toml").read_text() == "mine", "no file is written over"
    lines = said.splitlines()
    assert lines[0].startswith("wrote assignment-1.png: 320x180") or lines[1].startswith("wrote assignment-1.png: ")
    (command,) = (line.partition("its picture: ")[2] for line in lines if "assignment-2.toml" in line)
    program, *arguments = command.split()
    assert program == "raytracer"
    output_of(sys.executable, "-m", "raytracer", *arguments, cwd=tmp_path, env=view.variables)
    with Image.open(tmp_path / "assignment-2-rendered.png") as again:
        assert np.abs(np.asarray(again).astype(int) - picture).max() <= 1


@pytest.mark.window
def test_what_is_saved_is_shown_and_a_mistake_keeps_the_picture_and_names_the_line(tmp_path: Path) -> None:
    copy_checkout(tmp_path)
    file, shader, camera = (
        tmp_path / name for name in ("ball.toml", "shaders/shading/lighting.glsl", "shaders/geometry/camera.glsl")
    )
    file.write_text(BALL)
    plain = rendered(rt.load(file))
    upper = plain[: SIZE[1] // 4]  # above the message

    def saved(path: Path, old: str, new: str) -> None:
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    with window(tmp_path, file.name, "--samples", "1") as view:
        view.act("key l")
        view.until_shown(plain, "opening")

        def until_wrong(says: str) -> None:
            view.until(lambda: says in view.said(view.errors), f"the terminal does not say {says!r}")

            def shows_both() -> bool:
                # In one look: while a file is being written, a longer message of half a file may come first.
                shown = view.shown()
                return bool(np.abs(shown - plain).max() > 50 and np.abs(shown[: len(upper)] - upper).max() <= 1)

            view.until(shows_both, "the window does not show the mistake and above it the last good picture")

        line = shader.read_text().partition("m.ka * ambient")[0].count("\n") + 1
        saved(shader, "m.ka * ambient", "m.ka * ambience")
        until_wrong(f"shading/lighting.glsl:{line}: ")
        saved(shader, "m.ka * ambience", "m.kd * ambient")
        file.write_text(BALL.replace("kd = [0.5, 0.1, 0.1]", "kd = [0.5, 0.1, 0.1]\nka = [0.5, 0.1, 0.1]"))
        bright = rendered(rt.load(file))
        file.write_text(BALL)
        view.until_shown(bright, "mending and changing the shader")
        saved(shader, "m.kd * ambient", "m.ka * ambient")
        view.until_shown(plain, "changing it back")
        (tmp_path / "shaders/shading/.#lighting.glsl").symlink_to("nowhere")  # what an editor leaves for a while
        line = camera.read_text().partition("halfPixels() {")[0].count("\n") + 1
        saved(camera, "halfPixels() {", "halfPixels() { oops;")
        until_wrong(f"geometry/camera.glsl:{line}: ")
        saved(camera, "halfPixels() { oops;", "halfPixels() {")
        view.until_shown(plain, "mending the other file")

        saved(file, "radius = 2", "radius = -2")
        until_wrong("ball.toml:10: shapes.ball.sphere.radius: expected a number above 0")
        saved(file, "radius = -2", "radius = 1")
        view.until_shown(rendered(rt.load(file)), "mending the scene file")
        view.act("mousedown 1 mousemove_relative 40 0 mouseup 1")
        saved(file, "radius = 1", "radius = 2")
        turned = turn_light(rt.load(file), 0, half_turns(40), 0.0)
        view.until_shown(rendered(turned), "saving the scene: the light stays where it was moved")
        assert view.close() == ""


@pytest.mark.window
def test_a_resized_window_shows_the_picture_in_its_new_size() -> None:
    with window(CHECKOUT, "assignment", "--samples", "8", display=(640, 480)) as view:
        view.act("key l")
        for size in ((320, 180), (400, 301), (200, 480), (37, 23)):
            view.act(f"search --name assignment windowsize {size[0]} {size[1]}")
            view.until_shown(rendered(assignment(), size, samples=8), f"a resize to {size}")


@pytest.mark.window
def test_at_display_scale_2_the_window_has_twice_as_many_pixels_and_so_has_its_text() -> None:
    def table(view: Window, size: tuple[int, int]) -> int:
        """Pixels that H changes."""
        plain = rendered(assignment(), size)
        view.act("key l")
        view.until_shown(plain, "opening")
        view.act("key h")
        view.until(lambda: bool(np.abs(view.shown(size) - plain).max() > 10), "no table")
        changed = (np.abs(view.shown(size) - plain) > 1).any(axis=2)
        return int(changed.sum())

    small, large = (640, 440), (1280, 880)
    with window(CHECKOUT, "assignment", "--samples", "1", size=small, display=small) as view:
        once = table(view, small)
    with window(CHECKOUT, "assignment", "--samples", "1", size=small, display=large, scale=2) as view:
        twice = table(view, large)
    assert twice == pytest.approx(4 * once, rel=0.15)


class Opened:
    """A window of this process, and how often it has swapped its buffers."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self.swaps = 0

    def frame(self, *events: Event) -> float:
        """Handle events, and draw what is due."""
        glfw.poll_events()
        for event in events:
            self.viewer.handle(event)
        return self.viewer.frame()

    def until_idle(self) -> None:
        while (wait := self.frame()) != _LOOK:
            time.sleep(wait)

    def shown(self) -> np.ndarray:
        """(H, W, 3) int: what is on the display."""
        return shown(os.environ["DISPLAY"])

    def until_shows(self, right: Callable[[np.ndarray], bool]) -> None:
        """Wait for the display, which shows a picture a moment after the buffers were swapped."""
        deadline = time.monotonic() + TIMEOUT
        while not right(self.shown()):
            assert time.monotonic() < deadline
            time.sleep(0.02)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Opened]]:
    """Opens a window in this process, on a display of its own. While it is open, nothing can render by EGL."""
    found: list[Opened] = []

    def swap(window: object, original: Callable[..., None] = glfw.swap_buffers) -> None:
        found[0].swaps += 1
        original(window)

    # The window ends before its display, which would end this process.
    with x_server(640, 480) as display, ExitStack() as windows:
        for name, value in environment(DISPLAY=display).items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(glfw, "swap_buffers", swap)
        monkeypatch.setattr(window_module, "_TOGETHER", 0.0)
        monkeypatch.setattr(window_module, "_HINT", FOREVER)

        def open_one(
            scene: Path = ASSIGNMENT,
            size: tuple[int, int] | None = SIZE,
            samples: int = 4,
            budget: float = 1e9,
        ) -> Opened:
            viewer = window_module.opened(scene, SettingsPatch(samples=samples), size, budget)
            found.append(Opened(windows.enter_context(viewer)))
            return found[0]

        yield open_one
        errors = []
        for one in found:
            one.viewer.close()
            errors.append(one.viewer.context.error)
    assert errors == ["GL_NO_ERROR"] * len(found)


# No machine draws so fast, or waits so long.
AT_ONCE, FOREVER = 1e-9, 1e9


@pytest.mark.window
def test_a_moving_picture_has_one_sample_a_frame_with_enlarged_pixels_and_then_sharpens(
    opened: Callable[..., Opened], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    one = opened(samples=400, budget=AT_ONCE)
    live = one.viewer.picture
    one.frame(Press("left"))
    for k in range(1, 5):
        one.frame(Cursor(0.1 * k, 0.5))
        assert live.samples == 1 and live.enlarged > 1
    monkeypatch.setattr(window_module, "_STILL", 0.0)
    one.frame()
    assert live.samples == 1 and live.enlarged == 1
    for k in range(2, 5):
        one.frame()
        assert live.samples == k and live.enlarged == 1, "a sample takes longer than the budget"


@pytest.mark.window
def test_a_picture_that_may_move_again_waits_and_a_still_one_gets_as_many_samples_a_frame_as_there_is_time_for(
    opened: Callable[..., Opened], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    one = opened(samples=400, size=(16, 9), budget=FOREVER)
    live = one.viewer.picture
    one.frame(Press("left"))
    one.frame(Cursor(0.1, 0.5))
    swaps = one.swaps
    for _ in range(3):
        assert one.frame() > 1.0 and (live.samples, live.estimate(), one.swaps) == (1, None, swaps)
    one.frame(Key("H"))
    assert live.samples == 1 and one.swaps == swaps + 1, "the same picture under an overlay"
    monkeypatch.setattr(window_module, "_STILL", 0.0)
    one.frame()
    assert live.samples == 1 and not live.is_done
    one.frame()
    assert live.samples == 400 and live.estimate()


@pytest.mark.window
def test_a_picture_whose_error_cannot_be_found_has_its_samples_and_the_mistake(
    opened: Callable[..., Opened], shaders: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = shaders / "sampling/movement.frag"
    file.write_text(file.read_text().replace("vec3 moved =", "vec2 moved ="))
    one = opened(samples=8)
    for _ in range(2):
        one.until_idle()
        assert one.viewer.picture.samples == 8 and one.viewer.picture.estimate() is None
        assert "sampling/movement.frag:" in one.viewer.state.error
        assert "8 of 8 samples, phong" in glfw.get_window_title(one.viewer.window)
        one.viewer.handle(Wheel(1.0, True))
    assert capsys.readouterr().err.count("raytracer: sampling/movement.frag:") == 1


@pytest.mark.window
def test_the_title_has_the_error_and_a_still_picture_ends_with_what_was_asked_for(
    opened: Callable[..., Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "ball.toml"
    file.write_text(BALL + "[settings]\nmax_error = 0.004\nsize = [64, 36]\n")
    one = opened(scene=file, size=None, samples=1000)
    one.until_idle()
    drawn, window = one.viewer.picture, one.viewer.window
    estimate = drawn.estimate()
    assert drawn.size == (64, 36) and 4 <= drawn.samples < 1000 and estimate and estimate.reached
    assert f"{drawn.samples} of 1000 samples, error {estimate.in_words}, " in glfw.get_window_title(window)
    one.frame(Key("P"))
    one.until_idle()
    with Image.open("ball-1.png") as screenshot:
        assert screenshot.info["Error"].startswith(f"error {estimate.in_words} ")
        assert f"samples={drawn.samples}, " in screenshot.info["Description"]
    few = drawn.samples
    for settings, right in (("max_error = 0.0004", lambda n: n > few), ("sequence = 'grid'", lambda n: n > few)):
        file.write_text(f"{BALL}[settings]\n{settings}\n")
        time.sleep(0.1)
        one.viewer.look_at_files()
        one.until_idle()
        assert right(drawn.samples)
    assert f"{file}: settings.sequence: expected one of sobol, r2, random" in one.viewer.state.error
    assert capsys.readouterr().err.count(f"raytracer: {file}: settings.sequence") == 1


@pytest.mark.window
def test_nothing_is_drawn_for_a_still_picture_or_a_minimised_window(
    opened: Callable[..., Opened], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = opened()
    one.until_idle()
    assert glfw.get_window_title(one.viewer.window).startswith("assignment - ")
    title = glfw.get_window_title(one.viewer.window)
    assert "4 of 4 samples, error about 0.00" in title and title.endswith("phong, hard shadows, H for help")
    swaps = one.swaps
    for _ in range(20):
        assert one.frame() == _LOOK
    assert one.swaps == swaps
    one.frame(Key("H"))
    assert one.swaps == swaps + 1 and one.viewer.picture.samples == 4, "the same picture under an overlay"

    for name, instead in (("get_framebuffer_size", lambda _: (0, 0)), ("get_window_attrib", lambda *_: 1)):
        with monkeypatch.context() as patch:
            patch.setattr(glfw, name, instead)
            for _ in range(5):
                assert one.frame(Wheel(1.0, False)) == _LOOK
            assert one.swaps == swaps + 1
    one.until_idle()
    assert one.swaps > swaps + 1, "restored, it shows what has changed meanwhile"


@pytest.mark.window
def test_the_window_says_for_a_while_how_to_get_help_and_a_screenshot_does_not(
    opened: Callable[..., Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    picture = rendered(assignment())
    picture[: SIZE[1] // 2] = 0  # where the marker is

    def difference(shown: np.ndarray) -> int:
        return int(np.abs(shown - picture)[SIZE[1] // 2 :].max())

    one = opened(samples=1)
    one.until_idle()
    assert one.viewer.state.hint == "H: help" and difference(one.shown()) > 50
    one.viewer.handle(Key("P"))  # takes the hint back
    one.viewer.handle(Hinted("H: help"))
    one.until_idle()
    one.viewer.handle(Told(""))
    one.viewer.handle(Hinted("H: help"))
    one.until_idle()
    assert difference(one.shown()) > 50 and difference(as_written("assignment-1.png")) <= 1
    monkeypatch.setattr(window_module, "_HINT", 0.0)
    one.until_idle()
    assert one.viewer.state.hint == ""
    one.until_shows(lambda shown: difference(shown) <= 1)


@pytest.mark.window
def test_keys_in_a_row_count_all_and_only_the_last_ones_programs_are_compiled_which_the_title_says_before(
    opened: Callable[..., Opened], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_module, "_TOGETHER", FOREVER)
    pictures = rendered(assignment(), samples=4), rendered(assignment(), samples=4, shading="minnaert")
    half = slice(SIZE[1] // 3, 2 * SIZE[1] // 3)  # without marker and text
    one = opened(samples=4)
    programs = one.viewer.picture._device._programs
    one.viewer.handle(Key("L"))
    one.until_idle()
    compiled = len(programs)
    title = lambda: glfw.get_window_title(one.viewer.window)  # noqa: E731
    assert title().startswith("assignment - ") and "phong, hard shadows" in title()
    for model in ("blinn", "lambert", "minnaert"):
        one.frame(Key("B"))
        assert title() == f"assignment - compiling {model}, hard shadows ..., H for help"
        one.until_shows(lambda shown: np.abs(shown - pictures[0])[half].max() <= 1)
        assert np.abs(one.shown() - pictures[0]).max() > 50, "over the last picture it says so, too"
    assert len(programs) == compiled
    monkeypatch.setattr(window_module, "_TOGETHER", 0.0)
    one.until_idle()
    once = len(programs) - compiled
    assert "minnaert, hard shadows" in title() and "compiling" not in title()
    one.until_shows(lambda shown: np.abs(shown - pictures[1]).max() <= 1)
    monkeypatch.setattr(window_module, "_TOGETHER", FOREVER)
    one.frame(Key("V"))
    assert "compiling lambert, " in title()
    one.frame(Key("B"))
    one.until_idle()
    assert "4 of 4 samples" in title() and "minnaert, hard shadows" in title(), "back at what is compiled it is at once"
    assert once > 0 and len(programs) == compiled + once


def as_written(name: str) -> np.ndarray:
    with Image.open(name) as picture:
        return np.asarray(picture).astype(int)


@pytest.mark.window
def test_a_screenshot_has_all_samples_or_those_there_were_when_the_picture_changed(
    opened: Callable[..., Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    pictures = rendered(assignment(), samples=4), rendered(assignment(), samples=2, shadows="diluted")
    one = opened(samples=4)
    one.frame()
    one.frame(Key("P"))
    assert "4 samples" in one.viewer.state.notice and list(tmp_path.iterdir()) == []
    monkeypatch.setattr(window_module, "_STILL", 0.0)
    one.until_idle()
    monkeypatch.setattr(one.viewer, "_budget", 0.0)  # a sample a frame
    for key in ("S", "", ""):  # a new picture, still, and its second sample
        one.frame(Key(key))
    one.viewer.handle(Key("P"))
    one.frame(Key("N"))  # and another before it had all its samples
    for key in ("", "", "P"):
        one.frame(Key(key))
    one.viewer.close()
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["assignment-1.png", "assignment-2.png", "assignment-3.png"]
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(", ")[2] for line in lines] == [f"{k} of 4 samples" for k in (4, 2, 3)]
    for name, picture in zip(names[:2], pictures, strict=True):
        assert np.abs(as_written(name) - picture).max() <= 1
    with Image.open(names[2]) as screenshot:
        assert "showing normal" in screenshot.info["Description"]


@pytest.mark.window
@pytest.mark.parametrize(("samples", "budget"), [(4, FOREVER), (4, AT_ONCE), (1, FOREVER), (1, AT_ONCE)])
def test_a_screenshot_of_a_picture_with_one_sample_is_what_render_renders(
    opened: Callable[..., Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, samples: int, budget: float
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    pictures = rendered(assignment()), rendered(turn_light(assignment(), 0, half_turns(0.1 * SIZE[1]), 0.0))
    one = opened(samples=samples, budget=budget)
    live = one.viewer.picture
    one.frame(Cursor(0.0, 0.5), Press("left"))
    one.frame(Wheel(1.0, True))
    one.frame(Wheel(-1.0, True))
    assert (live.enlarged > 1) == (budget == AT_ONCE)
    one.viewer.handle(Key("P"))
    one.frame(Cursor(0.1, 0.5))
    assert live.samples == 1 and (live.enlarged > 1) == (budget == AT_ONCE)
    if samples > 1:  # a still picture's first
        monkeypatch.setattr(window_module, "_STILL", 0.0)
        one.frame(Key("P"))
        assert live.samples == 1 and live.enlarged == 1
    else:
        one.viewer.handle(Key("P"))
    one.viewer.close()
    for k, picture in enumerate(pictures):
        with Image.open(f"assignment-{k + 1}.png") as screenshot:
            assert "320x180, Settings(samples=1, " in screenshot.info["Description"]
        assert np.abs(as_written(f"assignment-{k + 1}.png") - picture).max() <= 1


@pytest.mark.window
def test_a_screenshot_is_of_what_a_file_held_before_it_was_saved(
    opened: Callable[..., Opened], shaders: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(window_module, "_STILL", FOREVER)
    picture = rendered(assignment())
    one = opened()
    one.frame()
    file = shaders / "shading/lighting.glsl"
    file.write_text(file.read_text().replace("m.ka * ambient", "oops"))
    one.viewer.handle(Key("P"))
    time.sleep(0.1)
    one.viewer.look_at_files()
    one.frame()
    assert "shading/lighting.glsl:" in one.viewer.state.error
    assert np.abs(as_written("assignment-1.png") - picture).max() <= 1


@pytest.mark.window
def test_what_this_driver_cannot_draw_is_taken_back_and_names_the_file(
    opened: Callable[..., Opened], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(BALL.replace("h = 100", "h = 3e5"))
    one = opened(scene=file)
    one.until_idle()
    one.frame(Key("B"))  # 4 h is too much
    assert one.viewer.state.settings.shading is None and f"{file}: shading: expected" in one.viewer.state.notice
    one.until_idle()
    file.write_text(BALL + "[[lights]]\nposition = [1, 2, 3]\n" * 5000)
    time.sleep(0.1)
    one.viewer.look_at_files()
    one.frame()
    assert f"{file}: expected at most" in one.viewer.state.error and len(one.viewer.state.scene.lights) == 1
    file.write_text(BALL)
    time.sleep(0.1)
    one.viewer.look_at_files()
    one.until_idle()
    assert one.viewer.state.error == "" and one.viewer.state.scene == rt.load(file)
    assert capsys.readouterr().err.count(f"raytracer: {file}: ") == 2


@pytest.mark.window
def test_what_is_written_is_told_in_the_window_also_where_standard_output_is_full(
    opened: Callable[..., Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    one = opened()

    class Full(io.StringIO):
        def write(self, _: str) -> int:
            raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", Full())
        one.frame(Key("E"))
    assert one.viewer.state.notice.startswith("wrote assignment-1.toml") and (tmp_path / "assignment-1.toml").exists()


@pytest.mark.window
def test_a_file_that_is_saved_as_the_window_opens_is_shown_as_it_was_saved(
    opened: Callable[..., Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(BALL)

    def save(path: Path) -> Files:
        file.write_text(BALL.replace("radius = 2", "radius = 1"))
        return Files(path)

    monkeypatch.setattr(window_module, "Files", save)
    assert opened(scene=file).viewer.state.scene == rt.load(file)


@pytest.mark.slow
@pytest.mark.window
def test_two_thousand_frames_with_toggles_and_resizes_leave_nothing_behind(opened: Callable[..., Opened]) -> None:
    one = opened(size=(96, 54), budget=0.033)
    kinds = ("Buffer", "Texture", "Framebuffer", "VertexArray", "Program", "Shader")
    prototype = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)
    exist = [prototype(glfw.get_proc_address(f"glIs{kind}")) for kind in kinds]  # pyright: ignore

    def objects() -> list[int]:
        return [sum(is_one(name) for name in range(1, 100_000)) for is_one in exist]

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    keys = "BSSSANZMHLABNZMHLB"
    left, memory = [], 0
    one.viewer.handle(Press("left"))
    for k in range(2000):
        one.frame(
            Cursor(0.01 * k, 0.5),
            Wheel(1.0 if k % 2 else -1.0, k % 4 < 2),
            Told(f"frame {k}"),
            Key(keys[k % len(keys)]),
        )
        if k % 10 == 0:
            glfw.set_window_size(one.viewer.window, 96 + k % 7, 54 + k % 5)
            one.viewer.picture.reread()
        one.frame()
        if k == 199:
            left, memory = objects(), resident()
    assert objects() == left
    assert resident() - memory < 4 * 2**20


@pytest.mark.skipif(sys.platform != "linux", reason="a display is always there")
def test_without_a_display_the_message_is_plain_and_names_render() -> None:
    command = (sys.executable, "-m", "raytracer", "view", str(ASSIGNMENT))
    done = finished(*command, cwd=CHECKOUT, env=environment())
    assert done.returncode == 1
    assert done.stderr.startswith("raytracer: no window opens on this machine: ")
    assert "`raytracer render" in done.stderr
    assert "Traceback" not in done.stderr and "b'" not in done.stderr
