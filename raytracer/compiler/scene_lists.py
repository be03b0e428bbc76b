"""The lists of all cells of a picture and around lights, where there are many primitives, as textures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import Batches
from raytracer.compiler.candidate_lists import CasterLists, Lister
from raytracer.compiler.direction_cells import CELL, MAX_PAIRS, Lists, check_pairs
from raytracer.compiler.meshes import cells_under
from raytracer.compiler.program_rows import check_listed, most_listed
from raytracer.compiler.rounds import ENTRY_ROUNDS
from raytracer.compiler.view_space import View
from raytracer.core.validation import InputError, Vec3
from raytracer.scene.lights import PointLight

Caster: TypeAlias = tuple[Vec3, float]  # the place and the radius of a light

# Cells of a side of each hemisphere around a light. The coarse ones are for large lights.
GRIDS = (512, 448, 384, 320, 256, 224, 192, 160, 128, 112, 96, 80, 64, 48, 32, 24, 16, 12, 8, 6, 4, 3, 2, 1)
# A light has so many cells for each ball: pictures of 20,000 balls take no longer than with finer ones, and lists less.
# But all lights together have so many at least: pictures of few balls take less time than with coarser ones.
_CELLS_FOR_BALL, _LEAST_CELLS = 3, 2 * 256**2
# Cells are larger where the lists of all lights would have more of them than that, or more pairs of a cell and an
# object of a common shape, or of a cell and a primitive of another object. They take 8, 4 and 150 bytes.
_MAX_CELLS, _MAX_ITEMS, _MAX_LISTED = 2**23, 2**24, 2**22
# Entries of the list of all objects up to which rays to a light from beyond its reach go through that list: eight times
# the primitives of which `walk` makes the same bits. A longer list takes too long for pixels at a horizon, and more
# rounds than llvmpipe computes (cut_short.glsl). There the list of the cell has to do, which may then miss an object
# that the ray only grazes, to within the ray's own rounding.
_MOST_FROM_AFAR = 4096
# Spheres times lights: to find in which cells each is seen takes 0.1 microseconds, and several times as long where the
# cells have to be made larger: some seconds.
_MAX_SEEN = 2**23


class CameraLists(msgspec.Struct, frozen=True, eq=False):
    """The part of the lists that the picture decides, whatever the lights."""

    lister: Lister
    batches: Batches
    lists: Lists
    longest: int  # entries of the longest list
    rectangles: NDArray[np.int32]  # (N, 8), of Lister.rectangles()
    farthest: float  # more than any distance to objects in them
    full_list: NDArray[np.int32]  # of all objects
    items: NDArray[np.float32]  # the texels `items` of lists.glsl
    objects: NDArray[np.int32]  # the texels `objects` of shapes.vert
    shape: tuple[int, int]  # rows and columns of cells


class LightLists(msgspec.Struct, frozen=True, eq=False):
    """The lists of the cells around lights, and all textures of lists.

    Each texture is in parts, one after the other. The next frame takes the parts of lights that stay.
    """

    camera: CameraLists
    casters: tuple[Caster, ...]  # of light_casters()
    has_mirrors: bool
    most_texels: int
    grid: int  # cells of a side of each hemisphere
    own: tuple[CasterLists, ...]  # the lists of each light
    # The texels `lists` of lists.glsl: the list of all objects, then the lists of the picture and of each light.
    entries: tuple[NDArray[np.int32], ...]
    # The texels `ends` of lists.glsl: a texel for each light, then one for each light's cells.
    ends: tuple[NDArray[np.int32], ...]
    everything: tuple[int, int]  # where the list of all objects begins and ends
    picture_ends: NDArray[np.int32]  # (cells, 2): where the list of each cell of the picture begins and ends
    rounds: tuple[int, int]  # of loops, of one ray of the camera or a mirror, and of one to a light


def make_camera_lists(view: View, batches: Batches, numbers: NDArray[np.float32], size: tuple[int, int]) -> CameraLists:
    """The lists for a picture of `size`. `numbers` are the texels of surfaces.glsl."""
    lister = Lister(view, batches)
    rectangles, farthest = lister.rectangles(size)
    lists = lister.camera_lists(size)
    return CameraLists(
        lister=lister,
        batches=batches,
        lists=lists,
        longest=lists.longest(),
        rectangles=rectangles,
        farthest=farthest,
        full_list=lister.full_list(),
        items=lister.items_texture(numbers),
        objects=rectangles.reshape(-1, 4),
        shape=(-(-size[1] // CELL), -(-size[0] // CELL)),
    )


def light_casters(lights: Sequence[PointLight]) -> tuple[Caster, ...]:
    """The places and radii of lights, which decide their lists."""
    return tuple((light.position, light.radius) for light in lights)


def make_light_lists(
    camera: CameraLists,
    lights: Sequence[PointLight],
    spheres: int,
    most_texels: int,
    *,
    has_mirrors: bool,
    previous: LightLists | None = None,
) -> LightLists:
    """Make the lists of lights that cast shadows.

    `previous` is returned if nothing has changed. Otherwise it lends the lists of lights that stay.

    Raises InputError if the lists take too much even with one cell for each hemisphere.
    """
    casters = light_casters(lights)
    if previous and previous.camera is not camera:
        previous = None
    if previous and (previous.casters, previous.has_mirrors, previous.most_texels) == (
        casters,
        has_mirrors,
        most_texels,
    ):
        return previous
    grid, own = _own_lists(camera.lister, lights, spheres, most_texels, previous)
    is_short = len(camera.full_list) <= _MOST_FROM_AFAR
    full_list = camera.full_list if is_short or has_mirrors else camera.full_list[:0]
    entries = full_list, camera.lists.entries, *(one.lists.entries for one in own)
    # For each light: the reach, and where the lists begin in the texture.
    headers = np.zeros((len(lights), 2), np.int32)
    reach = [one.reach if is_short else np.inf for one in own]
    headers[:, 0] = np.array(reach, np.float32).view(np.int32)
    headers[:, 1] = np.cumsum(list(map(len, entries)))[1:-1]
    everything = 0, len(full_list)
    return LightLists(
        camera=camera,
        casters=casters,
        has_mirrors=has_mirrors,
        most_texels=most_texels,
        grid=grid,
        own=own,
        entries=entries,
        ends=(headers, *(one.lists.ends for one in own)),
        everything=everything,
        picture_ends=previous.picture_ends
        if previous and previous.everything == everything
        else camera.lists.ends + np.int32(len(full_list)),
        rounds=_most_rounds(camera, max((one.longest for one in own), default=0), len(full_list)),
    )


def _own_lists(
    lister: Lister, lights: Sequence[PointLight], spheres: int, most_texels: int, previous: LightLists | None
) -> tuple[int, tuple[CasterLists, ...]]:
    """Make the lists of lights with as many cells as there is room for, and use: cells of a side, and these."""
    if spheres * len(lights) > _MAX_SEEN:
        raise InputError(
            f"expected at most {_MAX_SEEN} spheres times lights, got {spheres} x {len(lights)}, whose "
            f"lists take about {spheres * len(lights) * 2e-7:.2g} s; remedies are fewer lights, fewer spheres and "
            "no shadows",
            "objects",
        )
    finest = min((lister.finest_grid(light) for light in lights), default=1.0)
    count = max(len(lights), 1)
    wanted = max(_LEAST_CELLS // count, _CELLS_FOR_BALL * lister.ball_count)
    room = (min(most_texels, _MAX_CELLS) - count) // count
    for grid in GRIDS:
        is_last = grid == GRIDS[-1]
        if not is_last and (grid > finest or 2 * grid**2 > min(wanted, room)):
            continue
        limits = (MAX_PAIRS, most_listed(0)) if is_last else (min(_MAX_ITEMS, most_texels), _MAX_LISTED)
        try:
            return grid, _lists_of_lights(lister, lights, grid, previous, *limits)
        except InputError:
            if is_last:
                raise
    raise AssertionError


def _lists_of_lights(
    lister: Lister,
    lights: Sequence[PointLight],
    grid: int,
    previous: LightLists | None,
    most: int,
    most_primitives: int,
) -> tuple[CasterLists, ...]:
    """Make the lists of lights for hemispheres of grid x grid cells.

    Raises InputError for more pairs, in all, of a cell and an object of a common shape, or a primitive of another.
    """
    known: dict[Caster, CasterLists] = {}
    if previous and previous.grid == grid:
        known = dict(zip(previous.casters, previous.own, strict=True))
    pairs = listed = 0
    own = []
    for light, caster in zip(lights, light_casters(lights), strict=True):
        one = known.get(caster)
        if one is None:
            one = known[caster] = lister.caster_lists(light, grid, most - pairs, listed, most_primitives)
        pairs += one.pairs
        listed += one.listed
        check_pairs(pairs, most)
        check_listed(listed, most_primitives)
        own.append(one)
    return tuple(own)


def _most_rounds(camera: CameraLists, longest_to_light: int, everything: int) -> tuple[int, int]:
    """Rounds of loops of one ray, by the longest lists: a program takes as many for each root of its surfaces as it has
    codes. But of the list of all objects, with `everything` entries, rays pass all objects of common shapes.
    """
    programs = camera.batches.programs
    trees = any(not batch.pruner.is_chain for batch in programs)

    def rounds(codes: int) -> int:
        return codes * max(2 * codes if trees else 0, ENTRY_ROUNDS)

    ray = max(rounds(camera.longest), rounds(everything) if programs else everything)
    return ray, rounds(longest_to_light)


def listed_cells(camera: CameraLists) -> NDArray[np.bool_]:
    """(rows, columns): the cells of the picture in which there are lists, or rectangles."""
    return camera.lists.occupied().reshape(camera.shape) | cells_under(camera.rectangles, camera.shape, CELL)
