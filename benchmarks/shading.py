"""What shading costs: each model against Phong, and soft shadows against hard ones.

python -m benchmarks.shading [--rounds N] [-o FOLDER]
"""

import argparse
import time
from pathlib import Path
from statistics import median

import msgspec
from rich.progress import track

import raytracer as rt
from benchmarks.bench import FRAMES, Bench
from benchmarks.pages import machine_lines
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.models import SHADINGS
from raytracer.scene.settings import Settings

SIZE = (1280, 720)
# Most that a GGX material may cost, of Phong.
ASKED = 1.25


def _round_light(scene: rt.Scene) -> rt.Scene:
    lights = [msgspec.structs.replace(light, radius=0.5) for light in scene.lights]
    return msgspec.structs.replace(scene, lights=lights)


def costs(bench: Bench, scene: rt.Scene) -> dict[str, float]:
    """Of each model, and of soft shadows: how many times the time of Phong's frames, drawn in turns, a frame takes."""
    what = {model: (scene, Settings(shading=model)) for model in SHADINGS}
    what["phong, soft shadows"] = _round_light(scene), Settings(shading="phong", shadows="soft")
    phong = what.pop("phong")
    ratios = {}
    for name, case in track(what.items(), "models"):
        times: tuple[list[float], list[float]] = [], []
        for each in (case, phong):
            bench.frame(*each)  # compiles
        for _ in range(bench.rounds):
            for k, each in enumerate((case, phong)):
                times[k].extend(bench.frame(*each) for _ in range(FRAMES))
        ratios[name] = median(times[0]) / median(times[1])
    return ratios


def main() -> None:
    """Measure, print and write shading.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    bench = Bench(Renderer(shared_device()), SIZE, options.rounds)
    start = time.perf_counter()
    with bench.context:
        ratios = costs(bench, rt.load("assignment"))
    lines = [
        "# What shading costs",
        "",
        "Written by `python -m benchmarks.shading`: frames of the assignment at 1280x720, 1 sample, hard shadows, all",
        f"materials made the model's (`--shading`); each in turns with Phong, medians of {FRAMES * bench.rounds}.",
        "",
        machine_lines(bench),
        "",
        "| shading | times Phong's |",
        "|---|---|",
        *(f"| {name} | {ratio:.2f} |" for name, ratio in ratios.items()),
        "",
        f"Asked: `ggx` at most {ASKED}: {'kept' if ratios['ggx'] <= ASKED else 'not kept'}.",
    ]
    text = "\n".join(lines) + "\n"
    print(text)
    (options.output / "shading.md").write_text(text)
    print(f"wrote {options.output / 'shading.md'} in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
