"""Grids of long chains: for each cell of space, the leaves that a ray may be in while it is in the cell.

A long chain is an object of many leaves under one operator, such as a cube less thousands of holes. The shader
(shaders/csg/grid.glsl) treats it as a conjunction (chain.glsl). A ray in the conjunction's few common leaves passes
from hole to hole: it needs the leaves around one point at a time, which the grid has. The grid is in world space, so
that it stays the same while the camera and the lights move.

A grid's axes are those of the first leaf that bounds the object. Leaves count as larger by the growth, which covers
the rounding of points and roots in float32.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import Batches, ProgramBatch
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.csg_pruning import LEAF_SHIFT, NEGATED, OR_LEAF
from raytracer.compiler.culling import ROUNDING_GROWTH, longest_bounded_ray
from raytracer.compiler.long_chains import CORE
from raytracer.compiler.rounds import body_rounds
from raytracer.compiler.surfaces import Surfaces
from raytracer.compiler.view_space import View

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The number of cells for each leaf, and the most cells of a grid. More cells make lists shorter, and take 8 bytes each.
_CELLS_FOR_LEAF, _MAX_CELLS = 96, 2**19
# The most pairs of a cell and a leaf of one grid. A pair takes some 100 bytes while the grid is made, and 8 afterwards.
_MAX_PAIRS = 2**23
# The smallest side of a cell, in growths: in smaller cells, most leaves would be listed because of the growth.
_SMALLEST = 8.0
# The number of texels of a grid's header: see grid.glsl.
HEADER = 5


class Boxes(NamedTuple):
    """Boxes along a grid's axes."""

    low: Array  # (N, 3)
    high: Array  # (N, 3)


class ChainGrid(msgspec.Struct, frozen=True, eq=False):
    """The grid of one object."""

    axes: Array  # (3, 3): the rows are the axes, in world space, over the sides of a cell
    low: Array  # (3,): the corner of the first cell, along the axes
    shape: tuple[int, int, int]  # the number of cells along the axes
    is_union: bool
    leaf: int  # the surface index of one of the leaves
    core: Ints  # (C, 2): the leaves that every ray is tested against: code, and place in the tree
    ends: Ints  # (cells, 2): where the leaves of each cell begin and end in `leaves`
    leaves: Ints  # (L, 2): code, and place in the tree
    rounds: int  # an upper bound of the rounds of loops for a ray: see cut_short.glsl


class Grids(msgspec.Struct, frozen=True, eq=False):
    """The grids of all long chains of a scene, and the textures of grid.glsl for one view."""

    batches: Batches
    growth: float
    grids: list[ChainGrid]
    leaves: NDArray[np.int32]  # the texels `gridLeaves` (N, 2)
    view: View
    headers: NDArray[np.int32]  # the texels `grids` (HEADER * grids, 4)

    @property
    def rounds(self) -> int:
        """An upper bound of the rounds of loops for a ray and all grids."""
        return sum(grid.rounds for grid in self.grids)


def update_grids(compiled: CompiledScene, view: View, previous: Grids | None) -> Grids | None:
    """Return the grids of a view, which share unchanged parts with `previous`. None if the scene needs no grids."""
    batches = compiled.batches
    if not (compiled.has_lists and batches.has_grids):
        return None
    if previous and previous.batches is not batches:
        previous = None
    centers, radii = view.centers, view.surfaces.radii
    far = float((np.linalg.norm(centers, axis=1) + radii).max(initial=0.0))
    for light in compiled.shadowing_lights:
        far = max(far, longest_bounded_ray(view.place(light.position), centers, radii))
    # A power of two, so that the grids seldom change while the camera or a light moves.
    growth = 2.0 ** math.ceil(math.log2(max(ROUNDING_GROWTH * far, float(np.finfo(np.float32).tiny))))
    if previous and previous.growth == growth:
        if previous.view is view:
            return previous
        return Grids(batches, growth, previous.grids, previous.leaves, view, _headers(previous.grids, view))
    grids = make_grids(batches, view.surfaces, growth)
    return Grids(batches, growth, grids, _leaf_texels(grids), view, _headers(grids, view))


def are_boxes(batches: Batches, surfaces: Surfaces) -> bool:
    """Return whether all leaves of long chains are boxes, and the boxes of each chain share three normals.

    The bodies of one chain are then one after the other in the texture `bodies` (BOX of grid.glsl).
    """
    leaves = [row for batch in batches.programs if batch.is_long_chain for row in batch.surfaces]
    return all(_are_boxes(surfaces, np.sort(row)) for row in leaves)


def _are_boxes(surfaces: Surfaces, leaves: Ints) -> bool:
    bodies, first, end = surfaces.bodies, leaves[0] - surfaces.spheres, leaves[-1] - surfaces.spheres + 1
    if first < 0 or leaves[-1] >= surfaces.bounded or end - first != len(leaves) or bodies.kinds[first:end].any():
        return False
    starts = bodies.starts[first : end + 1]
    normals = bodies.normals[starts[0] : starts[-1]]
    return bool((np.diff(starts) == 3).all() and (normals.reshape(-1, 3, 3) == normals[:3]).all())


