"""The lists of balls of the cells of a cube around a light, for scenes of many balls and many lights.

Most balls are small as seen from a light. A few float32 operations give the cells of a small ball, and cube_faces()
those of any other.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import Array, Ints, Lists, check_pairs, cube_faces, runs

Floats: TypeAlias = NDArray[np.float32]
Words: TypeAlias = NDArray[Any]  # of _Keys.word

# A ball is small if its centre is so many radii away, and not so near that squares of distances leave float32's range.
_SMALL, _NEAREST = 8.0, 2.0**-50
# Shares of distances, radii and a face's half side that hold float32's roundings: see _seen() and _face_keys().
_STEP = 2.0**-24
_AWAY, _RADIUS, _EDGE = 16.0 * _STEP, 128.0 * _STEP, 512.0 * _STEP
# More than sqrt(2): a ball meets the quarter of space |b| <= a only if |b| <= a + sqrt(2) radius.
_DIAGONAL = 1.4145
# Bits of the distance by which balls of a list are sorted, if so many are left of 32: rays that are blocked find a
# nearer ball sooner.
_LEVELS = 6


class CubeBalls(NamedTuple):
    """Balls for the cubes around all lights, in view space."""

    centers: Array  # (N, 3)
    radii: Array  # (N,): of balls for a light of no size, that no rounding moves
    growth: Array  # (N,): by so many d they are wider than others where rounding moves a ray by d
    shown: Floats  # (5, N): x, y, z, radius and growth, to float32


class _Keys(NamedTuple):
    """The numbers by which balls are sorted into lists: bits of the cell, of the distance, and of the ball's number."""

    grid: int
    word: type[Any]  # np.uint32 or np.uint64
    levels: int  # bits of the distance
    numbers: int  # bits of a ball's number

    @property
    def cell(self) -> Any:
        """The place of a cell's bits."""
        return self.word(self.levels + self.numbers)


class _Seen(NamedTuple):
    """Balls as seen from a light."""

    places: tuple[Floats, ...]  # x, y, z of the centres from the light
    distance: Floats
    radius: Floats
    low: Words  # all of a key but the cell

    def take(self, number: Ints) -> _Seen:
        """Only the balls with these numbers."""
        x, y, z, distance, radius, low = (part.take(number) for part in (*self.places, *self[1:]))
        return _Seen((x, y, z), distance, radius, low)


def cube_balls(centers: Array, radii: Array, growth: Array) -> CubeBalls:
    """Round balls to float32, for all lights at once."""
    with np.errstate(over="ignore"):
        shown = np.vstack((centers.T, radii * (1.0 + _RADIUS), growth * (1.0 + _RADIUS))).astype(np.float32)
    return CubeBalls(centers, radii, growth, shown)


def cube_lists(balls: CubeBalls, place: Array, wider: float, passing: float, grid: int, most: int) -> tuple[Lists, int]:
    """Make the lists for the cells of the cube around a light at `place`, numbered as cube_faces() does.

    The second value is how many entries the longest list has.

    All balls are `wider`, and by `passing` more for each unit of growth. In a list, nearer balls come first, roughly.
    Raises InputError above `most` pairs of a cell and a ball.
    """
    numbers = max(len(balls.radii) - 1, 1).bit_length()
    left = 32 - numbers - (6 * grid * grid).bit_length()
    keys = _Keys(grid, np.uint32, min(left, _LEVELS), numbers) if left > 0 else _Keys(grid, np.uint64, _LEVELS, numbers)
    seen, small = _seen(balls, place, wider, passing, keys)
    parts = _small_keys(seen, keys, most) if len(seen.low) else [np.zeros(0, keys.word)]
    if len(seen.low) < len(small):
        number = np.flatnonzero(~small)
        radii = balls.radii[number] + balls.growth[number] * passing + wider
        cell, ball = cube_faces(balls.centers[number] - place, radii, grid, most)
        parts.append(cell.astype(keys.word) << keys.cell | number.astype(keys.word)[ball])
    return _sorted_lists(np.concatenate(parts), keys)


