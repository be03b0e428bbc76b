"""The layout of materials: the members of struct Material that a scene's models need, and their packed numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.scene.materials.lobe import peak
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS, Parameter

if TYPE_CHECKING:
    from raytracer.scene.materials.merl import Measured

# Parameters that the shaders leave out if they are 0 in all materials: few scenes use them.
_OFTEN_ZERO = ("ka", "le")
# The most texels of a material that the vertex shader may hand on, if it is the only one.
_FEW_TEXELS = 4
LOBE_PARTS = ("cx", "cy", "cz", "n", "scale")


class Layout(msgspec.Struct, frozen=True):
    """The members of struct Material for some materials, and the texel of each."""

    models: list[str]  # the models in use, in the order of the member `model`
    choices: dict[str, list[str]]  # the options in use of each choice, in the order of its member
    colors: list[str]  # members that are colours or directions, each in the xyz of a texel
    numbers: list[str]  # members that are numbers: first in the w of these texels, then four to a texel
    lobes: int  # the most lobes of a material
    is_anisotropic: bool  # whether any lobe is anisotropic

    @property
    def texels(self) -> int:
        """The number of texels of a material."""
        rest = max(0, len(self.numbers) - len(self.colors))
        return len(self.colors) + -(-rest // 4) + len(LOBE_PARTS) * self.lobes

    @property
    def is_small(self) -> bool:
        """Whether each surface has a copy of its material's texels, and the vertex shader may hand on a material.

        Otherwise each surface has one texel with the index of its material's first texel.
        """
        return not self.lobes and self.texels <= _FEW_TEXELS

    def place(self, number: int) -> tuple[int, int]:
        """Return the texel of a number, and the component of the texel."""
        if number < len(self.colors):
            return number, 3
        texel, part = divmod(number - len(self.colors), 4)
        return len(self.colors) + texel, part


def make_layout(materials: Sequence[Material]) -> Layout:
    """Return the layout for these materials together."""
    used = {material.model for material in materials}
    models = [model for model in MODELS if model in used]
    colors: dict[str, None] = {}
    numbers: dict[str, None] = {}
    choices: dict[str, list[str]] = {}
    for material in materials:
        for name, value in material.parameters.items():
            parameter = MODELS[material.model].parameters[name]
            match parameter.kind:
                case "color" | "direction":
                    if name not in _OFTEN_ZERO or any(value):
                        colors[_member(parameter)] = None
                case "number" | "whole" | "measured":
                    numbers[_member(parameter)] = None
                case "choice" if parameter.values:
                    numbers[_member(parameter)] = None
                case "choice" if value not in choices.setdefault(name, []):
                    choices[name].append(value)
    several = [name for name, options in choices.items() if len(options) > 1]
    model = ["model"] if len(models) > 1 else []
    lobes = [lobe for material in materials for lobe in material.get("lobes", ())]
    most = max((len(material.get("lobes", ())) for material in materials), default=0)
    is_anisotropic = any(lobe.cx != lobe.cy for lobe in lobes)
    if not is_anisotropic:
        colors.pop("tangent", None)
    return Layout(models, choices, [*colors], [*numbers, *model, *several, "number"], most, is_anisotropic)


def _member(parameter: Parameter) -> str:
    """Return the name of a parameter in struct Material."""
    return parameter.member or parameter.name


def pack_materials(
    layout: Layout, materials: Mapping[int, Material], to_view: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Pack the numbers of materials (N, texels, 4) in the layout that material_text() reads.

    Each material has the member `number`, its key in `materials`. `to_view` (3, 3) turns directions into view space.
    """
    result = np.zeros((len(materials), layout.texels, 4))
    tables = measured_tables(materials.values())
    for row, (number, material) in zip(result, materials.items(), strict=True):
        values = _members(layout, material, tables) | {"number": number}
        if "tangent" in values:
            values["tangent"] = to_view @ values["tangent"]
        for i, name in enumerate(layout.colors):
            row[i, :3] = values.get(name, 0.0)
        for i, name in enumerate(layout.numbers):
            row[layout.place(i)] = values.get(name, 0.0)
        lobes = row[layout.texels - len(LOBE_PARTS) * layout.lobes :].reshape(layout.lobes, len(LOBE_PARTS), 4)
        for place, lobe in zip(lobes, material.get("lobes", ()), strict=False):
            place[:, :3] = _normalize_lobe(lobe)
    return result.astype(np.float32)


def _members(layout: Layout, material: Material, tables: list[Measured]) -> dict[str, Any]:
    """Return a material's values for the members of struct Material, without lobes."""
    values: dict[str, Any] = {"model": layout.models.index(material.model)}
    for name, value in material.parameters.items():
        parameter = MODELS[material.model].parameters[name]
        if parameter.kind == "measured":
            value = tables.index(value)
        elif parameter.kind == "choice":
            options = parameter.choices if parameter.values else layout.choices[name]
            value = parameter.values[options.index(value)] if parameter.values else options.index(value)
        values[_member(parameter)] = value
    return values


def measured_tables(materials: Iterable[Material]) -> list[Measured]:
    """Return the tables of measured materials, each once, in the order of the numbers in struct Material."""
    return list(dict.fromkeys(material.file for material in materials if material.get("file")))


def pack_struct(layout: Layout, material: Material, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return a material as an element of struct Material. Its directions are in view space."""
    texels = pack_materials(layout, {0: material}, np.eye(3))[0]
    result = np.zeros((), dtype)
    for i, name in enumerate(layout.colors):
        result[name] = texels[i, :3]
    for i, name in enumerate(layout.numbers):
        result[name] = texels[layout.place(i)]
    if layout.lobes:
        lobes = texels[layout.texels - len(LOBE_PARTS) * layout.lobes :].reshape(layout.lobes, len(LOBE_PARTS), 4)
        for k, part in enumerate(LOBE_PARTS):
            result["lobes"][part] = lobes[:, k, :3]
    return result


def _normalize_lobe(lobe: Any) -> NDArray[np.float64]:
    """Return the parts of a lobe (5, 3). Coefficients are divided by the largest one, whose power might underflow."""
    parts = np.array([getattr(lobe, part) for part in LOBE_PARTS])
    largest = np.abs(parts[:3]).max(axis=0)
    parts[4] = [peak(*channel) for channel in parts.T]
    parts[:3] /= np.where(largest > 0.0, largest, 1.0)
    return parts
