"""Whether pictures with a time end in time: `--time T` on the examples.

python -m benchmarks.deadlines [--runs N] [-o FOLDER]
"""

import argparse
from pathlib import Path
from statistics import median

from rich.progress import track

import raytracer as rt
from raytracer.renderer import shared_renderer
from raytracer.settings import ASKED_SAMPLES, Settings

SIZE = (1280, 720)
TIMES = 0.1, 0.25, 0.5, 1.0


def main() -> None:
    """Measure, print and write deadlines.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    renderer = shared_renderer()
    scene = rt.load("assignment")
    renderer.render(scene, SIZE, Settings(samples=16, max_error=1e-9), geometry=False)  # compiles
    lines = [
        "# Whether pictures with a time end in time",
        "",
        f"Written by `python -m benchmarks.deadlines`: the assignment at {SIZE[0]}x{SIZE[1]}, {options.runs} runs of",
        "each, in turns with a picture of 1 sample: a pass. Times are from the first pass to the picture.",
        "",
        "| time asked for | median | longest | within the time and a pass | samples | error |",
        "|---|---|---|---|---|---|",
    ]
    for seconds in track(TIMES, "times"):
        images = []
        passes = []
        for _ in range(options.runs):
            single = renderer.render(scene, SIZE, Settings(samples=1), geometry=False).estimate
            images.append(renderer.render(scene, SIZE, Settings(samples=ASKED_SAMPLES, time=seconds), geometry=False))
            passes.append(single.seconds if single else 0.0)
        estimates = [image.estimate for image in images if image.estimate]
        kept = sum(e.seconds <= seconds + p for e, p in zip(estimates, passes, strict=True))
        took = [e.seconds for e in estimates]
        lines.append(
            f"| {seconds:g} s | {median(took):.3f} s | {max(took):.3f} s | {kept} of {options.runs} | "
            f"{median(e.samples for e in estimates):.1f} | {median(e.rmse or 0.0 for e in estimates):.2g} |"
        )
    text = "\n".join(lines) + "\n"
    (options.output / "deadlines.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
