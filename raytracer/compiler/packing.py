"""Packs the numbers of surfaces, materials and lights for the shaders' buffer textures and uniform blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.bodies import WALLS, wall_gradient
from raytracer.compiler.body_texels import body_headers, body_texels
from raytracer.compiler.material_layout import Layout, pack_materials
from raytracer.compiler.surfaces import Surfaces, powers
from raytracer.compiler.view_space import View, pixel_scale
from raytracer.scene.lights import FALLOFFS, PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.options import Precision

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The std140 layout of struct Light (light.glsl), by precision.
LIGHT = {
    precision: np.dtype(
        {
            "names": ["position", "on", "n", "radius", "color", "falloff"],
            "formats": [(real, 3), "i4", (real, 3), real, ("f4", 3), "i4"],
            "offsets": offsets,
            "itemsize": size,
        }
    )
    for precision, real, offsets, size in (
        (32, "f4", (0, 12, 16, 28, 32, 44), 48),
        (64, "f8", (0, 24, 32, 56, 64, 76), 96),
    )
}
# An odd number with spread bits: 2^64 divided by the golden ratio (Knuth's multiplicative hashing).
_MIXING = np.uint64(0x9E3779B97F4A7C15)
_REAL = {32: np.float32, 64: np.float64}  # the type `real` of real.glsl, by precision


def surface_rows(view: View) -> Array:
    """Return the uniform block Surfaces of surfaces.glsl (N, 4): centre and radius of balls, or normal and offset."""
    return np.column_stack([view.vectors, np.concatenate([view.surfaces.radii, view.depths])])


def coincidences(view: View, precision: Precision) -> Ints:
    """Return the coincidence number of each surface, from 1: equal if surfaces coincide at shader precision.

    The numbers (N + 2 K + W,) are those of the leaves, of the high and the low face of each slab, and of the walls. A
    body itself has the number 0.
    """
    spheres, bounded = view.surfaces.spheres, view.surfaces.bounded
    rows = surface_rows(view)
    bodies = view.bodies
    high, low = np.column_stack([bodies.normals, bodies.high]), np.column_stack([-bodies.normals, bodies.low])
    planes = np.concatenate([rows[bounded:], np.stack([high, low], axis=1).reshape(-1, 4)]).astype(_REAL[precision])
    # A half-space and its complement share one face, so take n or -n: the one whose first nonzero part is positive.
    first = np.argmax(planes[:, :3] != 0.0, axis=1)
    planes *= np.sign(planes[np.arange(len(planes)), first])[:, None]
    kinds = np.repeat([0, 1], [spheres, len(planes)]).astype(np.uint64)
    flat = np.concatenate([rows[:spheres].astype(_REAL[precision]), planes])
    numbers = _number_rows(np.column_stack([kinds, _words(flat)]))
    walls = bodies.forms.reshape(-1, 16).astype(_REAL[precision])
    wall_kinds = view.surfaces.bodies.kinds[view.surfaces.bodies.walls >= 0].astype(np.uint64)
    wall_numbers = len(numbers) + _number_rows(np.column_stack([wall_kinds, _words(walls)]))
    planes_end = spheres + view.surfaces.size - bounded
    none = np.zeros(bounded - spheres, np.int64)
    return np.concatenate([numbers[:spheres], none, numbers[spheres:planes_end], numbers[planes_end:], wall_numbers])


def _words(rows: NDArray[np.floating]) -> NDArray[np.uint64]:
    """Return the bits of numbers (N, even), as words of 64 bits. -0.0 becomes 0.0: equal numbers have equal bits."""
    return np.ascontiguousarray(rows + 0.0).view(np.uint64)


def _number_rows(rows: NDArray[np.uint64]) -> Ints:
    """Return a number from 1 to N for each row (N,), equal for equal rows.

    Sorting by all columns takes eight times as long as sorting by one key. So only rows with equal keys are sorted by
    all columns.
    """
    numbers = np.arange(1, len(rows) + 1)
    key = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        key = key * _MIXING + column
    order = np.argsort(key)
    shared = np.zeros(len(rows) + 1, bool)  # whether the previous key, in sorted order, is equal
    shared[1:-1] = np.diff(key[order]) == 0
    tied = order[shared[1:] | shared[:-1]]
    tied = tied[np.lexsort(rows[tied].T)]
    is_new = np.ones(len(tied), bool)
    is_new[1:] = (rows[tied[1:]] != rows[tied[:-1]]).any(axis=1)
    numbers[tied] = numbers[tied[is_new]][np.cumsum(is_new) - 1]
    return numbers


def split_slopes(view: View, size: tuple[int, int], vectors: Array) -> tuple[Array, Array]:
    """Return the coarse and fine slopes (N, 3 each) of vectors (N, 3), for cameraSlope() in camera.glsl.

    A slope, dot(vector, direction), is a x + b y + c, with x and y in half pixels from the picture's centre. Each
    coefficient is split into a multiple of `quantum` (coarse) and the rest (fine). For orthographic rays both are 0,
    because the shaders do not need them.
    """
    if view.camera.projection == "orthographic":
        return np.zeros_like(vectors), np.zeros_like(vectors)
    scale = pixel_scale(view.camera, size[1])
    slopes = vectors * (scale, scale, -1.0)
    largest = np.abs(slopes) @ (size[0], size[1], 1.0)
    # Partial sums stay below 2^23 quanta, so float32's 24 bits represent each exactly.
    quantum = np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(np.float32).tiny))) - 23.0)[:, None]
    coarse = np.rint(slopes / quantum) * quantum
    return coarse, slopes - coarse


def camera_terms(view: View, size: tuple[int, int], coinciding: Ints) -> tuple[Array, Array]:
    """Return the coarse and fine terms (N, 4 each) of surfaces, for struct Surface in surfaces.glsl.

    The first three columns are split_slopes(). The fourth column of the coarse terms has the spheres' powers, and that
    column of the fine terms the coincidence numbers `coinciding`. A body's coarse terms are its header instead.
    """
    coarse, fine = split_slopes(view, size, view.vectors)
    surfaces = view.surfaces
    spheres, bounded = surfaces.spheres, surfaces.bounded
    sphere_powers = powers(surfaces.centers[:spheres], surfaces.radii[:spheres], view.eye)
    power = np.pad(sphere_powers, (0, surfaces.size - spheres))
    coarse = np.column_stack([coarse, power])
    coarse[spheres:bounded] = body_headers(surfaces.bodies)
    return coarse, np.column_stack([fine, coinciding[: surfaces.size].astype(float)])


def face_texels(view: View, size: tuple[int, int], coinciding: Ints) -> Array:
    """Return the texels of all faces of bodies (T, 4), for body.glsl."""
    faces = coinciding[view.surfaces.size :]
    return body_texels(view.surfaces.bodies, view.bodies, faces, lambda vectors: split_slopes(view, size, vectors))


def number_texels(view: View, size: tuple[int, int], coinciding: Ints, order: Ints) -> NDArray[np.float32]:
    """Pack the texels `numbers` of surfaces.glsl (4 N, 4). `order` (N,) has the number of each surface's object."""
    bounded = view.surfaces.bounded
    texels = np.zeros((view.surfaces.size, 4, 4), np.float32)
    texels[:, 0] = surface_rows(view)
    texels[:, 1], texels[:, 2] = camera_terms(view, size, coinciding)
    texels[bounded:, 1, 3] = order[bounded:]
    texels[:, 3, 0] = order
    return texels.reshape(-1, 4)


