"""Frame times of the window while its light moves, against the bare shader passes and the swap.

python -m benchmarks.frames [SCENE]

Opens a window of 1280x720 on the display that there is, or on an Xvfb of its own. Both are measured
in one run in turns, at one sample a frame and full resolution.
"""

import os
import platform
import sys
import time
from collections.abc import Callable
from statistics import median, quantiles

import glfw

from raytracer.app.viewer.events import Cursor, Press
from raytracer.app.viewer.window import Viewer, opened
from raytracer.scene.settings_patch import EMPTY
from tests.displays import environment, x_server
from tests.processes import running

SIZE = (1280, 720)
ROUNDS, FRAMES = 10, 30


def milliseconds(act: Callable[[], None]) -> float:
    begin = time.perf_counter()
    act()
    return 1000.0 * (time.perf_counter() - begin)


def measure_frames(viewer: Viewer) -> None:
    glfw.swap_interval(0)
    while viewer.frame() > 0.0:
        glfw.poll_events()
    viewer.handle(Press("left"))
    x = 0.0

    def moved() -> None:
        nonlocal x
        glfw.poll_events()
        x += 0.002
        viewer.handle(Cursor(x, 0.5))
        viewer.frame()

    def bare() -> None:
        viewer.picture.step()
        glfw.swap_buffers(viewer.window)

    for act in (moved, bare) * 5:
        act()
    frames, passes = [], []
    for _ in range(ROUNDS):
        frames += [milliseconds(moved) for _ in range(FRAMES)]
        passes += [milliseconds(bare) for _ in range(FRAMES)]
    info = viewer.context.info
    print(f"{info['GL_RENDERER']}, {info['GL_VERSION']}, {platform.machine()}, {os.cpu_count()} cores")
    print(f"{viewer.state.scene.name}, {SIZE[0]}x{SIZE[1]}, {ROUNDS * FRAMES} frames each, milliseconds\n")
    print("| | median | 99th percentile |\n|---|---|---|")
    for label, times in (("frame while the light moves", frames), ("bare passes and swap", passes)):
        print(f"| {label} | {median(times):.1f} | {quantiles(times, n=100)[-1]:.1f} |")
    print(f"\nratio of the medians: {median(frames) / median(passes):.2f}")


def main() -> None:
    """Measure and print, where there is a display; or else again where there is one."""
    name = sys.argv[1] if len(sys.argv) > 1 else "assignment"
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        with opened(name, EMPTY, SIZE, budget=1e9) as viewer:
            measure_frames(viewer)
        return
    with x_server(*SIZE) as display:
        command = (sys.executable, "-m", "benchmarks.frames", name)
        with running(*command, env=environment(DISPLAY=display)) as process:
            sys.exit(process.wait())


if __name__ == "__main__":
    main()
