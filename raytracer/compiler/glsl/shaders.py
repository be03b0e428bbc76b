"""Generates the GLSL texts of all programs of a compiled scene.

The text depends on the scene's structure: its CSG trees, its types of primitives, its reflectance models, the number of
lights, and the type of shadows. It depends on a material's numbers only in whether any material has an ambient factor,
emits light, or is anisotropic. All other numbers are in textures, or the vertex shader hands them on. So scenes of one
structure share programs, and a scene's shader has only code that the scene uses. There is no OpenGL here, and no text
of a user's: the generated code forms names from numbers only.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal, NamedTuple

import numpy as np

from raytracer.compiler.bodies import WALLS
from raytracer.compiler.body_texels import count_texels
from raytracer.compiler.chain_grids import are_boxes
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.draws import SAMPLES_AT_ONCE
from raytracer.compiler.glsl import csg, csg_shapes
from raytracer.compiler.glsl.body_slots import body_slots, handed_begins, handed_texels, handed_text
from raytracer.compiler.glsl.constants import (
    CONSTANT_LIGHTS,
    UNLIMITED_VARYINGS,
    Handed,
    handed_constants,
    handed_names,
    named_planes,
    surface_index,
)
from raytracer.compiler.glsl.materials import material_text, reflected_text
from raytracer.compiler.glsl.preprocessor import Source, assemble
from raytracer.compiler.glsl.ray_queries import camera_query, mirror_query, shadow_query
from raytracer.compiler.meshes import EMPTY, PICTURE, PLANE_ONLY, SEE, SEVERAL, SHADE, SHAPES
from raytracer.compiler.rounds import has_model_loops, may_take_many_rounds
from raytracer.scene.materials.material import Material
from raytracer.scene.options import Shadows

# The image that the second pass draws: the picture, or one of three views of the geometry.
Show = Literal["picture", "normal", "depth", "material"]
# The defines for kinds of walls, by their numbers (body.glsl).
_WALLS = "", "HAS_ROUND_WALLS", "HAS_CONE_WALLS", "HAS_TORI"
_Constant = tuple[str, str, str]  # type, name, and the value in the vertex shader


class ProgramSource(NamedTuple):
    """The shaders of one program."""

    vertex: Source
    fragment: Source


def program_sources(
    compiled: CompiledScene,
    show: Show | None,
    varyings: int = UNLIMITED_VARYINGS,
    *,
    plane_only: bool = True,
    several: bool = False,
    transparent: bool = False,
) -> dict[str, ProgramSource]:
    """Generate the programs that draw a scene, by their names (meshes.py).

    Args:
        compiled: The scene.
        show: The image to draw. None draws only the surface that each pixel sees.
        varyings: The number of the driver's varying components.
        plane_only: Whether plane-only cells have a program of their own.
        several: Whether to add a program that draws several samples of plane-only cells at once, if it saves time.
        transparent: Whether the programs of a picture leave out the visible background, and draw the coverage, too.
    """
    alpha = {"TRANSPARENT": 1} if transparent else {}
    handed = handed_constants(compiled, varyings)
    sources: dict[str, ProgramSource] = {}
    cells = _vertex_source(compiled, handed)
    if show == "picture" and compiled.is_one_pass:
        sources[PICTURE] = ProgramSource(cells, _picture_source(compiled, handed, alpha))
    elif show == "picture":
        sources[SHADE] = ProgramSource(cells, _shade_source(compiled, handed, alpha))
    if show != "picture" or not (compiled.is_one_pass or compiled.is_over_planes):
        sources[SEE] = ProgramSource(cells, _visibility_source(compiled, handed, geometry=show != "picture"))
    if show and show != "picture":
        sources[SHADE] = ProgramSource(
            cells, assemble(f"window/show_{show}.frag", _defines(compiled), _material(compiled))
        )
    if compiled.has_lists and compiled.batches.shapes:
        sources[SHAPES] = _shapes_source(compiled, handed, geometry=show != "picture")
    if show == "picture" and compiled.has_plane_only_cells:
        if plane_only and compiled.batches.planes:
            sources[PLANE_ONLY] = ProgramSource(cells, _plane_only_source(compiled, handed, alpha))
            if several and _are_samples_cheap(compiled):
                # Each further sample needs two components for its place.
                handed = handed_constants(compiled, varyings - 2 * (SAMPLES_AT_ONCE - 1))
                vertex = _vertex_source(compiled, handed, SAMPLES_AT_ONCE)
                sources[SEVERAL] = ProgramSource(vertex, _plane_only_source(compiled, handed, alpha, SAMPLES_AT_ONCE))
        sources[EMPTY] = ProgramSource(plain_vertex_source(), assemble("passes/empty.frag", alpha))
    return sources


def _are_samples_cheap(compiled: CompiledScene) -> bool:
    """Return whether a plane-only sample takes about as long as adding it up, and its shader compiles fast."""
    is_simple = not compiled.has_area_lights and not has_model_loops(compiled)
    return is_simple and len(compiled.lights) <= CONSTANT_LIGHTS and compiled.options.precision == 32


def plain_vertex_source() -> Source:
    """Return the vertex shader for programs that need no numbers of a scene."""
    return assemble("passes/cells.vert", generated={"constants.glsl": "void setConstants() {}"})


def _vertex_source(compiled: CompiledScene, handed: Handed, samples: int = 1) -> Source:
    """Generate the vertex shader of all programs that draw cells. It hands on the constants of draw.glsl.

    The programs draw `samples` samples at once.
    """
    constants = _surface_constants(compiled, handed)
    if handed.material:
        index = surface_index(compiled, compiled.batches.planes[0])
        constants.append(("Material", "onlyMaterial", f"materialAt({index})"))
    if handed.lights:
        constants += [("Light", f"light{i}", f"lights[{i}]") for i in range(len(compiled.lights))]
    includes = ["geometry/surfaces.glsl", "materials.glsl", *(["shading/light.glsl"] if compiled.lights else [])]
    lines = [*(f'#include "{name}"' for name in includes), *_set_constants(constants)]
    generated = {"constants.glsl": "\n".join(lines)} | _material(compiled)
    defines = _defines(compiled) | {"VERTEX": 1} | _light_defines(compiled) | _sample_defines(samples)
    return assemble("passes/cells.vert", defines, generated)


def _visibility_source(compiled: CompiledScene, handed: Handed, *, geometry: bool) -> Source:
    """Generate the fragment shader that finds the surface of each pixel; with `geometry`, its distance and normal
    too."""
    defines = _defines(compiled) | ({"GEOMETRY": 1} if geometry else {})
    if compiled.has_lists and compiled.batches.shapes and compiled.batches.programs:
        defines["OTHERS"] = 1
    generated = [*_includes(compiled, handed), "", *camera_query(compiled, handed)]
    return assemble("passes/visibility.frag", defines, {"scene.glsl": "\n".join(generated)})


def _shapes_source(compiled: CompiledScene, handed: Handed, *, geometry: bool) -> ProgramSource:
    """Generate the shaders that find the surfaces of objects of common shapes (batches.py)."""
    shapes = compiled.batches.shapes
    slots = body_slots(compiled)
    defines = _defines(compiled)
    spheres = [("Surface", f"sphere{j}", f"surfaceOf(first.x + {j})") for j in range(handed.leaves)]
    texels = handed_texels(slots) if handed.texels else {}
    bodies = [("vec4", f"texel{n}", text) for n, text in texels.items()]
    lines = _set_constants(spheres + bodies + _surface_constants(compiled, handed))
    lines = [*(["uniform samplerBuffer bodies;"] if texels else []), *lines]
    vertex = assemble("passes/shapes.vert", defines | {"VERTEX": 1}, {"constants.glsl": "\n".join(lines)})
    planes = None if compiled.batches.programs else named_planes(compiled, handed)
    query = csg_shapes.shapes_query_text(shapes, slots, planes, handed.leaves, with_texels=bool(texels))
    generated = [*(handed_text(slots) if texels else []), *_includes(compiled, handed), "", *query]
    defines |= {"HANDED_TEXELS": handed_begins(slots)[-1]} if texels else {}
    defines |= {"SHAPES": 1} | ({"GEOMETRY": 1} if geometry else {})
    return ProgramSource(vertex, assemble("passes/visibility.frag", defines, {"scene.glsl": "\n".join(generated)}))


def _picture_source(compiled: CompiledScene, handed: Handed, alpha: dict[str, int]) -> Source:
    """Generate the fragment shader that finds the surface of each pixel and computes its light."""
    defines = _defines(compiled) | _light_defines(compiled) | _handed_defines(compiled, handed) | alpha
    generated = [*_includes(compiled, handed), "", *camera_query(compiled, handed)]
    if compiled.lights or compiled.has_mirrors:
        generated += [*_lights(compiled), *_light_rays(compiled)]
    if compiled.lights and compiled.options.shadows != "off":
        defines["SHADOWS"] = 1
        generated += ["", *shadow_query(compiled, handed), "", _shadow(compiled.options.shadows)]
    if compiled.has_mirrors:
        defines["BOUNCES"] = compiled.options.bounces
        generated.append('#include "shading/mirrors.glsl"')
    return assemble("passes/picture.frag", defines, {"scene.glsl": "\n".join(generated)} | _material(compiled))


def _shade_source(compiled: CompiledScene, handed: Handed, alpha: dict[str, int]) -> Source:
    """Generate the fragment shader that computes the light from the surface of each pixel."""
    options, lights, has_mirrors = compiled.options, compiled.lights, compiled.has_mirrors
    defines = _defines(compiled) | _light_defines(compiled) | _handed_defines(compiled, handed) | alpha
    if not lights and not compiled.is_over_planes and not has_mirrors:
        return assemble(
            "passes/shade.frag", defines, {"scene.glsl": '#include "geometry/camera.glsl"'} | _material(compiled)
        )
    generated = _includes(compiled, handed)
    if compiled.is_over_planes:
        defines["OVER_PLANES"] = 1
        generated += csg.nearest_plane_text(named_planes(compiled, handed), with_owner=True)
    if lights or has_mirrors:
        generated += [*_lights(compiled), *_light_rays(compiled)]
    if has_mirrors:
        defines |= {"BOUNCES": options.bounces}
        generated += mirror_query(compiled, handed)
    if lights and options.shadows != "off":
        defines["SHADOWS"] = 1
        is_written = has_mirrors and (options.evaluator == "roth" or compiled.has_lists)
        generated += [*([] if is_written else ["", *shadow_query(compiled, handed)]), "", _shadow(options.shadows)]
    if has_mirrors:
        generated.append('#include "shading/mirrors.glsl"')
    return assemble("passes/shade.frag", defines, {"scene.glsl": "\n".join(generated)} | _material(compiled))


def _plane_only_source(compiled: CompiledScene, handed: Handed, alpha: dict[str, int], samples: int = 1) -> Source:
    """Generate the fragment shader of plane-only cells (grounds.py), which finds the half-space and computes its light.

    The program draws `samples` samples at once.
    """
    planes = named_planes(compiled, handed)
    defines = _defines(compiled) | _light_defines(compiled) | {"NO_SPHERES": 1} | _handed_defines(compiled, handed)
    defines |= alpha
    if len(planes) == 1:
        defines["ONLY"] = planes[0][0]
        defines |= {"ONLY_MATERIAL": 1} if handed.material else {}
    generated = ['#include "geometry/plane.glsl"', *_declare_surfaces(compiled, handed), '#include "geometry/hit.glsl"']
    generated += csg.nearest_plane_text(planes, with_owner=True)
    if compiled.lights:
        visible = {compiled.surfaces.material[plane] for plane in compiled.batches.planes}
        generated += [*_lights(compiled, [compiled.materials[i] for i in visible]), *_light_rays(compiled)]
    if compiled.lights and compiled.options.shadows != "off" and len(planes) > 1:
        defines["SHADOWS"] = 1
        generated += [*csg.nearest_plane_text(planes, with_owner=False), _shadow(compiled.options.shadows)]
    texts = {"scene.glsl": "\n".join(generated)} | _material(compiled)
    return assemble("passes/picture.frag", defines | _sample_defines(samples), texts)


def _defines(compiled: CompiledScene) -> dict[str, int | str]:
    """Return the defines for the scene's surfaces."""
    surfaces = compiled.surfaces
    defines: dict[str, int | str] = {"HAS_SPHERES": 1} if surfaces.spheres else {}
    defines |= {"HAS_PLANES": 1} if len(surfaces.offsets) else {}
    if len(surfaces.bodies.parts):
        defines["HAS_BODIES"] = 1
        defines |= {_WALLS[kind]: 1 for kind in _wall_kinds(compiled)}
    defines |= {"ORTHOGRAPHIC": 1} if compiled.scene.camera.projection == "orthographic" else {}
    defines |= {"MANY_ROUNDS": 1} if may_take_many_rounds(compiled) else {}
    if compiled.has_lists:
        programs = compiled.batches.programs
        defines |= {"PROGRAMS": 1} if programs else {}
        defines |= {"PROGRAM_PLANES": 1} if any(np.any(b.surfaces[0] >= surfaces.bounded) for b in programs) else {}
        defines |= {"BOX_GRIDS": 1} if compiled.batches.has_grids and are_boxes(compiled.batches, surfaces) else {}
        return defines | {"LISTS": 1}
    defines |= {"FIRST_PLANE": surfaces.bounded, "SURFACES": surfaces.size}
    if compiled.options.precision == 64:
        defines |= {"DOUBLES": 1, "BODY_TEXELS": count_texels(surfaces.bodies)}
    return defines


