"""Direction cells: for a camera or a light, the balls that a ray through each cell of directions may meet.

The cells are a grid over the picture (screen tiles), or a grid on each of two hemispheres around a light (the light
buffer of Haines and Greenberg 1986). A cell lists all balls that a ray through it may meet, and rarely others. Balls
are bounding spheres. All is computed in float64, and holds for rays and balls rounded to float32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import InputError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Part = tuple[int, int, int, int]  # a part of a grid or picture: x, y, width, height; (x, y) is the lowest on the left

# The side of a picture's cells, in pixels.
CELL = 16
# The side of the blocks of a cell, in pixels, if only some of its pixels are drawn (stopping_rule.py). It divides CELL.
# llvmpipe shades 4 x 4 pixels at a time, and GPUs a few more, such as 4 x 8.
BLOCK = 4
# The margin of a ball's radius and of its bounds, relative to themselves. With it, a grazing ray finds its ball
# although shaders round both to float32 (2^-24), in up to a few dozen steps.
MARGIN = 2.0**-18
# The margin for the rounding of a camera ray's direction, 16 of float32's 2^-24: see grown_radii().
_TURN = 2.0**-20
# The margin of a ray's place in the grid, as a share of the grid's extent: tangents are offset before they are scaled,
# so near 0 their error is not relative to themselves. It is at most 1/100 of a cell for grids up to 10,000 cells wide,
# and 1/16 of a pixel for pictures of the largest size.
EDGE = 2.0**-20
# The largest tangent that float64 gives to within MARGIN. A larger one counts as infinite.
_FLAT = 2.0**30
# The number of balls that are bounded at once: allocators reuse the memory of arrays of this size without system calls.
_BLOCK = 2**13
# The most pairs of a cell and an item: at some 40 bytes each during the computation, 2.5 GiB.
MAX_PAIRS = 2**26


class Lists(NamedTuple):
    """The lists of cells. The list of cell i is entries[ends[i, 0] : ends[i, 1]]; cells may share a list."""

    ends: NDArray[np.int32]  # (cells, 2)
    entries: NDArray[np.int32]

    def longest(self) -> int:
        """Return the number of entries of the longest list."""
        return int(np.subtract(*self.ends.T[::-1]).max(initial=0))

    def occupied(self) -> NDArray[np.bool_]:
        """Return which lists have entries (cells,)."""
        return self.ends[:, 1] > self.ends[:, 0]


def grown_radii(centers: Array, radii: Array, times: Array | float = 1.0) -> Array:
    """Return radii (N,) with which balls hold the balls of `radii` as the camera, at the origin, sees them in float32.

    `times` multiplies the growth for the rounding of a ray's direction, for balls that grow faster.

    A ray that meets a ball in float32 passes its centre c at a distance p <= r + 8 u (A + p), by sphere.glsl. Here u =
    2^-24, and A is the length of the vector of |c_j d_k| + |c_k d_j| over the three pairs of axes, for the ray's
    direction d. d differs from c / |c| by at most sqrt(2) p / |c|, so A <= 2 N / |c| + 3 p, where N is the length of
    the vector of the three products c_j c_k. Together p <= (r + 16 u N / |c|) / (1 - 32 u). This margin is some u r in
    the middle of a picture, and u |c| in a wide view.
    """
    x, y, z = centers.T
    distance = np.sqrt(x * x + y * y + z * z)
    across = np.sqrt((x * y) ** 2 + (y * z) ** 2 + (z * x) ** 2) / np.where(distance > 0.0, distance, 1.0)
    return (radii + times * _TURN * across) * (1.0 + MARGIN)


def tangents(centers: Array, radii: Array) -> tuple[Array, Array]:
    """Return the smallest bounds (lo, hi), each (N, 2), of (x/-z, y/-z) over all rays in front that meet each ball.

    The eye is at the origin and looks along -z; in front means z < 0. `centers` (N, 3) and `radii` (N,) are lengths.
    The bounds hold grown_radii() balls, and have a margin MARGIN. They are -inf or +inf if the ball holds the eye, or
    reaches the eye's plane on that side. They are lo = +inf and hi = -inf for a ball that no ray in front can meet.

    For one axis, a ray may have any direction along the other one. So the ball is its projection, a disc of radius r at
    (a, b), a ahead and b aside, with h^2 = a^2 + b^2. The tangent rays have the length q = sqrt(h^2 - r^2) and the
    directions (a q + b r, b q - a r) and (a q - b r, b q + a r). With rounding e = 2^-53, q is off by 8 e of itself for
    r < h / 2. For a larger r, q is the right one of a disc whose radius is off by 8 e r, far less than MARGIN. Rounding
    turns a direction by 8 e more. So a bound t is off by at most 8 e (1 + t^2), and by as small a share of |t| and of
    the other bound if both are near 0.
    """
    lo, hi = np.empty((2, 2, len(radii)))
    for first in range(0, len(radii), _BLOCK):
        part = slice(first, first + _BLOCK)
        _tangents(centers[part], radii[part], lo[:, part], hi[:, part])
    return lo.T, hi.T


def _tangents(centers: Array, radii: Array, lo: Array, hi: Array) -> None:
    """Write tangents() into `lo` and `hi`, (2, N) each."""
    radius = grown_radii(centers, radii)
    depth = -centers[:, 2]
    # A memory order in which NumPy's loops run along the balls, not the two axes.
    across = np.ascontiguousarray(centers[:, :2].T)
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
    *,
    part: Part | None = None,
) -> tuple[Ints, Ints]:
    """Return (cell, item), each (M,): all pairs of a cell and an item whose rectangle [lo, hi] overlaps the cell.

    `lo` and `hi` are (N, 2). In a grid of `shape` (columns, rows), cell (i, j) covers origin + [i, i + 1] step in x,
    and likewise in y; a step may be negative. Only the cells of a `part` of the grid count. Default: all. In a part
    from (i0, j0) on, the cell's number is (j - j0) * columns + i - i0, with the columns of the part. Rectangles have
    the margin EDGE. Pairs are sorted by item, then cell. Raises InputError above `most` pairs, or MAX_PAIRS.
    """
    left, low, width, height = part or (0, 0, *shape)
    first, last = overlapped_cells(lo, hi, origin, step, shape)
    first = np.maximum(first - (left, low), 0)
    count = np.maximum(np.minimum(last - (left, low), (width - 1, height - 1)) - first + 1, 0)
    columns, rows = count[:, 0], count[:, 1]
    check_pairs(int(columns @ rows), most)
    item, row = repeat_counting(np.arange(len(lo), dtype=np.int64), np.where(columns > 0, rows, 0), first[:, 1])
    row, cell = repeat_counting(np.arange(len(item)), columns[item], row * width + first[item, 0])
    return cell, item[row]


def check_pairs(count: int, most: int | None) -> None:
    """Raise InputError for more than `most` pairs of a cell and an object, or more than MAX_PAIRS."""
    most = MAX_PAIRS if most is None else min(most, MAX_PAIRS)
    if count > most:
        raise InputError(
            f"expected at most {most} pairs of an object and a cell that it may be seen in, got {count}", "objects"
        )


def overlapped_cells(
    lo: Array, hi: Array, origin: tuple[float, float], step: tuple[float, float], shape: tuple[int, int]
) -> tuple[Ints, Ints]:
    """Return (first, last), each (N, 2): the columns and rows of the cells that each rectangle overlaps.

    For the arguments see overlaps(). A rectangle that overlaps no cell has last = first - 1 in both.
    """
    size = np.array(shape)
    at = [(bound - origin) / step for bound in (lo, hi)]
    down = np.array(step) < 0.0
    low, high = np.where(down, at[1], at[0]), np.where(down, at[0], at[1])
    # Clip before the conversion to integers, because bounds may be infinite.
    first = np.floor(np.clip(low - EDGE * size, 0.0, size)).astype(np.int64)
    last = np.floor(np.clip(high + EDGE * size, -1.0, size - 1.0)).astype(np.int64)
    none = np.any((lo > hi) | (last < first), axis=1)
    return first, np.where(none[:, None], first - 1, last)


def repeat_counting(items: Ints, count: Ints, start: Ints) -> tuple[Ints, Ints]:
    """Repeat every item `count` times, and beside it start, start + 1, ..., start + count - 1."""
    end = np.cumsum(count)
    offset = np.repeat(start - (end - count), count)
    return np.repeat(items, count), offset + np.arange(len(offset))


def hemisphere_cells(centers: Array, radii: Array, grid: int, most: int | None = None) -> tuple[Ints, Ints]:
    """Return (cell, item), each (M,): all pairs of a cell around a light and a ball in it. The light is at the origin.

    The hemispheres are z >= 0, then z < 0, each of grid x grid cells. A direction D is in the column of D_x / s and the
    row of D_y / s with s = |D_z| + |D|, both from -1 to 1: the stereographic projection. A cell's number is
    (hemisphere * grid + row) * grid + column. Raises InputError above `most` pairs, or MAX_PAIRS.

    The projection maps circles to circles. The rays to a ball of radius r at c, at the distance d, are a cone around c
    whose half angle has the sine r / d and the cosine q / d, with q = sqrt(d^2 - r^2). So the circle has the centre
    (c_x, c_y) / (h + q) and the radius r / (h + q), where h is the height of c in the hemisphere.
    """
    radius = grown_radii(centers, radii)
    x, y, z = centers.T
    square = (x * x + y * y + z * z) - radius * radius
    touching = np.sqrt(np.maximum(square, 0.0))
    items, los, his = [], [], []
    for sign in (1.0, -1.0):
        height = sign * z
        seen = np.flatnonzero((height + radius >= -MARGIN * touching) | (square <= 0.0))
        scale = height[seen] + touching[seen]
        # A ball far below the equator, or around the light, is in all cells: its circle is large, or holds infinity.
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


def cells_in(part: Part) -> Part:
    """Return the cells that a part of a picture touches, in cells."""
    x, y, width, height = part
    return x // CELL, y // CELL, -(-(x + width) // CELL) - x // CELL, -(-(y + height) // CELL) - y // CELL


def mask_shape(part: Part) -> tuple[int, int]:
    """Return (rows, columns) of the cells of a part of a picture."""
    _, _, columns, rows = cells_in(part)
    return rows, columns


def row_starts(cell: Ints, cells: int) -> Ints:
    """Return (cells + 1,): where the entries of each cell begin, once they are sorted by cell."""
    start = np.zeros(cells + 1, np.int64)
    np.cumsum(np.bincount(cell, minlength=cells), out=start[1:])
    return start
