"""The window on an X server of its own, with a synthetic mouse and keys: what it shows, and how it ends."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
import pytest
from PIL import Image, ImageGrab

import raytracer as rt
from raytracer import reference
from raytracer.settings import Settings
from raytracer.turntable import scale_camera, scale_light, turn_camera, turn_light

from .displays import environment, x_server
from .scenes import ASSIGNMENT, CHECKOUT, assignment

SIZE = (320, 180)
# For what takes a few seconds on two slow cores.
TIMEOUT = 120.0

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


class Window:
    """`raytracer view` in `folder`, without a marker: its pictures, and what a user does to it."""

    def __init__(self, display: str, folder: Path, *arguments: str) -> None:
        self.display = display
        self.variables = environment(DISPLAY=display, PYTHONPATH=str(CHECKOUT))
        # Not pipes: who reads those would have to read both at all times. window() closes the files.
        self.output, self.errors = tempfile.TemporaryFile("w+"), tempfile.TemporaryFile("w+")  # noqa: SIM115
        command = (sys.executable, "-m", "raytracer", "view", *arguments)
        self.process = subprocess.Popen(command, cwd=folder, env=self.variables, stdout=self.output, stderr=self.errors)

    def act(self, actions: str) -> None:
        """Do what xdotool does for these words."""
        subprocess.run(("xdotool", *actions.split()), env=self.variables, check=True)

    def shown(self, size: tuple[int, int] = SIZE) -> np.ndarray:
        """(H, W, 3) int: the upper left part of the display."""
        picture = ImageGrab.grab((0, 0, *size), xdisplay=self.display)
        return np.asarray(picture.convert("RGB")).astype(int)

    def until(self, what: Callable[[], bool], says: str, seconds: float = TIMEOUT) -> float:
        """Wait until something holds; the seconds that it took."""
        begin = time.monotonic()
        while not what():
            assert self.process.poll() is None, self.said(self.errors)
            assert time.monotonic() < begin + seconds, f"{says}\n{self.said(self.errors)}"
            time.sleep(0.02)
        return time.monotonic() - begin

    def until_shown(self, wanted: np.ndarray, after: str) -> None:
        """Wait for a picture, to 1/255 at every pixel."""
        size = wanted.shape[1], wanted.shape[0]
        self.until(lambda: bool(np.abs(self.shown(size) - wanted).max() <= 1), f"not the picture due after {after}")

    def said(self, file: IO[str]) -> str:
        """What the process has written so far."""
        file.seek(0)
        return file.read()

    def close(self) -> str:
        """Press Escape; standard output."""
        self.act("key Escape")
        assert self.process.wait(TIMEOUT) == 0, self.said(self.errors)
        return self.said(self.output)


@contextmanager
def window(
    folder: Path, *arguments: str, size: tuple[int, int] = SIZE, display: tuple[int, int] = SIZE, scale: int = 1
) -> Iterator[Window]:
    """A window on a display of its own, with the mouse in its middle. Without a window manager it is at (0, 0)."""
    with x_server(*display, scale) as name:
        opened = Window(name, folder, *arguments, "--size", f"{size[0]}x{size[1]}")
        try:
            opened.until(lambda: opened.shown(display).max() > 0, "nothing is shown")
            opened.act(f"mousemove {display[0] // 2} {display[1] // 2}")
            yield opened
        finally:
            opened.process.kill()
            opened.process.wait()
            opened.output.close()
            opened.errors.close()


def rendered(scene: rt.Scene, size: tuple[int, int] = SIZE, samples: int = 1, **settings: object) -> np.ndarray:
    return rt.render(scene, size, samples=samples, geometry=False, **settings).srgb8().astype(int)  # pyright: ignore[reportArgumentType]


def half_turns(pixels: float) -> float:
    """The angle of a drag."""
    return math.pi * pixels / SIZE[1]


@pytest.mark.window
def test_each_key_changes_the_picture_as_render_does_and_brings_it_back() -> None:
    scene = assignment()
    plain = rendered(scene, samples=16)
    with window(CHECKOUT, str(ASSIGNMENT), "--samples", "16") as view:
        view.act("key l")
        view.until_shown(plain, "hiding the marker: as many samples as render takes")
        for key, others in (
            ("b", [rendered(scene, samples=16, shading="blinn")]),
            ("s", [rendered(scene, samples=16, shadows=shadows) for shadows in ("diluted", "off")]),
            ("a", [rendered(scene), rendered(scene, samples=4)]),
        ):
            for k, other in enumerate(others):
                assert np.abs(other - plain).max() > 5, f"{key} would be seen in no picture"
                view.act(f"key {key}")
                view.until_shown(other, f"{key}, pressed {k + 1} times")
            view.act(f"key {key}")
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
            truth = reference.render(scene, SIZE, Settings()).srgb8().astype(int)
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
    (command,) = (line.partition("as shown: ")[2] for line in lines if "assignment-2.toml" in line)
    program, *arguments = command.split()
    assert program == "raytracer"
    subprocess.run((sys.executable, "-m", "raytracer", *arguments), cwd=tmp_path, env=view.variables, check=True)
    with Image.open(tmp_path / "assignment-2.png") as again:
        assert np.abs(np.asarray(again).astype(int) - picture).max() <= 1


@pytest.mark.window
def test_what_is_saved_is_shown_and_a_mistake_keeps_the_picture_and_names_the_line(tmp_path: Path) -> None:
    for folder in ("raytracer", "shaders", "assets/scenes"):
        shutil.copytree(CHECKOUT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    file, shader = tmp_path / "ball.toml", tmp_path / "shaders" / "shade.frag"
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
            view.until(lambda: bool(np.abs(view.shown() - plain).max() > 50), "the window does not show the mistake")
            assert np.abs(view.shown()[: len(upper)] - upper).max() <= 1, "the last good picture"

        saved(shader, "m.ka * ambient", "m.ka * ambience")
        until_wrong("shade.frag:23: ")
        saved(shader, "m.ka * ambience", "m.kd * ambient")
        file.write_text(BALL.replace("kd = [0.5, 0.1, 0.1]", "kd = [0.5, 0.1, 0.1]\nka = [0.5, 0.1, 0.1]"))
        bright = rendered(rt.load(file))
        file.write_text(BALL)
        view.until_shown(bright, "mending and changing the shader")
        saved(shader, "m.kd * ambient", "m.ka * ambient")
        view.until_shown(plain, "changing it back")

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
def test_a_resized_window_shows_the_picture_in_its_new_size_and_a_still_one_takes_no_time() -> None:
    with window(CHECKOUT, "assignment", "--samples", "8", display=(640, 480)) as view:
        view.act("key l")
        for size in ((320, 180), (400, 301), (200, 480), (37, 23)):
            view.act(f"search --name assignment windowsize {size[0]} {size[1]}")
            view.until_shown(rendered(assignment(), size, samples=8), f"a resize to {size}")
        time.sleep(1.0)

        def seconds() -> float:
            fields = Path(f"/proc/{view.process.pid}/stat").read_text().rpartition(")")[2].split()
            return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

        begin = seconds()
        time.sleep(3.0)
        assert seconds() - begin < 0.6, "a fifth of a core, for a picture that is still"
        assert view.process.poll() is None


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


@pytest.mark.window
def test_two_thousand_frames_with_toggles_and_resizes_leave_nothing_behind() -> None:
    script = """
