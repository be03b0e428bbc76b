"""Times to prepare a frame of a scene with many primitives, with many lights and with one light.

python -m benchmarks.light_frames [PRIMITIVES [LIGHTS]]

The lights lie on one of the primitives, the floor. The benchmark measures compile() and make_frame(), which a window
calls for each frame and which need no OpenGL. In the first frame of a scene everything is prepared ("all").
"""

import sys
import time

import msgspec
import numpy as np

import raytracer as rt
from benchmarks.scenes import GREY, RED
from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.limits import DriverLimits

SIZE = (1280, 720)
ROUNDS = 9
LIMITS = DriverLimits("none", 450, 2**14, 128, 2**16, 2**27, 2**11)


def crowd(primitives: int, lights: int) -> rt.Scene:
    """Return a scene of small spheres above a floor, with lights on the floor."""
    rng = np.random.default_rng(1)
    spheres = rt.Instances(rt.Sphere((0, 0, 0), 0.02, RED), rng.uniform((-9, 0.1, -9), (9, 6, 9), (primitives - 1, 3)))
    places = rng.uniform((-9, 0, -9), (9, 0, 9), (lights, 3)).tolist()
    camera = rt.Camera((0, 3, 14), (0, 2, 0))
    return rt.Scene([spheres, rt.Plane((0, 1, 0), 0, GREY)], [rt.PointLight(tuple(p)) for p in places], camera)


def change_scene(scene: rt.Scene, change: str, k: int) -> rt.Scene:
    """Return the scene of frame k, in which the named part differs from the other frames."""
    first, *others = scene.lights
    if change == "a light's color":
        first = msgspec.structs.replace(first, color=(0.5, 0.5, 1.0 / (2 + k)))
    elif change == "a light's place":
        first = msgspec.structs.replace(first, position=(0.01 * k, 0.0, 3.0))
    elif change == "the camera's place":
        camera = rt.Camera((0.01 * (k + 1), 3, 14), (0, 2, 0))
        return msgspec.structs.replace(scene, camera=camera)
    return msgspec.structs.replace(scene, lights=[first, *others])


class Frames:
    """Successive frames of crowd(), with a constant number of lights."""

    def __init__(self, primitives: int, lights: int, settings: rt.Settings) -> None:
        self._primitives, self._lights, self._settings = primitives, lights, settings
        self._scene = crowd(primitives, lights)
        self._frame: Frame | None = None

    def milliseconds(self, change: str, k: int) -> float:
        """Return the time to prepare frame k after one change. The change "all" starts a new scene."""
        if change == "all":
            self._scene, self._frame = crowd(self._primitives, self._lights), None
        scene, before = change_scene(self._scene, change, k), self._frame
        begin = time.perf_counter()
        compiled = compile(scene, self._settings.compile_options, before.compiled if before else None)
        self._frame = make_frame(compiled, SIZE, LIMITS, before)
        return 1000.0 * (time.perf_counter() - begin)


def main() -> None:
    """Measure, and print the table."""
    primitives, lights = (int(argument) for argument in (*sys.argv[1:], *("20001", "20")[len(sys.argv) - 1 :]))
    print(f"{primitives} primitives, 1 and {lights} lights on one of them, {SIZE[0]}x{SIZE[1]}, ms a frame\n")
    print(f"| changed | shadows | 1 light | {lights} lights | times |\n|---|---|---|---|---|")
    for shadows in ("off", "hard"):
        both = [Frames(primitives, count, rt.Settings(shadows=shadows)) for count in (1, lights)]
        for change in ("all", "nothing", "a light's color", "a light's place", "the camera's place"):
            # In turns, so that other work on the machine slows down both. The first round does not count.
            times = np.array([[frames.milliseconds(change, k) for frames in both] for k in range(ROUNDS + 1)])
            one, many = np.median(times[1:], axis=0)
            print(f"| {change} | {shadows} | {one:.2f} | {many:.2f} | {many / one:.2f} |", flush=True)


if __name__ == "__main__":
    main()
