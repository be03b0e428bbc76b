"""The error of each sample sequence for a pixel that an edge cuts, and the search for the scrambles of Sobol's points.

python -m benchmarks.sequences [--pairs N] [-o FOLDER]

Each of 128x128 pixels is cut by a random straight edge; all edges through a pixel are equally likely. The samples
estimate the share of the pixel behind its edge. The error is the root mean square error of the share over all pixels.
The benchmark needs no OpenGL.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from raytracer.analysis.figures import SEQUENCE_STYLES, label_logarithm, label_samples, new_figure, plain_axes, svg_text
from raytracer.analysis.tradeoffs.pareto import fit_slope
from raytracer.scene.sequences import (
    _SCRAMBLES,
    SEQUENCES,
    SampleSequence,
    is_scattered,
    sample_place,
    sample_points,
    scrambled_sobol,
)

SIZE = 128, 128
# Square numbers, which a grid can have.
SAMPLES = 4, 16, 64, 256, 1024
# The numbers of samples that rank the scrambles in `raytracer/scene/sequences.py`.
FIRST = 2, 3, 4, 8, 16, 32, 64
UNIT = 2.0**-24

Places = NDArray[np.uint32]


class Edges:
    """Random edges, one per pixel. Points with x n_x + y n_y < offset, from the pixel's centre, are behind the edge."""

    def __init__(self, count: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        # Edges through the circle around the pixel that miss the pixel are left out.
        angle = rng.uniform(0.0, 2.0 * np.pi, 4 * count)
        offset = rng.uniform(-math.sqrt(0.5), math.sqrt(0.5), 4 * count)
        normal = np.stack([np.cos(angle), np.sin(angle)])
        hit = np.flatnonzero(np.abs(offset) < np.abs(normal).sum(axis=0) / 2.0)[:count]
        self._normal, self._offset = normal[:, hit].astype(np.float32), offset[hit].astype(np.float32)
        (a, b), t = np.abs(normal[:, hit]), offset[hit] + np.abs(normal[:, hit]).sum(axis=0) / 2.0
        # The area of a triangle, minus the areas of its corners outside the pixel.
        self._share = (t**2 - np.maximum(t - a, 0.0) ** 2 - np.maximum(t - b, 0.0) ** 2) / (2.0 * a * b)

    def errors(self, places: Places, digits: Places, first: tuple[int, ...]) -> NDArray[np.float64]:
        """Return the error for each number of samples in `first`.

        Args:
            places: The sample places (N, 2).
            digits: The digits that each pixel exchanges in its sample places (edges, 2).
            first: Numbers of samples, each of which uses the first places.
        """
        x, y = ((places[:, i, None] ^ digits[:, i]).astype(np.float32) * np.float32(UNIT) for i in (0, 1))
        half = np.float32(0.5)
        behind = (x - half) * self._normal[0] + (y - half) * self._normal[1] < self._offset
        counts = np.add.reduceat(behind, (0, *first[:-1]), axis=0, dtype=np.int64).cumsum(axis=0)
        return np.sqrt(np.mean((counts / np.array(first)[:, None] - self._share) ** 2, axis=1))


def pixel_digits() -> Places:
    """Return the digits that each pixel exchanges in its sample places (pixels, 2)."""
    centre = np.array(sample_place(0), np.uint32)
    return (sample_points(0, SIZE, "sobol", 2) / UNIT).astype(np.uint32).reshape(-1, 2) ^ centre


def sequence_errors(edges: Edges, sequence: SampleSequence) -> list[float]:
    """Return a sequence's error for each number in SAMPLES."""
    errors = []
    for n in SAMPLES:
        places = np.array([sample_place(k, sequence, n) for k in range(n)], np.uint32)
        digits = pixel_digits() if is_scattered(sequence, n) else np.zeros((1, 2), np.uint32)
        errors.append(float(edges.errors(places, digits, (n,))[0]))
    return errors


def scrambled_errors(edges: Edges, scrambles: tuple[int, int]) -> NDArray[np.float64]:
    """Return the errors of Sobol's points with these scrambles, for each number in FIRST (2, FIRST).

    First row: the same places in all pixels. Second row: with each pixel's digits.
    """
    places = np.array([scrambled_sobol(k, *scrambles) for k in range(FIRST[-1])], np.uint32)
    return np.stack([edges.errors(places, digits, FIRST) for digits in (np.zeros((1, 2), np.uint32), pixel_digits())])


def geometric_mean(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the geometric mean over FIRST, which ranks pairs of scrambles: each number of samples counts equally."""
    return np.exp(np.log(errors).mean(axis=-1))


def as_markdown(
    errors_by_sequence: dict[SampleSequence, list[float]], chosen: NDArray[np.float64], others: NDArray[np.float64]
) -> str:
    """Return the page's text.

    Args:
        errors_by_sequence: The error for each number in SAMPLES.
        chosen: The errors of the scrambles in use (2, FIRST).
        others: The errors of random scrambles (pairs, 2, FIRST).
    """
    lines = [
        "# The error of sample sequences for a pixel that an edge cuts",
        "",
        "Written by `python -m benchmarks.sequences`: the root mean square error of the share of a pixel behind an",
        f"edge, over {SIZE[0] * SIZE[1]} random edges. p is the exponent of the best fit c n^(-p).",
        "",
        "![Error of the share behind an edge, against samples per pixel, for each sequence](sequences.svg)",
        "",
        f"| sequence | {' | '.join(f'{n} samples' for n in SAMPLES)} | p |",
        "|---" * (len(SAMPLES) + 2) + "|",
    ]
    for sequence, errors in errors_by_sequence.items():
        fit = fit_slope(SAMPLES, errors)
        assert fit
        lines.append(f"| `{sequence}` | {' | '.join(f'{error:.2e}' for error in errors)} | {fit[0]:.2f} |")
    lines += [
        "",
        "The rank of the scrambles in `raytracer/scene/sequences.py` among",
        f"{len(others)} random pairs, by the geometric mean of the errors with {', '.join(map(str, FIRST))} samples:",
        "",
        "| points | rank | mean error | best random pair | median random pair | " + " | ".join(map(str, FIRST)) + " |",
        "|---" * (len(FIRST) + 5) + "|",
    ]
    for i, points in enumerate(("the same in all pixels", "with each pixel's digits")):
        means, own = geometric_mean(others[:, i]), geometric_mean(chosen[i])
        numbers = own, means.min(), np.median(means), *chosen[i]
        rank = 1 + np.count_nonzero(means < own)
        lines.append(f"| {points} | {rank} | {' | '.join(f'{number:.2e}' for number in numbers)} |")
    return "\n".join(lines) + "\n"


def plot(errors_by_sequence: dict[SampleSequence, list[float]]) -> str:
    """Return the .svg text of a plot of the errors."""
    figure = new_figure(9.0, 4.6)
    axes = figure.add_subplot()
    for sequence, errors in errors_by_sequence.items():
        axes.plot(SAMPLES, errors, ls="-", lw=1.2, ms=7, label=sequence, **SEQUENCE_STYLES[sequence].options)
    axes.set_yscale("log")
    label_logarithm(axes.yaxis)
    label_samples(axes.xaxis, SAMPLES)
    plain_axes(axes)
    axes.set_xlabel("samples per pixel")
    axes.set_ylabel("error of the share behind an edge (RMSE)")
    figure.legend(loc="outside right upper", fontsize=8)
    return svg_text(figure, "error against samples, random edges")


def main() -> None:
    """Measure, print the page, and write sequences.md and sequences.svg."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=1500)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmarks/results"))
    options = parser.parse_args()
    edges = Edges(SIZE[0] * SIZE[1])
    errors_by_sequence: dict[SampleSequence, list[float]] = {
        sequence: sequence_errors(edges, sequence) for sequence in SEQUENCES
    }
    pairs = np.random.default_rng(1).integers(0, 2**32, (options.pairs, 2)).tolist()
    others = np.stack([scrambled_errors(edges, (x, y)) for x, y in track(pairs, "pairs")])
    (options.output / "sequences.svg").write_text(plot(errors_by_sequence))
    text = as_markdown(errors_by_sequence, scrambled_errors(edges, _SCRAMBLES), others)
    (options.output / "sequences.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
