"""Packs the numbers of surfaces, materials and lights for the shaders' buffer textures and uniform blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

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
    """Return the uniform block Surfaces of surfaces.glsl (N, 4): centre and radius, or normal and offset."""
    return np.column_stack([view.vectors, np.concatenate([view.surfaces.radii, view.depths])])


def coincidences(view: View, precision: Precision) -> Ints:
    """Return the coincidence number (N,) of each surface, from 1: equal if surfaces coincide at shader precision."""
    rows = surface_rows(view).astype(_REAL[precision])
    planes = rows[view.surfaces.spheres :]
    # A half-space and its complement share one face, so take n or -n: the one whose first nonzero part is positive.
    first = np.argmax(planes[:, :3] != 0.0, axis=1)
    planes *= np.sign(planes[np.arange(len(planes)), first])[:, None]
    is_plane = np.arange(len(rows)) >= view.surfaces.spheres
    words = (rows + 0.0).view(np.uint64)  # -0.0 becomes 0.0, so that equal numbers have equal bits
    return _number_rows(np.column_stack([is_plane.astype(np.uint64), words]))


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


def camera_terms(view: View, size: tuple[int, int], coinciding: Ints) -> tuple[Array, Array]:
    """Return the coarse and fine slopes (N, 4 each), for cameraSlope() in camera.glsl.

    A slope, dot(vector, direction), is a x + b y + c, with x and y in half pixels from the picture's centre. Each
    coefficient is split into a multiple of `quantum` (coarse) and the rest (fine). The fourth column of the coarse
    slopes has the spheres' powers, and that column of the fine slopes the coincidence numbers `coinciding`.
    """
    scale = pixel_scale(view.camera, size[1])
    slopes = view.vectors * (scale, scale, -1.0)
    largest = np.abs(slopes) @ (size[0], size[1], 1.0)
    # Partial sums stay below 2^23 quanta, so float32's 24 bits represent each exactly.
    quantum = np.exp2(np.ceil(np.log2(np.maximum(largest, np.finfo(np.float32).tiny))) - 23.0)[:, None]
    coarse = np.rint(slopes / quantum) * quantum

    surfaces = view.surfaces
    sphere_powers = powers(surfaces.centers, surfaces.radii, view.camera.position)
    power = np.pad(sphere_powers, (0, len(surfaces.planes)))
    return np.column_stack([coarse, power]), np.column_stack([slopes - coarse, coinciding.astype(float)])


def number_texels(view: View, size: tuple[int, int], coinciding: Ints, order: Ints) -> NDArray[np.float32]:
    """Pack the texels `numbers` of surfaces.glsl (4 N, 4). `order` (N,) has the number of each surface's object."""
    spheres = view.surfaces.spheres
    texels = np.zeros((view.surfaces.size, 4, 4), np.float32)
    texels[:, 0] = surface_rows(view)
    texels[:, 1], texels[:, 2] = camera_terms(view, size, coinciding)
    texels[spheres:, 1, 3] = order[spheres:]
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
            outward = view.vectors[surface]
            if surface < view.surfaces.spheres:
                outward = place - outward
            row["n"] = outward / np.linalg.norm(outward)
    return block.tobytes()
