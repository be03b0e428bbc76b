"""Lists of the objects that the rays of each cell may meet, as a texture through which shaders/csg/lists.glsl walks.

A cell's list is a row of entries. One that is 0 or more is an object of a common shape, by its number in the items'
texture; -n is followed by the number of another object in the scene, and the n - 1 codes of its program
(csg_pruning.py; chains begin as such), whose leaves are surfaces. Where an object is all around it is in no list.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import SHAPE_LEAVES, Balls, Batches, ProgramBatch, balls, combined
from raytracer.compiler.culling import PASSING, finest_grid, passing, reach, widening
from raytracer.compiler.direction_cells import (
    CELL,
    Lists,
    covered,
    hemisphere_cells,
    overlaps,
    tangents,
    widened,
)
from raytracer.compiler.hemisphere_lists import LightBalls, hemisphere_lists, light_balls
from raytracer.compiler.program_rows import FindPairs, Rows, everywhere, filled, met, most_listed
from raytracer.compiler.view_space import View, camera_grid
from raytracer.scene.lights import PointLight

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class CasterLists(NamedTuple):
    """The lists of the cells around one light, numbered as by hemisphere_cells()."""

    lists: Lists
    longest: int  # entries of the longest list
    reach: float  # the length up to which the lists hold every object that a ray to the light may meet
    pairs: int  # of a cell and an object of a common shape
    listed: int  # pairs of a cell and a primitive of another object


class Items(NamedTuple):
    """The objects of common shapes, in view space, in the order of their shapes."""

    centers: Array  # (N, 3) and (N,): balls that hold what float32 shows of them to the camera
    radii: Array
    growth: Array  # by so many d those balls are to be wider where rounding moves spheres by d
    shape: Ints
    first: Ints  # index of their first surface
    order: Ints  # number in the scene


def make_items(view: View, batches: Batches) -> Items:
    """Collect the objects of common shapes, as a camera sees them."""
    shapes = batches.shapes
    around = [balls(batch, view.surfaces.centers, view.surfaces.radii) for batch in shapes]
    none = Balls(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0))
    ball = Balls(*map(np.concatenate, zip(none, *around, strict=True)))
    away = ball.centers - view.camera.position
    centers = away @ view.rotation.T
    growth = np.maximum(np.linalg.norm(ball.growth, axis=1), 1.0)
    # The roots of a ray with a sphere of radius r at c are off by 32 u (|c| + r) at most, sums of the bounds in
    # sphere.glsl. That is along the ray, which is along c but for an angle of r / |c|; across it, rays and spheres are
    # where they are but for that share of r, and widened() of the larger ones.
    along = np.sum(ball.growth * np.abs(away), axis=1)
    return Items(
        centers,
        widened(centers, ball.radii, growth) + PASSING * (along + 4.0 * growth * ball.largest),
        growth,
        np.repeat(np.arange(len(shapes)), [len(batch.first) for batch in shapes]),
        np.concatenate([np.zeros(0, np.int64), *(batch.first for batch in shapes)]),
        np.concatenate([np.zeros(0, np.int64), *(batch.order for batch in shapes)]),
    )


class Lister:
    """Makes the lists of a scene's objects as one camera sees them."""

    def __init__(self, view: View, batches: Batches) -> None:
        self._view = view
        self._items = make_items(view, batches)
        self._batches = batches
        self._spheres = view.surfaces.spheres
        self._centers = np.asfortranarray(view.centers)  # in this order loops over all spheres are fast
        self._radii = view.surfaces.radii

    @property
    def ball_count(self) -> int:
        """The number of balls around which lights have lists."""
        return len(self._items.radii) + sum(batch.surfaces.size for batch in self._batches.programs)

    @functools.cached_property
    def _balls(self) -> LightBalls:
        return light_balls(self._items.centers, self._items.radii, self._items.growth - 1.0)

    def items_texture(self, numbers: NDArray[np.float32]) -> NDArray[np.float32]:
        """(4 N, 4): the texels `items` of lists.glsl; `numbers` are the texels of surfaces.glsl."""
        items = self._items
        texels = np.zeros((len(items.radii), 4, 4), np.float32)
        # As seen from anywhere, its spheres being where float32 has them.
        moved = PASSING * items.growth * np.linalg.norm(items.centers, axis=1)
        texels[:, 0, :3], texels[:, 0, 3] = items.centers, items.radii + moved
        texels[:, 1, :3] = np.column_stack([items.shape, items.first, items.order])
        # An object of fewer surfaces has numbers of others behind its own: they are not looked at.
        leaf = np.minimum(items.first[:, None] + np.arange(SHAPE_LEAVES), len(numbers) // 4 - 1)
        texels[:, 2], texels[:, 3] = numbers[4 * leaf + 1, 3], numbers[4 * leaf + 2, 3]
        return texels.reshape(-1, 4)

    def rectangles(self, size: tuple[int, int]) -> tuple[NDArray[np.int32], float]:
        """Where the camera may see objects of common shapes, and more than any distance to them there.

        (N, 8): first column and row of pixels, the lowest row being 0, and behind the last; shape; first surface;
        number in the scene; 0. In the order of the scene, without those that are not in the picture.
        """
        corner, step, _ = camera_grid(self._view.camera, size)
        pixel = step / CELL
        items = self._items
        lo, hi = self._bounds()
        first, last = covered(lo, hi, corner, (pixel, pixel), size)
        rows = np.column_stack([first, last + 1, items.shape, items.first, items.order, np.zeros_like(items.shape)])
        rows = rows[last[:, 0] >= first[:, 0]]
        farthest = np.linalg.norm(items.centers, axis=1) + items.radii
        return rows[np.argsort(rows[:, 6])].astype(np.int32), 2.0 * float(farthest.max(initial=0.5))

    def _bounds(self) -> tuple[Array, Array]:
        """tangents() to objects of common shapes: to the ball around each, but not beyond its spheres' tangents."""

        def leaf(number: int) -> tuple[Array, Array]:
            return tangents(self._centers[batch.first + number], self._radii[batch.first + number])

        lo, hi = np.empty((2, len(self._items.radii), 2))
        at = 0
        for batch in self._batches.shapes:
            part = slice(at, at + len(batch.first))
            bounds = combined(batch.tree, leaf, _inner, _outer)
            if len(batch.tree) > 1:  # one sphere is no larger than the ball around it
                bounds = _inner(tangents(self._items.centers[part], self._items.radii[part]), bounds)
            lo[part], hi[part] = bounds
            at = part.stop
        return lo, hi

    def camera_lists(self, size: tuple[int, int]) -> Lists:
        """The lists of programs for the cells of a picture of `size`: along its rows, the lowest first."""
        corner, step, shape = camera_grid(self._view.camera, size)

        def view(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            return overlaps(*tangents(centers, radii), corner, (step, step), shape)

        cells = shape[0] * shape[1]
        none = np.zeros(0, np.int32)
        return self._lists(view, np.zeros(cells, np.int64), none, 0, most_listed(cells))[0]

    def full_list(self) -> NDArray[np.int32]:
        """The list of all objects, for rays that come from anywhere."""

        def view(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            return np.zeros(len(radii), np.int64), np.arange(len(radii))

        every = np.arange(len(self._items.radii), dtype=np.int32)
        lists, _ = self._lists(view, np.array([len(every)]), every, 0, most_listed(0))
        begin, end = lists.ends[0]  # entries behind are for cells that see no sphere
        return lists.entries[begin:end]

    def finest_grid(self, light: PointLight) -> float:
        """The most cells that a side of a hemisphere around a light should have."""
        return finest_grid(self._view.place(light.position), light.radius, self._centers)

    def caster_lists(self, light: PointLight, grid: int, most: int, listed: int, most_listed: int) -> CasterLists:
        """The lists of the cells around a light.

        Raises InputError above `most` pairs of a cell and an object of a common shape, and for more than `most_listed`
        pairs of a cell and a primitive of another object, together with the `listed` ones of other lights.
        """
        place = self._view.place(light.position)
        far = reach(place, self._centers, self._radii)
        wider = widening(far, light.radius)
        lists, longest = hemisphere_lists(self._balls, place, wider, passing(far, light.radius), grid, most)
        pairs, total = len(lists.entries), listed
        if self._batches.programs:

            def view(centers: Array, radii: Array) -> tuple[Ints, Ints]:
                return hemisphere_cells(centers - place, radii + wider, grid)

            count = np.subtract(*lists.ends.T[::-1], dtype=np.int64)
            lists, total = self._lists(view, count, lists.entries, listed, most_listed)
            longest = lists.longest()
        return CasterLists(lists, longest, far, pairs, total - listed)

    def _lists(self, view: FindPairs, count: Ints, item: NDArray[np.int32], total: int, most: int) -> tuple[Lists, int]:
        """The lists of objects of common shapes, of which cell i has count[i] one after the other, and of all others.

        `total` pairs of a cell and a primitive grow by the pairs in the lists. Raises InputError above `most`.
        """
        listed: list[tuple[ProgramBatch, Ints, Rows]] = []
        for batch in self._batches.programs:
            pairs, rows, more = met(batch, self._spheres, self._centers, self._radii, view, total, most)
            listed.append((batch, pairs, rows))
            total += more
        bare = [everywhere(batch, self._spheres) for batch in self._batches.programs]
        if any(len(rows.cell) for rows in bare):
            some = count > 0
            for _, _, rows in listed:
                some[rows.cell] = True
            occupied = np.flatnonzero(some)
            listed = [
                (
                    batch,
                    pairs,
                    filled(batch, rows, around, pairs, occupied, most) if len(around.cell) else rows,
                )
                for (batch, pairs, rows), around in zip(listed, bare, strict=True)
            ]
        parts = [rows.entries() for _, _, rows in listed if len(rows.cell)]
        entries = item
        if parts:
            cell = np.concatenate(
                [np.repeat(np.arange(len(count), dtype=np.int32), count), *(cell for cell, _ in parts)]
            )
            entries = np.concatenate([item, *(values for _, values in parts)])
            if np.any(cell[1:] < cell[:-1]):
                entries = entries[np.argsort(cell, kind="stable")]
            count = np.bincount(cell, minlength=len(count))
        end = np.cumsum(count)
        ends = np.column_stack((end - count, end)).astype(np.int32)
        # One list for all cells without any other entries than those of all cells.
        around = np.concatenate([entries[:0], *(rows.entries()[1] for rows in bare)])
        if len(around):  # else an empty list will do, wherever it is
            ends[count == 0] = len(entries), len(entries) + len(around)
        return Lists(ends, np.concatenate((entries, around))), total


def _inner(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.maximum(a[0], b[0]), np.minimum(a[1], b[1])


def _outer(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