def _wall_kinds(compiled: CompiledScene) -> list[int]:
    """Return the kinds of walls in use, by their numbers in WALLS."""
    return sorted({*compiled.surfaces.bodies.kinds.tolist()} - {0})


def _light_defines(compiled: CompiledScene) -> dict[str, int]:
    """Return the defines for the scene's lights."""
    defines = {"LIGHTS": len(compiled.lights)}
    defines |= {"SPHERE_LIGHTS": 1} if compiled.has_area_lights else {}
    return defines | ({"FALLOFF": 1} if compiled.has_falloff else {})


def _sample_defines(samples: int) -> dict[str, int]:
    return {"SAMPLES": samples} if samples > 1 else {}


def _handed_defines(compiled: CompiledScene, handed: Handed) -> dict[str, int]:
    """Return the defines that tell fragment shaders which constants are varyings."""
    few = len(compiled.lights) <= CONSTANT_LIGHTS
    return {"FETCHED_LIGHTS": 1} if few and not handed.lights else {}


def _includes(compiled: CompiledScene, handed: Handed) -> list[str]:
    """Return the includes for the intersection of rays with the scene's surfaces."""
    lines = ['#include "geometry/sphere.glsl"'] if compiled.surfaces.spheres else []
    lines += ['#include "geometry/plane.glsl"'] if len(compiled.surfaces.offsets) else []
    if len(compiled.surfaces.bodies.parts):
        lines += [f'#include "geometry/{WALLS[kind]}_wall.glsl"' for kind in _wall_kinds(compiled)]
        lines += ['#include "geometry/body.glsl"']
    return [*lines, *_declare_surfaces(compiled, handed), '#include "geometry/hit.glsl"']


