"""Milliseconds on the processor for the numbers of a frame, with many primitives and many lights on one of them.

python -m benchmarks.light_frames [PRIMITIVES [LIGHTS]]

No OpenGL is needed: a window calls compile() and make_frame() for each frame, and these are measured.
"""

import sys
import time
from statistics import median

import msgspec
import numpy as np

import raytracer as rt
from benchmarks.scenes import GREY, RED
from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.limits import DriverLimits

SIZE = (1280, 720)
ROUNDS = 5
LIMITS = DriverLimits("none", 450, 2**14, 128, 2**16, 2**27, 2**11)


def crowd(primitives: int, lights: int) -> rt.Scene:
    """Small spheres above a floor, and lights on the floor."""
    rng = np.random.default_rng(1)
    spheres = rt.Instances(rt.Sphere((0, 0, 0), 0.02, RED), rng.uniform((-9, 0.1, -9), (9, 6, 9), (primitives - 1, 3)))
    places = rng.uniform((-9, 0, -9), (9, 0, 9), (lights, 3)).tolist()
    camera = rt.Camera((0, 3, 14), (0, 2, 0))
    return rt.Scene([spheres, rt.Plane((0, 1, 0), 0, GREY)], [rt.PointLight(tuple(p)) for p in places], camera)


def changed(scene: rt.Scene, change: str, k: int) -> rt.Scene:
    """The scene of frame k."""
    first, *others = scene.lights
    if change == "a light's color":
        first = msgspec.structs.replace(first, color=(0.5, 0.5, 1.0 / (2 + k)))
    elif change == "a light's place":
        first = msgspec.structs.replace(first, position=(0.01 * k, 0.0, 3.0))
    elif change == "the camera's place":
        camera = rt.Camera((0.01 * (k + 1), 3, 14), (0, 2, 0))
        return msgspec.structs.replace(scene, camera=camera)
    return msgspec.structs.replace(scene, lights=[first, *others])


def milliseconds(scene: rt.Scene, settings: rt.Settings, change: str) -> float:
    """The median for a frame after the first."""
    frame: Frame | None = None
    taken = []
    for k in range(ROUNDS + 1):
        new = changed(scene, change, k)
        begin = time.perf_counter()
        compiled = compile(new, settings.compile_options, frame.compiled if frame else None)
        frame = make_frame(compiled, SIZE, LIMITS, frame)
        taken.append(1000.0 * (time.perf_counter() - begin))
    return taken[0] if change == "all" else median(taken[1:])


def main() -> None:
    primitives, lights = (int(argument) for argument in (*sys.argv[1:], *("20001", "20")[len(sys.argv) - 1 :]))
    scene = crowd(primitives, lights)
    print(f"{primitives} primitives, {lights} lights on one of them, {SIZE[0]}x{SIZE[1]}, ms a frame\n")
    print("| changed | no shadows | hard shadows |\n|---|---|---|")
    for change in ("all", "nothing", "a light's color", "a light's place", "the camera's place"):
        times = (milliseconds(scene, rt.Settings(shadows=shadows), change) for shadows in ("off", "hard"))
        print(f"| {change} | " + " | ".join(f"{time:.2f}" for time in times) + " |")


if __name__ == "__main__":
    main()