import ctypes, glfw, os
from raytracer.context import open_window
from raytracer.interaction import Cursor, Key, Press, Told, Wheel, start
from raytracer.scene_file import parse, read
from raytracer.settings import Settings
from raytracer.viewer import Viewer

path, text = read("assignment")
context, window = open_window((96, 54), "leaks")
viewer = Viewer(context, window, path, start(text, parse(path, text), Settings(samples=4)), 0.033)
kinds = ("Buffer", "Texture", "Framebuffer", "VertexArray", "Program", "Shader")
exist = [ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(glfw.get_proc_address("glIs" + kind)) for kind in kinds]

def left():
    return [sum(is_one(name) for name in range(1, 100_000)) for is_one in exist]

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

keys = "BSSSANZMHLABNZMHLB"
viewer.handle(Press("left"))
for k in range(2000):
    viewer.handle(Cursor(0.01 * k, 0.5))
    viewer.handle(Wheel(1.0 if k % 2 else -1.0, k % 4 < 2))
    viewer.handle(Told(f"frame {k}"))
    viewer.handle(Key(keys[k % len(keys)]))
    if k % 10 == 0:
        glfw.set_window_size(window, 96 + k % 7, 54 + k % 5)
        viewer.live.reread()
    for _ in range(2):
        glfw.poll_events()
        viewer.frame()
    if k == 199:
        objects, memory = left(), resident()
assert left() == objects, (objects, left())
assert resident() - memory < 4 * 2**20, (resident() - memory) / 2**20
assert context.error == "GL_NO_ERROR"
context.release()
"""
    with x_server(640, 480) as display:
        done = subprocess.run(
            (sys.executable, "-c", script),
            env=environment(DISPLAY=display), cwd=CHECKOUT, capture_output=True, text=True,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="a display is always there")
def test_without_a_display_the_message_is_plain_and_names_render() -> None:
    command = (sys.executable, "-m", "raytracer", "view", str(ASSIGNMENT))
    done = subprocess.run(command, cwd=CHECKOUT, env=environment(), capture_output=True, text=True, timeout=TIMEOUT)
    assert done.returncode == 1
    assert done.stderr.startswith("raytracer: there is no window here: ")
    assert "`raytracer render" in done.stderr
    assert "Traceback" not in done.stderr and "b'" not in done.stderr
