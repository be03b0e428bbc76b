"""Time, true error and stated error of each quality preset.

python -m benchmarks.quality [--rounds N] [--only SCENE ...] [--references FOLDER] [-o FOLDER] [--docs]

Pictures of all qualities are rendered in turns, and compared with a reference of 8192 samples. The reference takes
minutes, so the folder of --references keeps it for the next run. The first samples of the reference are the picture's
samples, so the error of a picture with 1024 samples is measured up to an eighth too small. --docs also writes the table
into docs/accuracy.md. Scenes that are not among --only keep their last results.
"""

import argparse
import csv
import io
import time
from pathlib import Path
from statistics import median
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from benchmarks.pages import fill, machine_lines
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Shadows
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import QUALITIES, flags


class _Case(NamedTuple):
    """The shadows and the picture size of a scene."""

    shadows: Shadows
    size: tuple[int, int]


SCENES = {
    "assignment": _Case("hard", (1280, 720)),
    "many": _Case("hard", (1280, 720)),
    "materials": _Case("soft", (640, 360)),
}
# Samples of a reference: eight times the samples of the quality `reference`.
_REFERENCE = 8192
# Seconds. A picture that takes longer is rendered only once.
_LONG = 10.0


class QualityRow(NamedTuple):
    """The measurements of a quality on a scene."""

    scene: str
    quality: str
    seconds: float
    samples: float
    estimate: float | None
    error: float
    uncertain: bool = False


def reference(renderer: Renderer, name: str, folder: Path | None) -> NDArray[np.float32]:
    """Return the radiance of a scene's reference, from the folder if it is there, else rendered."""
    shadows, size = SCENES[name]
    file = folder / f"{name}-{_REFERENCE}.npy" if folder else None
    if file and file.exists():
        return np.load(file)
    settings = Settings(samples=_REFERENCE, shadows=shadows)
    radiance = renderer.render(rt.load(name), size, settings, geometry=False).radiance
    if file:
        np.save(file, radiance)
    return radiance


def rows(renderer: Renderer, name: str, rounds: int, converged: NDArray[np.float32]) -> list[QualityRow]:
    """Measure all qualities on one scene, in turns."""
    scene = rt.load(name)
    shadows = SCENES[name].shadows
    settings = {quality: patch.replace(shadows=shadows).resolve() for quality, patch in QUALITIES.items()}
    pictures: dict[str, tuple[rt.Image, list[float]]] = {}
    for k in range(rounds):
        for quality, chosen in settings.items():
            if k and pictures[quality][1][0] > _LONG:
                continue
            if not k:  # compiles
                few = msgspec.structs.replace(chosen, samples=min(chosen.samples, 16))
                renderer.render(scene, SCENES[name].size, few, geometry=False)
            begin = time.perf_counter()
            image = renderer.render(scene, SCENES[name].size, chosen, geometry=False)
            pictures.setdefault(quality, (image, []))[1].append(time.perf_counter() - begin)
    result = []
    for quality, (image, times) in pictures.items():
        own = image.estimate
        assert own
        error = float(np.sqrt(np.mean((image.radiance - converged) ** 2, dtype=float)))
        row = QualityRow(name, quality, median(times), own.samples, own.rmse, error, own.uncertain)
        print(*row, len(times), sep=", ", flush=True)
        result.append(row)
    return result


def last_rows(path: Path, name: str) -> list[QualityRow]:
    """Read the rows of a scene from the last results."""
    with path.open(newline="") as file:
        return [
            QualityRow(
                row["scene"],
                row["quality"],
                float(row["seconds"]),
                float(row["samples"]),
                float(row["estimate"]) if row["estimate"] else None,
                float(row["error"]),
                row.get("uncertain") == "True",
            )
            for row in csv.DictReader(file)
            if row["scene"] == name
        ]


def table(rows: list[QualityRow]) -> str:
    """Format a Markdown table: a row for each quality, with time, samples, error and estimate on each scene."""
    names = list(dict.fromkeys(row.scene for row in rows))
    head = " | ".join(f"`{name}`, {_case_text(SCENES[name])}" for name in names)
    lines = [f"| quality | settings | {head} |", "|---|---|" + "---|" * len(names)]
    for quality, patch in QUALITIES.items():
        by_scene = {row.scene: row for row in rows if row.quality == quality}
        lines.append(f"| `{quality}` | `{flags(patch)}` | {' | '.join(_cell(by_scene[name]) for name in names)} |")
    return "\n".join(lines)


def _case_text(case: _Case) -> str:
    return f"{case.size[0]}x{case.size[1]}{', soft shadows' if case.shadows == 'soft' else ''}"


def _cell(row: QualityRow) -> str:
    estimate = "unknown" if row.estimate is None else f"{'at least ' if row.uncertain else ''}{row.estimate:.1e}"
    seconds = f"{row.seconds:.2g}" if row.seconds < 10.0 else f"{row.seconds:.0f}"
    samples = f"{row.samples:.1f}".removesuffix(".0")
    return f"{seconds} s, {samples} sample{'s' if row.samples > 1.0 else ''}, {row.error:.1e} ({estimate})"


def main() -> None:
    """Measure all qualities, print the table, and write quality.md and quality.csv."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--references", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--docs", action="store_true", help="also write the table into docs/accuracy.md")
    options = parser.parse_args()
    renderer = Renderer(shared_device())
    start = time.perf_counter()
    all_rows: list[QualityRow] = []
    for name in SCENES:
        if name in options.only:
            all_rows += rows(renderer, name, options.rounds, reference(renderer, name, options.references))
        else:
            all_rows += last_rows(options.output / "quality.csv", name)
    lines = [
        "# Cost and accuracy of each quality",
        "",
        "Written by `python -m benchmarks.quality`. Seconds are",
        f"medians of {options.rounds} pictures, in turns, without compilation, geometry and writing the file.",
        f"A picture that takes more than {_LONG:.0f} s is rendered once. Samples are means per pixel. The error, in",
        f"linear radiance, is the root mean square difference to a picture of {_REFERENCE} samples, whose first",
        "samples are the picture's. The picture's own estimate is in parentheses.",
        "",
        machine_lines(renderer.device),
        "",
        table(all_rows),
    ]
    text = "\n".join(lines) + "\n"
    print(text)
    (options.output / "quality.md").write_text(text)
    file = io.StringIO()
    csv.writer(file).writerows([QualityRow._fields, *all_rows])
    (options.output / "quality.csv").write_text(file.getvalue())
    if options.docs:
        fill(Path("docs/accuracy.md"), "quality", table(all_rows))
    print(f"wrote {options.output / 'quality.md'} in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
