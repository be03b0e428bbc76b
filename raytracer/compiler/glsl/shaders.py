"""Scene + Settings -> GLSL text.

A scene's structure goes into the text: its CSG trees, its kinds of primitive, its reflectance
models, how many lights, which shadows. Its numbers do not, but for whether any material has an
ambient factor, shines, or is anisotropic: they are in textures, or handed on by the vertex shader.
So scenes of one structure share a program, and what a scene does not use is not in its shader. No
OpenGL here, and no text of a user's: names in the generated code are made of numbers only.
"""

from __future__ import annotations

import itertools
from typing import Literal

from raytracer.compiler import rounds
from raytracer.compiler.batches import FEW, KIND_LEAVES, groups
from raytracer.compiler.glsl import csg, csg_lists, reflectance
from raytracer.compiler.glsl.preprocessor import Source, assemble
from raytracer.compiler.glsl.varyings import ALL, Handed, fitting
from raytracer.compiler.surfaces import table
from raytracer.scene.instances import Instances
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, Union, simplified

# What the second pass makes of what a pixel sees; all but the picture for looking into it.
Show = Literal["picture", "normal", "depth", "material"]

# Up to so many surfaces, and lights, are handed on by the vertex shader, where there is room (varyings.py).
CONSTANTS, CONSTANT_LIGHTS = 6, 2
# Components of the other varyings of cells.vert and kinds.vert (draw.glsl): vectors and colours; 2 of `real`; and those
# that are only in lists, of programs, of kinds, and under lights with a radius.
_DRAW, _DRAW_REALS, _DRAW_LISTED, _DRAW_PROGRAMS, _DRAW_KINDS, _DRAW_SPHERE_LIGHTS = 12, 2, 3, 2, 3, 1
Constant = tuple[str, str, str]  # type, name, and what it is in the vertex shader


def is_listed(scene: Scene, settings: Settings) -> bool:
    """Whether rays look for what they meet in the lists of cells (candidate_lists.py): where there are many primitives.

    With 64 bits they never do: the lists' textures hold float32.
    """
    return settings.evaluator == "cells" and settings.precision == 32 and table(scene).size > FEW


def has_mirrors(scene: Scene, settings: Settings) -> bool:
    """Whether the light of some material comes from other surfaces, too."""
    return settings.bounces > 0 and any(MODELS[model].mirrors for model in material_layout(scene, settings).models)


def is_over_planes(scene: Scene, settings: Settings) -> bool:
    """Whether besides objects of kinds there are at most half-spaces, which the second pass quickly finds itself."""
    only = is_listed(scene, settings) and bool(groups(scene).kinds) and not groups(scene).bigs
    return only and not has_mirrors(scene, settings)


_last: tuple[object, object, tuple[dict[int, Material], reflectance.Layout]] | None = None


def _shaded(scene: Scene, settings: Settings) -> tuple[dict[int, Material], reflectance.Layout]:
    """Kept as long as scenes of the same objects are asked for with the same shading."""
    global _last
    found = table(scene)
    last = _last  # another thread may set it meanwhile
    if last is None or last[0] is not found or last[1] != settings.shading:
        materials = {i: settings.shaded(scene.materials[i]) for i in found.used}
        _last = last = found, settings.shading, (materials, reflectance.layout([*materials.values()]))
    return last[2]


def shaded_materials(scene: Scene, settings: Settings) -> dict[int, Material]:
    """The materials that surfaces have, as they are shaded, by their index in the scene's."""
    return _shaded(scene, settings)[0]


def material_layout(scene: Scene, settings: Settings) -> reflectance.Layout:
    """What the shaders hold of them."""
    return _shaded(scene, settings)[1]


