"""The lists of all cells of a picture and of the cubes around lights, where there are many primitives, as textures."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import Batches
from raytracer.compiler.candidate_lists import Lister, Lists
from raytracer.compiler.culling import OccupiedCells
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.meshes import cells_under
from raytracer.compiler.program_rows import check_listed
from raytracer.compiler.rounds import ENTRY_ROUNDS
from raytracer.compiler.view_space import View
from raytracer.core.validation import InputError
from raytracer.scene.lights import PointLight

# Cells of a side of a cube's face around a light: in a picture of many objects, one of the first covers about a
# quarter of a cell. The coarse ones are for large lights.
GRIDS = (256, 128, 64, 32, 16, 8, 4, 2, 1)
# Cells are larger where the lists of all lights would have more of them than that, or more pairs of a cell and an
# object of a common shape, or of a cell and a primitive of another object. They take 24, 40 and 150 bytes.
_MAX_CELLS, _MAX_ITEMS, _MAX_LISTED = 2**23, 2**24, 2**22
# Entries of the list of all objects up to which rays to a light from beyond its reach go through that list: eight times
# the primitives of which `walk` makes the same bits. A longer list takes too long for pixels at a horizon, and more
# rounds than llvmpipe computes (cut_short.glsl). There the list of the cell has to do, which may then miss an object
# that the ray only grazes, to within the ray's own rounding.
_MOST_FROM_AFAR = 4096
# Spheres times lights: to find in which cells each is seen takes 0.7 microseconds, and up to 2.6 where the cells have
# to be made larger several times: 20 seconds.
_MAX_SEEN = 2**23


class CameraLists(msgspec.Struct, frozen=True, eq=False):
    """The part of the lists that the picture decides, whatever the lights."""

    lister: Lister
    batches: Batches
    lists: Lists
    rectangles: NDArray[np.int32]  # (N, 8), of Lister.rectangles()
    farthest: float  # more than any distance to objects in them
    full_list: NDArray[np.int32]  # of all objects
    items: NDArray[np.float32]  # the texels `items` of lists.glsl
    objects: NDArray[np.int32]  # the texels `objects` of shapes.vert
    shape: tuple[int, int]  # rows and columns of cells


class LightLists(msgspec.Struct, frozen=True, eq=False):
    """The lists of the cubes around lights, and all textures of lists."""

    camera: CameraLists
    casters: tuple[object, ...]  # of light_casters()
    has_mirrors: bool
    most_cells: int
    lists: Lists
    grid: int  # cells of a side of a cube's face
    entries: NDArray[np.int32]  # the texels `lists` of lists.glsl
    ends: NDArray[np.int32]  # the texels `ends` of lists.glsl
    everything: tuple[int, int]  # where the list of all objects begins and ends
    picture_ends: NDArray[np.int32]  # (cells, 2): where the list of each cell of the picture begins and ends
    rounds: tuple[int, int]  # of loops, of one ray of the camera or a mirror, and of one to a light


def make_camera_lists(view: View, batches: Batches, numbers: NDArray[np.float32], size: tuple[int, int]) -> CameraLists:
    """The lists for a picture of `size`. `numbers` are the texels of surfaces.glsl."""
    lister = Lister(view, batches)
    rectangles, farthest = lister.rectangles(size)
    return CameraLists(
        lister=lister,
        batches=batches,
        lists=lister.camera_lists(size),
        rectangles=rectangles,
        farthest=farthest,
        full_list=lister.full_list(),
        items=lister.items_texture(numbers),
        objects=rectangles.reshape(-1, 4),
        shape=(-(-size[1] // CELL), -(-size[0] // CELL)),
    )


def light_casters(lights: Sequence[PointLight]) -> tuple[object, ...]:
    """The places and radii of lights, which decide their lists."""
    return tuple((light.position, light.radius) for light in lights)


def make_light_lists(
    camera: CameraLists,
    lights: Sequence[PointLight],
    spheres: int,
    most_cells: int,
    *,
    has_mirrors: bool,
    previous: LightLists | None = None,
) -> LightLists:
    """The lists of lights that cast shadows. `previous` is returned if nothing has changed.

    Raises InputError if the lists take too much even with one cell for each face of a cube.
    """
    casters = light_casters(lights)
    if (
        previous
        and previous.camera is camera
        and (previous.casters, previous.has_mirrors, previous.most_cells) == (casters, has_mirrors, most_cells)
    ):
        return previous
    grid, lists = _cube_lists(camera.lister, lights, spheres, most_cells)
    # All in one texture, the camera's last; and where the list of each cell of a light begins and ends. Behind
    # these, each light's reach.
    is_short = len(camera.full_list) <= _MOST_FROM_AFAR
    full_list = camera.full_list if is_short or has_mirrors else camera.full_list[:0]
    parts = [lists.entries, full_list, camera.lists.entries]
    first = np.cumsum([0, *map(len, parts)])
    reach = [camera.lister.reach(light) if is_short else np.inf for light in lights]
    reaches = np.column_stack((reach, np.zeros(len(lights)))).astype(np.float32)
    everything = int(first[1]), int(first[2])
    return LightLists(
        camera=camera,
        casters=casters,
        has_mirrors=has_mirrors,
        most_cells=most_cells,
        lists=lists,
        grid=grid,
        entries=np.concatenate(parts),
        ends=np.concatenate((lists.ends, reaches.view(np.int32))),
        everything=everything,
        picture_ends=camera.lists.ends + np.int32(first[2]),
        rounds=_most_rounds(camera, lists, everything[1] - everything[0] if has_mirrors else 0),
    )


def _cube_lists(lister: Lister, lights: Sequence[PointLight], spheres: int, most_cells: int) -> tuple[int, Lists]:
    """The lists for cubes around lights, of as many cells as there is room for, and use: cells of a side, and these."""
    if spheres * len(lights) > _MAX_SEEN:
        raise InputError(
            f"expected at most {_MAX_SEEN} spheres times lights, got {spheres} x {len(lights)}, whose "
            f"lists take about {spheres * len(lights) * 2e-6:.2g} s; remedies are fewer lights, fewer spheres and "
            "no shadows",
            "objects",
        )
    most = min(most_cells, _MAX_CELLS)
    finest = min((lister.finest_grid(light) for light in lights), default=GRIDS[0])
    for grid in GRIDS:
        is_last = grid == GRIDS[-1]
        if not is_last and (grid > finest or (6 * grid**2 + 1) * len(lights) > most):
            continue
        shared, others = lister.pairs(lights, grid)
        if is_last:
            check_listed(others)
        elif shared > _MAX_ITEMS or others > _MAX_LISTED:
            continue
        try:
            return grid, lister.light_lists(lights, grid)
        except InputError:  # there are more pairs than they seemed to be
            if is_last:
                raise
    raise AssertionError


def _most_rounds(camera: CameraLists, lights: Lists, everything: int) -> tuple[int, int]:
    """Rounds of loops of one ray, by the longest lists: a program takes as many for each root of its surfaces as it has
    codes. But of the list of all objects, with `everything` entries, rays pass all objects of common shapes.
    """
    longest, longest_to_light = (int(np.diff(lists.ends).max(initial=0)) for lists in (camera.lists, lights))
    programs = camera.batches.programs
    trees = any(not batch.pruner.is_chain for batch in programs)

    def rounds(codes: int) -> int:
        return codes * max(2 * codes if trees else 0, ENTRY_ROUNDS)

    ray = max(rounds(longest), rounds(everything) if programs else everything)
    return ray, rounds(longest_to_light)


def listed_cells(lists: LightLists, lights: Sequence[PointLight]) -> OccupiedCells:
    """The cells in which there are lists, or rectangles; without `lights` only the picture's."""
    camera = lists.camera
    picture = _has_entries(camera.lists) | cells_under(camera.rectangles, camera.shape, CELL).ravel()
    cubes = _has_entries(lists.lists).reshape(-1, 6 * lists.grid**2) if lights else ()
    return OccupiedCells(picture, list(cubes))


def _has_entries(lists: Lists) -> NDArray[np.bool_]:
    return lists.ends[:, 1] > lists.ends[:, 0]
