"""The plots and tables of docs/choosing.md, from measurements of `raytracer trade` on the assignment.

python -m benchmarks.choosing [--scene SCENE] [--size W H] [--rounds N] [--quick] [--results] [--docs FOLDER]

A run takes a quarter of an hour. It writes the tables between the markers of the page, including tables from
benchmarks/results, and the plots into the page's folder choosing/.
"""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import raytracer as rt
from benchmarks.pages import fill
from raytracer.analysis.tradeoffs import plots
from raytracer.analysis.tradeoffs.approximations import add_approximations
from raytracer.analysis.tradeoffs.configurations import FULL, MAIN, QUICK, Extent, plan
from raytracer.analysis.tradeoffs.data_files import as_csv
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs, measure_tradeoffs
from raytracer.analysis.tradeoffs.summaries import shadow_differences, slopes
from raytracer.core.progress import progress_bar
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.sequences import SEQUENCES, sample_points
from raytracer.scene.settings_patch import fewest, flags

# Widths of discs and lines in the table `blind`, in multiples of the distance between samples.
_WIDTHS = (0.25, 0.5, 1.0, 1.5, 2.0)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _ms(result: Result) -> str:
    milliseconds = 1e3 * result.median
    return f"{milliseconds:.1f}" if milliseconds < 10.0 else f"{milliseconds:.0f}"


def _error(result: Result) -> str:
    assert result.error
    return f"{result.error.rmse:.1e}" + ("" if result.resolved else " (not resolved)")


def front(trade: Tradeoffs) -> str:
    """Format the Pareto front: all configurations that no other beats in both time and error."""
    results = sorted(
        (result for result in trade.of(MAIN) if result.beaten_by is None), key=lambda result: result.median
    )
    rows = []
    for result in results:
        configuration = result.configuration
        text = f"`{flags(fewest(configuration.settings)) or '--samples 1'}`"
        if configuration.scale != 1.0:
            text += f" at {configuration.scale:g} times the size"
        rows.append([text, _ms(result), f"{result.samples:.1f}", _error(result)])
    return _table(["settings", "ms", "samples", "error"], rows)


def sequences(trade: Tradeoffs) -> str:
    """Format the errors of each sample sequence, and the slopes of its error with hard and with soft shadows."""
    numbers = [4, 16, 64, 256]
    hard, soft = (slopes(trade, knob) for knob in ("sequence", "sequence, soft shadows"))
    rows = []
    for sequence in SEQUENCES:
        own = {
            result.configuration.settings.samples: result
            for result in trade.of_knob("sequence")
            if result.configuration.settings.sequence == sequence and result.configuration.settings.samples > 1
        }
        fits = [f"{fit[0]:.2f}" if fit else "" for fit in (hard.get(sequence), soft.get(sequence))]
        rows.append([f"`{sequence}`", *(_error(own[n]) if n in own else "" for n in numbers), *fits])
    return _table(
        ["sequence", *(f"{n} samples" for n in numbers), "slope p (error ~ n^-p)", "slope p, soft shadows"], rows
    )


def shadows(trade: Tradeoffs) -> str:
    """Format the time and the error of each kind of shadows, and its difference from soft shadows."""
    differences = shadow_differences(trade)
    rows = []
    for kind in ("off", "hard", "diluted", "soft"):
        target = f"{kind} shadows"
        own = {result.configuration.settings.samples: result for result in trade.of_knob("shadows", target)}
        cells = [f"{_ms(own[n])} ms, {_error(own[n])}" if n in own else "" for n in (1, 4, 16, 64)]
        rows.append([f"`{kind}`", *cells, f"{differences[target]:.1e}" if target in differences else ""])
    return _table(["shadows", "1 sample", *(f"{n} samples" for n in (4, 16, 64)), "difference from soft"], rows)


def exact(trade: Tradeoffs) -> str:
    """Format the time and the error of each precision and each evaluator."""
    results = [*trade.of_knob("precision"), *trade.of_knob("evaluator")]
    own = {result.configuration.label: result for result in results}
    return _table(
        ["16 samples", "ms", "error"],
        [
            [f"`{flags(fewest(result.configuration.settings)) or 'default'}`", _ms(result), _error(result)]
            for result in own.values()
        ],
    )


