"""Sample sequences: the positions of the samples in a pixel.

To add a sequence, add its name to `SampleSequence`, and a row with a function for its positions to `SEQUENCES`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

SampleSequence = Literal["sobol", "r2", "random", "grid", "rotated", "corners"]

# Scrambling seeds of the two dimensions of Sobol's sequence. Among 1500 random pairs, this pair had the smallest error
# in the share of a pixel that an edge cuts off, with the first 2, 3, 4, 8, 16, 32 and 64 points. Compared with another
# 1500 pairs (benchmarks/sequences.py) it is second, and with 16 points its error is half the error of "r2". If pixels
# exchange digits (is_scattered), the pair is average, 2 % worse than the best.
_SCRAMBLES = 0xE7DAAF3E, 0xBB162E79
# Scrambling seeds, and the shift of digits, of replicate_place(): the best of 200 random choices. For edges and lines
# of all widths, and 2 to 64 samples, half the mean square difference of the two means is within 8 % of the mean square
# error.
_REPLICATE_SCRAMBLES, _REPLICATE_SHIFT = (9252736, 850290736), (14400251, 6415969)
# 1/p and 1/p^2 with p the plastic number, the real root of p^3 = p + 1.
_ALPHA = (0.7548776662466927, 0.5698402909980532)


def sample_place(k: int, sequence: SampleSequence = "sobol", samples: int = 1) -> tuple[int, int]:
    """Return the position of a sample in its pixel as integers (x, y), in units of 2^-24 pixel from the top left.

    Sample 0 of "sobol" is the pixel's centre. A single sample is the centre in all other sequences, too, except in
    "random" and "corners".

    Args:
        k: the number of the sample, from 0.
        sequence: the sequence. Default: "sobol".
        samples: the number of samples of the pixel, a square number for "grid", "rotated" and "corners". Default: 1.
    """
    x, y = SEQUENCES[sequence].place(k, samples)
    return int(x * 2.0**24), int(y * 2.0**24)


def is_scattered(sequence: SampleSequence, samples: int) -> bool:
    """Whether the sample positions are scrambled differently in each pixel. A single sample is not scrambled."""
    return SEQUENCES[sequence].is_scattered and samples > 1


def sample_points(k: int, size: tuple[int, int], sequence: SampleSequence = "sobol", samples: int = 1) -> Any:
    """Return the positions of sample k in all pixels, in [0, 1)^2 from the top left, as camera.glsl computes them.

    The result has the shape [2] if all pixels have the same position, else [H, W, 2].

    Args:
        k: the number of the sample, from 0.
        size: (width, height) of the picture in pixels.
        sequence: the sequence. Default: "sobol".
        samples: the number of samples of each pixel. Default: 1.
    """
    import numpy as np

    place = np.array(sample_place(k, sequence, samples), np.uint32)
    if is_scattered(sequence, samples):
        width, height = size
        x, y = np.meshgrid(np.arange(width), np.arange(height)[::-1])
        pixel_hash = x.astype(np.uint32) * np.uint32(3242174889) + y.astype(np.uint32) * np.uint32(2447445413)
        place = place ^ (np.stack([pixel_hash, pixel_hash * np.uint32(1010068087)], axis=-1) >> np.uint32(8))
    return place * 2.0**-24


def _r2(k: int, _: int) -> tuple[float, float]:
    """The additive recurrence R2 (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences")."""
    return (0.5 + k * _ALPHA[0]) % 1.0, (0.5 + k * _ALPHA[1]) % 1.0


def _random(k: int, _: int) -> tuple[float, float]:
    """Independent random points, with the number of the sample as the seed, so that pictures are reproducible."""
    from random import Random

    generator = Random(k)
    return generator.random(), generator.random()


def _grid(k: int, samples: int) -> tuple[float, float]:
    """The centres of n x n squares."""
    n = math.isqrt(samples)
    j, i = divmod(k, n)
    return (i + 0.5) / n, (j + 0.5) / n


def _rotated(k: int, samples: int) -> tuple[float, float]:
    """A grid sheared so that each of n^2 rows and columns has one point; with 4 points, the rotated grid of GPUs."""
    n = math.isqrt(samples)
    j, i = divmod(k, n)
    return (i + (j + 0.5) / n) / n, (j + (n - 0.5 - i) / n) / n


def _corners(k: int, samples: int) -> tuple[float, float]:
    """The corners of n x n squares: the points of a plain double loop over i / n and j / n."""
    n = math.isqrt(samples)
    j, i = divmod(k, n)
    return i / n, j / n


def _sobol(k: int, _: int) -> tuple[float, float]:
    """Point k of Sobol's sequence (1967) with Owen's nested scrambling, to 24 binary digits.

    The first two dimensions of the sequence are a (0, 2)-sequence: each box of a shape 2^-i x 2^(i - m) contains one of
    the first 2^m points. A digital shift moves point 0 to the pixel's centre.
    """
    x, y = scrambled_sobol(k, *_SCRAMBLES)
    return x * 2.0**-24, y * 2.0**-24


def scrambled_sobol(k: int, x_seed: int, y_seed: int) -> tuple[int, int]:
    """Return point k of Sobol's sequence, scrambled by a seed per dimension, as integers in units of 2^-24."""
    x = _reverse_bits(_scramble(k, x_seed) ^ _scramble(0, x_seed))
    y = _reverse_bits(_scramble(_pascal(k), y_seed) ^ _scramble(0, y_seed))
    return (x >> 8) ^ 1 << 23, (y >> 8) ^ 1 << 23


def light_index(k: int) -> int:
    """Return the index, in Sobol's sequence, of the point on a light that sample `k` of a pixel uses.

    With the sequence "sobol", the position in the pixel and the point on the light together are a four-dimensional
    (0, 4)-sequence in base 4: each box of volume 4^-m, whose sides are powers of 1/4, contains one of the first 4^m
    samples. Each of the two alone is a (0, 2)-sequence in base 2. So the error also falls fast where a penumbra varies
    within a pixel.

    The index is the vector of base-4 digits of `k`, multiplied by a Pascal matrix over the field {0, 1, w, w + 1} whose
    entries on diagonal d are multiplied by w^d. In Faure's construction over that field (Niederreiter 1987, "Point sets
    and sequences with small discrepancy") the four dimensions have the matrices for 0, 1, w and w + 1 in place of w.
    Sobol's two dimensions are the first two of these. Applied to the index, they give the other two, up to a
    permutation of each digit.
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
    """Return the position of sample `k` for a second scrambling of "sobol", in the units of sample_place().

    The means of samples 0 to n - 1 with both scramblings have independent errors of the same size. Their difference
    estimates the error.
    """
    x, y = scrambled_sobol(k, *_REPLICATE_SCRAMBLES)
    return x ^ _REPLICATE_SHIFT[0], y ^ _REPLICATE_SHIFT[1]


# The next three functions repeat shaders/sampling/sobol.glsl: reversal of 32 bits; a permutation in which each bit
# depends on lower bits only (Laine and Karras 2011, with Vegdahl's steps of 2021), for Owen scrambling; and the digits
# of Sobol's second dimension, a Pascal matrix modulo 2.


def _reverse_bits(x: int) -> int:
    return int(f"{x:032b}"[::-1], 2)


def _scramble(x: int, seed: int) -> int:
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
    """A sample sequence: a function for its positions, and its properties."""

    # A function of (k, number of samples) that returns the position of sample k in [0, 1)^2.
    place: Callable[[int, int], tuple[float, float]]
    # Whether the first n points are spread over the pixel for every n, so that samples can be added one at a time. The
    # other sequences need a square number of samples.
    is_progressive: bool = False
    # Whether each pixel exchanges digits of the positions by a hash of its own. It is true only for points that stay as
    # evenly spread, such as digital sequences.
    is_scattered: bool = False
    # Whether the samples allow an estimate of the error of their mean.
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
