"""Frame times of the window while the light or the camera moves, against the bare draws of the same frame.

python -m benchmarks.frames [SCENE ...] [--csv]

The windows open at 1280x720 on the current display, or without a display on an Xvfb that the benchmark starts. All
times of a scene are measured in turns within one run, at one sample a frame and full resolution. A whole frame lasts
from a movement of the mouse to the picture on the display. Replayed draws leave out the preparation of the draws. Bare
passes leave out the draws of the canvas as well: the window is only cleared.
"""

import argparse
import csv
import os
import platform
import sys
from statistics import median
from typing import NamedTuple

import glfw

from benchmarks.bare import recorded
from benchmarks.bench import seconds
from raytracer.app.viewer.events import Button, Cursor, Press, Release
from raytracer.app.viewer.window import Viewer, open_viewer
from raytracer.scene.settings_patch import SettingsPatch
from tests.displays import environment, x_server
from tests.processes import running_process

SIZE = (1280, 720)
SCENES = "assignment", "many", "materials"
MOVEMENTS: dict[str, Button] = {"light": "left", "camera": "right"}
ROUNDS, FRAMES = 10, 5
# More than one, as users have: a moving picture then gets one sample, and a picture at rest starts anew.
SAMPLES = 2
# The movement of the mouse from frame to frame, in heights of the window.
_STEP = 0.002


class FrameTimes(NamedTuple):
    """Median seconds of a scene's frames while the light or the camera moves."""

    scene: str
    movement: str
    whole: float
    draws: float
    passes: float


def measure_frames(viewer: Viewer, movement: str) -> FrameTimes:
    """Measure the frames of a window during a movement. Vertical synchronisation must be off."""
    x = 0.0

    def move() -> None:
        nonlocal x
        x += _STEP
        glfw.poll_events()
        viewer.handle(Cursor(x, 0.5))
        viewer.frame()

    def play_again(*, whole: bool) -> None:
        if not whole:  # so that the swap has a picture to show
            viewer.context.screen.clear()
        for call in calls:
            if whole or not call.is_for_screen:
                call.again()
        glfw.swap_buffers(viewer.window)

    viewer.handle(Press(MOVEMENTS[movement]))
    move()
    with recorded() as calls:
        move()
    acts = move, lambda: play_again(whole=True), lambda: play_again(whole=False)
    times: list[list[float]] = [[], [], []]
    for k in range(ROUNDS + 1):
        for act, taken in zip(acts, times, strict=True):
            measured = [seconds(act) for _ in range(FRAMES)]
            if k:  # the first round compiles, and does not count
                taken += measured
    viewer.handle(Release(MOVEMENTS[movement]))
    return FrameTimes(viewer.state.scene.name, movement, *map(median, times))


def measure_scene(name: str) -> list[FrameTimes]:
    """Measure the frames of a scene while the light moves, and while the camera moves."""
    with open_viewer(name, SettingsPatch(samples=SAMPLES), SIZE, budget=1e9) as viewer:
        glfw.swap_interval(0)
        viewer.frame()
        return [measure_frames(viewer, movement) for movement in MOVEMENTS]


def main() -> None:
    """Measure, and print the table. Without a display, run this program again on an Xvfb."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", metavar="SCENE", nargs="*", default=SCENES)
    parser.add_argument("--csv", action="store_true", help="print the seconds as CSV, for another program")
    options = parser.parse_args()
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        with x_server(*SIZE) as display:
            command = (sys.executable, "-m", "benchmarks.frames", *sys.argv[1:])
            with running_process(*command, env=environment(DISPLAY=display)) as process:
                sys.exit(process.wait())
    rows = [row for name in options.scenes for row in measure_scene(name)]
    if options.csv:
        csv.writer(sys.stdout).writerows([FrameTimes._fields, *rows])
        return
    print(f"{platform.machine()}, {os.cpu_count()} cores, {SIZE[0]}x{SIZE[1]}, medians of {ROUNDS * FRAMES} frames\n")
    print("| scene | moves | whole frame, ms | draws again and swap, ms | ratio | bare passes and swap, ms | ratio |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        whole, draws, passes = (1000.0 * value for value in row[2:])
        print(
            f"| {row.scene} | {row.movement} | {whole:.1f} | {draws:.1f} | {whole / draws:.2f} "
            f"| {passes:.1f} | {whole / passes:.2f} |"
        )


if __name__ == "__main__":
    main()
