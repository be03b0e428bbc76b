"""The plots and tables of docs/choosing.md, from measurements of `raytracer trade` on the assignment.

python -m benchmarks.choosing [--scene SCENE] [--size W H] [--rounds N] [--quick] [--results] [--redraw] [--docs FOLDER]

It takes a quarter of an hour; --results and --redraw take seconds. The tables, and tables of benchmarks/results, go
between the marks of the page, and the plots into its folder choosing/.
"""

import argparse
import csv
import math
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import raytracer as rt
from benchmarks.pages import fill
from raytracer.analysis.figures import svg_text
from raytracer.analysis.image_difference import Comparison
from raytracer.analysis.tradeoffs import plots
from raytracer.analysis.tradeoffs.approximations import add_approximations
from raytracer.analysis.tradeoffs.configurations import FULL, MAIN, QUICK, Configuration, Extent, plan
from raytracer.analysis.tradeoffs.data_files import as_csv
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs, measure_tradeoffs
from raytracer.analysis.tradeoffs.summaries import fit_slopes, shadow_differences
from raytracer.analysis.tradeoffs.targets import Reference
from raytracer.core.progress import progress_bar
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.sequences import SEQUENCES, sample_points
from raytracer.scene.settings_patch import SettingsPatch, flags, minimal_patch

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
        (result for result in trade.results_for(MAIN) if result.beaten_by is None), key=lambda result: result.median
    )
    rows = []
    for result in results:
        configuration = result.configuration
        text = f"`{flags(minimal_patch(configuration.settings)) or '--samples 1'}`"
        if configuration.scale != 1.0:
            text += f" at {configuration.scale:g} times the size"
        rows.append([text, _ms(result), f"{result.samples:.1f}", _error(result)])
    return _table(["settings", "ms", "samples", "error"], rows)


