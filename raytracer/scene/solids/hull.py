"""The faces of the convex hull of points.

The hull grows by one point after another (the beneath-beyond method: Preparata and Shamos 1985). All its decisions are
exact: float64 decides with a bound of its error, and integers decide the rest (Shewchuk 1997 calls this a filter). Then
no order of points and no coplanar or nearly equal points can break it. In the end, triangles that lie in one plane up
to rounding become one face.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]

# Points are rounded to integers up to 2^60: with the bits of float64 next to the largest coordinate, and 7 more.
_BITS = 60
# Bound of the error of a determinant of differences in float64, relative to the sum of the absolute products: 8 rounded
# operations follow one another, and twice that covers the rounding of the bound itself.
_DETERMINANT = 16.0 * 2.0**-53
# Points as far below a plane count as its points, relative to the largest coordinate. Corners that a program computes,
# as by a few rotations, are off by some 2^-53; this is 64 times as much.
_COPLANAR = 64.0 * 2.0**-53
# The smallest height of the first tetrahedron, relative to the largest coordinate: several times _COPLANAR, or all
# points would lie in both planes of a flat hull.
_FLAT = 8.0 * _COPLANAR
# A triangle is no part of a face, however thin it is, if its normal is 84 degrees or more away: cos 84 degrees.
_ASKEW = 0.1
# The most products in memory at once: 4 MiB of float64, which caches hold.
_PRODUCTS = 2**19


class Side(NamedTuple):
    """A face of a hull, or two parallel ones: low <= dot(normal, x) <= high. One face has low = -inf."""

    normal: tuple[float, float, float]  # a unit vector
    low: float
    high: float


def hull_sides(points: Array, thinnest: float) -> list[Side]:
    """Return the faces of the convex hull of `points` [N, 3], in a fixed order.

    All points lie inside the faces, up to rounding. Faces across an axis have exact normals. The list is empty if all
    points lie in one plane to float64, or within `thinnest` of it.
    """
    scale = 2.0 ** (_BITS - math.frexp(float(np.abs(points).max()) or 1.0)[1])
    places = np.unique(np.rint(points * scale), axis=0) + 0.0
    simplex = _first_tetrahedron(places, thinnest * scale)
    if simplex is None:
        return []
    triangles = _triangulate(places, simplex)
    corners, triangles = np.unique(triangles, return_inverse=True)
    normals = _face_normals(places[corners], triangles.reshape(-1, 3))
    return _pair(points, places[corners], normals)


def _integers(places: Array) -> Array:
    """Return the coordinates as an array of Python integers."""
    return np.array([[int(x) for x in place] for place in places.tolist()], dtype=object)


def _cross(u: Array, v: Array) -> tuple[Array, Array]:
    """Return the cross products of vectors [N, 3], and the sums of the absolute products."""
    (a, b, c), (x, y, z) = u.T, v.T
    left, right = np.stack((b * z, c * x, a * y), 1), np.stack((c * y, a * z, b * x), 1)
    return left - right, np.abs(left) + np.abs(right)


def _triangulate(places: Array, simplex: tuple[int, int, int, int]) -> Array:
    """Return the triangles [F, 3] of the hull of distinct points, counterclockwise as seen from outside."""
    hull = _Hull(places, simplex)
    # Far points first, so that most of the others are inside at once.
    distance = np.linalg.norm(places - places.mean(axis=0), axis=1)
    for i in np.argsort(-distance, kind="stable").tolist():
        if i not in simplex:
            hull.add(i)
    return hull.vertices[: hull.count]


def _first_tetrahedron(places: Array, thinnest: float) -> tuple[int, int, int, int] | None:
    """Return four points with a large volume; None if all points lie in one plane up to `thinnest`, or to rounding."""
    b = int(np.argmax(np.linalg.norm(places - places[0], axis=1)))
    offsets = places - places[0]
    normals, _ = _cross(np.broadcast_to(offsets[b], offsets.shape), offsets)
    areas = np.linalg.norm(normals, axis=1)
    c = int(np.argmax(areas))
    heights = offsets @ (normals[c] / (areas[c] or 1.0))
    d = int(np.argmax(np.abs(heights)))
    if abs(heights[d]) < max(thinnest, _FLAT * float(np.abs(places).max())):
        return None
    return (0, b, c, d) if heights[d] < 0.0 else (0, c, b, d)


class _Hull:
    """The triangles of a growing hull, in the first `count` rows of arrays."""

    def __init__(self, places: Array, simplex: tuple[int, int, int, int]) -> None:
        self._places = places
        self._exact = _integers(places)
        most = 2 * len(places) + 4  # Euler: a hull of N vertices has 2 N - 4 triangles
        self.count = 0
        self.vertices = np.zeros((most, 3), np.int64)
        self._anchors = np.zeros((most, 3))  # the first vertices
        self._normals = np.zeros((most, 3))
        self._errors = np.zeros((most, 3))
        a, b, c, d = simplex
        self._put(np.arange(4), np.array([(a, b, c), (a, d, b), (b, d, c), (c, d, a)]))
        self.count = 4

    def add(self, point: int) -> None:
        """Grow by a point."""
        signs = self._signs(point)
        if not (signs > 0).any():
            return
        # Triangles in the plane of the point go as well: the new ones then have an area.
        gone = np.flatnonzero(signs >= 0)
        old = self.vertices[gone]
        starts, ends = old.ravel(), old[:, (1, 2, 0)].ravel()
        size = len(self._places)
        twins = np.sort(ends * size + starts)
        edges = starts * size + ends
        is_rim = twins[np.searchsorted(twins, edges) % len(twins)] != edges
        starts, ends = starts[is_rim], ends[is_rim]
        made = np.column_stack((starts, ends, np.full(len(starts), point)))
        count = self.count + len(made) - len(gone)
        if len(made) >= len(gone):
            self._put(np.concatenate((gone, np.arange(self.count, count))), made)
        else:
            self._put(gone[: len(made)], made)
            holes = gone[len(made) :]
            kept = np.setdiff1d(np.arange(count, self.count), holes)
            holes = holes[holes < count]
            for rows in (self.vertices, self._anchors, self._normals, self._errors):
                rows[holes] = rows[kept]
        self.count = count

    def _put(self, rows: Array, vertices: Array) -> None:
        a, b, c = (self._places[vertices[:, i]] for i in range(3))
        self.vertices[rows], self._anchors[rows] = vertices, a
        self._normals[rows], products = _cross(b - a, c - a)
        self._errors[rows] = _DETERMINANT * products

    def _signs(self, point: int) -> Array:
        """Return 1, 0 or -1 for each triangle: whether the point is in front of it, in its plane or behind it."""
        offsets = self._places[point] - self._anchors[: self.count]
        heights = np.einsum("ij,ij->i", self._normals[: self.count], offsets)
        bounds = np.einsum("ij,ij->i", self._errors[: self.count], np.abs(offsets))
        signs = np.sign(heights)
        # A bound of 0 is exact: all the products are 0, or the differences of coordinates are.
        unsure = np.flatnonzero((np.abs(heights) <= bounds) & (bounds > 0.0))
        if len(unsure):
            a, b, c = (self._exact[self.vertices[unsure, i]] for i in range(3))
            normals, _ = _cross(b - a, c - a)
            exact = (normals * (self._exact[point] - a)).sum(axis=1)
            signs[unsure] = [(x > 0) - (x < 0) for x in exact]
        return signs


def _face_normals(places: Array, triangles: Array) -> Array:
    """Return the unit normals [M, 3] of the faces, where coplanar triangles have one face."""
    exact = _integers(places)
    a, b, c = (triangles[:, i] for i in range(3))
    normals = _cross(exact[b] - exact[a], exact[c] - exact[a])[0].astype(np.float64)
    areas = np.linalg.norm(normals, axis=1)
    normals /= areas[:, None]
    slack = _COPLANAR * float(np.abs(places).max())
    longest = np.max([np.linalg.norm(places[p] - places[q], axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    # The normal of a thin triangle is off, and its plane far away from it is off by so much more.
    extent = float(np.linalg.norm(np.ptp(places, axis=0)))
    slacks = slack * (1.0 + extent * longest / areas)
    faces: list[Array] = []
    is_done = np.zeros(len(triangles), bool)
    is_alone = np.concatenate([np.count_nonzero(_is_near(places, *rows), axis=1) <= 3
                               for rows in _split(len(places), normals, slacks)])  # fmt: skip
    for i in np.argsort(-areas, kind="stable").tolist():
        if is_done[i]:
            continue
        if is_alone[i]:
            faces.append(normals[i])
            continue
        normal = normals[i]
        for reach in (slacks[i], slack):
            fitted = _fit(exact, np.flatnonzero(_is_near(places, normals[i : i + 1], np.array([reach]))[0]), normal)
            heights = places @ fitted
            if np.max(heights) - np.max(heights[triangles[i]]) <= slack:
                normal = fitted
                break
        is_near = _is_near(places, normal[None], np.array([slack]))[0]
        is_done |= is_near[triangles].all(axis=1) & (normals @ normal > _ASKEW)
        faces.append(normal)
    return np.array(faces)


def _split(columns: int, *arrays: Array) -> list[tuple[Array, ...]]:
    """Return the arrays in parts, so that rows times `columns` stay within _PRODUCTS."""
    rows = max(1, _PRODUCTS // columns)
    return [tuple(array[i : i + rows] for array in arrays) for i in range(0, len(arrays[0]), rows)]


def _is_near(places: Array, normals: Array, slacks: Array) -> Array:
    """Whether each point [N] is within each slack [M] of the supporting plane with each normal [M, 3]: [M, N]."""
    heights = normals @ places.T
    return heights >= heights.max(axis=1, keepdims=True) - slacks[:, None]


def _fit(exact: Array, members: Array, normal: Array) -> Array:
    """Return the unit normal of a large triangle of points, on the side of `normal`; `normal` for points in a line."""
    offsets = exact[members] - exact[members[0]]
    rough = offsets.astype(np.float64)
    b = int(np.argmax(np.linalg.norm(rough, axis=1)))
    c = int(np.argmax(np.linalg.norm(np.cross(rough[b], rough), axis=1)))
    made = _cross(offsets[b : b + 1], offsets[c : c + 1])[0][0].astype(np.float64)
    length = float(np.linalg.norm(made))
    return made / math.copysign(length, float(made @ normal)) if length > 0.0 else normal


def _pair(points: Array, places: Array, normals: Array) -> list[Side]:
    """Return the faces with these normals around the points, two by two where they are parallel."""
    slack = _COPLANAR * float(np.abs(places).max())
    tops: list[bytes] = []
    bottoms: list[bytes] = []
    for (rows,) in _split(len(places), normals):
        heights = rows @ places.T
        tops += _members(heights >= heights.max(axis=1, keepdims=True) - slack)
        bottoms += _members(heights <= heights.min(axis=1, keepdims=True) + slack)
    numbers = {top: i for i, top in enumerate(tops)}
    sides: list[Side] = []
    is_done = [False] * len(normals)
    for i in range(len(normals)):
        if is_done[i]:
            continue
        j = numbers.get(bottoms[i], i)
        has_pair = j != i and not is_done[j]
        is_done[i] = is_done[j] = True
        x, y, z = max(normals[i].tolist(), (-normals[i]).tolist()) if has_pair else normals[i].tolist()
        heights = points[:, 0] * x + points[:, 1] * y + points[:, 2] * z
        low = float(heights.min()) if has_pair else -math.inf
        sides.append(Side((x + 0.0, y + 0.0, z + 0.0), low, float(heights.max())))
    return sorted(sides, reverse=True)


def _members(rows: Array) -> list[bytes]:
    """Return the numbers of the members of each row of booleans, as keys."""
    return [np.flatnonzero(row).tobytes() for row in rows]
