"""What the rays of each cell may meet, as the texture of whole numbers that shaders/lists.glsl walks through.

A cell's list is a row of entries. One that is 0 or more is an object of a kind, by its number in the items'
texture; -n is followed by the number of another object in the scene, and the n - 1 codes of its program
(prune.py; chains begin as such), whose leaves are surfaces. Where an object is all around it is in no list.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.cells import CELL, MARGIN, by_cell, covered, cube_faces, overlaps, row_starts, tangents, widened
from raytracer.groups import KIND_LEAVES, Balls, balls, combined, groups
from raytracer.prune import LEAF_SHIFT, TRUE, chains
from raytracer.scene import PointLight, Scene
from raytracer.sight import PASSING, finest_grid, reach, widening
from raytracer.table import table
from raytracer.view_space import camera_grid, rotation, vectors

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Lists(NamedTuple):
    """Cell i's entries are entries[start[i] : start[i + 1]]."""

    start: Ints  # (cells + 1,)
    entries: NDArray[np.int32]

    def ends(self, first: int) -> NDArray[np.int32]:
        """(cells, 2): where each cell's entries begin and end in an array in which `entries` come from `first` on."""
        return np.column_stack([self.start[:-1], self.start[1:]]).astype(np.int32) + np.int32(first)


class Items(NamedTuple):
    """The objects of kinds, in view space; those of kind 0 come first."""

    centers: Array  # (N, 3) and (N,): balls that hold what float32 shows of them to the camera
    radii: Array
    growth: Array  # by so many d those balls are to be wider where rounding moves spheres by d
    kind: Ints
    first: Ints  # index of their first surface
    order: Ints  # number in the scene


def items(scene: Scene) -> Items:
    """The objects of kinds of `scene`."""
    found = table(scene)
    kinds = groups(scene).kinds
    around = [balls(group, found.centers, found.radii) for group in kinds]
    none = Balls(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0))
    ball = Balls(*map(np.concatenate, zip(none, *around, strict=True)))
    away = ball.centers - scene.camera.position
    centers = away @ rotation(scene.camera).T
    growth = np.maximum(np.linalg.norm(ball.growth, axis=1), 1.0)
    # The roots of a ray with a sphere of radius r at c are off by 32 u (|c| + r) at most, sums of the bounds in
    # sphere.glsl. That is along the ray, which is along c but for an angle of r / |c|; across it, rays and spheres are
    # where they are but for that share of r, and widened() of the larger ones.
    along = np.sum(ball.growth * np.abs(away), axis=1)
    return Items(
        centers,
        widened(centers, ball.radii, growth) + PASSING * (along + 4.0 * growth * ball.largest),
        growth,
        np.repeat(np.arange(len(kinds)), [len(group.first) for group in kinds]),
        np.concatenate([np.zeros(0, np.int64), *(group.first for group in kinds)]),
        np.concatenate([np.zeros(0, np.int64), *(group.order for group in kinds)]),
    )


