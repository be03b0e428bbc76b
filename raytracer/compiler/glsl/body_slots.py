"""The structure that the bodies of all objects of common shapes have, and the texels that the vertex shader hands on.

With a structure that is known, the shader's text has only the slabs and the wall that a body has.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.body_texels import FEW_SLABS, body_size, camera_texels
from raytracer.compiler.compiled_scene import CompiledScene


class Slot(NamedTuple):
    """The structure of the bodies number j of all objects, None for numbers that differ."""

    slabs: int | None
    kind: int | None  # of the wall, an index into WALLS
    part: int | None  # of a torus; 0 for other bodies


def body_slots(compiled: CompiledScene) -> list[Slot]:
    """Return the structure of the bodies of all objects of common shapes, in their order in an object."""
    shapes, bodies = compiled.batches.shapes, compiled.surfaces.bodies
    slabs = np.diff(bodies.starts)
    slots = []
    for j in range(max((batch.bodies for batch in shapes), default=0)):
        own = (
            np.concatenate([batch.first[:, 1] + j for batch in shapes if batch.bodies > j]) - compiled.surfaces.spheres
        )
        slots.append(Slot(_common(slabs[own]), _common(bodies.kinds[own]), _common(bodies.parts[own])))
    return slots


def _common(values: NDArray[np.int64]) -> int | None:
    """Return the value that all have, or None."""
    return int(values[0]) if np.all(values == values[0]) else None


def handed_begins(slots: Sequence[Slot]) -> list[int]:
    """Return the number of each slot's first texel among the handed texels, and the number of all.

    Empty if the structure of bodies differs, or if there are bodies with many slabs.
    """
    if any(slot.slabs is None or slot.slabs > FEW_SLABS or slot.kind is None or slot.part is None for slot in slots):
        return []
    return [0, *itertools.accumulate(body_size(slot.slabs or 0, slot.kind or 0) for slot in slots)]


def handed_texels(slots: Sequence[Slot]) -> dict[int, str]:
    """Return the GLSL expressions of the texels to hand on, by their number among the handed texels."""
    return {
        begin + texel: f"texelFetch(bodies, headerOf(first.y + {j}).x + {texel})"
        for j, (slot, begin) in enumerate(zip(slots, handed_begins(slots), strict=False))
        for texel in camera_texels(slot.slabs or 0, slot.kind or 0)
    }


def handed_text(slots: Sequence[Slot]) -> list[str]:
    """Generate handedAt() for body.glsl, in the fragment shader."""
    numbers = [*handed_texels(slots)]
    choice = "".join(f"i == {n} ? texel{n} : " for n in numbers[:-1])
    return [
        *(f"flat in vec4 texel{n};" for n in numbers),
        f"vec4 handedAt(int i) {{ return {choice}texel{numbers[-1]}; }}",
    ]
