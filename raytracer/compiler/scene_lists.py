"""The candidate lists of all cells of a picture and around lights, as textures, for scenes of many primitives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import Batches
from raytracer.compiler.candidate_lists import CasterLists, Lister
from raytracer.compiler.direction_cells import CELL, MAX_PAIRS, Lists, Part, cells_in, check_pairs, mask_shape
from raytracer.compiler.meshes import cells_under
from raytracer.compiler.program_rows import check_listed, most_listed
from raytracer.compiler.rounds import ENTRY_ROUNDS, body_rounds
from raytracer.compiler.view_space import View
from raytracer.core.validation import InputError, Vec3
from raytracer.scene.lights import PointLight

Caster: TypeAlias = tuple[Vec3, float]  # the place and the radius of a light

# The possible numbers of cells along each side of a hemisphere around a light. The small ones are for large lights.
GRIDS = (512, 448, 384, 320, 256, 224, 192, 160, 128, 112, 96, 80, 64, 48, 32, 24, 16, 12, 8, 6, 4, 3, 2, 1)
# The number of a light's cells for each ball: with it, pictures of 20,000 balls take no longer than with finer cells,
# and the lists take less time. And the least number of cells of all lights together: with it, pictures of few balls
# take less time than with coarser cells.
_CELLS_FOR_BALL, _LEAST_CELLS = 3, 2 * 256**2
# The most cells of all lights, the most pairs of a cell and an object of a common shape, and the most pairs of a cell
# and a primitive of another object. Above any of these, cells become larger. They take 8, 4 and 150 bytes each.
_MAX_CELLS, _MAX_ITEMS, _MAX_LISTED = 2**23, 2**24, 2**22
# The longest list of all objects that is used for rays to a light from beyond the light's reach: eight times the
# primitives for which the evaluator `walk` gives equal bits. A longer list would take too long for pixels at a horizon,
# and more rounds than llvmpipe computes (cut_short.glsl). Then the list of the cell is used, which may miss an object
# that the ray only grazes, to within the ray's own rounding.
_MOST_FROM_AFAR = 4096
# The most spheres times lights. Finding the cells of one sphere for one light takes 0.1 microseconds, and several times
# as long if the cells have to be made larger: in all some seconds.
_MAX_SEEN = 2**23


class CameraLists(msgspec.Struct, frozen=True, eq=False):
    """The part of the lists that depends on the camera and the picture, for any lights."""

    lister: Lister
    batches: Batches
    lists: Lists
    longest: int  # number of entries of the longest list
    body_rounds: int  # the most rounds of loops for the roots of a body, by body_rounds()
    rectangles: NDArray[np.int32]  # (N, 8), by Lister.rectangles()
    farthest: float  # more than the distance to any object in the rectangles
    full_list: NDArray[np.int32]  # the list of all objects
    items: NDArray[np.float32]  # the texels `items` of lists.glsl
    objects: NDArray[np.int32]  # the texels `objects` of shapes.vert
    shape: tuple[int, int]  # rows and columns of cells
    part: Part  # the part of the picture whose cells have lists; the rectangles are for the whole picture


class LightLists(msgspec.Struct, frozen=True, eq=False):
    """The lists of the cells around lights, and all textures of lists.

    Each texture consists of parts, one after the other. The next frame shares the parts of unchanged lights.
    """

    camera: CameraLists
    casters: tuple[Caster, ...]  # by light_casters()
    has_mirrors: bool
    most_texels: int
    grid: int  # number of cells along each side of a hemisphere
    own: tuple[CasterLists, ...]  # the lists of each light
    # The texels `lists` of lists.glsl: the list of all objects, then the lists of the picture and of each light.
    entries: tuple[NDArray[np.int32], ...]
    # The texels `ends` of lists.glsl: a texel for each light, then one for each light's cells.
    ends: tuple[NDArray[np.int32], ...]
    everything: tuple[int, int]  # where the list of all objects begins and ends
    picture_ends: NDArray[np.int32]  # (cells, 2): where the list of each cell of the picture begins and ends
    rounds: tuple[int, int]  # the most rounds of loops for a ray from the camera or a mirror, and for a ray to a light


def make_camera_lists(
    view: View, batches: Batches, numbers: NDArray[np.float32], size: tuple[int, int], part: Part
) -> CameraLists:
    """Make the lists for a part of a picture of `size` (width, height). `numbers` are the texels of surfaces.glsl."""
    lister = Lister(view, batches)
    rectangles, farthest = lister.rectangles(size)
    lists = lister.camera_lists(size, part)
    return CameraLists(
        lister=lister,
        batches=batches,
        lists=lists,
        longest=lists.longest(),
        body_rounds=int(body_rounds(view.surfaces).max(initial=0)),
        rectangles=rectangles,
        farthest=farthest,
        full_list=lister.full_list(),
        items=lister.items_texture(numbers),
        objects=rectangles.reshape(-1, 4),
        shape=mask_shape(part),
        part=part,
    )


def turn_to_part(camera: CameraLists, size: tuple[int, int], part: Part) -> CameraLists:
    """Return the lists for another part of the same picture. They share everything else with `camera`."""
    lists = camera.lister.camera_lists(size, part)
    shape = mask_shape(part)
    return msgspec.structs.replace(camera, lists=lists, longest=lists.longest(), shape=shape, part=part)


def light_casters(lights: Sequence[PointLight]) -> tuple[Caster, ...]:
    """Return the positions and radii of lights, which decide their lists."""
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

    The result is `previous` if nothing has changed. Otherwise it shares the lists of unchanged lights with `previous`.

    Raises InputError if the lists take too much time or memory even with one cell for each hemisphere.
    """
    casters = light_casters(lights)
    if previous and previous.camera.lister is not camera.lister:
        previous = None
    same_camera = previous is not None and previous.camera is camera
    if previous and (same_camera, previous.casters, previous.has_mirrors, previous.most_texels) == (
        True,
        casters,
        has_mirrors,
        most_texels,
    ):
        return previous
    grid, own = _own_lists(camera.lister, lights, spheres, most_texels, previous)
    is_short = len(camera.full_list) <= _MOST_FROM_AFAR
    full_list = camera.full_list if is_short or has_mirrors else camera.full_list[:0]
    entries = full_list, camera.lists.entries, *(one.lists.entries for one in own)
    # For each light: its reach, and where its lists begin in the texture.
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
        if previous and same_camera and previous.everything == everything
        else camera.lists.ends + np.int32(len(full_list)),
        rounds=_most_rounds(camera, max((one.longest for one in own), default=0), len(full_list)),
    )


