"""The GLSL of a scene's materials: a struct Material of just the parameters that its models need, how it is fetched,
and reflected(), which calls just those models; and the same materials' numbers, packed for it.

The models themselves are in `shaders/brdf/`, one file each, with one signature:
`vec3 ggx(Material m, vec3 N, vec3 L, vec3 V)`, f cos(theta_i) for unit vectors with N.L > 0.
"""

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

# Parameters that are 0 in all materials are in no shader: few scenes have them.
_OFTEN_ZERO = ("ka", "le")
# A lone material of so many texels is handed on by the vertex shader.
_FEW_TEXELS = 4
_LOBE = ("cx", "cy", "cz", "n", "scale")
# Parts of models: a scene's shader has only the forms that its materials choose. Each function has a type, a name, and
# parameters besides the Material. With "fresnel", fresnel() calls schlickFresnel() of brdf/fresnel_schlick.glsl, or
# the function of another form.
Function = tuple[str, str, str]
FUNCTIONS: dict[str, tuple[Function, ...]] = {
    "fresnel": (("vec3", "fresnel", "float VoH"),),
    "masking": (("float", "masking", "float l, float v, float NoL, float NoV"),),
    "smith": (("float", "smith", "float mu"),),
    "distribution": (
        ("float", "D", "vec3 N, vec3 S"),
        ("float", "slope", "float mu"),
        ("vec2", "extent", "float alpha"),
    ),
    "form": (("vec3", "form", "vec3 N, vec3 L, vec3 V"),),
}


