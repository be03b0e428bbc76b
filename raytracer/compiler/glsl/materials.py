"""Generates the GLSL of a scene's materials: struct Material, materialAt() and reflected().

struct Material has only the parameters that the models in use need, and reflected() calls only these models. The models
are in `shaders/brdf/`, one file each, with one signature: `vec3 ggx(Material m, vec3 N, vec3 L, vec3 V)` returns
f cos(theta_i) for unit vectors with N.L > 0.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from raytracer.compiler.material_layout import LOBE_PARTS, Layout
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# The functions of each part of models with several forms: type, name, and parameters besides the Material. A scene's
# shader has only the forms that its materials choose. For example fresnel() calls schlickFresnel() of
# brdf/fresnel_schlick.glsl, or the function of another form.
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


def material_text(layout: Layout) -> str:
    """Generate materials.glsl: struct Material, materialAt(), and the defines that shaders/ tests."""
    struct, fetch = [], []
    for i, name in enumerate(layout.colors):
        struct.append(f"    vec3 {name};")
        fetch.append(f"    m.{name} = texelFetch(materials, at + {i}).xyz;")
    for i, name in enumerate(layout.numbers):
        kind = "int" if name in ("model", "number", *layout.choices) else "float"
        texel, part = layout.place(i)
        struct.append(f"    {kind} {name};")
        fetch.append(f"    m.{name} = {kind}(texelFetch(materials, at + {texel}).{'xyzw'[part]});")
    if layout.lobes:
        struct.append("    Lobe lobes[LOBES];")
        first = layout.texels - len(LOBE_PARTS) * layout.lobes
        for i in range(layout.lobes):
            for k, part in enumerate(LOBE_PARTS):
                texel = first + i * len(LOBE_PARTS) + k
                fetch.append(f"    m.lobes[{i}].{part} = texelFetch(materials, at + {texel}).xyz;")
    lobe = ["struct Lobe {", *(f"    vec3 {part};" for part in LOBE_PARTS), "};"] if layout.lobes else []
    flags = {"AMBIENT": "ka" in layout.colors, "EMISSION": "le" in layout.colors, "ANISOTROPIC": layout.is_anisotropic}
    lines = [
        *(f"#define {name} 1" for name, holds in flags.items() if holds),
        f"#define LOBES {layout.lobes}" if layout.lobes else "",
        *lobe,
        "struct Material {",
        *struct,
        "};",
        "uniform samplerBuffer materials;",
        "Material materialAt(int index) {",
        f"    int at = {f'{layout.texels} * index' if layout.is_small else 'int(texelFetch(materials, index).x)'};",
        "    Material m;",
        *fetch,
        "    return m;",
        "}",
    ]
    return "\n".join(lines)


def reflected_text(
    layout: Layout, *, mirrors: bool = False, materials: Collection[Material] | None = None
) -> list[str]:
    """Generate reflected(), which is f cos(theta_i) by each material's own model, with the forms that models choose.

    With `mirrors` the text also has mirrored(), the share of the light from the mirror direction. It serves
    `materials`, some of the layout's (default: all). Fewer models are faster, because llvmpipe computes all models of a
    text for each pixel.
    """
    lines: list[str] = []
    models = {i: model for i, model in enumerate(layout.models) if _is_used("model", model, materials)}
    for name, functions in FUNCTIONS.items():  # in this order, because a function may call earlier ones
        options = {
            i: option for i, option in enumerate(layout.choices.get(name, [])) if _is_used(name, option, materials)
        }
        lines += [f'#include "brdf/{name}_{option}.glsl"' for option in options.values()]
        for kind, function, parameters in functions if options else ():
            arguments = ", ".join(["m", *(p.split()[1] for p in parameters.split(", "))])
            calls = {i: f"{option}{function[0].upper()}{function[1:]}({arguments})" for i, option in options.items()}
            choice = _choice_text(f"m.{name}", calls)
            lines.append(f"{kind} {function}(Material m, {parameters}) {{ return {choice}; }}")
    lines += [f'#include "brdf/{model}.glsl"' for model in models.values()]
    calls = {i: f"{model}(m, N, L, V)" for i, model in models.items()}
    if mirrors:
        mirrored = {
            i: f"{model}Mirrored(m, N, V)" if MODELS[model].mirrors else "vec3(0.0)" for i, model in models.items()
        }
        lines.append(f"vec3 mirrored(Material m, vec3 N, vec3 V) {{ return {_choice_text('m.model', mirrored)}; }}")
    return [
        *lines,
        "vec3 reflected(Material m, vec3 N, vec3 L, vec3 V) {",
        f"    return {_choice_text('m.model', calls)};",
        "}",
    ]


def _is_used(name: str, value: str, materials: Collection[Material] | None) -> bool:
    """Return whether the model of any material, or its choice `name`, is `value`. None stands for all materials."""
    if materials is None:
        return True
    return any((material.model if name == "model" else material.get(name)) == value for material in materials)


def _choice_text(member: str, calls: Mapping[int, str]) -> str:
    """Return the expression that selects a call by the number `member`; a single call needs no selection."""
    *others, last = calls.items()
    return "".join(f"{member} == {i} ? {call} : " for i, call in others) + last[1]
