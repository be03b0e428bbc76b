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
from raytracer.groups import FEW, groups
from raytracer.listed import listed
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.solids import MODELS, Complement, Difference, Intersection, Plane, Solid, Sphere, Union, postfix
from raytracer.table import table

# What the second pass makes of what a pixel sees; all but the picture for looking into it.
Show = Literal["picture", "normal", "depth", "material"]

# Cells of a side of a cube's face around a light: in a picture of many objects, one covers about a cell.
GRID = 128
# Texels in a row of the textures that hold a scene's numbers, where they are many.
ROW = 1024


def is_listed(scene: Scene, settings: Settings) -> bool:
    """Whether rays look for what they meet in the lists of cells (lists.py): where there are many primitives.

    With 64 bits they never do: the lists' textures hold float32.
    """
    return settings.evaluator == "cells" and settings.precision == 32 and table(scene).size > FEW


def models(scene: Scene, settings: Settings) -> list[str]:
    """The specular models in use, in the order of `Material.model`."""
    used = {settings.shaded(scene.materials[i]).model for i in set(table(scene).material.tolist())}
    return [model for model in MODELS if model in used]


def visibility_source(scene: Scene, settings: Settings, *, geometry: bool = False) -> Source:
    """The fragment shader that finds what each pixel sees; with `geometry`, its distance and normal too."""
    defines = _defines(scene, settings) | ({"GEOMETRY": 1} if geometry else {})
    generated = [*_includes(scene), "", *_ray_csg(scene, settings)]
    return assemble("visibility.frag", defines, {"scene.glsl": "\n".join(generated)})


def shade_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that computes the light from what each pixel sees."""
    defines = _defines(scene, settings) | {"LIGHTS": len(scene.lights)}
    if not scene.lights:
        return assemble("shade.frag", defines, {"scene.glsl": '#include "camera.glsl"'})
    generated = [*_includes(scene), '#include "light.glsl"', *_specular(scene, settings)]
    if settings.shadows != "off":
        defines["SHADOWS"] = 1
        generated += ["", *_blocked_at(scene, settings), "", f'#include "shadow_{settings.shadows}.glsl"']
    return assemble("shade.frag", defines, {"scene.glsl": "\n".join(generated)})


def quiet_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that does both where only half-spaces are to be seen, and nothing else casts shadows there.

    Of a scene that has such objects: see raytracer/sight.py.
    """
    planes, spheres = groups(scene).planes, len(table(scene).radii)
    defines = _defines(scene, settings) | {"LIGHTS": len(scene.lights), "NO_SPHERES": 1}
    if len(planes) == 1:
        defines["ONLY"] = f"(firstPlane + {planes[0] - spheres})"
    generated = ['#include "plane.glsl"', '#include "hit.glsl"']
    generated += evaluators.nearest_plane(planes, spheres, what=True)
    if scene.lights:
        generated += ['#include "light.glsl"', *_specular(scene, settings)]
    if scene.lights and settings.shadows != "off" and len(planes) > 1:
        defines["SHADOWS"] = 1
        generated += evaluators.nearest_plane(planes, spheres, what=False)
        generated += [f'#include "shadow_{settings.shadows}.glsl"']
    return assemble("picture.frag", defines, {"scene.glsl": "\n".join(generated)})


def show_source(scene: Scene, settings: Settings, show: Show) -> Source:
    """The fragment shader of the second pass."""
    if show == "picture":
        return shade_source(scene, settings)
    return assemble(f"show_{show}.frag", _defines(scene, settings))


def roth_loops(scene: Scene) -> int:
    """How many loops in a row the Roth filters of a scene are: what bounds their compilation."""
    cost = {Union: 1, Intersection: 1, Difference: 2, Complement: 1}
    return sum(1 + sum(cost.get(type(node), 0) for node in postfix(solid)) for solid in scene.solids())


def _defines(scene: Scene, settings: Settings) -> dict[str, int | str]:
    found = table(scene)
    spheres, planes = len(found.radii), len(found.planes)
    defines: dict[str, int | str] = {"HAS_SPHERES": 1} if spheres else {}
    defines |= {"HAS_PLANES": 1} if planes else {}
    if is_listed(scene, settings):
        return defines | {"LISTED": 1, "ROW": ROW, "GRID": GRID}
    defines |= {"SPHERES": spheres, "SURFACES": found.size}
    return defines | {"DOUBLES": 1} if settings.precision == 64 else defines


def _includes(scene: Scene) -> list[str]:
    """What knows where rays meet the scene's surfaces."""
    found = table(scene)
    lines = ['#include "sphere.glsl"'] if len(found.radii) else []
    lines += ['#include "plane.glsl"'] if found.planes else []
    return [*lines, '#include "hit.glsl"']


def _ray_csg(scene: Scene, settings: Settings) -> list[str]:
    if settings.evaluator == "roth":
        return _roth(scene)
    if is_listed(scene, settings):
        return _listed(scene, what=True, first=False)
    return _walk(scene, what=True)


def _blocked_at(scene: Scene, settings: Settings) -> list[str]:
    if settings.evaluator == "roth":
        return _roth(scene)
    if is_listed(scene, settings):
        return _listed(scene, what=False, first=settings.shadows == "hard")
    return _walk(scene, what=False)


def _roth(scene: Scene) -> list[str]:
    most = max(map(evaluators.max_hits, scene.solids()))
    text = evaluators.roth(_numbered(scene), len(table(scene).radii))
    return [f"#define MAX_HITS {most}", '#include "roth.glsl"', *text]


def _walk(scene: Scene, *, what: bool) -> list[str]:
    return ['#include "walk.glsl"', *evaluators.walk(_numbered(scene), len(table(scene).radii), what=what)]


def _listed(scene: Scene, *, what: bool, first: bool) -> list[str]:
    found = groups(scene)
    depth = max((big.pruner.depth for big in found.bigs), default=0)
    trees = [kind.tree for kind in found.kinds]
    return listed(trees, depth, found.planes, len(table(scene).radii), what=what, first=first)


def _numbered(scene: Scene) -> list[evaluators.Tree]:
    spheres, planes = itertools.count(), itertools.count(len(table(scene).radii))

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
