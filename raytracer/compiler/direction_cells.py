"""From one point, the camera or a light: which balls can a ray in which direction meet?

The directions are divided into cells, a grid over the picture or one on each of two hemispheres around
a light, and each cell lists the balls that a ray through it may meet: never too few, rarely too
many. The light buffer of Haines and Greenberg 1986, and for the camera screen tiles. Balls are
bounding spheres; all is computed in float64, and holds for rays and balls rounded to float32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import InputError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Side of the cells in which a picture is divided, in pixels.
CELL = 16
# Side of the blocks in which a cell is divided where only some of its pixels are drawn (stopping_rule.py): one
# that divides CELL. llvmpipe shades 4 x 4 pixels at a time, GPUs 4 x 8 and the like.
BLOCK = 4
# By how much, relative to a ball's radius and to its bounds, they are widened: it decides whether a
# grazing ray finds its ball though shaders round both to float32 (2^-24), in up to a few dozen steps.
MARGIN = 2.0**-18
# The same for what rounding turns a ray of the camera by, 16 of float32's 2^-24: see widened().
_TURN = 2.0**-20
# The same for a ray's place in the grid, of the grid's extent: tangents are offset before they are
# scaled, so near 0 their error is not relative to themselves. A hundredth of a cell or less for
# grids up to 10,000 wide; of pixels, a sixteenth for pictures of the largest size.
EDGE = 2.0**-20
# A tangent above which float64 no longer gives it to within MARGIN; it counts as infinite.
_FLAT = 2.0**30
# Balls that are bounded at once: allocators reuse the memory of arrays of so many without asking the system.
_BLOCK = 2**13
# Pairs of a cell and an item; at some 40 bytes each while they are made, 2.5 GiB.
MAX_PAIRS = 2**26


class Lists(NamedTuple):
    """Cell i's entries are entries[ends[i, 0] : ends[i, 1]]; cells may share them."""

    ends: NDArray[np.int32]  # (cells, 2)
    entries: NDArray[np.int32]

    def longest(self) -> int:
        """The number of entries of the longest list."""
        return int(np.subtract(*self.ends.T[::-1]).max(initial=0))

    def occupied(self) -> NDArray[np.bool_]:
        """(cells,): which lists have entries."""
        return self.ends[:, 1] > self.ends[:, 0]


def widened(centers: Array, radii: Array, times: Array | float = 1.0) -> Array:
    """(N,): radii of balls that hold those of radius `radii` as float32 shows them to the camera, at the origin; or
    balls that grow by so many `times` what that moves a ray by.

    A ray that meets a ball in float32 passes its centre c at a distance p <= r + 8 u (A + p), by sphere.glsl, with
    u = 2^-24 and A the length of (|c_j d_k| + |c_k d_j|) for its direction d, over the three pairs of axes. d is off
    c / |c| by sqrt(2) p / |c| at most, so A <= 2 N / |c| + 3 p, with N the length of the three c_j c_k: all in all
    p <= (r + 16 u N / |c|) / (1 - 32 u). That is some u r in the middle of a picture, u |c| where the view is wide.
    """
    x, y, z = centers.T
    distance = np.sqrt(x * x + y * y + z * z)
    across = np.sqrt((x * y) ** 2 + (y * z) ** 2 + (z * x) ** 2) / np.where(distance > 0.0, distance, 1.0)
    return (radii + times * _TURN * across) * (1.0 + MARGIN)


def tangents(centers: Array, radii: Array) -> tuple[Array, Array]:
    """The smallest bounds (lo, hi), each (N, 2), of (x/-z, y/-z) over all rays in front that meet each ball.

    The eye is at the origin and looks along -z; in front is z < 0. `centers` (N, 3) and `radii` (N,)
    are lengths. Bounds hold widened() balls, and are widened by MARGIN; -inf, +inf where the ball reaches round
    to the eye's plane on that side or holds the eye; lo = +inf, hi = -inf for a ball that no ray in front can meet.

    Along the other axis a ray may go anywhere, so per axis the ball is its shadow, a disc of radius r at (a, b): a
    ahead, b aside, h^2 = a^2 + b^2. The rays that touch it are as long as q = sqrt(h^2 - r^2) up to there, and have the
    directions (a q + b r, b q - a r) and (a q - b r, b q + a r). Rounding, e = 2^-53, gives q to 8 e of itself where
    r < h / 2. Elsewhere q belongs to a disc whose radius is off by 8 e r: less than MARGIN by far. Rounding turns a
    direction by 8 e more. So a bound t is off by 8 e (1 + t^2) at most, and by as small a share of |t| and the other
    bound where both are near 0.
    """
    lo, hi = np.empty((2, 2, len(radii)))
    for first in range(0, len(radii), _BLOCK):
        part = slice(first, first + _BLOCK)
        _tangents(centers[part], radii[part], lo[:, part], hi[:, part])
    return lo.T, hi.T


def _tangents(centers: Array, radii: Array, lo: Array, hi: Array) -> None:
    """Write tangents() into `lo` and `hi`, (2, N) each."""
    radius = widened(centers, radii)
    depth = -centers[:, 2]
    across = np.ascontiguousarray(centers[:, :2].T)  # in this order NumPy's loops run along the balls, not the two axes
    square = across * across + (depth * depth - radius * radius)
    outside = square > 0.0
    touching = np.sqrt(np.maximum(square, 0.0))
    along, aside = depth * touching, across * touching
    lean, turn = across * radius, depth * radius
    shift = np.zeros(len(radius))
    for bound, ahead, beside in ((lo, along + lean, aside - turn), (hi, along - lean, aside + turn)):
        bound[:] = -np.inf if bound is lo else np.inf
        size = np.abs(beside)
        is_finite = outside & (ahead * _FLAT > size)
        np.divide(beside, ahead, out=bound, where=is_finite)
        np.divide(size, ahead, out=size, where=is_finite)
        size[~is_finite] = 0.0
        shift += size[0] + size[1]
    shift *= MARGIN
    lo -= shift
    hi += shift
    behind = depth + radius <= 0.0
    lo[:, behind], hi[:, behind] = np.inf, -np.inf