def make_grids(batches: Batches, surfaces: Surfaces, growth: float) -> list[ChainGrid]:
    """Make the grids of all long chains. Leaves count as larger by `growth`, a length."""
    leaf_rounds = 0 if are_boxes(batches, surfaces) else int(body_rounds(surfaces).max(initial=0))
    return [
        _make_grid(batch, batch.surfaces[k], surfaces, growth, leaf_rounds)
        for batch in batches.programs
        if batch.is_long_chain
        for k in range(len(batch.order))
    ]


def _make_grid(batch: ProgramBatch, surface: Ints, surfaces: Surfaces, growth: float, leaf_rounds: int) -> ChainGrid:
    """Make the grid of one object, whose leaves are the surfaces `surface` (k,).

    `leaf_rounds` is the most rounds of loops for the roots of a leaf.
    """
    codes = batch.pruner.whole_program()
    is_union = (codes[-1] & 7) == OR_LEAF
    place = codes >> LEAF_SHIFT
    # In the conjunction, a ray must be in the leaves that are not negated.
    negated = ((codes & NEGATED) != 0) != is_union
    codes = surface[place] << LEAF_SHIFT | codes & NEGATED
    rows = np.column_stack([codes, place])
    bounded = surface[place] < surfaces.bounded
    listed = np.flatnonzero(negated & bounded)
    core = np.flatnonzero(~(negated & bounded))
    bounding = core[bounded[core]]
    first = surface[place[bounding[0] if len(bounding) else listed[0]]]
    frame = _frame(surfaces, int(first))
    boxes = _boxes(surfaces, surface[place[listed]], frame, growth)
    low, high = boxes.low.min(axis=0), boxes.high.max(axis=0)
    if len(bounding):
        around = _boxes(surfaces, surface[place[bounding]], frame, growth)
        low, high = np.maximum(low, around.low.max(axis=0)), np.minimum(high, around.high.min(axis=0))
    extent = np.maximum(high - low, 2.0 * growth)
    side = max(
        (float(np.prod(extent)) / min(_CELLS_FOR_LEAF * len(listed), _MAX_CELLS)) ** (1.0 / 3.0),
        _SMALLEST * growth,
        float(extent.max()) / 2**10,
    )
    while True:
        shape = np.maximum(np.ceil(extent / side), 1.0).astype(np.int64)
        sides = extent / shape
        begin = np.clip(np.floor((boxes.low - low) / sides), 0, None).astype(np.int64)
        end = np.minimum(np.floor((boxes.high - low) / sides), shape - 1.0).astype(np.int64) + 1
        spans = np.maximum(end - begin, 0)
        if spans.prod(axis=1).sum() <= _MAX_PAIRS:
            break
        side *= 1.25
    cell, leaf = _pairs(begin, spans, shape)
    keep = _keep_meeting(surfaces, surface[place[listed]], frame, low, sides, shape, growth, cell, leaf)
    cell, leaf = cell[keep], leaf[keep]
    order = np.argsort(cell, kind="stable")
    count = np.bincount(cell, minlength=int(shape.prod()))
    stop = np.cumsum(count)
    return ChainGrid(
        axes=frame / sides[:, None],
        low=low / sides,
        shape=(int(shape[0]), int(shape[1]), int(shape[2])),
        is_union=bool(is_union),
        leaf=int(surface[0]),
        core=rows[core],
        ends=np.column_stack([stop - count, stop]),
        leaves=rows[listed[leaf[order]]],
        rounds=_most_rounds(shape, int(count.max(initial=0)), leaf_rounds),
    )


def _most_rounds(shape: Ints, longest: int, leaf_rounds: int) -> int:
    """Return the most rounds of loops for a ray in a grid of `shape` cells, whose longest list has `longest` leaves.

    A ray passes the list of a cell again only if it has gone on to the end of a leaf in the list, or of the core.
    """
    cells = int(shape.sum()) + 1
    passes = cells * max(longest, 1) + CORE + 2
    return passes * (1 + (longest + 1) * (1 + leaf_rounds)) + (CORE + 1) * (1 + leaf_rounds)


def _frame(surfaces: Surfaces, index: int) -> Array:
    """Return the axes (3, 3) of a grid as rows: the normals of a body's slabs, made orthogonal."""
    if index < surfaces.spheres:
        return np.eye(3)
    body, bodies = index - surfaces.spheres, surfaces.bodies
    own = bodies.normals[bodies.starts[body] : bodies.starts[body + 1]]
    axes, _ = np.linalg.qr(np.concatenate([own, np.eye(3)]).T)
    # Axes that are nearly the world's axes become them, so that grids of solids without a rotation have no rounding.
    return np.where(np.abs(axes.T) < 2.0**-50, 0.0, axes.T)