def approximations(trade: Tradeoffs) -> str:
    """Format the error of each approximation, with its time and the time of the exact model."""
    rows = []
    for name, target in trade.plan.targets.items():
        if target.same_samples and trade.of(name):
            exact_result = next(result for result in trade.of(name) if result.error and result.error.rmse == 0.0)
            for result in trade.of(name):
                if result is not exact_result:
                    assert result.error
                    largest = f"{result.error.largest:.1e}"
                    rows.append(
                        [name, result.configuration.label, _ms(result), _ms(exact_result), _error(result), largest]
                    )
    return _table(["exact model", "approximation", "ms", "ms, exact model", "error", "largest error"], rows)


def blind() -> str:
    """Format the shares of randomly placed discs and lines that no sample hits, by their width."""
    rows = []
    for shape, length, n in (("discs", 0, 4), ("discs", 0, 16), ("discs", 0, 64), ("lines, 10 pixels long", 10, 16)):
        missed = [_missed(width / math.sqrt(n), length, n) for width in _WIDTHS]
        rows.append([shape, str(n), f"{1.0 / math.sqrt(n):g}", *(f"{share:.0%}" for share in missed)])
    return _table(["shape", "samples", "spacing, pixels", *(f"width {width:g} spacings" for width in _WIDTHS)], rows)


def _missed(width: float, length: float, n: int) -> float:
    rng = np.random.default_rng(2)
    centers = rng.uniform(8, 56, (2000, 2))
    angle = rng.uniform(0.0, math.pi, len(centers))
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    corner = centers.astype(int)
    hit = np.zeros(len(centers), bool)
    reach = math.ceil(length / 2.0 + width / 2.0)
    for k in range(n):
        points = sample_points(k, (64, 64), samples=n) + np.stack(np.meshgrid(np.arange(64), np.arange(64)), axis=-1)
        for dx, dy in np.ndindex(2 * reach + 1, 2 * reach + 1):
            offset = points[corner[:, 1] + dy - reach, corner[:, 0] + dx - reach] - centers
            t = np.clip((offset * along).sum(axis=1), -length / 2.0, length / 2.0)
            hit |= np.linalg.norm(offset - t[:, None] * along, axis=1) < width / 2.0
    return 1.0 - float(hit.mean())


def results() -> dict[str, str]:
    """Return the tables that other benchmarks wrote into benchmarks/results."""
    folder = Path(__file__).parent / "results"
    texts = {name: (folder / f"{name}.md").read_text().rstrip() for name in ("estimates", "deadlines", "tuning")}
    return {
        "estimates": texts["estimates"][texts["estimates"].index("**") :],
        "deadlines": texts["deadlines"][texts["deadlines"].index("|") :],
        "tuning": texts["tuning"].splitlines()[-1],
    }


def measure_tables(name: str, size: tuple[int, int], rounds: int, extent: Extent, folder: Path) -> dict[str, str]:
    """Measure the trade-offs and return their tables. Write the plots and all measurements into the folder."""
    scene, renderer = rt.load(name), Renderer(shared_device())
    planned = plan(scene, extent)
    add_approximations(planned, scene, extent, renderer)
    trade = measure_tradeoffs(scene, planned, renderer, size, rounds, progress_bar, method="gpu")
    folder.mkdir(exist_ok=True)
    (folder / "trade.csv").write_text(as_csv(trade))
    drawn = {
        "time": plots.error_against_time(trade, MAIN),
        "samples": plots.error_against_samples(trade, "sequence"),
        "soft": plots.error_against_samples(trade, "sequence, soft shadows"),
    }
    for plot, svg in drawn.items():
        (folder / f"{plot}.svg").write_text(svg.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"', 1))
    tables = {table.__name__: table(trade) for table in (front, sequences, shadows, exact, approximations)}
    machine = "; ".join(f"{key}: {value}" for key, value in trade.machine.items())
    return tables | {"blind": blind(), "machine": f"{size[0]}x{size[1]}; {machine}"}


def main() -> None:
    """Measure, and write the plots and tables of the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="assignment")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"), default=(320, 180))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="measure a few configurations only, as a trial run")
    parser.add_argument(
        "--results", action="store_true", help="measure nothing, and fill only the tables from benchmarks/results"
    )
    parser.add_argument("--docs", type=Path, default=Path("docs"))
    options = parser.parse_args()
    tables = results()
    if not options.results:
        size = options.size[0], options.size[1]
        tables |= measure_tables(
            options.scene, size, options.rounds, QUICK if options.quick else FULL, options.docs / "choosing"
        )
    page = options.docs / "choosing.md"
    for name, table in tables.items():
        fill(page, name, table)
    print(f"wrote {page}")


if __name__ == "__main__":
    main()
