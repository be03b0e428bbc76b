"""Scene + Settings -> GLSL text.

A scene's structure goes into the text: its CSG trees, its kinds of primitive, its reflectance
models, how many lights, which shadows. Its numbers do not: they are uniforms. So scenes of one
structure share a program, and what a scene does not use is not in its shader. No OpenGL here,
and no text of a user's: names in the generated code are made of numbers only.
"""

from __future__ import annotations

import itertools
from typing import Literal

from raytracer import evaluators
from raytracer.glsl_source import Source, assemble
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.solids import (
    MODELS,
    Complement,
    Difference,
    Intersection,
    Plane,
    Primitive,
    Solid,
    Sphere,
    Union,
    leaves,
    postfix,
)

# What the second pass makes of what a pixel sees; all but the picture for looking into it.
Show = Literal["picture", "normal", "depth", "material"]

# Side of the cells in which a picture is divided, in pixels: see raytracer/sight.py.
CELL = 16


def surfaces(scene: Scene) -> list[Primitive]:
    """Every leaf of every tree in the order of the shader's surface index: spheres, then planes."""
    found = [leaf for solid in scene.solids() for leaf in leaves(solid)]
    return sorted(found, key=lambda leaf: not isinstance(leaf, Sphere))  # stable


def models(scene: Scene, settings: Settings) -> list[str]:
    """The specular models in use, in the order of `Material.model`."""
    used = {settings.shaded(surface.material).model for surface in surfaces(scene)}
    return [model for model in MODELS if model in used]


def visibility_source(scene: Scene, settings: Settings, *, geometry: bool = False) -> Source:
    """The fragment shader that finds what each pixel sees; with `geometry`, its distance and normal too."""
    defines = _counts(scene) | ({"GEOMETRY": 1} if geometry else {})
    generated = "\n".join([*_includes(scene, settings), "", *_ray_csg(_numbered(scene), scene, settings)])
    return _assemble("visibility.frag", defines, settings, generated)


def shade_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that computes the light from what each pixel sees."""
    defines = _counts(scene) | {"LIGHTS": len(scene.lights)}
    if not scene.lights:
        return _assemble("shade.frag", defines, settings, '#include "camera.glsl"')
    generated = [*_includes(scene, settings), '#include "light.glsl"', *_specular(scene, settings)]
    if settings.shadows != "off":
        defines["SHADOWS"] = 1
        generated += ["", *_blocked_at(_numbered(scene), scene, settings)]
    return _assemble("shade.frag", defines, settings, "\n".join(generated))


def quiet_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that does both where only half-spaces are to be seen, and nothing else casts shadows there.

    Of a scene with such objects: see raytracer/sight.py.
    """
    spheres = _counts(scene)["SPHERES"]
    trees = [tree for tree in _numbered(scene) if len(tree) == 1 and isinstance(tree[0], int) and tree[0] >= spheres]
    defines = _counts(scene) | {"LIGHTS": len(scene.lights), "NO_SPHERES": 1}
    if not trees:
        return empty_source()
    if len(trees) == 1 and isinstance(trees[0][0], int):
        defines["ONLY"] = trees[0][0]
    generated = [*_includes(scene, settings, ("Plane",)), *evaluators.walk(trees, spheres, what=True)]
    if scene.lights:
        generated += ['#include "light.glsl"', *_specular(scene, settings)]
    if scene.lights and settings.shadows != "off" and len(trees) > 1:
        defines["SHADOWS"] = 1
        generated += [*evaluators.walk(trees, spheres, what=False), f'#include "shadow_{settings.shadows}.glsl"']
    return _assemble("picture.frag", defines, settings, "\n".join(generated))


def empty_source() -> Source:
    """The fragment shader of where nothing is to be seen."""
    return assemble("empty.frag")


def show_source(scene: Scene, settings: Settings, show: Show) -> Source:
    """The fragment shader of the second pass."""
    return shade_source(scene, settings) if show == "picture" else assemble(f"show_{show}.frag", _counts(scene))


def _assemble(top: str, defines: dict[str, int], settings: Settings, generated: str) -> Source:
    doubles = {"DOUBLES": 1} if settings.precision == 64 else {}
    return assemble(top, defines | doubles, {"scene.glsl": generated})


def roth_loops(scene: Scene) -> int:
    """How many loops in a row the Roth filters of a scene are: what bounds their compilation."""
    cost = {Union: 1, Intersection: 1, Difference: 2, Complement: 1}
    return sum(1 + sum(cost.get(type(node), 0) for node in postfix(solid)) for solid in scene.solids())


def _counts(scene: Scene) -> dict[str, int]:
    found = surfaces(scene)
    spheres = sum(isinstance(surface, Sphere) for surface in found)
    return {"SPHERES": spheres, "PLANES": len(found) - spheres, "SURFACES": len(found)}


def _includes(scene: Scene, settings: Settings, kinds: tuple[str, ...] = ("Sphere", "Plane")) -> list[str]:
    counts = _counts(scene)
    most = f"#define MAX_HITS {max(map(evaluators.max_hits, scene.solids()))}"
    return [
        *(f'#include "{kind.lower()}.glsl"' for kind in kinds if counts[f"{kind.upper()}S"]),
        '#include "hit.glsl"',
        *([most, '#include "roth.glsl"'] if settings.evaluator == "roth" else ['#include "walk.glsl"']),
    ]


def _ray_csg(trees: list[evaluators.Tree], scene: Scene, settings: Settings) -> list[str]:
    spheres = _counts(scene)["SPHERES"]
    if settings.evaluator == "roth":
        return evaluators.roth(trees, spheres)
    return evaluators.walk(trees, spheres, what=True)


def _blocked_at(trees: list[evaluators.Tree], scene: Scene, settings: Settings) -> list[str]:
    spheres = _counts(scene)["SPHERES"]
    roth = settings.evaluator == "roth"
    text = evaluators.roth(trees, spheres) if roth else evaluators.walk(trees, spheres, what=False)
    return [*text, "", f'#include "shadow_{settings.shadows}.glsl"']


def _numbered(scene: Scene) -> list[evaluators.Tree]:
    spheres, planes = itertools.count(), itertools.count(_counts(scene)["SPHERES"])

    def numbered(node: Solid) -> Solid | int:
        return next(spheres) if isinstance(node, Sphere) else next(planes) if isinstance(node, Plane) else node

    return [[numbered(node) for node in postfix(solid)] for solid in scene.solids()]


def _specular(scene: Scene, settings: Settings) -> list[str]:
    """specular(): the material's specular factor, with just the models in use."""
    used = models(scene, settings)
    calls = [f"{model}(N, L, V, m.h)" for model in used]
    choice = " : ".join(f"m.model == {MODELS.index(m)} ? {call}" for m, call in zip(used[:-1], calls, strict=False))
    return [
        '#include "material.glsl"',
        *(f'#include "brdf/{model}.glsl"' for model in used),
        "float specular(Material m, vec3 N, vec3 L, vec3 V) {",
        f"    return {choice + ' : ' if choice else ''}{calls[-1]};",
        "}",
    ]