def _handed(scene: Scene, settings: Settings, varyings: int) -> Handed:
    """The constants that the vertex shaders hand on with so many components of varyings."""
    real, layout, lit = settings.precision // 32, material_layout(scene, settings), light_defines(scene, settings)
    in_lists, has_spheres = is_listed(scene, settings), "SPHERE_LIGHTS" in lit
    kinds = _trees(scene) if in_lists else []
    wanted = Handed(
        [*_nameable(scene, settings)],
        csg_lists.most_leaves(kinds) if kinds else 0,
        len(scene.lights) <= CONSTANT_LIGHTS,
        len(groups(scene).planes) == 1 and layout.is_small,
    )
    room = varyings - _DRAW - _DRAW_REALS * real - (_DRAW_LISTED if in_lists else 0)
    return fitting(
        room - (_DRAW_PROGRAMS if in_lists else 0) - (_DRAW_SPHERE_LIGHTS if has_spheres else 0),
        room - _DRAW_KINDS,
        wanted,
        # light.glsl: position, n and radius; color, on and falloff
        len(scene.lights) * ((7 if has_spheres else 6) * real + (5 if "FALLOFF" in lit else 4)),
        3 * len(layout.colors) + len(layout.numbers),
    )


def vertex_source(scene: Scene, settings: Settings, varyings: int = ALL) -> Source:
    """The vertex shader of all these programs. It hands them the constants that they declare: see draw.glsl.

    `varyings`, here and below, is how many components of varyings the driver has. The texts of one program must be made
    with the same number.
    """
    handed = _handed(scene, settings, varyings)
    constants = _surface_constants(scene, settings, varyings)
    if handed.material:
        constants.append(
            ("Material", "onlyMaterial", f"materialAt({_index(scene, settings, groups(scene).planes[0])})")
        )
    if handed.lights:
        constants += [("Light", f"light{i}", f"lights[{i}]") for i in range(len(scene.lights))]
    includes = ["geometry/surfaces.glsl", "materials.glsl", *(["shading/light.glsl"] if scene.lights else [])]
    defines = _defines(scene, settings) | {"VERTEX": 1} | light_defines(scene, settings)
    lines = [*(f'#include "{name}"' for name in includes), *_set_constants(constants)]
    generated = {"constants.glsl": "\n".join(lines)}
    return assemble("passes/cells.vert", defines, generated | _materials(scene, settings))


def _handed_defines(scene: Scene, settings: Settings, varyings: int) -> dict[str, int]:
    """The defines by which fragment shaders know which varyings there are."""
    few = len(scene.lights) <= CONSTANT_LIGHTS
    return {"FETCHED_LIGHTS": 1} if few and not _handed(scene, settings, varyings).lights else {}


def light_defines(scene: Scene, settings: Settings) -> dict[str, int]:
    """What texts depend on of the lights: how many, whether any has a radius, whether any is attenuated."""
    defines = {"LIGHTS": len(scene.lights)}
    if any(settings.cast(light).radius for light in scene.lights):
        defines["SPHERE_LIGHTS"] = 1
    return defines | ({"FALLOFF": 1} if any(light.falloff != "none" for light in scene.lights) else {})


def plain_vertex_source() -> Source:
    """The vertex shader for programs that need nothing of a scene."""
    return assemble("passes/cells.vert", generated={"constants.glsl": "void setConstants() {}"})


def visibility_source(scene: Scene, settings: Settings, varyings: int = ALL, *, geometry: bool = False) -> Source:
    """The fragment shader that finds what each pixel sees; with `geometry`, its distance and normal too."""
    defines = _defines(scene, settings) | ({"GEOMETRY": 1} if geometry else {})
    if is_listed(scene, settings) and groups(scene).kinds and groups(scene).bigs:
        defines["OTHERS"] = 1
    generated = [*_includes(scene, settings, varyings), "", *_ray_csg(scene, settings, varyings)]
    return assemble("passes/visibility.frag", defines, {"scene.glsl": "\n".join(generated)})


def kinds_source(
    scene: Scene, settings: Settings, varyings: int = ALL, *, geometry: bool = False
) -> tuple[Source, Source]:
    """The vertex and fragment shader that find the same where objects of kinds (batches.py) are seen."""
    trees = _trees(scene)
    defines = _defines(scene, settings)
    leaves = _handed(scene, settings, varyings).leaves
    spheres = [("Surface", f"sphere{j}", f"surfaceOf(first + {j})") for j in range(leaves)]
    lines = _set_constants(spheres + _surface_constants(scene, settings, varyings))
    vertex = assemble("passes/kinds.vert", defines | {"VERTEX": 1}, {"constants.glsl": "\n".join(lines)})
    planes = None if groups(scene).bigs else _planes(scene, settings, varyings)
    generated = [*_includes(scene, settings, varyings), "", *csg_lists.seen_kinds(trees, planes, leaves)]
    defines |= {"KINDS": 1} | ({"GEOMETRY": 1} if geometry else {})
    return vertex, assemble("passes/visibility.frag", defines, {"scene.glsl": "\n".join(generated)})


