"""The constants that the vertex shaders hand on: as many as a driver has varyings for. Fragment shaders fetch the rest.

Handed on they are quicker (draw.glsl), and have the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

# Components of the varyings of a scene that wants the most of them: 125 and some.
ALL = 128
# Components of a Surface (surfaces.glsl) at 32 bits, three vec4. Surfaces of 64 bits are not handed on.
_SURFACE = 12


class Handed(NamedTuple):
    """The constants that are handed on."""

    surfaces: Sequence[int]  # by their index
    leaves: int  # surfaces of an object of a kind (kinds.vert)
    lights: bool
    material: bool  # the only one


def fitting(room: int, room_of_kinds: int, wanted: Handed, lights: int, material: int) -> Handed:
    """Those of `wanted` for which there is room, in components: in cells.vert, and in kinds.vert where objects of kinds
    have leaves. `lights` and `material` are the components of all of these.
    """
    leaves = min(wanted.leaves, max(room_of_kinds, 0) // _SURFACE)
    both = min(room, room_of_kinds - leaves * _SURFACE) if wanted.leaves else room
    surfaces = wanted.surfaces[: max(both, 0) // _SURFACE]
    room -= len(surfaces) * _SURFACE
    has_lights = wanted.lights and lights <= room
    room -= lights * has_lights
    return Handed(surfaces, leaves, has_lights, wanted.material and material <= room)