def _seen(balls: CubeBalls, place: Array, wider: float, passing: float, keys: _Keys) -> tuple[_Seen, NDArray[np.bool_]]:
    """Find the small balls as seen from a light, and which ones are small.

    Let u be _STEP. Rounding moves a ball's centre, the light and their difference by u of each length, in all by
    2 u (distance + |place|) at most. It turns a ray by widened() of direction_cells.py, which is 16 u / sqrt(3) of the
    distance at most: the three products of two coordinates have at most that length. Radii grow by all these. The
    sums below are off by 4 u of themselves, and tangents() holds balls wider by MARGIN, 64 u: both are in _RADIUS.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        x, y, z = (row - shift for row, shift in zip(balls.shown[:3], place.astype(np.float32), strict=True))
        distance = np.sqrt(x * x + y * y + z * z)
        radius = distance * np.float32(_AWAY)
        radius += balls.shown[3]
        radius += balls.shown[4] * np.float32(passing)
        radius += np.float32(wider * (1.0 + _RADIUS) + 4.0 * _STEP * float(np.linalg.norm(place)))
        small = distance > radius * np.float32(_SMALL)
        small &= distance > np.float32(_NEAREST)
        low = np.arange(len(x), dtype=keys.word)
        seen = _Seen((x, y, z), distance, radius, low)
    if not small.all():
        seen = seen.take(np.flatnonzero(small))
    if len(seen.low):
        level = seen.distance * np.float32(2.0 ** (keys.levels - 1) / float(seen.distance.mean()))
        np.minimum(level, np.float32(2**keys.levels - 1), out=level)
        seen.low[:] += level.astype(keys.word) << keys.word(keys.numbers)
    return seen, small


def _small_keys(seen: _Seen, keys: _Keys, most: int) -> list[Words]:
    """Make the keys of all pairs of a cell and a small ball: on the face of the ball's centre, and on those beside."""
    x, y, z = seen.places
    sizes = np.abs(x), np.abs(y), np.abs(z)
    on_x = (sizes[0] >= sizes[1]) & (sizes[0] >= sizes[2])
    on_y = (sizes[1] >= sizes[2]) & ~on_x
    # Sums of products with 0 and 1 are faster than a choice, and as exact.
    at_x, at_y, at_z = (on.astype(np.float32) for on in (on_x, on_y, ~(on_x | on_y)))
    off_x, off_z = np.float32(1.0) - at_x, np.float32(1.0) - at_z
    main = x * at_x + y * at_y + z * at_z
    b, c = x * off_x + y * at_x, z * off_z + y * at_z
    axis = on_y.astype(keys.word) + keys.word(2) * at_z.astype(keys.word)
    reach = seen.radius * np.float32(_DIAGONAL)
    reach += seen.distance * np.float32(_EDGE)
    beside = (np.maximum(np.abs(b), np.abs(c)) + reach >= np.abs(main)).nonzero()[0]
    x, y, z, reach, own = (part.take(beside) for part in (x, y, z, reach, axis))
    numbers, faces = [], [(main, b, c)]
    for other, (p, q, r) in enumerate(((x, y, z), (y, x, z), (z, x, y))):
        seen_there = (own != other) & (np.abs(p) + reach >= np.maximum(np.abs(q), np.abs(r)))
        numbers.append(seen_there.nonzero()[0])
        faces.append(tuple(part.take(numbers[-1]) for part in (p, q, r)))
    again = beside.take(np.concatenate(numbers))
    rest = (np.concatenate((part, part.take(again))) for part in seen[1:])
    places = tuple(np.concatenate(part) for part in zip(*faces, strict=True))
    axis = np.concatenate((axis, np.repeat(np.arange(3, dtype=keys.word), list(map(len, numbers)))))
    return _face_keys(_Seen(places, *rest), axis, keys, most)


def _face_keys(seen: _Seen, axis: Words, keys: _Keys, most: int) -> list[Words]:
    """Make the keys of each ball's cells on one face, whose axis comes first in `places`: axis[i] of x, y, z.

    Along another axis, a ray meets the ball only if its tangent t is one of the ball's shadow, a disc of radius r at
    (a, b): |t - a b / (a^2 - r^2)| <= r sqrt(a^2 + b^2 - r^2) / (a^2 - r^2). The distance d in place of the square
    root makes that larger. As d >= 8 r and |b| <= a + 1.5 r, a >= 3 r. So rounding changes a^2 - r^2 by 3 u of itself,
    t by 8 u, and a place in the grid by 20 u of half the grid. _EDGE holds these, the margin of overlaps(), 32 u, and
    that of tangents(), 64 u of four bounds.
    """
    grid, word, shift = keys.grid, keys.word, keys.cell
    main, *across = seen.places
    half, top = np.float32(0.5 * grid), np.float32(grid - 1)
    scale = half / (main * main - seen.radius * seen.radius)
    width = seen.radius * seen.distance
    width *= scale
    width += half * np.float32(_EDGE)
    scale *= np.abs(main)
    key = axis + axis + (main < 0.0)
    more = []  # rows and columns behind the first one
    for side in across[::-1]:
        at: Floats = np.multiply(side, scale)
        at += half
        first = _cell_numbers(np.subtract(at, width), top, word)
        at += width
        key *= word(grid)
        key += first
        more.append(_cell_numbers(at, top, word) - first)
    rows, columns = more
    key <<= shift
    key += seen.low
    parts = [key]
    if max(int(rows.max(initial=0)), int(columns.max(initial=0))) > 1:
        large = (np.maximum(rows, columns) > 1).nonzero()[0]
        wide = columns[large].astype(np.int64) + 1
        count = wide * (rows[large].astype(np.int64) + 1)
        check_pairs(int(count.sum()), most)
        ball, place = runs(np.arange(len(large)), count - 1, np.ones(len(large), np.int64))
        row, column = np.divmod(place, wide[ball])
        parts.append(key[large[ball]] + ((row * grid + column).astype(word) << shift))
        rows[large] = columns[large] = 0
    right = (columns > 0).nonzero()[0]
    beside = key.take(right) + (word(1) << shift)
    up = word(grid) << shift
    above = key.take((rows > 0).nonzero()[0]) + up
    return [*parts, beside, above, beside.take((rows.take(right) > 0).nonzero()[0]) + up]


def _cell_numbers(at: Floats, top: np.float32, word: type[Any]) -> Words:
    """Round places in a grid down to whole numbers from 0 to `top`. It changes `at`."""
    np.maximum(at, np.float32(0.0), out=at)
    np.minimum(at, top, out=at)
    return at.astype(word)


def _sorted_lists(key: Words, keys: _Keys) -> tuple[Lists, int]:
    """Sort the keys of balls into the lists of all cells, and find how many entries the longest one has."""
    longest = 0
    ends = np.zeros((6 * keys.grid**2, 2), np.int32)
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
        # Two numbers are written as one, which is several times faster.
        ends.view(np.int64)[occupied, 0] = spans.view(np.int64)[:, 0]
    key &= keys.word((1 << keys.numbers) - 1)
    return Lists(ends, key.astype(np.int32)), longest
