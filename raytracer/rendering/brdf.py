"""Reflectance models, evaluated by the shaders that render, for any directions of light and viewer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.compiler.glsl import materials
from raytracer.compiler.material_layout import make_layout, pack_struct
from raytracer.core.arrays import number_array
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, Keys, check_text, is_number, number, vector
from raytracer.gpu import glsl_call
from raytracer.gpu.device import Device
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.merl import SHAPE, Measured, directions

# The name of the generated shader file, and its last function.
_TOP = "reflectance.glsl"
_EVALUATE = [
    "vec3 evaluate(Material m, vec3 L, vec3 V) {",
    "    return L.z > 0.0 && V.z > 0.0 ? reflected(m, vec3(0.0, 0.0, 1.0), L, V) : vec3(0.0);",
    "}",
]
# The most directions of one call on the GPU, each of which is uploaded together with a copy of the Material.
_SLICE = 2**17
# Tolerance of a direction's squared length: it covers rounding to float32, and a user's rounding to 4 digits.
_OFF_UNIT = 1e-3
# The most rows of a list: 400 MB as float64. An array may have more.
_MOST_ROWS = 2**24


def evaluate(material: Material, wi: ArrayLike, wo: ArrayLike, *, device: Device | None = None) -> NDArray[np.float32]:
    """Evaluate f cos(theta_i) of a material on the GPU, by the shaders that render: RGB in 1/sr, (N, 3) float32.

    Args:
        material: the material; Lafortune's `tangent` is in the frame of the directions
        wi: unit directions to the light (N, 3), or one (3,) for all, in a frame whose normal is +z
        wo: unit directions to the viewer, in the same form
        device: the OpenGL device. Default: the shared device.

    Directions are rounded to float32. The result is 0 if a direction is not above the horizon. The ideal reflection of
    a mirror is not included. Raises InputError for directions that are not finite or not unit.
    """
    _check(material, device)
    pair = [_directions(value, name) for value, name in ((wi, "wi"), (wo, "wo"))]
    lengths = {len(part) for part in pair} - {1}
    if len(lengths) > 1 or 0 in lengths:
        got = " and ".join(str(len(part)) for part in pair)
        raise InputError(f"expected as many directions as in wi, or one in wi or wo, got {got}", "wo")
    return call("evaluate", material, *pair, device=device)


def call(function: str, material: Material, *arguments: ArrayLike, device: Device | None = None) -> NDArray[Any]:
    """Call a GLSL function whose first parameter is a Material, in a shader for the model of `material`.

    For example: ggxD() of shaders/brdf/distribution_ggx.glsl, for a material of the model ggx. For further
    arguments, the result and errors see raytracer.glsl.call().
    """
    _check(material, device)
    check_text(function, "function")
    layout = make_layout([material])
    lines = ['#include "materials.glsl"', *materials.reflected_text(layout), *_EVALUATE]
    generated = {"materials.glsl": materials.material_text(layout), _TOP: "\n".join(lines)}
    data = pack_struct(layout, material, glsl_call.struct_dtype("Material", _TOP, generated))
    table = material.get("file")
    volumes = {"measured": table.values} if table else {}
    return glsl_call.call(function, data, *arguments, device=device, generated=generated, file=_TOP, volumes=volumes)


def bake(material: Material, *, device: Device | None = None) -> Measured:
    """Tabulate an isotropic material in MERL's format: the value of f in the middle of each cell.

    Cells below the horizon, which take part in interpolation, have the value just above the horizon. Raises
    InputError for an anisotropic material.
    """
    _check(material, device)
    if make_layout([material]).is_anisotropic:
        raise InputError("expected cx equal to cy: MERL's format is for isotropic materials", "lobes")
    wi, wo = (_raise_above_horizon(part.reshape(-1, 3)) for part in directions())
    slices = [slice(i, i + _SLICE) for i in range(0, len(wi), _SLICE)]
    f = np.concatenate([evaluate(material, wi[part], wo[part], device=device) / wi[part, 2:] for part in slices])
    return Measured(f.reshape(*SHAPE, 3))


def _check(material: Any, device: Any) -> None:
    if not isinstance(material, Material):
        raise InputError(f"expected a Material, got {format_value(material)}", "material")
    if device is not None and not isinstance(device, Device):
        raise InputError(f"expected a Device or None, got {format_value(device)}", "device")


def _raise_above_horizon(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Raise all directions to at least half a cell, half a degree, above the horizon."""
    least = np.sin(np.radians(0.5))
    x, y, z = directions.T
    scale = np.where(z < least, np.sqrt((1.0 - least**2) / np.maximum(x**2 + y**2, 1e-30)), 1.0)
    return np.stack([x * scale, y * scale, np.maximum(z, least)], -1)


def _directions(value: Any, name: str) -> NDArray[np.float32]:
    array = number_array(value, name, _MOST_ROWS, _direction)
    if array.ndim not in (1, 2) or array.shape[-1] != 3:
        raise InputError(f"expected unit directions (N, 3), got an array of shape {array.shape}", name)
    with np.errstate(over="ignore"):  # a number that overflows is part of no unit direction
        unit = array.astype(np.float32)
    if not (np.abs(np.sum(unit.astype(float) ** 2, axis=-1) - 1.0) <= _OFF_UNIT).all():
        raise InputError("expected unit directions, got one whose length is not 1", name)
    return np.atleast_2d(unit)


def _direction(row: Any, keys: Keys) -> Any:
    return number(row, keys) if is_number(row) else vector(row, keys, -2.0, 2.0, "a unit direction, 3 numbers")