def sequences(trade: Tradeoffs) -> str:
    """Format the errors of each sample sequence, and the slopes of its error with hard and with soft shadows."""
    numbers = [4, 16, 64, 256]
    hard, soft = (fit_slopes(trade, knob) for knob in ("sequence", "sequence, soft shadows"))
    rows = []
    for sequence in SEQUENCES:
        own = {
            result.configuration.settings.samples: result
            for result in trade.results_for_knob("sequence")
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
        own = {result.configuration.settings.samples: result for result in trade.results_for_knob("shadows", target)}
        cells = [f"{_ms(own[n])} ms, {_error(own[n])}" if n in own else "" for n in (1, 4, 16, 64)]
        rows.append([f"`{kind}`", *cells, f"{differences[target]:.1e}" if target in differences else ""])
    return _table(["shadows", "1 sample", *(f"{n} samples" for n in (4, 16, 64)), "difference from soft"], rows)


def exact(trade: Tradeoffs) -> str:
    """Format the time and the error of each precision and each evaluator."""
    results = [*trade.results_for_knob("precision"), *trade.results_for_knob("evaluator")]
    own = {result.configuration.label: result for result in results}
    return _table(
        ["16 samples", "ms", "error"],
        [
            [f"`{flags(minimal_patch(result.configuration.settings)) or 'default'}`", _ms(result), _error(result)]
            for result in own.values()
        ],
    )


def approximations(trade: Tradeoffs) -> str:
    """Format the error of each approximation, with its time and the time of the exact model."""
    rows = []
    for name, target in trade.plan.targets.items():
        if target.same_samples and (own := trade.results_for(name)):
            exact = plots.exact_result(own)
            assert exact
            for result in own:
                if result is not exact:
                    assert result.error
                    largest = f"{result.error.largest:.1e}"
                    rows.append([name, result.configuration.label, _ms(result), _ms(exact), _error(result), largest])
    return _table(["exact model", "approximation", "ms", "ms, exact model", "error", "largest error"], rows)


def missed_features() -> str:
    """Format the shares of randomly placed discs and lines that no sample hits, by their width."""
    rows = []
    for shape, length, n in (("discs", 0, 4), ("discs", 0, 16), ("discs", 0, 64), ("lines, 10 pixels long", 10, 16)):
        missed = [_missed_share(width / math.sqrt(n), length, n) for width in _WIDTHS]
        rows.append([shape, str(n), f"{1.0 / math.sqrt(n):g}", *(f"{share:.0%}" for share in missed)])
    return _table(["shape", "samples", "spacing, pixels", *(f"width {width:g} spacings" for width in _WIDTHS)], rows)


def _missed_share(width: float, length: float, n: int) -> float:
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
    write_plots(trade, folder)
    tables = {table.__name__: table(trade) for table in (front, sequences, shadows, exact, approximations)}
    machine = "; ".join(f"{key}: {value}" for key, value in trade.machine.items())
    return tables | {"blind": missed_features(), "machine": f"{size[0]}x{size[1]}; {machine}"}


def write_plots(trade: Tradeoffs, folder: Path) -> None:
    """Write the plots of the page as .svg."""
    for name, title, figure in (
        ("time", "error against time", plots.error_against_time(trade, MAIN)),
        ("samples", "error against samples", plots.error_against_samples(trade, "sequence")),
        ("soft", "error against samples, soft shadows", plots.error_against_samples(trade, "sequence, soft shadows")),
    ):
        (folder / f"{name}.svg").write_text(svg_text(figure, title))


def read_trade(file: Path, scene: rt.Scene) -> Tradeoffs:
    """Read the measurements of trade.csv that the plots show. The file lacks the errors of references: they are 0."""
    trade = Tradeoffs("", (1, 1), 1, {}, plan(scene), {}, [])
    with file.open(newline="") as lines:
        rows = [row for row in csv.DictReader(lines) if row["seconds"] and row["target"] in trade.plan.targets]
    for row in rows:
        words = row["flags"].split()
        options: dict[str, Any] = dict(zip(words[::2], words[1::2], strict=True))
        fields: dict[str, Any] = {name[2:].replace("-", "_"): _number_or_word(value) for name, value in options.items()}
        settings = SettingsPatch(**fields).resolve()
        label, knobs = row["configuration"], tuple(row["knobs"].split("; "))
        estimates = label.endswith("with its error")
        configuration = Configuration(knobs, label, row["target"], settings, float(row["scale"]), estimates=estimates)
        error = Comparison(float(row["rmse"]), float(row["largest"]), (0, 0), 0.0, None, 0.0, float(row["over"]))
        result = Result(configuration, [float(row["seconds"])], float(row["samples"]), float(row["rays"]), error)
        result.resolved, result.beaten_by = row["resolved"] == "True", row["beaten_by"] or None
        trade.results.append(result)
    trade.references = dict.fromkeys(trade.plan.targets, Reference(np.zeros((1, 1, 3)), 0.0, "unknown"))
    return trade


def _number_or_word(value: str) -> int | float | str:
    for kind in (int, float):
        with suppress(ValueError):
            return kind(value)
    return value


def main() -> None:
    """Measure, and write the plots and tables of the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="assignment")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"), default=(320, 180))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="a small part, as a test of this script")
    parser.add_argument("--results", action="store_true", help="measure nothing: only copy benchmarks/results")
    parser.add_argument("--redraw", action="store_true", help="measure nothing: only draw the plots of trade.csv again")
    parser.add_argument("--docs", type=Path, default=Path("docs"))
    options = parser.parse_args()
    folder = options.docs / "choosing"
    if options.redraw:
        write_plots(read_trade(folder / "trade.csv", rt.load(options.scene)), folder)
        print(f"wrote the plots of {folder}")
        return
    tables = results()
    if not options.results:
        size = options.size[0], options.size[1]
        tables |= measure_tables(options.scene, size, options.rounds, QUICK if options.quick else FULL, folder)
    page = options.docs / "choosing.md"
    for name, table in tables.items():
        fill(page, name, table)
    print(f"wrote {page}")


if __name__ == "__main__":
    main()
