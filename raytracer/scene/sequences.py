"""The sequences of sample places in a pixel, all in one table: `SEQUENCES`.

A new sequence is a name in `SampleSequence`, and a row in `SEQUENCES` with the function that places its samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

SampleSequence = Literal["sobol", "r2", "random", "grid", "rotated", "corners"]

# Seeds that scramble the two dimensions of Sobol: of 1500 random pairs the one whose first 2, 3, 4, 8, 16, 32 and 64
# points were least wrong about which share of a pixel an edge cuts off. Among 1500 others (benchmarks/sequences.py) it
# is second, and with 16 half as wrong as "r2". Over pixels that exchange digits it is like most, 2 % worse than the
# best.
_SCRAMBLES = 0xE7DAAF3E, 0xBB162E79
# The same for replicate_place(), and the shift of its digits. Of 200 random ones they are best: for edges and lines of
# all widths and 2 to 64 samples half the mean square difference of both means is the mean square error within 8 %.
_REPLICATE_SCRAMBLES, _REPLICATE_SHIFT = (9252736, 850290736), (14400251, 6415969)
# 1/p and 1/p^2 with p the plastic number, the real root of p^3 = p + 1.
_ALPHA = (0.7548776662466927, 0.5698402909980532)


def sample_place(k: int, sequence: SampleSequence = "sobol", samples: int = 1) -> tuple[int, int]:
    """Sample k = 0, 1, 2, ... of a pixel that gets so many, in 2^-24 of the pixel: x from the left, y from the top.

    The first of "sobol", and the only one of all but "random" and "corners", is the pixel's centre.
    """
    x, y = SEQUENCES[sequence].place(k, samples)
    return int(x * 2.0**24), int(y * 2.0**24)


def scatters(sequence: SampleSequence, samples: int) -> bool:
    """Whether each pixel exchanges digits of its own in the places of its samples: a single sample's are kept."""
    return SEQUENCES[sequence].is_scattered and samples > 1


def sample_points(k: int, size: tuple[int, int], sequence: SampleSequence = "sobol", samples: int = 1) -> Any:
    """(2,), or (H, W, 2) where they differ: where sample k is in the pixels of a picture of `size` (width, height), in
    [0, 1)^2, x from the left, y from the top. The same as camera.glsl has.
    """
    import numpy as np

    place = np.array(sample_place(k, sequence, samples), np.uint32)
    if scatters(sequence, samples):
        width, height = size
        x, y = np.meshgrid(np.arange(width), np.arange(height)[::-1])
        at = x.astype(np.uint32) * np.uint32(3242174889) + y.astype(np.uint32) * np.uint32(2447445413)
        place = place ^ (np.stack([at, at * np.uint32(1010068087)], axis=-1) >> np.uint32(8))
    return place * 2.0**-24


def _r2(k: int, _: int) -> tuple[float, float]:
    """The additive recurrence of Roberts (2018, "The unreasonable effectiveness of quasirandom sequences")."""
    return (0.5 + k * _ALPHA[0]) % 1.0, (0.5 + k * _ALPHA[1]) % 1.0


def _random(k: int, _: int) -> tuple[float, float]:
    """Independent points, always the same."""
    from random import Random

    generator = Random(k)
    return generator.random(), generator.random()


def _grid(k: int, samples: int) -> tuple[float, float]:
    """The middles of n x n squares."""
    n = math.isqrt(samples)
    j, i = divmod(k, n)
    return (i + 0.5) / n, (j + 0.5) / n


def _rotated(k: int, samples: int) -> tuple[float, float]:
    """A grid sheared so that each of n^2 rows and columns has one point; of 4, the rotated grid of hardware."""
    n = math.isqrt(samples)
    j, i = divmod(k, n)
    return (i + (j + 0.5) / n) / n, (j + (n - 0.5 - i) / n) / n


def _corners(k: int, samples: int) -> tuple[float, float]:
    """The corners of n x n squares, as the plain double loop over i / n and j / n has it."""
    n = math.isqrt(samples)
    j, i = divmod(k, n)
    return i / n, j / n


def _sobol(k: int, _: int) -> tuple[float, float]:
    """Point k of Sobol's (1967) first two dimensions, a (0, 2)-sequence, with Owen's nested scrambling: of the first
    2^m points each box of any shape 2^-i x 2^(i - m) holds one. Then shifted digit by digit so that point 0 is the
    centre. To 24 digits.
    """
    x, y = scrambled_sobol(k, *_SCRAMBLES)
    return x * 2.0**-24, y * 2.0**-24