def shade_source(scene: Scene, settings: Settings, varyings: int = ALL) -> Source:
    """The fragment shader that computes the light from what each pixel sees."""
    defines = _defines(scene, settings) | light_defines(scene, settings) | _handed_defines(scene, settings, varyings)
    over_planes = is_over_planes(scene, settings)
    mirrors = has_mirrors(scene, settings)
    if not scene.lights and not over_planes and not mirrors:
        return assemble(
            "passes/shade.frag",
            defines,
            {"scene.glsl": '#include "geometry/camera.glsl"'} | _materials(scene, settings),
        )
    generated = _includes(scene, settings, varyings)
    if over_planes:
        defines["OVER_PLANES"] = 1
        generated += csg.nearest_plane(_planes(scene, settings, varyings), what=True)
    if scene.lights or mirrors:
        generated += [*_lights(scene, settings), *_light_rays(scene, settings)]
    if mirrors:
        defines |= {"BOUNCES": settings.bounces}
        generated += _ray_anywhere(scene, settings, varyings)
    if scene.lights and settings.shadows != "off":
        defines["SHADOWS"] = 1
        written = mirrors and (settings.evaluator == "roth" or is_listed(scene, settings))
        generated += [*([] if written else ["", *_blocked_at(scene, settings, varyings)]), "", _shadow(settings)]
    if mirrors:
        generated.append('#include "shading/mirrors.glsl"')
    return assemble("passes/shade.frag", defines, {"scene.glsl": "\n".join(generated)} | _materials(scene, settings))


def quiet_source(scene: Scene, settings: Settings, varyings: int = ALL) -> Source:
    """The fragment shader that does both where only half-spaces are to be seen, and nothing else casts shadows there.

    Of a scene that has such objects: see raytracer/compiler/culling.py.
    """
    planes = _planes(scene, settings, varyings)
    defines = _defines(scene, settings) | light_defines(scene, settings) | {"NO_SPHERES": 1}
    defines |= _handed_defines(scene, settings, varyings)
    if len(planes) == 1:
        defines["ONLY"] = planes[0][0]
        defines |= {"ONLY_MATERIAL": 1} if _handed(scene, settings, varyings).material else {}
    generated = [
        '#include "geometry/plane.glsl"',
        *_declared(scene, settings, varyings),
        '#include "geometry/hit.glsl"',
    ]
    generated += csg.nearest_plane(planes, what=True)
    if scene.lights:
        generated += [*_lights(scene, settings), *_light_rays(scene, settings)]
    if scene.lights and settings.shadows != "off" and len(planes) > 1:
        defines["SHADOWS"] = 1
        generated += [*csg.nearest_plane(planes, what=False), _shadow(settings)]
    return assemble("passes/picture.frag", defines, {"scene.glsl": "\n".join(generated)} | _materials(scene, settings))


def show_source(scene: Scene, settings: Settings, show: Show, varyings: int = ALL) -> Source:
    """The fragment shader of the second pass."""
    if show == "picture":
        return shade_source(scene, settings, varyings)
    return assemble(f"window/show_{show}.frag", _defines(scene, settings), _materials(scene, settings))


def roth_loops(scene: Scene) -> int:
    """How many loops in a row the Roth filters of a scene are: what bounds their compilation."""
    cost = {Union: 1, Intersection: 1, Difference: 2, Complement: 1}
    loops = 0
    for item in scene.objects:
        tree = simplified(item.solid if isinstance(item, Instances) else item)
        count = len(item) if isinstance(item, Instances) else 1
        loops += count * (1 + sum(cost.get(type(node), 0) for node in tree))
    return loops


def _defines(scene: Scene, settings: Settings) -> dict[str, int | str]:
    found = table(scene)
    spheres, planes = len(found.radii), len(found.planes)
    defines: dict[str, int | str] = {"HAS_SPHERES": 1} if spheres else {}
    defines |= {"HAS_PLANES": 1} if planes else {}
    defines |= {"MANY_ROUNDS": 1} if _may_take_many_rounds(scene, settings) else {}
    if is_listed(scene, settings):
        defines |= {"PROGRAMS": 1} if groups(scene).bigs else {}
        return defines | {"LISTED": 1}
    defines |= {"SPHERES": spheres, "SURFACES": found.size}
    return defines | {"DOUBLES": 1} if settings.precision == 64 else defines


