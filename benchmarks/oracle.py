"""Random scenes of solids of all kinds against the float64 reference, with all evaluators and precisions.

python -m benchmarks.oracle [--scenes 300] [--first 0] [--short]
"""

import argparse
import inspect
import sys

from rich.progress import Progress

from raytracer.analysis.numerics.findings import LedgerRow
from raytracer.analysis.numerics.ledger_page import as_markdown
from raytracer.analysis.numerics.random_solids import measure_random_solids, random_solids
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer


def main() -> None:
    """Measure the scenes, and print the findings. The exit status is 1 if one is beyond its bound."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenes", type=int, default=300, help="number of scenes. Default: 300.")
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene. Default: 0.")
    parser.add_argument(
        "--short", action="store_true", help="one picture of most scenes, by turns with each evaluator and precision"
    )
    options = parser.parse_args()
    count, first = options.scenes, options.first
    renderer = Renderer(shared_device())
    with Progress() as progress:
        task = progress.add_task(f"{count} random scenes", total=count)
        findings = measure_random_solids(
            renderer,
            range(first, first + count),
            short=options.short,
            progress=lambda done: progress.update(task, completed=done),
        )
    how = f"Scenes {first} to {first + count - 1}, on {renderer.device.limits.driver}."
    print(as_markdown([LedgerRow(inspect.cleandoc(random_solids.__doc__ or ""), findings)], how))
    sys.exit(not all(finding.is_within_bound for finding in findings))


if __name__ == "__main__":
    main()