def scrambled_sobol(k: int, x_seed: int, y_seed: int) -> tuple[int, int]:
    """Point k of Sobol's sequence, scrambled by the two seeds, in 2^-24."""
    x = _reversed(_scrambled(k, x_seed) ^ _scrambled(0, x_seed))
    y = _reversed(_scrambled(_pascal(k), y_seed) ^ _scrambled(0, y_seed))
    return (x >> 8) ^ 1 << 23, (y >> 8) ^ 1 << 23


def light_index(k: int) -> int:
    """The index, in Sobol's sequence, of the point on each light that belongs to sample `k` of a pixel.

    With "sobol", place and point are four dimensions of a (0, 4)-sequence in base 4: of the first 4^m samples each box
    of any shape with sides that are powers of 1/4 and a volume of 4^-m holds one. Both the place and the point alone
    are (0, 2)-sequences in base 2. So the error falls fast where a penumbra moves within a pixel, too.

    The index has the base-4 digits of `k` times a Pascal matrix over the field {0, 1, w, w + 1}, whose entries on
    diagonal d are multiplied by w^d. In Faure's construction over that field (Niederreiter 1987, "Point sets and
    sequences with small discrepancy") the four dimensions have the matrices for 0, 1, w and w + 1 in place of w.
    Sobol's two dimensions are the first two. They turn the index into the other two, but for an order in each digit.
    """
    digits = [k >> shift & 3 for shift in range(0, max(k.bit_length(), 1), 2)]
    index = 0
    for i in range(len(digits)):
        for j in range(i, len(digits)):
            if i & j == i:  # the binomial coefficient of j over i is odd
                index ^= _TIMES_W[(j - i) % 3][digits[j]] << 2 * i
    return index


# Each digit times 1, w and w^2, in the field of four elements with w^2 = w + 1.
_TIMES_W = (0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2)


def replicate_place(k: int) -> tuple[int, int]:
    """Sample `k` of a pixel in another scrambling of the sequence "sobol", as sample_place() has it.

    Means of the samples 0 to n - 1 in both scramblings have independent errors of the same size.
    """
    x, y = scrambled_sobol(k, *_REPLICATE_SCRAMBLES)
    return x ^ _REPLICATE_SHIFT[0], y ^ _REPLICATE_SHIFT[1]


# As in shaders/sampling/sobol.glsl, which explains them.


def _reversed(x: int) -> int:
    return int(f"{x:032b}"[::-1], 2)


def _scrambled(x: int, seed: int) -> int:
    bits = 0xFFFFFFFF
    x ^= x * 0x3D20ADEA & bits
    x = (x + seed) * (seed >> 16 | 1) & bits
    x ^= x * 0x05526C56 & bits
    return x ^ x * 0x53A22864 & bits


def _pascal(x: int) -> int:
    x ^= x >> 1 & 0x55555555
    x ^= x >> 2 & 0x33333333
    x ^= x >> 4 & 0x0F0F0F0F
    x ^= x >> 8 & 0x00FF00FF
    return x ^ x >> 16


class SequenceTraits(NamedTuple):
    """A sequence: where its samples lie, and facts that others ask for."""

    # The place of sample k of so many, in [0, 1)^2.
    place: Callable[[int, int], tuple[float, float]]
    # Any number of first points is spread over the pixel, so samples can be added one at a time. The other sequences
    # take a square number.
    is_progressive: bool = False
    # Each pixel exchanges digits of its own: only for points that lose nothing by it, as in an order by digits.
    is_scattered: bool = False
    # The samples tell the error of their mean.
    estimates_error: bool = False


SEQUENCES: dict[SampleSequence, SequenceTraits] = {
    "sobol": SequenceTraits(_sobol, is_progressive=True, is_scattered=True, estimates_error=True),
    "r2": SequenceTraits(_r2, is_progressive=True),
    "random": SequenceTraits(_random, is_progressive=True, is_scattered=True),
    "grid": SequenceTraits(_grid),
    "rotated": SequenceTraits(_rotated),
    "corners": SequenceTraits(_corners),
}
PROGRESSIVE: tuple[SampleSequence, ...] = tuple(name for name, traits in SEQUENCES.items() if traits.is_progressive)