def material_texels(
    surfaces: Surfaces, layout: Layout, materials: Mapping[int, Material], to_view: Array
) -> NDArray[np.float32]:
    """Pack the texels `materials` of the generated materials.glsl (texels, 4).

    `materials` has the materials in use by their index in the scene.
    """
    rows = pack_materials(layout, materials, to_view)
    row = np.searchsorted(surfaces.used, surfaces.material)
    if layout.is_small:
        return rows[row].reshape(-1, 4)
    begins = np.zeros((len(row), 4), np.float32)
    begins[:, 0] = len(row) + layout.texels * row
    return np.concatenate([begins, rows.reshape(-1, 4)])


def lights_block(
    view: View, lights: Sequence[PointLight], touched: Sequence[int | None], coinciding: Ints, precision: Precision
) -> bytes:
    """Pack the uniform block of light.glsl. `touched` has the index of the surface that each light lies on, or None."""
    block = np.zeros(len(lights), LIGHT[precision])
    for row, light, surface in zip(block, lights, touched, strict=True):
        place = view.place(light.position)
        row["position"], row["color"] = place, light.color
        row["radius"], row["falloff"] = light.radius, FALLOFFS.index(light.falloff)
        if surface is None:
            continue
        row["on"] = coinciding[surface]
        if not light.radius:
            outward = _outward(view, surface, place)
            row["n"] = outward / np.linalg.norm(outward)
    return block.tobytes()


def _outward(view: View, surface: int, place: Array) -> Array:
    """Return the outward normal (3,), of any length, of a surface of coincidences() at a place on it."""
    surfaces, bodies = view.surfaces, view.surfaces.bodies
    if surface < surfaces.size:
        return place - view.vectors[surface] if surface < surfaces.spheres else view.vectors[surface]
    face = surface - surfaces.size
    if face < 2 * len(bodies.high):
        return view.bodies.normals[face // 2] * (1.0 if face % 2 == 0 else -1.0)
    wall = face - 2 * len(bodies.high)
    forms = view.bodies.forms[wall]
    return wall_gradient(WALLS[bodies.kinds[bodies.walls == wall][0]], forms, forms[:, :3] @ place + forms[:, 3])
