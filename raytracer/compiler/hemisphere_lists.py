"""The lists of balls of the cells around a light, made fast for scenes with many balls and many lights.

Most balls are small as seen from a light. A few float32 operations give the cells of a small ball, and
hemisphere_cells() gives the cells of all other balls.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import Array, Ints, Lists, check_pairs, hemisphere_cells, repeat_counting

Floats: TypeAlias = NDArray[np.float32]
Words: TypeAlias = NDArray[Any]  # of the type _Keys.word

# A ball is small if its centre is more than _SMALL radii away, and more than _NEAREST, so that squares of distances
# stay in float32's range.
_SMALL, _NEAREST = 2.0, 2.0**-50
# Margins for float32's roundings, as shares of distances, radii and half a grid: see _small_keys().
_STEP = 2.0**-24
_AWAY, _RADIUS, _EDGE = 16.0 * _STEP, 128.0 * _STEP, 512.0 * _STEP
# The number of bits of the distance by which the balls of a list are sorted, if 32 bits have room for them: a blocked
# ray then finds a ball near the light sooner.
_LEVELS = 6


class LightBalls(NamedTuple):
    """The balls in the lists of all lights, in view space."""

    centers: Array  # (N, 3)
    radii: Array  # (N,): the radii for a point light, without rounding
    growth: Array  # (N,): if rounding moves a ray by d, the balls grow by growth * d more than other balls
    shown: Floats  # (4 or 5, N): x, y, z, radius, and the growth if any ball has one, in float32


class _Keys(NamedTuple):
    """The layout of the keys that sort balls into lists: bits of the cell, of the distance, and of the ball's
    number."""

    grid: int
    word: type[Any]  # np.uint32 or np.uint64
    levels: int  # number of bits of the distance
    numbers: int  # number of bits of a ball's number

    @property
    def cell(self) -> Any:
        """The lowest bit of the cell."""
        return self.word(self.levels + self.numbers)


def light_balls(centers: Array, radii: Array, growth: Array) -> LightBalls:
    """Round balls to float32, for all lights at once."""
    with np.errstate(over="ignore"):
        grows = [growth * (1.0 + _RADIUS)] if growth.any() else []
        shown = np.vstack((centers.T, radii * (1.0 + _RADIUS), *grows)).astype(np.float32)
    return LightBalls(centers, radii, growth, shown)


def hemisphere_lists(
    balls: LightBalls, place: Array, wider: float, passing: float, grid: int, most: int
) -> tuple[Lists, int]:
    """Make the lists of the cells around a light at `place`, and count the entries of the longest list.

    hemisphere_cells() numbers the cells. All radii grow by `wider`, and by `passing` more for each unit of growth. In a
    list, nearer balls come first, roughly. Raises InputError above `most` pairs of a cell and a ball.
    """
    count = len(balls.radii)
    numbers = max(count - 1, 1).bit_length()
    left = 32 - numbers - (2 * grid * grid).bit_length()
    keys = _Keys(grid, np.uint32, min(left, _LEVELS), numbers) if left > 0 else _Keys(grid, np.uint64, _LEVELS, numbers)
    parts, others = _small_keys(balls, place, wider, passing, keys, most) if count else ([], np.zeros(0, np.int64))
    if len(others) or not count:
        radii = balls.radii[others] + balls.growth[others] * passing + wider
        cell, ball = hemisphere_cells(balls.centers[others] - place, radii, grid, most)
        parts.append(cell.astype(keys.word) << keys.cell | others.astype(keys.word)[ball])
    return _sorted_lists(np.concatenate(parts), keys)


def _small_keys(
    balls: LightBalls, place: Array, wider: float, passing: float, keys: _Keys, most: int
) -> tuple[list[Words], Ints]:
    """Make the keys of all pairs of a cell and a small ball, and find all other balls.

    The margins, with u = _STEP: Rounding moves a ball's centre, the light and their difference by u of each length, in
    all by at most 2 u (distance + |place|). It turns a ray as grown_radii() of direction_cells.py assumes: by at most
    16 u / sqrt(3) of the distance, the largest length of the three products of two coordinates. The radii grow by all
    of these. The sums are off by 4 u of themselves, and grown_radii() adds MARGIN, 64 u: _RADIUS covers both.

    As d >= 2 r, d^2 - r^2 is off by 5 u of itself. A ball at the equator is in both hemispheres, in one of them with a
    height h of at least -1.1 r. So q + h is off by 10 u of itself, a place in the grid by 16 u of half the grid, and a
    projected radius, at most 1.6 times half the grid, by 13 u of itself. _EDGE covers these errors, and the margins of
    overlaps(), 32 u, and of hemisphere_cells(), 64 u of the radius and of two coordinates, each at most 2.6.
    """
    word, shift = keys.word, keys.cell
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, z = (row - own for row, own in zip(balls.shown[:3], place.astype(np.float32), strict=True))
        square = x * x
        square += y * y
        square += z * z
        distance = np.sqrt(square)
        radius = distance * np.float32(_AWAY)
        radius += balls.shown[3]
        for growth in balls.shown[4:]:
            radius += growth * np.float32(passing)
        radius += np.float32(wider * (1.0 + _RADIUS) + 4.0 * _STEP * float(np.linalg.norm(place)))
        height = np.abs(z)
        small = distance > radius * np.float32(_SMALL)
        small &= distance > np.float32(_NEAREST)
    below = z < 0.0
    low = np.arange(len(x), dtype=word)
    others = (~small).nonzero()[0]
    if len(others):
        chosen = small.nonzero()[0]
        parts = (x, y, height, square, distance, radius, low, below)
        x, y, height, square, distance, radius, low, below = (part.take(chosen) for part in parts)
        if not len(chosen):
            return [low], others
    equator = (height <= radius + distance * np.float32(_EDGE)).nonzero()[0]
    if len(equator):
        height, below = np.concatenate((height, -height[equator])), np.concatenate((below, ~below[equator]))
        parts = (x, y, square, distance, radius, low)
        x, y, square, distance, radius, low = (np.concatenate((part, part.take(equator))) for part in parts)
    distance *= np.float32(2.0 ** (keys.levels - 1) / float(distance.mean()))
    np.minimum(distance, np.float32(2**keys.levels - 1), out=distance)
    low += distance.astype(word) << word(keys.numbers)
    square -= radius * radius
    scale = np.sqrt(square, out=square)
    scale += height
    half = np.float32(0.5 * keys.grid)
    np.divide(half, scale, out=scale)
    radius *= scale
    radius += half * np.float32(_EDGE)
    key = below * word(1)
    more = []  # for y and x: the number of rows or columns after the first one
    for side in (y, x):
        side *= scale
        side += half
        first = _round_down(np.subtract(side, radius), np.float32(keys.grid - 1), word)
        side += radius
        key *= word(keys.grid)
        key += first
        more.append(_round_down(side, np.float32(keys.grid - 1), word) - first)
    key <<= shift
    key += low
    rows, columns = more
    keys_of_balls = [key]
    if max(int(rows.max()), int(columns.max())) > 1:
        large = (np.maximum(rows, columns) > 1).nonzero()[0]
        wide = columns[large].astype(np.int64) + 1
        count = wide * (rows[large].astype(np.int64) + 1)
        check_pairs(int(count.sum()), most)
        ball, number = repeat_counting(np.arange(len(large)), count - 1, np.ones(len(large), np.int64))
        row, column = np.divmod(number, wide[ball])
        keys_of_balls.append(key[large[ball]] + ((row * keys.grid + column).astype(word) << shift))
        rows[large] = columns[large] = 0
    right = (columns > 0).nonzero()[0]
    beside = key.take(right) + (word(1) << shift)
    up = word(keys.grid) << shift
    above = key.take((rows > 0).nonzero()[0]) + up
    return [*keys_of_balls, beside, above, beside.take((rows.take(right) > 0).nonzero()[0]) + up], others


def _round_down(numbers: Floats, top: np.float32, word: type[Any]) -> Words:
    """Round numbers down to whole numbers from 0 to `top`. Changes `numbers` in place."""
    np.maximum(numbers, np.float32(0.0), out=numbers)
    np.minimum(numbers, top, out=numbers)
    return numbers.astype(word)


def _sorted_lists(key: Words, keys: _Keys) -> tuple[Lists, int]:
    """Sort the keys of balls into the lists of all cells, and count the entries of the longest list."""
    longest = 0
    ends = np.zeros((2 * keys.grid**2, 2), np.int32)
    key.sort()
    if len(key):
        cell = key >> keys.cell
        change = np.flatnonzero(cell[1:] != cell[:-1])
        change += 1
        spans = np.empty((len(change) + 1, 2), np.int32)
        spans[0, 0], spans[1:, 0] = 0, change
        spans[:-1, 1], spans[-1, 1] = change, len(key)
        occupied = np.concatenate((cell[:1], cell.take(change))).astype(np.int64)
        longest = int((spans[:, 1] - spans[:, 0]).max())
        # Each pair of 32-bit numbers is written as one 64-bit number, which is several times faster.
        ends.view(np.int64)[occupied, 0] = spans.view(np.int64)[:, 0]
    key &= keys.word((1 << keys.numbers) - 1)
    # Keys of 32 bits serve as entries without a copy.
    return Lists(ends, key.view(np.int32) if key.itemsize == 4 else key.astype(np.int32)), longest
