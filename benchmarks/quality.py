"""The time, the true error and the stated error of each quality.

python -m benchmarks.quality [--rounds N] [--only SCENE ...] [--truths FOLDER] [-o FOLDER] [--docs]

Pictures of all qualities are rendered in turns. They are compared with a reference of 8192 samples, which takes
minutes: FOLDER keeps it for the next run. A picture's samples are the first of the reference's, so the error of a
picture with 1024 samples is measured up to an eighth too small. --docs also writes the table into docs/accuracy.md.
The last results of scenes that are not among --only are kept.
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
    """The shadows and the size of a scene's pictures."""

    shadows: Shadows
    size: tuple[int, int]


SCENES = {
    "assignment": _Case("hard", (1280, 720)),
    "many": _Case("hard", (1280, 720)),
    "materials": _Case("soft", (640, 360)),
}
# Samples of a reference: eight times as many as the quality `reference` has. They take minutes.
_REFERENCE = 8192
# A picture that takes longer is rendered once.
_LONG = 10.0


class QualityRow(NamedTuple):
    """A quality on a scene."""

    scene: str
    quality: str
    seconds: float
    samples: float
    estimate: float | None
    error: float
    uncertain: bool = False


def reference(renderer: Renderer, name: str, folder: Path | None) -> NDArray[np.float32]:
    """The radiance of a scene's picture that has converged, as far as it has."""
    shadows, size = SCENES[name]
    file = folder / f"{name}-{_REFERENCE}.npy" if folder else None
    if file and file.exists():
        return np.load(file)
    settings = Settings(samples=_REFERENCE, shadows=shadows)
    radiance = renderer.render(rt.load(name), size, settings, geometry=False).radiance
    if file:
        np.save(file, radiance)
    return radiance


def rows(renderer: Renderer, name: str, rounds: int, right: NDArray[np.float32]) -> list[QualityRow]:
    """All qualities on one scene, in turns."""
    scene = rt.load(name)
    shadows = SCENES[name].shadows
    settings = {quality: patch.replace(shadows=shadows).resolve() for quality, patch in QUALITIES.items()}
    pictures: dict[str, tuple[rt.Image, list[float]]] = {}
    for k in range(rounds):
        for quality, each in settings.items():
            if k and pictures[quality][1][0] > _LONG:
                continue
            if not k:  # compiles
                few = msgspec.structs.replace(each, samples=min(each.samples, 16))
                renderer.render(scene, SCENES[name].size, few, geometry=False)
            begin = time.perf_counter()
            image = renderer.render(scene, SCENES[name].size, each, geometry=False)
            pictures.setdefault(quality, (image, []))[1].append(time.perf_counter() - begin)
    result = []
    for quality, (image, times) in pictures.items():
        own = image.estimate
        assert own
        error = float(np.sqrt(np.mean((image.radiance - right) ** 2, dtype=float)))
        row = QualityRow(name, quality, median(times), own.samples, own.rmse, error, own.uncertain)
        print(*row, len(times), sep=", ", flush=True)
        result.append(row)
    return result


def last_rows(path: Path, name: str) -> list[QualityRow]:
    """The rows of a scene in the last results."""
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
    """Markdown: a row for each quality, with time, samples, estimate and error on each scene."""
    names = list(dict.fromkeys(row.scene for row in rows))
    head = " | ".join(f"`{name}`, {_says(SCENES[name])}" for name in names)
    lines = [f"| quality | the same as | {head} |", "|---|---|" + "---|" * len(names)]
    for quality, patch in QUALITIES.items():
        by_scene = {row.scene: row for row in rows if row.quality == quality}
        lines.append(f"| `{quality}` | `{flags(patch)}` | {' | '.join(_cell(by_scene[name]) for name in names)} |")
    return "\n".join(lines)


def _says(case: _Case) -> str:
    return f"{case.size[0]}x{case.size[1]}{', soft shadows' if case.shadows == 'soft' else ''}"


def _cell(row: QualityRow) -> str:
    estimate = "unknown" if row.estimate is None else f"{'at least ' if row.uncertain else ''}{row.estimate:.1e}"
    seconds = f"{row.seconds:.2g}" if row.seconds < 10.0 else f"{row.seconds:.0f}"
    samples = f"{row.samples:.1f}".removesuffix(".0")
    return f"{seconds} s, {samples} sample{'s' if row.samples > 1.0 else ''}, {row.error:.1e} ({estimate})"


def main() -> None:
    """Measure, print and write quality.md and quality.csv."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--truths", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--docs", action="store_true", help="also write the table into docs/accuracy.md")
    options = parser.parse_args()
    renderer = Renderer(shared_device())
    start = time.perf_counter()
    all_rows: list[QualityRow] = []
    for name in SCENES:
        if name in options.only:
            all_rows += rows(renderer, name, options.rounds, reference(renderer, name, options.truths))
        else:
            all_rows += last_rows(options.output / "quality.csv", name)
    lines = [
        "# What a quality costs",
        "",
        "Written by `python -m benchmarks.quality`: errors in linear radiance. Seconds are",
        f"medians of {options.rounds} pictures, in turns, without compilation, geometry and the file's writing; one",
        f"picture where it takes more than {_LONG:.0f} s. Samples a pixel are means. The error is the root mean square",
        f"difference to a picture of {_REFERENCE} samples, whose first samples are the picture's. The picture's own",
        "estimate is in parentheses.",
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
