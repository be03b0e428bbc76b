"""Adherence of `--time T` to the time limit, on the examples: in new processes, and within one process.

python -m benchmarks.deadlines [--runs N] [-o FOLDER]
"""

import argparse
import sys
import tempfile
from pathlib import Path
from statistics import median

from PIL import Image as Pillow
from rich.progress import track

import raytracer as rt
from raytracer.formats.estimate import Estimate
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import DEFAULT_SAMPLE_LIMIT
from raytracer.scene.settings import Settings
from tests.processes import run_for_output

SIZE = (1280, 720)
SCENES = "assignment", "many"
TIMES = 0.1, 0.25, 0.5, 1.0
# Time limits for pictures by new processes. Few, because each process takes a second or two to start.
NEW_TIMES = 0.25, 1.0


def in_process(renderer: Renderer, name: str, seconds: float | None) -> Estimate:
    """Render a picture with a time limit, or for None with 1 sample, which takes one pass. Return its estimate."""
    settings = Settings() if seconds is None else Settings(samples=DEFAULT_SAMPLE_LIMIT, time=seconds)
    estimate = renderer.render(rt.load(name), SIZE, settings, geometry=False).estimate
    assert estimate
    return estimate


def by_process(name: str, seconds: float) -> Estimate:
    """Render by `raytracer render` in a new process, and return the estimate that the written file states."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "out.png"
        command = [sys.executable, "-m", "raytracer", "render", name, "-o", str(path)]
        command += ["--size", f"{SIZE[0]}x{SIZE[1]}", "--time", str(seconds)]
        run_for_output(*command)
        with Pillow.open(path) as image:
            text = image.info
    error = str(text["Error"]).removeprefix("error ")
    is_bound = error.startswith("at least ")
    rmse = None if error.startswith("unknown") else float(error.split()[2 if is_bound else 1])
    return Estimate(float(text["Samples"]), float(text["Seconds"]), rmse, unknown=error if is_bound else "")


def table_row(renderer: Renderer, name: str, seconds: float, runs: int, new: bool) -> str:
    """Measure a scene with a time limit, and format the line of the table."""
    kept = 0
    estimates: list[Estimate] = []
    passes: list[float] = []
    for _ in range(runs):
        passes.append(in_process(renderer, name, None).seconds)
        estimates.append(by_process(name, seconds) if new else in_process(renderer, name, seconds))
        kept += estimates[-1].seconds <= seconds + passes[-1]
    took = [estimate.seconds for estimate in estimates]
    errors = [estimate.rmse for estimate in estimates if estimate.rmse is not None]
    error = f"{median(errors):.2g}" if errors else "unknown"
    if 0 < len(errors) < runs:
        error += f", unknown in {runs - len(errors)}"
    if bounds := sum(estimate.uncertain for estimate in estimates):
        error += f", a lower bound in {bounds}"
    return (
        f"| {name}{', new process' if new else ''} | {seconds:g} s | {median(passes):.3f} s | {median(took):.3f} s "
        f"| {max(took):.3f} s | {kept} of {runs} | {median(estimate.samples for estimate in estimates):.1f} | {error} |"
    )


def main() -> None:
    """Measure all cases, print the table, and write deadlines.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    renderer = Renderer(shared_device())
    lines = [
        "# Adherence to the time limit",
        "",
        f"Written by `python -m benchmarks.deadlines`: {SIZE[0]}x{SIZE[1]}, {options.runs} runs of each, in turns",
        "with a picture of 1 sample, which takes one pass. The seconds are the picture's own, which begin when all",
        "programs are compiled. *New process*: `raytracer render --time`. The other rows: renderings in one process.",
        "",
        "| scene | time limit | one pass | median | longest | within the limit + one pass | samples | error |",
        "|---|---|---|---|---|---|---|---|",
    ]
    times = (True, NEW_TIMES), (False, TIMES)
    cases = [(name, new, seconds) for name in SCENES for new, all_times in times for seconds in all_times]
    for name, new, seconds in track(cases, "cases"):
        in_process(renderer, name, None)  # compiles
        lines.append(table_row(renderer, name, seconds, options.runs, new))
    text = "\n".join(lines) + "\n"
    (options.output / "deadlines.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
