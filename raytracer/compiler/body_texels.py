"""Packs the faces of bodies for shaders/geometry/body.glsl."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.bodies import Bodies
from raytracer.compiler.body_view import BodyView

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Split: TypeAlias = Callable[[Array], tuple[Array, Array]]

# The texels of a slab, of a wall, and of each form of a wall (body.glsl).
SLAB, WALL_HEADER, FORM = 4, 1, 3
# The most slabs of a body whose code is written out: a box has three.
FEW_SLABS = 3
# The forms of walls by their kind: body.glsl reads only these. A round wall and a torus have a constant l0, in the
# wall's header.
_FORMS = (), (1, 2, 3), (0, 1, 2, 3), (1, 2, 3)
# A depth beyond any root, INF of ray.glsl: a side of a slab without a face.
_NO_FACE = 1e30


def body_headers(bodies: Bodies) -> Array:
    """Return the header of each body (B, 4): its first texel, its number of slabs, its kind of wall, and its part."""
    begins, _, _ = _layout(bodies)
    return np.column_stack([begins, np.diff(bodies.starts), bodies.kinds, bodies.parts]).astype(float)


def _layout(bodies: Bodies) -> tuple[Ints, Ints, int]:
    """Return the first texel of each body (B,) and of each wall (W,), and the number of all texels."""
    sizes = np.array([WALL_HEADER + FORM * len(forms) if forms else 0 for forms in _FORMS])[bodies.kinds]
    slabs = SLAB * np.diff(bodies.starts)
    ends = np.cumsum(slabs + sizes)
    begins = ends - slabs - sizes
    return begins, (begins + slabs)[bodies.walls >= 0], int(ends[-1]) if len(ends) else 0


def body_size(slabs: int, kind: int) -> int:
    """Return the number of texels of a body, by its slabs and its kind of wall."""
    return SLAB * slabs + (WALL_HEADER + FORM * len(_FORMS[kind]) if kind else 0)


def camera_texels(slabs: int, kind: int) -> list[int]:
    """Return the texels that camera rays read of a body, counted from its first, by its slabs and its kind of wall."""
    wall = SLAB * slabs
    forms = range(wall + WALL_HEADER, wall + WALL_HEADER + FORM * len(_FORMS[kind]), FORM)
    own = [texel for slab in range(0, wall, SLAB) for texel in (slab + 2, slab + 3)]
    return [*own, *([wall] if kind else []), *(texel for form in forms for texel in (form + 1, form + 2))]


def count_texels(bodies: Bodies) -> int:
    """Return the number of texels of all faces."""
    return _layout(bodies)[2]


def body_texels(bodies: Bodies, view: BodyView, coinciding: Ints, split: Split) -> Array:
    """Return the texels of all faces (T, 4).

    Args:
        bodies: The bodies in world space.
        view: The bodies in view space.
        coinciding: The coincidence numbers (2 K + W,) of the faces.
        split: Splits the slopes of vectors (N, 3) into coarse and fine ones.
    """
    begins, walls, count = _layout(bodies)
    texels = np.zeros((count, 4))
    number = np.repeat(np.arange(len(begins)), np.diff(bodies.starts))
    at = begins[number] + SLAB * (np.arange(len(number)) - bodies.starts[number])
    slabs = len(bodies.high)
    coarse, fine = split(view.normals)
    depths = np.column_stack([view.high, view.low])
    surfaces = np.where(np.isfinite(depths), coinciding[: 2 * slabs].reshape(-1, 2), 0)
    high, low = np.minimum(depths, _NO_FACE).T
    texels[at] = np.column_stack([view.normals, high])
    texels[at + 1] = np.column_stack([low, surfaces, high])
    texels[at + 2] = np.column_stack([coarse, high])
    texels[at + 3] = np.column_stack([fine, low])
    kinds = bodies.kinds[bodies.walls >= 0]
    texels[walls] = np.column_stack([view.forms[:, 0, 3], view.powers, coinciding[2 * slabs :], np.zeros(len(walls))])
    for kind, forms in enumerate(_FORMS):
        own = np.flatnonzero(kinds == kind)
        for k, form in enumerate(forms):
            place = walls[own] + WALL_HEADER + FORM * k
            coarse, fine = split(view.forms[own, form, :3])
            texels[place] = view.forms[own, form]
            texels[place + 1] = np.column_stack([coarse, view.forms[own, form, 3]])
            texels[place + 2, :3] = fine
    return texels
