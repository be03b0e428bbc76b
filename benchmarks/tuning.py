"""Whether `raytracer tune` finds what a sweep over all candidates finds: on ten scenes, at one size.

For each scene the error is asked for that a plain picture of some number of samples has. The sweep measures all
candidates of tune's grid but those that take far longer than that picture; the fastest of those that meet the error is
then timed in turns with tune's pick.

python -m benchmarks.tuning [--scenes N] [--size W H] [--rounds N] [-o FOLDER]
"""

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import raytracer as rt
from benchmarks.scenes import BLUE, GREEN, GREY, RED
from raytracer.analysis.machine import describe_machine
from raytracer.analysis.tradeoffs.trials import Trial, Trials
from raytracer.analysis.tradeoffs.tune import asked, grid, tune
from raytracer.core.output import check_folder, written_whole
from raytracer.core.progress import Progress, progress_bar
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import fewest, flags

# How much longer tune's pick may take.
ASKED = 1.15
# Samples of plain pictures whose error is asked for, in turn.
_SAMPLES = (4, 12, 24)
# The sweep leaves out plain candidates with more than twice these samples, and adaptive ones with more than 8 times.
_PLAIN, _ADAPTIVE = 2, 8
# What the sweep finds within so many times its best time is timed again, as often as `--rounds`.
_CLOSE = 1.5


class TuningRow(NamedTuple):
    """What was found on a scene."""

    scene: str
    error: float
    pick: Trial | None
    best: Trial
    candidates: int
    seconds: float  # that tune took

    @property
    def ratio(self) -> float:
        """The pick's median time over the best one's."""
        return self.pick.seconds / self.best.seconds if self.pick else float("inf")

    @property
    def least_ratio(self) -> float:
        """The same of their shortest times."""
        return self.pick.least / self.best.least if self.pick else float("inf")


def random_scene(seed: int) -> rt.Scene:
    """Some balls with bites taken out of them, of all sizes, on a floor."""
    rng = np.random.default_rng(seed)
    solids: list[rt.Solid] = []
    for _ in range(int(rng.integers(2, 9))):
        radius = float(rng.uniform(0.2, 1.0))
        x, z = rng.uniform(-3.0, 3.0, 2).tolist()
        ball = rt.Sphere((x, radius, z), radius, (RED, BLUE, GREEN)[rng.integers(3)])
        dx, dy, dz = (0.8 * radius * rng.normal(size=3)).tolist()
        solids.append(ball - rt.Sphere((x + dx, radius + dy, z + dz), 0.7 * radius, GREY))
    lights = [rt.PointLight((4, 7, 4)), rt.PointLight((-5, 3, 6), (0.5, 0.4, 0.3))][: int(rng.integers(1, 3))]
    return rt.Scene(
        [*solids, rt.Plane((0, 1, 0), 0, GREY)], lights, rt.Camera((0, 3, 7), (0, 0.7, 0)), name=f"random {seed}"
    )


def compared(renderer: Renderer, scene: rt.Scene, samples: int, size: tuple[int, int], rounds: int) -> TuningRow:
    """Tune's pick and the sweep's, for the error of a plain picture of so many samples."""
    base = Settings()
    trials = Trials(renderer, scene, base, size)
    trials.refer(2 * samples)
    # A little above it, so that it does not hang on the last digit whether that picture meets it.
    error = 1.05 * trials.measure(Settings(samples=samples)).error
    begin = time.perf_counter()
    tuned = tune(renderer, scene, size, base, max_error=error)
    took = time.perf_counter() - begin
    candidates = [
        settings
        for settings in grid(base)
        if settings.samples <= (_PLAIN if settings.adaptive is None else _ADAPTIVE) * samples
    ]
    swept = [trials.measure(settings) for settings in candidates + asked(base, error)]
    met = trials.in_turns((each for each in swept if each.error <= error), 3)
    least = min(each.least for each in met)
    close = [each for each in met if each.least <= _CLOSE * least]
    swept_settings = {each.settings for each in close}
    if tuned.pick and tuned.pick.settings not in swept_settings:
        close.append(tuned.pick)
    again = trials.in_turns(close, rounds)
    pick = next((each for each in again if tuned.pick and each.settings == tuned.pick.settings), None)
    best = min((each for each in again if each.settings in swept_settings), key=lambda each: each.least)
    return TuningRow(scene.name, error, pick, best, len(swept), took)


def as_markdown(rows: list[TuningRow], renderer: Renderer, size: tuple[int, int], rounds: int) -> str:
    """The report."""
    kept, by_least = (sum(getattr(row, name) <= ASKED for row in rows) for name in ("ratio", "least_ratio"))
    lines = [
        "# What `raytracer tune` finds, and what a sweep finds",
        "",
        f"Written by `python -m benchmarks.tuning`: {size[0]}x{size[1]}, medians of {rounds} rounds, in turns.",
        "",
        *(f"- {key}: {value}" for key, value in describe_machine(renderer).items()),
        "",
        "| scene | asked for | tune's pick | ms | error | the sweep's | ms | error | of | ratio | shortest | took |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        pick = _cells(row.pick) if row.pick else "none | | "
        ratio = " | ".join(f"{r:.2f}" if r <= ASKED else f"**{r:.2f}**" for r in (row.ratio, row.least_ratio))
        lines.append(
            f"| {row.scene} | {row.error:.2g} | {pick} | {_cells(row.best)} | {row.candidates} | {ratio} "
            f"| {row.seconds:.0f} s |"
        )
    lines += [
        "",
        "*Ratio*: of the medians; *shortest*: of the shortest times.",
        f"Asked: at most {ASKED} times the time of the sweep's. Kept on {kept} of {len(rows)} scenes by medians, on "
        f"{by_least} by the shortest times, which other work on the machine does not lengthen. Below 1: a pick that "
        "the sweep has not, or noise. The sweep's is the one with the shortest time of several, which favours it.",
    ]
    return "\n".join(lines) + "\n"


def _cells(trial: Trial) -> str:
    return f"`{flags(fewest(trial.settings)) or '--samples 1'}` | {1e3 * trial.seconds:.1f} | {trial.error:.2g}"


def main() -> None:
    """Measure, print and write tuning.md."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tuning", description=__doc__)
    parser.add_argument("--scenes", type=int, default=10, help="how many (default: 10)")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"), default=(320, 180))
    parser.add_argument("--rounds", type=int, default=15, help="of the last comparison (default: 15)")
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    check_folder(options.output, "tuning.md")
    renderer = Renderer(shared_device())
    size = options.size[0], options.size[1]
    scenes = [rt.load(name) for name in ("assignment", "materials", "many")]
    scenes = [scenes[0], *map(random_scene, range(7)), *scenes[1:]][: options.scenes]
    rows: list[TuningRow] = []
    text = ""
    progress: Progress | None
    with progress_bar("tuning") as progress:
        for i, scene in enumerate(scenes):
            rows.append(compared(renderer, scene, _SAMPLES[i % len(_SAMPLES)], size, options.rounds))
            text = as_markdown(rows, renderer, size, options.rounds)
            with written_whole(options.output / "tuning.md") as file:  # it takes long: what there is, is kept
                file.write(text.encode())
            if progress:
                progress(i + 1, len(scenes))
    print(f"{text}\nwrote {options.output / 'tuning.md'}")


if __name__ == "__main__":
    main()