class Lister:
    """Makes lists for scenes of the same objects, seen by a camera of the same place."""

    def __init__(self, scene: Scene) -> None:
        self._items = items(scene)
        self._bigs = groups(scene).bigs
        self._spheres = len(table(scene).radii)
        self._centers = vectors(scene)[: self._spheres]
        self._radii = table(scene).radii

    def items_texture(self, numbers: NDArray[np.float32]) -> NDArray[np.float32]:
        """(4 N, 4): the texels `items` of lists.glsl; `numbers` are those of surfaces.glsl."""
        found = self._items
        texels = np.zeros((len(found.radii), 4, 4), np.float32)
        # As seen from anywhere, its spheres being where float32 has them.
        moved = PASSING * found.growth * np.linalg.norm(found.centers, axis=1)
        texels[:, 0, :3], texels[:, 0, 3] = found.centers, found.radii + moved
        texels[:, 1, :3] = np.column_stack([found.kind, found.first, found.order])
        # An object of fewer surfaces has numbers of others behind its own: they are not looked at.
        leaf = np.minimum(found.first[:, None] + np.arange(KIND_LEAVES), len(numbers) // 4 - 1)
        texels[:, 2], texels[:, 3] = numbers[4 * leaf + 1, 3], numbers[4 * leaf + 2, 3]
        return texels.reshape(-1, 4)

    def rectangles(self, scene: Scene, size: tuple[int, int]) -> tuple[NDArray[np.int32], float]:
        """Where the camera may see objects of kinds in a picture of `size`, and more than any distance to them there.

        (N, 8): first column and row of pixels, the lowest row being 0, and behind the last; kind; first surface;
        number in the scene; 0. In the order of the scene, without those that are not in the picture.
        """
        corner, step, _ = camera_grid(scene.camera, size)
        pixel = step / CELL
        found = self._items
        lo, hi = self._bounds(scene)
        first, last = covered(lo, hi, corner, (pixel, pixel), size)
        rows = np.column_stack([first, last + 1, found.kind, found.first, found.order, np.zeros_like(found.kind)])
        rows = rows[last[:, 0] >= first[:, 0]]
        farthest = np.linalg.norm(found.centers, axis=1) + found.radii
        return rows[np.argsort(rows[:, 6])].astype(np.int32), 2.0 * float(farthest.max(initial=0.5))

    def _bounds(self, scene: Scene) -> tuple[Array, Array]:
        """tangents() to objects of kinds: to the ball around each, but not beyond those of the spheres in it."""

        def leaf(number: int) -> tuple[Array, Array]:
            return tangents(self._centers[group.first + number], self._radii[group.first + number])

        lo, hi = tangents(self._items.centers, self._items.radii)
        at = 0
        for group in groups(scene).kinds:
            found = combined(group.tree, leaf, _inner, _outer)
            part = slice(at, at + len(group.first))
            lo[part], hi[part] = _inner((lo[part], hi[part]), found)
            at = part.stop
        return lo, hi

    def of_camera(self, scene: Scene, size: tuple[int, int]) -> Lists:
        """Of objects that are no kinds, for the cells of a picture of `size`: along its rows, the lowest first."""
        corner, step, shape = camera_grid(scene.camera, size)

        def pairs(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            return overlaps(*tangents(centers, radii), corner, (step, step), shape)

        cells = shape[0] * shape[1]
        return self._lists(pairs, cells, np.zeros(cells + 1, np.int64), np.zeros(0, np.int64))

    def of_everything(self) -> Lists:
        """Of all objects, for rays that come from anywhere: one list."""

        def pairs(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            return np.zeros(len(radii), np.int64), np.arange(len(radii))

        every = np.arange(len(self._items.radii))
        return self._lists(pairs, 1, np.array([0, len(every)]), every)

    def finest_grid(self, scene: Scene, light: PointLight) -> float:
        """How many cells a side of a cube's face around a light should at most have."""
        return finest_grid(_place(scene, light), light.radius, self._centers)

    def reach(self, scene: Scene, light: PointLight) -> float:
        """How long rays to a light may be for what of_light() says."""
        return reach(_place(scene, light), self._centers, self._radii)

    def of_light(self, scene: Scene, light: PointLight, grid: int) -> Lists:
        """For the cells of the cube around a light, numbered as cells.cube_faces() does."""
        place = _place(scene, light)
        wider = widening(place, light.radius, self._centers, self._radii)
        passing = wider - light.radius * (1.0 + MARGIN)  # the part of it that is for rounding

        def pairs(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            return cube_faces(centers - place, radii + wider, grid)

        cells = 6 * grid * grid
        # Nearest first: what is behind a hit is not looked at.
        near = np.linalg.norm(self._items.centers - place, axis=1) - self._items.radii
        cell, item = pairs(self._items.centers, self._items.radii + (self._items.growth - 1.0) * passing)
        return self._lists(pairs, cells, *by_cell(cell, item, cells, near))

    def _lists(self, pairs: Callable[[Array, Array], tuple[Ints, Ints]], cells: int, start: Ints, item: Ints) -> Lists:
        """The lists of objects of kinds, cell i's being item[start[i] : start[i + 1]], with those of all others.

        `pairs(centers, radii)` are all pairs of a cell and a ball that it sees.
        """
        cell_of, entry = [np.repeat(np.arange(cells), np.diff(start))], [item]
        for big in self._bigs:
            sphere = big.surfaces < self._spheres
            where = big.surfaces[sphere]
            cell, leaf = pairs(self._centers[where], self._radii[where])
            everywhere = np.flatnonzero(~sphere)
            cell = np.concatenate([cell, np.repeat(np.arange(cells), len(everywhere))])
            leaf = np.concatenate([np.flatnonzero(sphere)[leaf], np.tile(everywhere, cells)])
            start, leaf = by_cell(cell, leaf, cells, np.arange(len(big.surfaces), dtype=float))
            start, code = big.pruner.programs(np.repeat(np.arange(cells), np.diff(start)), leaf, cells)
            cell = np.repeat(np.arange(cells), np.diff(start))
            surfaces = (code & 7) != TRUE
            cell, code = cell[surfaces], code[surfaces]
            start = row_starts(cell, cells)
            code = chains(start, code)
            count = np.diff(start)
            some = np.flatnonzero(count)
            absolute = (big.surfaces[code >> LEAF_SHIFT] << LEAF_SHIFT) | (code & ((1 << LEAF_SHIFT) - 1))
            cell_of += [some, some, cell]
            entry += [-count[some] - 1, np.full(len(some), big.order), absolute]
        if len(entry) == 1:
            return Lists(start, item.astype(np.int32))
        cell, value = np.concatenate(cell_of), np.concatenate(entry)
        start = np.zeros(cells + 1, np.int64)
        np.cumsum(np.bincount(cell, minlength=cells), out=start[1:])
        return Lists(start, value[np.argsort(cell, kind="stable")].astype(np.int32))


def _place(scene: Scene, light: PointLight) -> Array:
    """Where a light is in view space."""
    return np.subtract(light.position, scene.camera.position) @ rotation(scene.camera).T


def _inner(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.maximum(a[0], b[0]), np.minimum(a[1], b[1])


def _outer(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