def _may_take_many_rounds(scene: Scene, settings: Settings) -> bool:
    """Whether a pixel's rays may go through more rounds of loops than llvmpipe has (cut_short.glsl).

    Lists of any length are assumed: scenes that differ in the number of objects share their text.
    """
    if is_listed(scene, settings):
        return True
    ray = rounds_of_ray(scene, settings)
    return most_rounds(scene, settings, ray, ray) > rounds.MAX_ROUNDS


def rounds_of_ray(scene: Scene, settings: Settings) -> int:
    """Rounds of loops in which one ray is evaluated at most, where there are no lists."""
    if settings.evaluator == "roth":
        return rounds.of_roth(roth_loops(scene), max(map(csg.max_hits, scene.solids())))
    return rounds.of_walk(table(scene).size)


def most_rounds(scene: Scene, settings: Settings, ray: int, to_light: int) -> int:
    """Rounds of loops that all rays of a pixel go through at most, by those of one ray, and of one to a light."""
    return rounds.of_pixel(
        ray,
        to_light if settings.shadows != "off" else 0,
        rounds.of_models(material_layout(scene, settings).models),
        len(scene.lights),
        settings.bounces if has_mirrors(scene, settings) else 0,
    )


def _includes(scene: Scene, settings: Settings, varyings: int) -> list[str]:
    """What knows where rays meet the scene's surfaces."""
    found = table(scene)
    lines = ['#include "geometry/sphere.glsl"'] if len(found.radii) else []
    lines += ['#include "geometry/plane.glsl"'] if found.planes else []
    return [*lines, *_declared(scene, settings, varyings), '#include "geometry/hit.glsl"']


def _declared(scene: Scene, settings: Settings, varyings: int) -> list[str]:
    """The surfaces that a text names, from the vertex shader."""
    return [
        '#include "geometry/surfaces.glsl"',
        *(f"flat in Surface {name};" for name in _named(scene, settings, varyings).values()),
    ]


def _named(scene: Scene, settings: Settings, varyings: int) -> dict[int, str]:
    """The surfaces, by index, that the vertex shader hands to all others, and their names."""
    names = _nameable(scene, settings)
    return {k: names[k] for k in _handed(scene, settings, varyings).surfaces}


def _nameable(scene: Scene, settings: Settings) -> dict[int, str]:
    """The same where there is room for all."""
    found, planes = table(scene), groups(scene).planes
    if is_listed(scene, settings):  # beside those of an object of a kind
        return {k: f"plane{k - len(found.radii)}" for k in planes} if len(planes) <= CONSTANTS - KIND_LEAVES else {}
    names = {k: f"surface{k}" for k in (range(found.size) if found.size <= CONSTANTS else planes)}
    return names if len(names) <= CONSTANTS and settings.precision == 32 else {}


def _surface_constants(scene: Scene, settings: Settings, varyings: int) -> list[Constant]:
    return [
        ("Surface", name, f"surfaceOf({_index(scene, settings, k)})")
        for k, name in _named(scene, settings, varyings).items()
    ]


def _set_constants(constants: list[Constant]) -> list[str]:
    """The end of a vertex shader's generated text: it hands these on."""
    lines = [f"flat out {kind} {name};" for kind, name, _ in constants]
    return [*lines, "void setConstants() {", *(f"    {name} = {value};" for _, name, value in constants), "}"]


def _index(scene: Scene, settings: Settings, surface: int) -> str:
    return f"firstPlane + {surface - len(table(scene).radii)}" if is_listed(scene, settings) else str(surface)


def _called(scene: Scene, settings: Settings, varyings: int) -> dict[int, str]:
    """What texts call the surfaces that they name."""
    every = groups(scene).planes if is_listed(scene, settings) else range(table(scene).size)
    return {k: f"surfaceOf({_index(scene, settings, k)})" for k in every} | _named(scene, settings, varyings)