def _boxes(surfaces: Surfaces, index: Ints, frame: Array, growth: float) -> Boxes:
    """Return the bounds of leaves (N,) along the axes of a frame."""
    centers = surfaces.centers[index] @ frame.T
    radii = surfaces.radii[index, None]
    low, high = centers - radii, centers + radii
    is_body = np.flatnonzero(index >= surfaces.spheres)
    corners = surfaces.bodies.corners[index[is_body] - surfaces.spheres] @ frame.T
    low[is_body] = np.maximum(low[is_body], corners.min(axis=1))
    high[is_body] = np.minimum(high[is_body], corners.max(axis=1))
    return Boxes(low - growth, high + growth)


def _pairs(begin: Ints, spans: Ints, shape: Ints) -> tuple[Ints, Ints]:
    """Return all pairs of a cell and a leaf whose ranges of cells are `begin` to `begin + spans`, each (N, 3)."""
    count = spans.prod(axis=1)
    leaf = np.repeat(np.arange(len(count)), count)
    within = np.arange(len(leaf)) - np.repeat(np.cumsum(count) - count, count)
    rest, x = np.divmod(within, spans[leaf, 0])
    z, y = np.divmod(rest, spans[leaf, 1])
    first = (begin[:, 2] * shape[1] + begin[:, 1]) * shape[0] + begin[:, 0]
    return first[leaf] + (z * shape[1] + y) * shape[0] + x, leaf


def _keep_meeting(
    surfaces: Surfaces,
    index: Ints,
    frame: Array,
    low: Array,
    sides: Array,
    shape: Ints,
    growth: float,
    cell: Ints,
    leaf: Ints,
) -> NDArray[np.bool_]:
    """Return which pairs (M,) to keep: the leaf meets the cell, and no other leaf holds the whole cell.

    A ray in a cell that one leaf holds leaves the cell with this leaf. So the cell needs no other leaf.
    """
    rest, x = np.divmod(cell, shape[0])
    z, y = np.divmod(rest, shape[1])
    center = low + sides * (np.column_stack([x, y, z]) + 0.5)
    half = sides / 2.0
    keep = np.ones(len(cell), bool)
    holds = np.ones(len(cell), bool)
    # Spheres, by the distances of the nearest and the farthest point of the cell.
    sphere = np.flatnonzero(index[leaf] < surfaces.spheres)
    own = index[leaf[sphere]]
    away = np.abs(surfaces.centers[own] @ frame.T - center[sphere])
    radii = surfaces.radii[own]
    keep[sphere] = np.linalg.norm(np.maximum(away - half, 0.0), axis=1) <= radii + growth
    holds[sphere] = np.linalg.norm(away + half, axis=1) <= radii - growth
    # Bodies, slab by slab.
    bodies = surfaces.bodies
    counts = np.append(np.diff(bodies.starts), 0)  # the last one is for spheres
    body = np.where(index < surfaces.spheres, -1, index - surfaces.spheres)
    slabs = counts[body]
    is_body = index[leaf] >= surfaces.spheres
    holds[is_body] = bodies.walls[body[leaf[is_body]]] < 0
    normals = bodies.normals @ frame.T
    for k in range(int(slabs.max(initial=0))):
        pair = np.flatnonzero(slabs[leaf] > k)
        slab = bodies.starts[body[leaf[pair]]] + k
        normal = normals[slab]
        middle = (normal * center[pair]).sum(axis=1)
        reach = np.abs(normal) @ half + growth
        keep[pair] &= (middle - reach <= bodies.high[slab]) & (middle + reach >= bodies.low[slab])
        holds[pair] &= (middle + reach <= bodies.high[slab]) & (middle - reach >= bodies.low[slab])
    holder = np.full(int(shape.prod()), len(cell))
    held = np.flatnonzero(holds)[::-1]
    holder[cell[held]] = held
    return keep & ((holder[cell] == len(cell)) | (holder[cell] == np.arange(len(cell))))


def _headers(grids: list[ChainGrid], view: View) -> NDArray[np.int32]:
    """Pack the headers of grids (HEADER * grids, 4) for the shader, whose rays are in view space."""
    headers = np.zeros((len(grids), HEADER, 4), np.int32)
    begin = 0
    for header, grid in zip(headers, grids, strict=True):
        rows = np.empty((3, 4), np.float32)
        rows[:, :3] = grid.axes @ view.rotation.T
        rows[:, 3] = grid.axes @ np.array(view.eye) - grid.low
        header[:3] = rows.view(np.int32)
        core = begin + len(grid.ends)
        header[3] = *grid.shape, begin
        header[4] = core, core + len(grid.core), grid.is_union, grid.leaf
        begin = core + len(grid.core) + len(grid.leaves)
    return headers.reshape(-1, 4)


def _leaf_texels(grids: list[ChainGrid]) -> NDArray[np.int32]:
    """Pack the cells, the core and the leaves of each grid (N, 2), one grid after the other."""
    parts = [np.zeros((0, 2), np.int32)]
    begin = 0
    for grid in grids:
        leaves = begin + len(grid.ends) + len(grid.core)
        parts += [part.astype(np.int32) for part in (grid.ends + leaves, grid.core, grid.leaves)]
        begin = leaves + len(grid.leaves)
    return np.concatenate(parts)
