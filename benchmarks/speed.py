"""Speed of users' calls against peers: POV-Ray, bare draws, the literal shader, and other calls.

Each call takes turns with its peer, and the median times are compared. Pictures are compared as well: the exit status
is 1 if a picture is wrong. Rows against POV-Ray have no times if POV-Ray is not installed.
"""

import argparse
import sys
from pathlib import Path
from statistics import median

from benchmarks.bench import CALLS, Bench
from benchmarks.pages import fill, machine_lines
from benchmarks.povray import UnavailableError
from benchmarks.speed_page import TimedRow, as_csv, as_markdown, calls_table, stem_of
from benchmarks.speed_rows import ROWS, SCENES
from raytracer import InputError, Settings, ShaderError
from raytracer.core.output import check_folder, write_atomically
from raytracer.core.progress import progress_bar
from raytracer.gpu.device import shared_device

_SIZE = (1280, 720)
# Errors of a single row. The benchmark notes them in the table, and continues with the next row.
_NOT_AVAILABLE = (UnavailableError, InputError, ShaderError)
_LARGE = ((1920, 1080), (3840, 2160))
_EXAMPLES = """\
examples:
  python -m benchmarks.speed
  python -m benchmarks.speed --rows assignment literal --rounds 9
  python -m benchmarks.speed -o benchmarks/results --docs
"""


def main() -> int:
    """Measure all rows, print and write the tables. Return 1 if a picture is wrong."""
    parser = _parser()
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error(f"argument --rounds: expected at least 1, got {options.rounds}")
    if options.docs and options.rows:
        parser.error("argument --docs: not allowed with --rows, because docs/performance.md has rows of several groups")
    folder = Path(options.output)
    check_folder(folder)
    bench = Bench(shared_device(), _SIZE, options.rounds)
    rows = [row for row in ROWS if row.group in (options.rows or [row.group])]
    results: list[TimedRow] = []
    with progress_bar("measuring") as progress:
        for i, row in enumerate(rows):
            try:
                results.append((row, row.measure(bench)))
            except _NOT_AVAILABLE as error:
                results.append((row, _reason(error)))
            if progress:
                progress(i + 1, len(rows))
        rates = [] if bench.software else _rates(bench)
    text = as_markdown(results, rates, machine_lines(bench.device), bench)
    stem = stem_of(bench)
    for suffix, content in ((".md", text), (".csv", as_csv(results))):
        path = folder / (stem + suffix)
        with write_atomically(path) as file:
            file.write(content.encode())
    print(f"{text}\nwrote {folder / stem}.md and .csv")
    if options.docs:
        fill(Path("docs/performance.md"), "speed", calls_table(results))
    agreements = [timing.agreement for _, timing in results if not isinstance(timing, str)]
    return 0 if all(agreement is None or agreement.right for agreement in agreements) else 1


def _reason(error: Exception) -> str:
    """Return the error's first line, for a cell of a table."""
    return str(error).partition("\n")[0].replace("|", "\\|")


def _rates(bench: Bench) -> list[tuple[str, ...]]:
    """Measure pictures a second at the large sizes.

    Return for each scene its name, and a rate or a reason for each size.
    """
    lines = []
    for work, (scene, samples) in SCENES.items():
        scene_object, settings, cells = scene(), Settings(samples=samples), []
        for size in _LARGE:
            try:
                bench.call(scene_object, settings, size)
                seconds = median(bench.call(scene_object, settings, size) for _ in range(CALLS * bench.rounds))
                cells.append(f"{1.0 / seconds:.0f}")
            except _NOT_AVAILABLE as error:
                cells.append(f"not available: {_reason(error)}")
        lines.append((work, *cells))
    return lines


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.speed",
        description=__doc__,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    groups = list(dict.fromkeys(row.group for row in ROWS))
    parser.add_argument(
        "--rows",
        metavar="NAME",
        nargs="+",
        choices=groups,
        help=f"groups of rows to measure, of {', '.join(groups)} (default: all)",
    )
    parser.add_argument("--rounds", metavar="N", type=int, default=5, help="rounds of calls in turns (default: 5)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        default=".",
        help="folder for speed.md and speed.csv, or with a GPU speed-NAME.md and .csv; existing files are replaced "
        "(default: the current folder)",
    )
    parser.add_argument(
        "--docs", action="store_true", help="also write the rows of users' calls into docs/performance.md"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
