"""How well pictures know their error: what they say against what is true, on random scenes (`unseen.py`).

python -m benchmarks.estimates [--scenes N] [--first SEED] [--check N] [-o FOLDER]

Of each scene: the estimate with 2, 4, ... 64 samples, and a picture for an error drawn at random between those of 64
and of 2. What is true is what a picture converges to whose error is estimated to be a fifth of that with 64 samples
(2048 at most); of every `--check`th scene also, by another sequence, 512 samples of all pixels. Scenes whose rows the
.csv has are not measured again: it may be interrupted.
"""

import argparse
import csv
import time
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.unseen import SIZE, unseen
from raytracer.formats.image import Image
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import ASKED_SAMPLES

SAMPLES = 2, 4, 8, 16, 32, 64
# What was asked: estimates within 25 % of the true error, and errors at most 1.1 times those asked for, of 95 %.
WITHIN, MOST, SHARE = 0.25, 1.1, 0.95
# The seeds below 1000 were used to develop the estimate.
FIRST = 1000


def _rms(image: Image, truth: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean((image.radiance.astype(float) - truth) ** 2)))


def measure_scene(renderer: Renderer, seed: int, check: bool) -> dict[str, float | int | str]:
    """A row of the table. Ratios are nan where there is no error at all."""
    scene, shadows = unseen(seed)

    def picture(**fields: object) -> Image:
        settings = msgspec.structs.replace(Settings(shadows=shadows), **fields)
        return renderer.render(scene, SIZE, settings, geometry=False)

    begin = time.perf_counter()
    images = {n: picture(samples=n) for n in SAMPLES}
    said = {n: image.estimate.rmse or 0.0 for n, image in images.items() if image.estimate}
    row: dict[str, float | int | str] = {"seed": seed, "shadows": shadows}
    converged = picture(samples=2048, max_error=max(said[64] / 5.0, 1e-9))
    truth = converged.radiance.astype(float)
    true = {n: _rms(image, truth) for n, image in images.items()}
    row |= {f"ratio {n}": said[n] / true[n] if true[n] > 0.0 else float("nan") for n in SAMPLES}
    rng = np.random.default_rng([3, seed])
    low, high = np.log(np.maximum((true[64], true[2]), 1e-9))
    asked = float(np.exp(rng.uniform(low, high)))
    image = picture(samples=ASKED_SAMPLES, max_error=asked)
    estimate = image.estimate
    assert estimate and estimate.rmse is not None
    got = _rms(image, truth)
    row |= {"asked": asked, "true": got, "said": estimate.rmse, "samples": estimate.samples}
    if check:
        other = picture(samples=512, sequence="r2").radiance.astype(float)
        row["other truth 16"] = _rms(images[16], other) / true[16] if true[16] > 0.0 else float("nan")
    row["seconds"] = time.perf_counter() - begin
    return {key: round(value, 6) if isinstance(value, float) else value for key, value in row.items()}


def as_markdown(rows: list[dict[str, str]]) -> str:
    """The table as Markdown."""
    lines = [
        "# How well pictures know their error",
        "",
        f"Written by `python -m benchmarks.estimates`: {len(rows)} random scenes at {SIZE[0]}x{SIZE[1]}, seeds from",
        f"{rows[0]['seed']} on, of which none was used to develop the estimate. Asked: within {WITHIN:.0%} of the true "
        f"error in {SHARE:.0%}.",
        "",
        f"| samples | estimate over true error: median | 5 % to 95 % | within {WITHIN:.0%} |",
        "|---|---|---|---|",
    ]
    for n in SAMPLES:
        ratios = np.array([float(row[f"ratio {n}"]) for row in rows])
        ratios = ratios[np.isfinite(ratios)]
        low, middle, high = np.percentile(ratios, (5, 50, 95))
        lines.append(f"| {n} | {middle:.2f} | {low:.2f} to {high:.2f} | {np.mean(np.abs(ratios - 1) <= WITHIN):.0%} |")
    errors = np.array([float(row["true"]) / float(row["asked"]) for row in rows])
    ratios = np.array([float(row["said"]) / max(float(row["true"]), 1e-12) for row in rows])
    lines += [
        "",
        f"With `--max-error E`: the true error was at most {MOST} E in {np.mean(errors <= MOST):.0%} (asked: "
        f"{SHARE:.0%}), {np.median(errors):.2f} E in the median, {errors.max():.2f} E at most; the estimate was within "
        f"{WITHIN:.0%} in {np.mean(np.abs(ratios - 1) <= WITHIN):.0%}.",
    ]
    others = [float(row["other truth 16"]) for row in rows if row.get("other truth 16")]
    if others:
        lines += [
            "",
            f"Against 512 samples of another sequence, in {len(others)} of these scenes, the error with 16 samples is "
            f"{min(others):.3f} to {max(others):.3f} times what is taken for true here.",
        ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure what is missing, print and write estimates.csv and estimates.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--check", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    path = options.output / "estimates.csv"
    rows: list[dict[str, str]] = []
    if path.exists():
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
    have = {int(row["seed"]) for row in rows}
    seeds = [seed for seed in range(options.first, options.first + options.scenes) if seed not in have]
    columns = ["seed", "shadows", *(f"ratio {n}" for n in SAMPLES)]
    columns += ["asked", "true", "said", "samples", "other truth 16", "seconds"]
    for seed in track(seeds, "scenes"):
        row = measure_scene(Renderer(shared_device()), seed, seed % options.check == 0)
        rows.append({key: str(row.get(key, "")) for key in columns})
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows(rows)
    text = as_markdown(rows)
    (options.output / "estimates.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
