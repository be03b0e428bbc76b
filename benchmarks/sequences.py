"""Antialiasing error of each sample sequence at random edges, and the search for good scrambles of Sobol's points.

python -m benchmarks.sequences [--pairs N] [-o FOLDER]

A random straight edge cuts each of 128x128 pixels; all edges through a pixel are equally likely. The samples estimate
the share of the pixel behind the edge. The benchmark reports the root mean square error of this estimate. No
OpenGL is needed.
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
# Square numbers, so that the sequence `grid` can have them as well.
SAMPLES = 4, 16, 64, 256, 1024
# The scrambles in `raytracer/scene/sequences.py` were chosen by the errors with these numbers of samples.
FIRST = 2, 3, 4, 8, 16, 32, 64
UNIT = 2.0**-24

Places = NDArray[np.uint32]


class Edges:
    """Random edges, one for each pixel.

    Points with x n_x + y n_y < offset, from the pixel's centre, are behind an edge.
    """

    def __init__(self, count: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        # The circle around the pixel, of which edges that miss the pixel are left out.
        angle = rng.uniform(0.0, 2.0 * np.pi, 4 * count)
        offset = rng.uniform(-math.sqrt(0.5), math.sqrt(0.5), 4 * count)
        normal = np.stack([np.cos(angle), np.sin(angle)])
        hit = np.flatnonzero(np.abs(offset) < np.abs(normal).sum(axis=0) / 2.0)[:count]
        self._normal, self._offset = normal[:, hit].astype(np.float32), offset[hit].astype(np.float32)
        (a, b), t = np.abs(normal[:, hit]), offset[hit] + np.abs(normal[:, hit]).sum(axis=0) / 2.0
        # The area behind the edge: a triangle, less the parts of its corners outside the pixel.
        self._share = (t**2 - np.maximum(t - a, 0.0) ** 2 - np.maximum(t - b, 0.0) ** 2) / (2.0 * a * b)

    def errors(self, places: Places, digits: Places, first: tuple[int, ...]) -> NDArray[np.float64]:
        """Return the RMS error over all edges for each number of samples in `first`, in ascending order.

        Args:
            places: Sample places as integers [N, 2].
            digits: The scrambling of each pixel, combined with the places by XOR [edges, 2], or [1, 2] for all pixels.
            first: Numbers of samples; each takes that many of the first places.
        """
        x, y = ((places[:, i, None] ^ digits[:, i]).astype(np.float32) * np.float32(UNIT) for i in (0, 1))
        half = np.float32(0.5)
        behind = (x - half) * self._normal[0] + (y - half) * self._normal[1] < self._offset
        counts = np.add.reduceat(behind, (0, *first[:-1]), axis=0, dtype=np.int64).cumsum(axis=0)
        return np.sqrt(np.mean((counts / np.array(first)[:, None] - self._share) ** 2, axis=1))


def pixel_digits() -> Places:
    """Return the scrambling of each pixel, the digits that its sample places exchange [pixels, 2]."""
    centre = np.array(sample_place(0), np.uint32)
    return (sample_points(0, SIZE, "sobol", 2) / UNIT).astype(np.uint32).reshape(-1, 2) ^ centre


def sequence_errors(edges: Edges, sequence: SampleSequence) -> list[float]:
    """Return the errors of a sequence with each number of samples in SAMPLES."""
    errors = []
    for n in SAMPLES:
        places = np.array([sample_place(k, sequence, n) for k in range(n)], np.uint32)
        digits = pixel_digits() if scatters(sequence, n) else np.zeros((1, 2), np.uint32)
        errors.append(float(edges.errors(places, digits, (n,))[0]))
    return errors


def scrambled_errors(edges: Edges, scrambles: tuple[int, int]) -> NDArray[np.float64]:
    """Return the errors of Sobol's points with a pair of scrambles [2, FIRST].

    The first row has the same points in all pixels, the second row scatters them by each pixel's digits.
    """
    places = np.array([scrambled_sobol(k, *scrambles) for k in range(FIRST[-1])], np.uint32)
    return np.stack([edges.errors(places, digits, FIRST) for digits in (np.zeros((1, 2), np.uint32), pixel_digits())])


def geometric_mean(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the geometric mean over FIRST, in which every number of samples has the same weight."""
    return np.exp(np.log(errors).mean(axis=-1))


def as_markdown(
    errors_by_sequence: dict[SampleSequence, list[float]], chosen: NDArray[np.float64], others: NDArray[np.float64]
) -> str:
    """Format the tables as Markdown.

    Args:
        errors_by_sequence: Errors with the numbers of samples in SAMPLES.
        chosen: Errors of the scrambles in use [2, FIRST].
        others: Errors of the random pairs [pairs, 2, FIRST].
    """
    lines = [
        "# Errors of sample sequences at an edge",
        "",
        "Written by `python -m benchmarks.sequences`: root mean square errors of a pixel's share behind an edge,",
        f"over {SIZE[0] * SIZE[1]} random edges. The errors fall as n^-p; p is fitted.",
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
        f"Sobol's points: the scrambles of `raytracer/scene/sequences.py` among {len(others)} random pairs, by",
        f" geometric mean of the errors with the first {', '.join(map(str, FIRST))} samples:",
        "",
        "| points | rank | mean error | best random pair | median pair | " + " | ".join(map(str, FIRST)) + " |",
        "|---" * (len(FIRST) + 5) + "|",
    ]
    for i, points in enumerate(("the same in all pixels", "scattered by each pixel's digits")):
        means, own = geometric_mean(others[:, i]), geometric_mean(chosen[i])
        numbers = own, means.min(), np.median(means), *chosen[i]
        rank = 1 + np.count_nonzero(means < own)
        lines.append(f"| {points} | {rank} | {' | '.join(f'{number:.2e}' for number in numbers)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure all sequences and scrambles, print the tables, and write sequences.md."""
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
    text = as_markdown(errors_by_sequence, scrambled_errors(edges, _SCRAMBLES), others)
    (options.output / "sequences.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
