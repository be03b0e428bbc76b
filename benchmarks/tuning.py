"""Comparison of `raytracer tune` with a sweep over all candidates, on ten scenes at one size.

The target error of a scene is the error of a plain picture, with the same number of samples in all pixels. The sweep
measures all candidates of tune's grid, except candidates that take far longer than the plain picture. The fastest
candidates that meet the target are then timed in turns with tune's pick.

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
from raytracer.analysis.tradeoffs.tune import candidates_for_error, list_candidates, tune
from raytracer.core.output import check_folder, write_atomically
from raytracer.core.progress import Progress, progress_bar
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import flags, minimal_patch

# The goal: the largest ratio of the time of tune's pick to the time of the sweep's best candidate.
GOAL = 1.15
# The samples of the plain picture, for one scene after the other.
_SAMPLES = (4, 12, 24)
# The sweep leaves out candidates with more samples than the plain picture times these factors: plain and adaptive ones.
_PLAIN, _ADAPTIVE = 2, 8
# Candidates within this factor of the sweep's best time are timed again, `--rounds` times.
_CLOSE = 1.5


class TuningRow(NamedTuple):
    """The pick of tune and the best candidate of the sweep on a scene."""

    scene: str
    error: float
    pick: Trial | None
    best: Trial
    candidates: int
    seconds: float  # of the run of tune

    @property
    def ratio(self) -> float:
        """Return the median time of the pick over the median time of the best candidate."""
        return self.pick.seconds / self.best.seconds if self.pick else float("inf")

    @property
    def least_ratio(self) -> float:
        """Return the shortest time of the pick over the shortest time of the best candidate."""
        return self.pick.least / self.best.least if self.pick else float("inf")


def random_scene(seed: int) -> rt.Scene:
    """Return a random scene: balls of several sizes with bites, on a floor."""
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


def compare(renderer: Renderer, scene: rt.Scene, samples: int, size: tuple[int, int], rounds: int) -> TuningRow:
    """Compare tune with the sweep on a scene. The target is the error of a plain picture with `samples` samples."""
    base = Settings()
    trials = Trials(renderer, scene, base, size)
    trials.draw_reference(2 * samples)
    # Slightly above the error of the plain picture, so that the last digit does not decide whether this picture meets
    # it.
    error = 1.05 * trials.measure(Settings(samples=samples)).error
    begin = time.perf_counter()
    tuned = tune(renderer, scene, size, base, max_error=error)
    took = time.perf_counter() - begin
    candidates = [
        settings
        for settings in list_candidates(base)
        if settings.samples <= (_PLAIN if settings.adaptive is None else _ADAPTIVE) * samples
    ]
    swept = [trials.measure(settings) for settings in candidates + candidates_for_error(base, error)]
    met = trials.time_in_turns((trial for trial in swept if trial.error <= error), 3)
    least = min(trial.least for trial in met)
    close = [trial for trial in met if trial.least <= _CLOSE * least]
    swept_settings = {trial.settings for trial in close}
    if tuned.pick and tuned.pick.settings not in swept_settings:
        close.append(tuned.pick)
    again = trials.time_in_turns(close, rounds)
    pick = next((trial for trial in again if tuned.pick and trial.settings == tuned.pick.settings), None)
    best = min((trial for trial in again if trial.settings in swept_settings), key=lambda trial: trial.least)
    return TuningRow(scene.name, error, pick, best, len(swept), took)


def as_markdown(rows: list[TuningRow], renderer: Renderer, size: tuple[int, int], rounds: int) -> str:
    """Format the report."""
    by_median, by_least = (sum(getattr(row, name) <= GOAL for row in rows) for name in ("ratio", "least_ratio"))
    lines = [
        "# `raytracer tune` compared with a sweep",
        "",
        f"Written by `python -m benchmarks.tuning`: {size[0]}x{size[1]}, medians of {rounds} rounds, in turns.",
        "",
        *(f"- {key}: {value}" for key, value in describe_machine(renderer).items()),
        "",
        "| scene | target | tune's pick | ms | error | best of sweep | ms | error | of | ratio | shortest | took |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        pick = _cells(row.pick) if row.pick else "none | | "
        ratio = " | ".join(f"{r:.2f}" if r <= GOAL else f"**{r:.2f}**" for r in (row.ratio, row.least_ratio))
        lines.append(
            f"| {row.scene} | {row.error:.2g} | {pick} | {_cells(row.best)} | {row.candidates} | {ratio} "
            f"| {row.seconds:.0f} s |"
        )
    lines += [
        "",
        "*Of*: the candidates. *Ratio*: of the median times. *Shortest*: of the shortest times. Bold: above the goal.",
        f"Goal: tune's pick takes at most {GOAL} times the time of the sweep's best candidate. It is reached on "
        f"{by_median} of {len(rows)} scenes by medians, and on {by_least} by the shortest times, which other work on "
        "the machine does not lengthen. A ratio below 1 is noise, or a pick that the sweep lacks. The sweep's best "
        "is the candidate with the shortest time of several, which favours the sweep.",
    ]
    return "\n".join(lines) + "\n"


def _cells(trial: Trial) -> str:
    return f"`{flags(minimal_patch(trial.settings)) or '--samples 1'}` | {1e3 * trial.seconds:.1f} | {trial.error:.2g}"


def main() -> None:
    """Measure all scenes, print the table, and write tuning.md."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tuning", description=__doc__)
    parser.add_argument("--scenes", type=int, default=10, help="number of scenes (default: 10)")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"), default=(320, 180))
    parser.add_argument("--rounds", type=int, default=15, help="rounds of the last comparison (default: 15)")
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
            rows.append(compare(renderer, scene, _SAMPLES[i % len(_SAMPLES)], size, options.rounds))
            text = as_markdown(rows, renderer, size, options.rounds)
            with write_atomically(options.output / "tuning.md") as file:  # after each scene, as the run takes long
                file.write(text.encode())
            if progress:
                progress(i + 1, len(scenes))
    print(f"{text}\nwrote {options.output / 'tuning.md'}")


if __name__ == "__main__":
    main()