def overlaps(
    lo: Array,
    hi: Array,
    origin: tuple[float, float],
    step: tuple[float, float],
    shape: tuple[int, int],
    most: int | None = None,
) -> tuple[Ints, Ints]:
    """(cell, item), each (M,): all pairs of a cell and an item whose rectangle [lo, hi] overlaps it.

    `lo` and `hi` are (N, 2). Cell (i, j) covers origin + [i, i + 1] step and so on in y, of a grid of
    `shape` (columns, rows); a step may be negative. Its number is j * columns + i. Rectangles are
    widened by EDGE. Pairs are sorted by item, then cell. Raises InputError above `most`, or MAX_PAIRS.
    """
    first, last = covered(lo, hi, origin, step, shape)
    count = last - first + 1
    columns, rows = count[:, 0], count[:, 1]
    check_pairs(int(columns @ rows), most)
    item, row = runs(np.arange(len(lo), dtype=np.int64), np.where(columns > 0, rows, 0), first[:, 1])
    row, cell = runs(np.arange(len(item)), columns[item], row * shape[0] + first[item, 0])
    return cell, item[row]


def check_pairs(count: int, most: int | None) -> None:
    """Raise InputError for more than `most` pairs, or MAX_PAIRS, of a cell and an object."""
    most = MAX_PAIRS if most is None else min(most, MAX_PAIRS)
    if count > most:
        raise InputError(
            f"expected at most {most} pairs of an object and a cell that it may be seen in, got {count}", "objects"
        )


def covered(
    lo: Array, hi: Array, origin: tuple[float, float], step: tuple[float, float], shape: tuple[int, int]
) -> tuple[Ints, Ints]:
    """(first, last), each (N, 2): the columns and rows that overlaps() says of each rectangle.

    last is first - 1 in both where there are none.
    """
    size = np.array(shape)
    at = [(bound - origin) / step for bound in (lo, hi)]
    down = np.array(step) < 0.0
    low, high = np.where(down, at[1], at[0]), np.where(down, at[0], at[1])
    # Clipped before they are integers: bounds may be infinite.
    first = np.floor(np.clip(low - EDGE * size, 0.0, size)).astype(np.int64)
    last = np.floor(np.clip(high + EDGE * size, -1.0, size - 1.0)).astype(np.int64)
    none = np.any((lo > hi) | (last < first), axis=1)
    return first, np.where(none[:, None], first - 1, last)


def runs(items: Ints, count: Ints, start: Ints) -> tuple[Ints, Ints]:
    """Repeat every item `count` times, and beside it start, start + 1, ..., start + count - 1."""
    end = np.cumsum(count)
    offset = np.repeat(start - (end - count), count)
    return np.repeat(items, count), offset + np.arange(len(offset))


def hemisphere_cells(centers: Array, radii: Array, grid: int, most: int | None = None) -> tuple[Ints, Ints]:
    """(cell, item), each (M,): for a light at the origin, the cells of two hemispheres around it, and the balls there.

    The hemispheres are z >= 0, then z < 0, each of grid x grid cells. A direction D is in the column of D_x / s and the
    row of D_y / s with s = |D_z| + |D|, both from -1 to 1: the stereographic projection. A cell's number is
    (hemisphere * grid + row) * grid + column. Raises InputError above `most`, or MAX_PAIRS.

    The projection makes a circle of a circle. The rays to a ball of radius r at c, at the distance d, are a cone
    around c whose half angle has the sine r / d and the cosine q / d, with q = sqrt(d^2 - r^2). So the circle has the
    centre (c_x, c_y) / (h + q) and the radius r / (h + q), with h the height of c in the hemisphere.
    """
    radius = widened(centers, radii)
    x, y, z = centers.T
    square = (x * x + y * y + z * z) - radius * radius
    touching = np.sqrt(np.maximum(square, 0.0))
    items, los, his = [], [], []
    for sign in (1.0, -1.0):
        height = sign * z
        seen = np.flatnonzero((height + radius >= -MARGIN * touching) | (square <= 0.0))
        scale = height[seen] + touching[seen]
        # A ball far below the equator, or around the light, takes all cells: its circle is large, or holds infinity.
        bounded = (square[seen] > 0.0) & (height[seen] >= -0.7 * touching[seen])
        half = radius[seen] / np.where(bounded, scale, 1.0)
        middle = np.stack((x[seen], y[seen])) / np.where(bounded, scale, 1.0)
        half = np.where(bounded, half + MARGIN * (half + np.abs(middle).sum(axis=0)), np.inf)
        items.append(seen)
        los.append(np.where(bounded, middle - half, -np.inf))
        his.append(np.where(bounded, middle + half, np.inf))
    item = np.concatenate(items)
    face = np.repeat(np.arange(2), list(map(len, items)))
    step = 2.0 / grid
    lo, hi = np.concatenate(los, axis=1).T, np.concatenate(his, axis=1).T
    cell, pair = overlaps(lo, hi, (-1.0, -1.0), (step, step), (grid, grid), most)
    return cell + (face * grid * grid)[pair], item[pair]


def row_starts(cell: Ints, cells: int) -> Ints:
    """(cells + 1,): where the entries of each cell begin once they are sorted by cell."""
    start = np.zeros(cells + 1, np.int64)
    np.cumsum(np.bincount(cell, minlength=cells), out=start[1:])
    return start