def _own_lists(
    lister: Lister, lights: Sequence[PointLight], spheres: int, most_texels: int, previous: LightLists | None
) -> tuple[int, tuple[CasterLists, ...]]:
    """Make the lists of lights with as many cells as are useful and fit into memory.

    Returns the number of cells along each side of a hemisphere, and the lists of each light.
    """
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

    Raises InputError for more than `most` pairs of a cell and an object of a common shape, and for more than
    `most_primitives` pairs of a cell and a primitive of another object, over all lights.
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
    """Return the most rounds of loops for a ray from the camera or a mirror, and for a ray to a light.

    They follow from the longest lists. A program takes as many rounds for each root of its surfaces as it has codes.
    `everything` is the length of the list of all objects.
    """
    programs = camera.batches.programs
    trees = any(not batch.pruner.is_chain for batch in programs)

    def rounds(codes: int) -> int:
        body = camera.body_rounds
        return codes * max(2 * codes * (1 + body) if trees else 0, ENTRY_ROUNDS + body)

    ray = max(rounds(camera.longest), rounds(everything) if programs else everything)
    return ray, rounds(longest_to_light)


def listed_cells(camera: CameraLists) -> NDArray[np.bool_]:
    """Return the cells (rows, columns) of the part with entries in their lists, or with rectangles."""
    return camera.lists.occupied().reshape(camera.shape) | cells_under(camera.rectangles, cells_in(camera.part), CELL)