def _planes(scene: Scene, settings: Settings, varyings: int) -> list[csg.NamedPlane]:
    called = _called(scene, settings, varyings)
    return [(called[k], _index(scene, settings, k)) for k in groups(scene).planes]


def _ray_csg(scene: Scene, settings: Settings, varyings: int) -> list[str]:
    if settings.evaluator == "roth":
        return _roth(scene, settings, varyings)
    if is_listed(scene, settings):
        planes = _planes(scene, settings, varyings)
        if not groups(scene).bigs:
            return csg.nearest_plane(planes, what=True)
        return csg_lists.seen(_depth(scene), planes)
    return _walk(scene, settings, varyings, what=True)


def _ray_anywhere(scene: Scene, settings: Settings, varyings: int) -> list[str]:
    """rayCSG() for rays that do not come from the camera; for some evaluators with blockedAt()."""
    if not is_listed(scene, settings):
        return _ray_csg(scene, settings, varyings)
    return [*_blocked_at(scene, settings, varyings), *csg_lists.anywhere(_planes(scene, settings, varyings))]


def _blocked_at(scene: Scene, settings: Settings, varyings: int) -> list[str]:
    if settings.evaluator == "roth":
        return _roth(scene, settings, varyings)
    if is_listed(scene, settings):
        trees, planes = _trees(scene), _planes(scene, settings, varyings)
        programs, mirrors = bool(groups(scene).bigs), has_mirrors(scene, settings)
        first = settings.shadows != "diluted" and not mirrors
        beside = "SPHERE_LIGHTS" in light_defines(scene, settings)
        return csg_lists.blocked(trees, programs, _depth(scene), planes, first=first, what=mirrors, beside=beside)
    return _walk(scene, settings, varyings, what=False)


def _roth(scene: Scene, settings: Settings, varyings: int) -> list[str]:
    most = max(map(csg.max_hits, scene.solids()))
    text = csg.roth(_numbered(scene), len(table(scene).radii), _called(scene, settings, varyings))
    return [f"#define MAX_HITS {most}", '#include "csg/roth.glsl"', *text]


def _walk(scene: Scene, settings: Settings, varyings: int, *, what: bool) -> list[str]:
    called = _called(scene, settings, varyings)
    return ['#include "csg/walk.glsl"', *csg.walk(_numbered(scene), len(table(scene).radii), called, what=what)]


def _depth(scene: Scene) -> int:
    """The stack that the deepest of a scene's programs needs, chains aside; 0 if they are all chains."""
    return max((big.pruner.depth for big in groups(scene).bigs if not big.pruner.is_chain), default=0)


def _trees(scene: Scene) -> list[csg.Tree]:
    return [kind.tree for kind in groups(scene).kinds]


def _numbered(scene: Scene) -> list[csg.Tree]:
    spheres, planes = itertools.count(), itertools.count(len(table(scene).radii))

    def numbered(node: Solid) -> Solid | int:
        return next(spheres) if isinstance(node, Sphere) else next(planes) if isinstance(node, Plane) else node

    return [[numbered(node) for node in simplified(solid)] for solid in scene.solids()]


def _materials(scene: Scene, settings: Settings) -> dict[str, str]:
    return {"materials.glsl": reflectance.material_text(material_layout(scene, settings))}


def _shadow(settings: Settings) -> str:
    """Of the one point that is looked at of a light, soft shadows are hard."""
    return f'#include "shading/shadow_{"diluted" if settings.shadows == "diluted" else "hard"}.glsl"'


def _light_rays(scene: Scene, settings: Settings) -> list[str]:
    """What lights need that are more than the lecture's."""
    needed = {
        "FALLOFF": ["shading/irradiance.glsl"],
        "SPHERE_LIGHTS": ["sampling/sobol.glsl", "shading/sphere_light.glsl"],
    }
    defines = light_defines(scene, settings)
    return [f'#include "{name}"' for define, names in needed.items() if define in defines for name in names]


def _lights(scene: Scene, settings: Settings) -> list[str]:
    """The lights, and reflected(), with just the models in use."""
    return [
        *(['#include "shading/light.glsl"'] if scene.lights else []),
        '#include "shading/material.glsl"',
        *reflectance.reflected_text(material_layout(scene, settings), mirrors=has_mirrors(scene, settings)),
    ]