def _declare_surfaces(compiled: CompiledScene, handed: Handed) -> list[str]:
    """Return the declarations of the handed surfaces."""
    names = handed_names(compiled, handed).values()
    return ['#include "geometry/surfaces.glsl"', *(f"flat in Surface {name};" for name in names)]


def _surface_constants(compiled: CompiledScene, handed: Handed) -> list[_Constant]:
    names = handed_names(compiled, handed)
    return [("Surface", name, f"surfaceOf({surface_index(compiled, k)})") for k, name in names.items()]


def _set_constants(constants: list[_Constant]) -> list[str]:
    """Generate setConstants(), with which a vertex shader hands on the constants."""
    lines = [f"flat out {kind} {name};" for kind, name, _ in constants]
    return [*lines, "void setConstants() {", *(f"    {name} = {value};" for _, name, value in constants), "}"]


def _material(compiled: CompiledScene) -> dict[str, str]:
    return {"materials.glsl": material_text(compiled.layout)}


def _shadow(shadows: Shadows) -> str:
    """Return the include for shadows. Soft shadows use hard ones: each sample tests one point on the light."""
    return f'#include "shading/shadow_{"diluted" if shadows == "diluted" else "hard"}.glsl"'


def _light_rays(compiled: CompiledScene) -> list[str]:
    """Return the includes for lights with falloff or with a radius, which the lecture does not have."""
    names = ["shading/irradiance.glsl"] if compiled.has_falloff else []
    names += ["sampling/sobol.glsl", "shading/sphere_light.glsl"] if compiled.has_area_lights else []
    return [f'#include "{name}"' for name in names]


def _lights(compiled: CompiledScene, materials: Collection[Material] | None = None) -> list[str]:
    """Generate the lights and reflected(), with the models in use by `materials` (default: by all materials)."""
    return [
        *(['#include "shading/light.glsl"'] if compiled.lights else []),
        '#include "shading/material.glsl"',
        *reflected_text(compiled.layout, mirrors=compiled.has_mirrors, materials=materials),
    ]
