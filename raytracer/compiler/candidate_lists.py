"""Candidate lists: for each cell, the objects that its rays may meet, as a texture for shaders/csg/lists.glsl.

A cell's list is a row of entries. An entry >= 0 is an object of a common shape, by its number in the texture of items.
An entry -n begins another object: its number in the scene follows, and then the n - 1 codes of its program, whose
leaves are surface indices (csg_pruning.py; the first code of a chain names the chain's operation). An object that fills
all of a cell is in no list.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import SHAPE_LEAVES, Balls, Batches, ProgramBatch, bounding_balls, combine_bounds
from raytracer.compiler.culling import ROUNDING_GROWTH, ball_growth, finest_grid, longest_bounded_ray, rounding_growth
from raytracer.compiler.direction_cells import (
    CELL,
    Lists,
    Part,
    cells_in,
    hemisphere_cells,
    overlapped_cells,
    overlaps,
)
from raytracer.compiler.hemisphere_lists import LightBalls, hemisphere_lists, light_balls
from raytracer.compiler.program_rows import (
    FindPairs,
    Rows,
    fill_rows,
    most_listed,
    rows_of_cells,
    rows_of_grids,
    rows_without_spheres,
)
from raytracer.compiler.view_space import View, camera_grid, grown_radii, project_balls
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The amount by which a body may reach beyond its corners, as a share of their distance: where faces meet at an angle
# of more than a thousandth, float32 roots move an edge by less. It is a quarter of a pixel or so.
_CORNER_GROWTH = 2.0**-12


class CasterLists(NamedTuple):
    """The lists of the cells around one light. hemisphere_cells() numbers the cells."""

    lists: Lists
    longest: int  # number of entries of the longest list
    reach: float  # the length of ray to the light up to which the lists are complete
    pairs: int  # number of pairs of a cell and an object of a common shape
    listed: int  # number of pairs of a cell and a primitive of another object


class Items(NamedTuple):
    """The objects of common shapes, in view space, in the order of their shapes."""

    centers: Array  # (N, 3): centres of balls that hold the objects as the camera sees them in float32
    radii: Array  # (N,)
    growth: Array  # (N,): if rounding moves spheres by d, the balls must grow by growth * d
    shape: Ints
    first: Ints  # (N, 2): index of each object's first sphere and of its first body
    order: Ints  # each object's number in the scene


def make_items(view: View, batches: Batches) -> Items:
    """Collect the objects of common shapes as a camera sees them."""
    shapes = batches.shapes
    around = [bounding_balls(batch, view.surfaces.centers, view.surfaces.radii) for batch in shapes]
    none = np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)), np.zeros(0)
    parts = zip(none, *(ball[:4] for ball in around), strict=True)
    ball = Balls(*map(np.concatenate, parts), are_spheres=False)
    away = ball.centers - view.eye
    centers = away @ view.rotation.T
    growth = np.maximum(np.linalg.norm(ball.growth, axis=1), 1.0)
    # By the bounds in sphere.glsl, the roots of a ray with a sphere of radius r at c are off by at most 32 u (|c| + r).
    # This error is along the ray, whose direction differs from c by an angle of at most r / |c|. Across the ray, the
    # error is that share of r, and grown_radii() of the larger spheres. Orthographic rays are parallel instead: their
    # error is along them, in proportion to the depth.
    if view.camera.projection == "orthographic":
        away = -centers[:, 2:] * np.array(view.camera.axes()[2])
    along = np.sum(ball.growth * np.abs(away), axis=1)
    return Items(
        centers,
        grown_radii(view.camera, centers, ball.radii, growth) + ROUNDING_GROWTH * (along + 4.0 * growth * ball.largest),
        growth,
        np.repeat(np.arange(len(shapes)), [len(batch.first) for batch in shapes]),
        np.concatenate([np.zeros((0, 2), np.int64), *(batch.first for batch in shapes)]),
        np.concatenate([np.zeros(0, np.int64), *(batch.order for batch in shapes)]),
    )


class Lister:
    """Makes the candidate lists of a scene for one camera."""

    def __init__(self, view: View, batches: Batches) -> None:
        self._view = view
        self._items = make_items(view, batches)
        self._batches = batches
        self._bounded = view.surfaces.bounded
        self._centers = np.asfortranarray(view.centers)  # column order, in which loops over all spheres are fast
        self._radii = view.surfaces.radii

    @property
    def ball_count(self) -> int:
        """The number of balls in the lists of lights."""
        return len(self._items.radii) + sum(
            len(batch.order) if batch.is_long_chain else batch.surfaces.size for batch in self._batches.programs
        )

    @functools.cached_property
    def _balls(self) -> LightBalls:
        return light_balls(self._items.centers, self._items.radii, self._items.growth - 1.0)

    def items_texture(self, numbers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Pack the texels `items` of lists.glsl (4 N, 4). `numbers` are the texels of surfaces.glsl."""
        items = self._items
        texels = np.zeros((len(items.radii), 4, 4), np.float32)
        # For rays from any origin, with the spheres as float32 rounds them.
        moved = ROUNDING_GROWTH * items.growth * np.linalg.norm(items.centers, axis=1)
        texels[:, 0, :3], texels[:, 0, 3] = items.centers, items.radii + moved
        texels[:, 1] = np.column_stack([items.shape, items.first[:, 0], items.order, items.first[:, 1]])
        # Behind the spheres of a small object there are numbers of other surfaces, which the shader ignores.
        leaf = np.minimum(items.first[:, :1] + np.arange(SHAPE_LEAVES), len(numbers) // 4 - 1)
        texels[:, 2], texels[:, 3] = numbers[4 * leaf + 1, 3], numbers[4 * leaf + 2, 3]
        return texels.reshape(-1, 4)

    def rectangles(self, size: tuple[int, int]) -> tuple[NDArray[np.int32], float]:
        """Return the rectangles in which the camera may see objects of common shapes, and a bound of their distances.

        A rectangle (8 numbers) has the first column and row of pixels (0 is the lowest row), one past the last column
        and row, the shape, the index of the first sphere, the object's number in the scene, and the index of the first
        body. The rectangles (N, 8) are in the order of the scene, without the objects outside the picture. All
        distances are less than the bound.
        """
        corner, step, _ = camera_grid(self._view.camera, size)
        pixel = step / CELL
        items = self._items
        lo, hi = self._bounds()
        first, last = overlapped_cells(lo, hi, corner, (pixel, pixel), size)
        rows = np.column_stack([first, last + 1, items.shape, items.first[:, 0], items.order, items.first[:, 1]])
        rows = rows[last[:, 0] >= first[:, 0]]
        farthest = np.linalg.norm(items.centers, axis=1) + items.radii
        return rows[np.argsort(rows[:, 6])].astype(np.int32), 2.0 * float(farthest.max(initial=0.5))

    def _bounds(self) -> tuple[Array, Array]:
        """Return the bounds of objects of common shapes by project_balls().

        They are the bounds of the bounding sphere, narrowed to the bounds of the object's leaves.
        """
        camera, view = self._view.camera, self._view

        def leaf(number: int) -> tuple[Array, Array]:
            surface = batch.surface(number)
            bounds = project_balls(camera, self._centers[surface], self._radii[surface])
            if number < batch.spheres:
                return bounds
            return _intersect_bounds(
                bounds, _corner_bounds(camera, view.bodies.corners[surface - view.surfaces.spheres])
            )

        lo, hi = np.empty((2, len(self._items.radii), 2))
        at = 0
        for batch in self._batches.shapes:
            part = slice(at, at + len(batch.first))
            bounds = combine_bounds(batch.tree, leaf, _intersect_bounds, _join_bounds)
            if len(batch.tree) > 1:  # a single sphere is its own bounding sphere
                own = project_balls(self._view.camera, self._items.centers[part], self._items.radii[part])
                bounds = _intersect_bounds(own, bounds)
            lo[part], hi[part] = bounds
            at = part.stop
        return lo, hi

    def camera_lists(self, size: tuple[int, int], part: Part) -> Lists:
        """Make the lists of programs for the cells in a part of a picture of `size`, row by row from the bottom."""
        corner, step, shape = camera_grid(self._view.camera, size)

        def find_pairs(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            bounds = project_balls(self._view.camera, centers, radii)
            return overlaps(*bounds, corner, (step, step), shape, part=cells_in(part))

        cells = math.prod(cells_in(part)[2:])
        none = np.zeros(0, np.int32)
        return self._lists(find_pairs, np.zeros(cells, np.int64), none, 0, most_listed(cells))[0]

    def full_list(self) -> NDArray[np.int32]:
        """Make the list of all objects, for rays from any origin."""

        def find_pairs(centers: Array, radii: Array) -> tuple[Ints, Ints]:
            return np.zeros(len(radii), np.int64), np.arange(len(radii))

        every = np.arange(len(self._items.radii), dtype=np.int32)
        lists, _ = self._lists(find_pairs, np.array([len(every)]), every, 0, most_listed(0))
        begin, end = lists.ends[0]  # the entries after these are for cells without spheres
        return lists.entries[begin:end]

    def finest_grid(self, light: PointLight) -> float:
        """Return the largest useful number of cells along each side of a hemisphere around a light."""
        return finest_grid(self._view.place(light.position), light.radius, self._centers)

    def caster_lists(self, light: PointLight, grid: int, most: int, listed: int, most_listed: int) -> CasterLists:
        """Make the lists of the cells around a light.

        Args:
            light: The light.
            grid: The number of cells along each side of a hemisphere.
            most: The most pairs of a cell and an object of a common shape.
            listed: The number of pairs of a cell and a primitive of another object, in the lists of earlier lights.
            most_listed: The most such pairs in the lists of all lights together.

        Raises InputError above either limit.
        """
        place = self._view.place(light.position)
        far = longest_bounded_ray(place, self._centers, self._radii)
        wider = ball_growth(far, light.radius)
        lists, longest = hemisphere_lists(self._balls, place, wider, rounding_growth(far, light.radius), grid, most)
        pairs, total = len(lists.entries), listed
        if self._batches.programs:

            def find_pairs(centers: Array, radii: Array) -> tuple[Ints, Ints]:
                return hemisphere_cells(centers - place, radii + wider, grid)

            count = np.subtract(*lists.ends.T[::-1], dtype=np.int64)
            lists, total = self._lists(find_pairs, count, lists.entries, listed, most_listed)
            longest = lists.longest()
        return CasterLists(lists, longest, far, pairs, total - listed)

    def _lists(
        self, find_pairs: FindPairs, count: Ints, item: NDArray[np.int32], total: int, most: int
    ) -> tuple[Lists, int]:
        """Make the lists of all objects, and count the pairs of a cell and a primitive.

        Args:
            find_pairs: Finds the pairs of a cell and a ball.
            count: The number of objects of common shapes in each cell.
            item: These objects, cell after cell.
            total: The number of pairs of a cell and a primitive in earlier lists, to which the new ones are added.
            most: The most such pairs; more raise InputError.
        """
        listed: list[tuple[ProgramBatch, Ints, Rows]] = []
        grids: list[Rows] = []
        number = 0  # of the next grid
        for batch in self._batches.programs:
            if batch.is_long_chain:
                grids.append(rows_of_grids(batch, number, self._centers, self._radii, find_pairs))
                number += len(batch.order)
                continue
            pairs, rows, more = rows_of_cells(batch, self._bounded, self._centers, self._radii, find_pairs, total, most)
            listed.append((batch, pairs, rows))
            total += more
        bare = [rows_without_spheres(batch, self._bounded) for batch, _, _ in listed]
        if any(len(rows.cell) for rows in bare):
            some = count > 0
            for rows in (*grids, *(rows for _, _, rows in listed)):
                some[rows.cell] = True
            occupied = np.flatnonzero(some)
            listed = [
                (
                    batch,
                    pairs,
                    fill_rows(batch, rows, around, pairs, occupied, most) if len(around.cell) else rows,
                )
                for (batch, pairs, rows), around in zip(listed, bare, strict=True)
            ]
        parts = [rows.entries() for rows in (*grids, *(rows for _, _, rows in listed)) if len(rows.cell)]
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
        # All cells without entries of their own share one list: the programs that every cell has.
        around = np.concatenate([entries[:0], *(rows.entries()[1] for rows in bare)])
        if len(around):  # otherwise any empty list serves
            ends[count == 0] = len(entries), len(entries) + len(around)
        return Lists(ends, np.concatenate((entries, around))), total


def _corner_bounds(camera: Camera, corners: Array) -> tuple[Array, Array]:
    """Return the bounds (low, high), each (N, 2), by project_balls(), of convex bodies, by their corners (N, 8, 3)."""
    radii = _CORNER_GROWTH * np.linalg.norm(corners, axis=2)
    low, high = (bound.reshape(-1, 8, 2) for bound in project_balls(camera, corners.reshape(-1, 3), radii.ravel()))
    # A body that reaches behind the camera may be seen anywhere.
    is_ahead = np.all(-corners[..., 2] > 2.0 * radii, axis=1)[:, None]
    return np.where(is_ahead, low.min(axis=1), -np.inf), np.where(is_ahead, high.max(axis=1), np.inf)


def _intersect_bounds(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the intersection of two bounds (low, high)."""
    return np.maximum(a[0], b[0]), np.minimum(a[1], b[1])


def _join_bounds(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the smallest bound (low, high) around two."""
    return np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
