"""The speed of users' calls, against POV-Ray, bare draws, the assignment written down literally, and each other.

Times are medians, each in turns with its peer's, on the machine at hand. Pictures are compared as well:
the exit status is 1 if one is wrong. Rows against POV-Ray are left out where it is not installed.
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
from raytracer.core.output import check_folder, written_whole
from raytracer.core.progress import progress_bar
from raytracer.gpu.device import shared_device

_SIZE = (1280, 720)
# What a row may fail by while the others go on.
_NOT_AVAILABLE = (UnavailableError, InputError, ShaderError)
_LARGE = ((1920, 1080), (3840, 2160))
_EXAMPLES = """\
examples:
  python -m benchmarks.speed
  python -m benchmarks.speed --rows assignment literal --rounds 9
  python -m benchmarks.speed -o benchmarks/results --docs
"""


def main() -> int:
    """Measure, print and write; 1 if a picture is wrong."""
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
        with written_whole(path) as file:
            file.write(content.encode())
    print(f"{text}\nwrote {folder / stem}.md and .csv")
    if options.docs:
        fill(Path("docs/performance.md"), "speed", calls_table(results))
    agreements = [timing.agreement for _, timing in results if not isinstance(timing, str)]
    return 0 if all(agreement is None or agreement.right for agreement in agreements) else 1


def _reason(error: Exception) -> str:
    """The reason in one line, for a table."""
    return str(error).partition("\n")[0].replace("|", "\\|")


def _rates(bench: Bench) -> list[tuple[str, ...]]:
    """The name of each scene, and its pictures a second at each of the large sizes, or why there are none."""
    lines = []
    for work, (scene, samples) in SCENES.items():
        made, settings, cells = scene(), Settings(samples=samples), []
        for size in _LARGE:
            try:
                bench.call(made, settings, size)
                seconds = median(bench.call(made, settings, size) for _ in range(CALLS * bench.rounds))
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
        "--rows", metavar="NAME", nargs="+", choices=groups, help=f"only these of {', '.join(groups)} (default: all)"
    )
    parser.add_argument("--rounds", metavar="N", type=int, default=5, help="rounds of calls in turns (default: 5)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        default=".",
        help="gets speed.md and speed.csv, or with a GPU speed-NAME.md and .csv, over those that are there "
        "(default: here)",
    )
    parser.add_argument(
        "--docs", action="store_true", help="also write the rows of users' calls into docs/performance.md"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
