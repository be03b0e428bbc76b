"""Waiting times of users that `make bench` does not measure, each against its floor.

python -m benchmarks.waiting [--rounds N]

The floor of the window's first frame is a process that opens a window and shows one colour. The floor of a frame is its
replayed draws and the swap. The floor of a picture with soft shadows is its draws and the read-back.
"""

import argparse
import csv
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial

import raytracer as rt
from benchmarks.bare import BareDraws
from benchmarks.bench import in_turns, seconds
from benchmarks.frames import SCENES, SIZE
from benchmarks.speed_rows import process_seconds
from raytracer.gpu.device import shared_device
from tests.displays import x_server
from tests.processes import run_for_output

_SOFT_SIZE = (640, 360)
_FIRST_FRAME = """
import sys
from raytracer.app.viewer.window import open_viewer
from raytracer.scene.settings_patch import EMPTY_PATCH
with open_viewer(sys.argv[1], EMPTY_PATCH, (1280, 720), budget=0.033) as viewer:
    viewer.frame()
"""
_BARE_WINDOW = """
import numpy, glfw, moderngl
glfw.init()
glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
window = glfw.create_window(1280, 720, "bare", None, None)
glfw.make_context_current(window)
context = moderngl.create_context()
context.screen.clear(0.5, 0.7, 0.9)
glfw.swap_buffers(window)
"""
# The name of a waiting time, its seconds, and the seconds of its floor.
Row = tuple[str, float, float]


def first_frames(rounds: int) -> Iterator[Row]:
    """Time processes that end after the window's first frame. Mesa has the compiled programs on disk."""
    for name in SCENES:
        first: Callable[[], float] = partial(process_seconds, "-c", _FIRST_FRAME, name, variables={})
        bare: Callable[[], float] = partial(process_seconds, "-c", _BARE_WINDOW, variables={})
        yield f"window's first frame, {name}", *in_turns(rounds, first, bare)


def moving_frames() -> Iterator[Row]:
    """Time frames of the window while the light or the camera moves."""
    text = run_for_output(sys.executable, "-m", "benchmarks.frames", "--csv")
    for row in csv.DictReader(text.splitlines()):
        yield f"frame while the {row['movement']} moves, {row['scene']}", float(row["whole"]), float(row["draws"])


def soft_shadows() -> Iterator[Row]:
    """Time a picture with soft shadows and the quality `normal`."""
    scene, settings = rt.load("materials"), rt.quality("normal").replace(shadows="soft")
    with closing(BareDraws(shared_device(), scene, settings, _SOFT_SIZE)) as bare:
        call = partial(rt.render, scene, _SOFT_SIZE, settings)
        yield "materials, soft shadows, quality normal, 640x360", seconds(call), seconds(bare.draw_and_read)


@contextmanager
def display() -> Iterator[None]:
    """Provide a display for the windows of processes that the block starts."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        yield
        return
    with x_server(*SIZE) as name:
        os.environ["DISPLAY"] = name
        try:
            yield
        finally:
            del os.environ["DISPLAY"]


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", metavar="N", type=int, default=3)
    options = parser.parse_args()
    print("| wait | ms | floor, ms | ratio |\n|---|---|---|---|", flush=True)
    with display():
        for rows in (first_frames(options.rounds), moving_frames(), soft_shadows()):
            for name, ours, floor in rows:
                print(f"| {name} | {1000 * ours:.0f} | {1000 * floor:.0f} | {ours / floor:.2f} |", flush=True)


if __name__ == "__main__":
    main()
