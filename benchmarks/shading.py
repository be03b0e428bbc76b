"""Cost of shading: bare draws of each model and of soft shadows, relative to Phong with hard shadows.

python -m benchmarks.shading [--rounds N] [-o FOLDER]
"""

import argparse
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import msgspec
from rich.progress import track

import raytracer as rt
from benchmarks.bare import BareDraws
from benchmarks.bench import CALLS, in_turns, seconds
from benchmarks.pages import machine_lines
from raytracer.gpu.device import Device, shared_device
from raytracer.scene.materials.models import SHADINGS
from raytracer.scene.settings import Settings

SIZE = (1280, 720)
# The goal: the largest cost of GGX, in multiples of Phong's cost.
GOAL = 1.25


def _round_light(scene: rt.Scene) -> rt.Scene:
    lights = [msgspec.structs.replace(light, radius=0.5) for light in scene.lights]
    return msgspec.structs.replace(scene, lights=lights)


def costs(device: Device, scene: rt.Scene, rounds: int) -> dict[str, float]:
    """Measure the draws of each model, and of soft shadows, in turns with Phong's draws.

    Return the ratios of the times.
    """
    cases = {model: (scene, Settings(shading=model)) for model in SHADINGS}
    cases["phong, soft shadows"] = _round_light(scene), Settings(shading="phong", shadows="soft")
    ratios = {}
    with closing(BareDraws(device, *cases.pop("phong"), SIZE)) as phong:
        for name, case in track(cases.items(), "models"):
            with closing(BareDraws(device, *case, SIZE)) as draws:
                ours, theirs = in_turns(rounds, partial(seconds, draws.draw), partial(seconds, phong.draw))
            ratios[name] = ours / theirs
    return ratios


def main() -> None:
    """Measure all models, print the table, and write shading.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    device = shared_device()
    start = time.perf_counter()
    ratios = costs(device, rt.load("assignment"), options.rounds)
    lines = [
        "# Cost of shading",
        "",
        "Written by `python -m benchmarks.shading`: draws of the assignment at 1280x720, 1 sample, hard shadows, all",
        f"materials converted to the model (`--shading`). Each model takes turns with Phong; medians of "
        f"{CALLS * options.rounds}.",
        "",
        machine_lines(device),
        "",
        "| shading | time / Phong's time |",
        "|---|---|",
        *(f"| {name} | {ratio:.2f} |" for name, ratio in ratios.items()),
        "",
        f"Goal: `ggx` at most {GOAL}: {'reached' if ratios['ggx'] <= GOAL else 'not reached'}.",
    ]
    text = "\n".join(lines) + "\n"
    print(text)
    (options.output / "shading.md").write_text(text)
    print(f"wrote {options.output / 'shading.md'} in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
