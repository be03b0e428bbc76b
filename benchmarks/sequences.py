"""How wrong the samples of a pixel are about an edge through it, by sequence; and the search for Sobol's scrambles.

python -m benchmarks.sequences [--pairs N] [-o FOLDER]

Each of 128x128 pixels is cut by a straight edge of its own, all edges through a pixel being equally likely. The samples
say which share of it lies behind; what is told is the root mean square of what they are wrong by. No OpenGL is needed.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from raytracer.analysis.tradeoffs.pareto import slope
from raytracer.scene.sequences import (
    _SCRAMBLES,
    SEQUENCES,
    SampleSequence,
    sample_place,
    sample_points,
    scatters,
    scrambled_sobol,
)

SIZE = 128, 128
# Those that a grid can have, too.
SAMPLES = 4, 16, 64, 256, 1024
# The numbers of samples by which the scrambles in `raytracer/scene/sequences.py` were chosen.
FIRST = 2, 3, 4, 8, 16, 32, 64
UNIT = 2.0**-24

Places = NDArray[np.uint32]


class Edges:
    """Random ones, one a pixel: x n_x + y n_y < offset from the pixel's centre is behind it."""

    def __init__(self, count: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        # Those that miss the pixel, but not the circle around it, are left out.
        angle = rng.uniform(0.0, 2.0 * np.pi, 4 * count)
        offset = rng.uniform(-math.sqrt(0.5), math.sqrt(0.5), 4 * count)
        normal = np.stack([np.cos(angle), np.sin(angle)])
        hit = np.flatnonzero(np.abs(offset) < np.abs(normal).sum(axis=0) / 2.0)[:count]
        self._normal, self._offset = normal[:, hit].astype(np.float32), offset[hit].astype(np.float32)
        (a, b), t = np.abs(normal[:, hit]), offset[hit] + np.abs(normal[:, hit]).sum(axis=0) / 2.0
        # The area of a triangle, less those of its corners outside the pixel.
        self._share = (t**2 - np.maximum(t - a, 0.0) ** 2 - np.maximum(t - b, 0.0) ** 2) / (2.0 * a * b)

    def errors(self, places: Places, digits: Places, first: tuple[int, ...]) -> NDArray[np.float64]:
        """Of the `first` so many of `places` (N, 2), each with its digits exchanged by `digits` (edges, 2)."""
        x, y = ((places[:, i, None] ^ digits[:, i]).astype(np.float32) * np.float32(UNIT) for i in (0, 1))
        half = np.float32(0.5)
        behind = (x - half) * self._normal[0] + (y - half) * self._normal[1] < self._offset
        counts = np.add.reduceat(behind, (0, *first[:-1]), axis=0, dtype=np.int64).cumsum(axis=0)
        return np.sqrt(np.mean((counts / np.array(first)[:, None] - self._share) ** 2, axis=1))


def pixel_digits() -> Places:
    """(pixels, 2): what each pixel exchanges of the samples' places."""
    centre = np.array(sample_place(0), np.uint32)
    return (sample_points(0, SIZE, "sobol", 2) / UNIT).astype(np.uint32).reshape(-1, 2) ^ centre


def of_sequence(edges: Edges, sequence: SampleSequence) -> list[float]:
    """Its errors with so many samples as in SAMPLES."""
    errors = []
    for n in SAMPLES:
        places = np.array([sample_place(k, sequence, n) for k in range(n)], np.uint32)
        digits = pixel_digits() if scatters(sequence, n) else np.zeros((1, 2), np.uint32)
        errors.append(float(edges.errors(places, digits, (n,))[0]))
    return errors


def of_scrambles(edges: Edges, scrambles: tuple[int, int]) -> NDArray[np.float64]:
    """(2, FIRST): the errors of Sobol's points with these, the same in all pixels, and with each pixel's digits."""
    places = np.array([scrambled_sobol(k, *scrambles) for k in range(FIRST[-1])], np.uint32)
    return np.stack([edges.errors(places, digits, FIRST) for digits in (np.zeros((1, 2), np.uint32), pixel_digits())])


def mean(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """By which pairs are ranked: the geometric mean over FIRST, as each of these counts alike."""
    return np.exp(np.log(errors).mean(axis=-1))


def as_markdown(
    errors_by_sequence: dict[SampleSequence, list[float]], chosen: NDArray[np.float64], others: NDArray[np.float64]
) -> str:
    """The tables as Markdown. `chosen` (2, FIRST), `others` (pairs, 2, FIRST)."""
    lines = [
        "# Where samples lie, and what an edge makes of it",
        "",
        "Written by `python -m benchmarks.sequences`: the root mean square error of a pixel's share behind an edge,",
        f"over {SIZE[0] * SIZE[1]} random edges. p is that of the n^-p that fits best.",
        "",
        f"| sequence | {' | '.join(f'{n} samples' for n in SAMPLES)} | p |",
        "|---" * (len(SAMPLES) + 2) + "|",
    ]
    for sequence, errors in errors_by_sequence.items():
        fit = slope(SAMPLES, errors)
        assert fit
        lines.append(f"| `{sequence}` | {' | '.join(f'{error:.2e}' for error in errors)} | {fit[0]:.2f} |")
    lines += [
        "",
        f"Sobol's points with the scrambles of `raytracer/scene/sequences.py` among {len(others)} random pairs, by the",
        f"geometric mean of the errors of the first {', '.join(map(str, FIRST))}:",
        "",
        "| points | rank | mean error | the best random pair's | the median | " + " | ".join(map(str, FIRST)) + " |",
        "|---" * (len(FIRST) + 5) + "|",
    ]
    for i, points in enumerate(("the same in all pixels", "with each pixel's digits")):
        means, own = mean(others[:, i]), mean(chosen[i])
        numbers = own, means.min(), np.median(means), *chosen[i]
        rank = 1 + np.count_nonzero(means < own)
        lines.append(f"| {points} | {rank} | {' | '.join(f'{number:.2e}' for number in numbers)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print and write sequences.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=1500)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    edges = Edges(SIZE[0] * SIZE[1])
    errors_by_sequence: dict[SampleSequence, list[float]] = {
        sequence: of_sequence(edges, sequence) for sequence in SEQUENCES
    }
    pairs = np.random.default_rng(1).integers(0, 2**32, (options.pairs, 2)).tolist()
    others = np.stack([of_scrambles(edges, (x, y)) for x, y in track(pairs, "pairs")])
    text = as_markdown(errors_by_sequence, of_scrambles(edges, _SCRAMBLES), others)
    (options.output / "sequences.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