class Layout(msgspec.Struct, frozen=True):
    """What struct Material holds for some materials: members (type, name), and of these what is in which texel."""

    models: list[str]  # those in use, in the order of the member `model`
    choices: dict[str, list[str]]  # the options in use of each choice, in the order of its member
    colors: list[str]  # members, each a texel's xyz
    numbers: list[str]  # members, in the texels' w as long as there are any, then four to a texel
    lobes: int
    turned: bool  # whether any lobe is anisotropic

    @property
    def texels(self) -> int:
        """How many a material takes."""
        rest = max(0, len(self.numbers) - len(self.colors))
        return len(self.colors) + -(-rest // 4) + len(_LOBE) * self.lobes

    @property
    def is_small(self) -> bool:
        """Whether each surface has its own row of texels, and the vertex shader may hand on such a material.

        If not, each surface has a texel that says where its material's row begins.
        """
        return not self.lobes and self.texels <= _FEW_TEXELS


def layout(materials: Sequence[Material]) -> Layout:
    """The layout for these materials together."""
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
    kinds = ["model"] if len(models) > 1 else []
    lobes = [lobe for material in materials for lobe in material.get("lobes", ())]
    most = max((len(material.get("lobes", ())) for material in materials), default=0)
    turned = any(lobe.cx != lobe.cy for lobe in lobes)
    if not turned:
        colors.pop("tangent", None)
    return Layout(models, choices, [*colors], [*numbers, *kinds, *several, "number"], most, turned)


def _member(parameter: Parameter) -> str:
    return parameter.member or parameter.name


def material_text(found: Layout) -> str:
    """The text of materials.glsl: struct Material, materialAt(), and what else the files of shaders/ ask."""
    struct, fetch = [], []
    for i, name in enumerate(found.colors):
        struct.append(f"    vec3 {name};")
        fetch.append(f"    m.{name} = texelFetch(materials, at + {i}).xyz;")
    for i, name in enumerate(found.numbers):
        kind = "int" if name in ("model", "number", *found.choices) else "float"
        texel, part = _place(found, i)
        struct.append(f"    {kind} {name};")
        fetch.append(f"    m.{name} = {kind}(texelFetch(materials, at + {texel}).{'xyzw'[part]});")
    if found.lobes:
        struct.append("    Lobe lobes[LOBES];")
        first = found.texels - len(_LOBE) * found.lobes
        for i in range(found.lobes):
            for k, part in enumerate(_LOBE):
                texel = first + i * len(_LOBE) + k
                fetch.append(f"    m.lobes[{i}].{part} = texelFetch(materials, at + {texel}).xyz;")
    lobe = ["struct Lobe {", *(f"    vec3 {part};" for part in _LOBE), "};"] if found.lobes else []
    flags = {"AMBIENT": "ka" in found.colors, "EMISSION": "le" in found.colors, "ANISOTROPIC": found.turned}
    lines = [
        *(f"#define {name} 1" for name, holds in flags.items() if holds),
        f"#define LOBES {found.lobes}" if found.lobes else "",
        *lobe,
        "struct Material {",
        *struct,
        "};",
        "uniform samplerBuffer materials;",
        "Material materialAt(int index) {",
        f"    int at = {f'{found.texels} * index' if found.is_small else 'int(texelFetch(materials, index).x)'};",
        "    Material m;",
        *fetch,
        "    return m;",
        "}",
    ]
    return "\n".join(lines)


def _place(found: Layout, number: int) -> tuple[int, int]:
    """The texel of a number, and which of its four parts."""
    if number < len(found.colors):
        return number, 3
    texel, part = divmod(number - len(found.colors), 4)
    return len(found.colors) + texel, part


def reflected_text(found: Layout, *, mirrors: bool = False) -> list[str]:
    """reflected(): f cos(theta_i) by each material's own model; and the forms that these choose.

    With `mirrors` also mirrored(): the share of the light from the mirror direction.
    """
    lines: list[str] = []
    for name, functions in FUNCTIONS.items():  # in this order: one may call those before
        options = found.choices.get(name, [])
        lines += [f'#include "brdf/{name}_{option}.glsl"' for option in options]
        for kind, function, parameters in functions if options else ():
            given = ", ".join(["m", *(p.split()[1] for p in parameters.split(", "))])
            calls = [f"{option}{function[0].upper()}{function[1:]}({given})" for option in options]
            choice = _chosen(f"m.{name}", calls)
            lines.append(f"{kind} {function}(Material m, {parameters}) {{ return {choice}; }}")
    lines += [f'#include "brdf/{model}.glsl"' for model in found.models]
    calls = [f"{model}(m, N, L, V)" for model in found.models]
    if mirrors:
        mirrored = [f"{model}Mirrored(m, N, V)" if MODELS[model].mirrors else "vec3(0.0)" for model in found.models]
        lines.append(f"vec3 mirrored(Material m, vec3 N, vec3 V) {{ return {_chosen('m.model', mirrored)}; }}")
    return [
        *lines,
        "vec3 reflected(Material m, vec3 N, vec3 L, vec3 V) {",
        f"    return {_chosen('m.model', calls)};",
        "}",
    ]


def _chosen(member: str, calls: list[str]) -> str:
    """The call that `member` counts; the only one, if there is one."""
    return "".join(f"{member} == {i} ? {call} : " for i, call in enumerate(calls[:-1])) + calls[-1]


def packed(found: Layout, materials: Mapping[int, Material], to_view: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, texels, 4): the numbers of materials, each with the member `number`, as material_text() fetches them.

    `to_view` (3, 3) turns directions into the axes of the shaders.
    """
    result = np.zeros((len(materials), found.texels, 4))
    tables = measured(materials.values())
    for row, (number, material) in zip(result, materials.items(), strict=True):
        values = _members(found, material, tables) | {"number": number}
        if "tangent" in values:
            values["tangent"] = to_view @ values["tangent"]
        for i, name in enumerate(found.colors):
            row[i, :3] = values.get(name, 0.0)
        for i, name in enumerate(found.numbers):
            row[_place(found, i)] = values.get(name, 0.0)
        lobes = row[found.texels - len(_LOBE) * found.lobes :].reshape(found.lobes, len(_LOBE), 4)
        for place, lobe in zip(lobes, material.get("lobes", ()), strict=False):
            place[:, :3] = _normalized(lobe)
    return result.astype(np.float32)


def _members(found: Layout, material: Material, tables: list[Measured]) -> dict[str, Any]:
    """What a material has for the members of struct Material, but for lobes."""
    values: dict[str, Any] = {"model": found.models.index(material.model)}
    for name, value in material.parameters.items():
        parameter = MODELS[material.model].parameters[name]
        if parameter.kind == "measured":
            value = tables.index(value)
        elif parameter.kind == "choice":
            options = parameter.choices if parameter.values else found.choices[name]
            value = parameter.values[options.index(value)] if parameter.values else options.index(value)
        values[_member(parameter)] = value
    return values


def measured(materials: Iterable[Material]) -> list[Measured]:
    """The tables of measured materials, once each, in the order in which struct Material counts them."""
    return list(dict.fromkeys(material.file for material in materials if material.get("file")))


def struct(found: Layout, material: Material, dtype: np.dtype[Any]) -> NDArray[Any]:
    """A material as an element of struct Material; its axes are those of the shaders."""
    texels = packed(found, {0: material}, np.eye(3))[0]
    result = np.zeros((), dtype)
    for i, name in enumerate(found.colors):
        result[name] = texels[i, :3]
    for i, name in enumerate(found.numbers):
        result[name] = texels[_place(found, i)]
    if found.lobes:
        lobes = texels[found.texels - len(_LOBE) * found.lobes :].reshape(found.lobes, len(_LOBE), 4)
        for k, part in enumerate(_LOBE):
            result["lobes"][part] = lobes[:, k, :3]
    return result


def _normalized(lobe: Any) -> NDArray[np.float64]:
    """(5, 3): the parts of a lobe; its coefficients over the largest, because the power of that may underflow."""
    parts = np.array([getattr(lobe, part) for part in _LOBE])
    largest = np.abs(parts[:3]).max(axis=0)
    parts[4] = [peak(*channel) for channel in parts.T]
    parts[:3] /= np.where(largest > 0.0, largest, 1.0)
    return parts
