"""Handed constants: the vertex shaders hand on as many as fit into a driver's varyings; fragment shaders fetch the
rest.

Fragment shaders read handed constants faster (draw.glsl). The bits are equal either way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from raytracer.compiler.batches import SHAPE_LEAVES
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.glsl.body_slots import body_slots, handed_texels
from raytracer.compiler.glsl.csg import NamedPlane

# More varying components than any scene needs: the most is 125 and some.
UNLIMITED_VARYINGS = 128
# The components of a struct Surface (surfaces.glsl) with 32 bits: three vec4. Surfaces with 64 bits are not handed on.
_SURFACE = 12
# The most surfaces, and the most lights, that the vertex shader hands on if they fit.
CONSTANTS, CONSTANT_LIGHTS = 6, 2
# The components of the other varyings of cells.vert and shapes.vert (draw.glsl): vectors and colours; two numbers of
# the type `real`; and the components for lists, for programs, for common shapes, and for lights with a radius.
_DRAW, _DRAW_REALS, _DRAW_LISTS, _DRAW_PROGRAMS, _DRAW_SHAPES, _DRAW_SPHERE_LIGHTS = 12, 2, 3, 2, 4, 1


class Handed(NamedTuple):
    """The constants that the vertex shaders hand on."""

    surfaces: Sequence[int]  # indices of surfaces
    leaves: int  # number of spheres of an object of a common shape (shapes.vert)
    texels: bool  # whether the texels of its bodies
    lights: bool  # whether all lights
    material: bool  # whether the only material


def handed_constants(compiled: CompiledScene, varyings: int) -> Handed:
    """Return the constants that fit into `varyings` varying components.

    All texts of one program must be made with equal constants.
    """
    real, layout, lights = compiled.options.precision // 32, compiled.layout, len(compiled.lights)
    shapes = compiled.batches.shapes if compiled.has_lists else []
    # Orthographic rays read other texels.
    is_perspective = compiled.scene.camera.projection == "perspective"
    texels = handed_texels(body_slots(compiled)) if shapes and is_perspective else {}
    wanted = Handed(
        [*_surface_names(compiled)],
        max((shape.spheres for shape in shapes), default=0),
        bool(texels),
        lights <= CONSTANT_LIGHTS,
        len(compiled.batches.planes) == 1 and layout.is_small,
    )
    room = varyings - _DRAW - _DRAW_REALS * real - (_DRAW_LISTS if compiled.has_lists else 0)
    cells_room = room - (_DRAW_PROGRAMS if compiled.has_lists else 0)
    return _select_fitting(
        cells_room - (_DRAW_SPHERE_LIGHTS if compiled.has_area_lights else 0),
        room - _DRAW_SHAPES,
        wanted,
        4 * len(texels),
        # light.glsl: position, n and radius; color, on and falloff
        lights * ((7 if compiled.has_area_lights else 6) * real + (5 if compiled.has_falloff else 4)),
        3 * len(layout.colors) + len(layout.numbers),
    )


def _select_fitting(room: int, shapes_room: int, wanted: Handed, texels: int, lights: int, material: int) -> Handed:
    """Return the part of `wanted` that fits.

    Args:
        room: The free components in cells.vert.
        shapes_room: The free components in shapes.vert.
        wanted: The constants to hand on.
        texels: The components of the texels of bodies.
        lights: The components of all lights.
        material: The components of the material.
    """
    leaves = min(wanted.leaves, max(shapes_room, 0) // _SURFACE)
    shapes_room -= leaves * _SURFACE
    has_texels = wanted.texels and texels <= shapes_room
    shapes_room -= texels * has_texels
    both = min(room, shapes_room) if wanted.leaves or wanted.texels else room
    surfaces = wanted.surfaces[: max(both, 0) // _SURFACE]
    room -= len(surfaces) * _SURFACE
    has_lights = wanted.lights and lights <= room
    room -= lights * has_lights
    return Handed(surfaces, leaves, has_texels, has_lights, wanted.material and material <= room)


def handed_names(compiled: CompiledScene, handed: Handed) -> dict[int, str]:
    """Return the GLSL names of the handed surfaces, by surface index."""
    names = _surface_names(compiled)
    return {k: names[k] for k in handed.surfaces}


def _surface_names(compiled: CompiledScene) -> dict[int, str]:
    """Return the GLSL names of all surfaces that may be handed on, by surface index."""
    planes, size = compiled.batches.planes, compiled.surfaces.size
    if compiled.has_lists:  # leave room for the leaves of an object of a common shape
        named = planes if len(planes) <= CONSTANTS - SHAPE_LEAVES else []
        return {k: f"plane{k - compiled.surfaces.bounded}" for k in named}
    names = {k: f"surface{k}" for k in (range(size) if size <= CONSTANTS else planes)}
    return names if len(names) <= CONSTANTS and compiled.options.precision == 32 else {}


def surface_index(compiled: CompiledScene, surface: int) -> str:
    """Return the GLSL expression for a surface's index."""
    return f"firstPlane + {surface - compiled.surfaces.bounded}" if compiled.has_lists else str(surface)


def surface_texts(compiled: CompiledScene, handed: Handed) -> dict[int, str]:
    """Return the GLSL expression for each surface that texts may name, by surface index."""
    every = compiled.batches.planes if compiled.has_lists else range(compiled.surfaces.size)
    fetched = {k: f"surfaceOf({surface_index(compiled, k)})" for k in every}
    return fetched | handed_names(compiled, handed)


def named_planes(compiled: CompiledScene, handed: Handed) -> list[NamedPlane]:
    """Return the single half-spaces, each with the GLSL expressions for it and for its index."""
    texts = surface_texts(compiled, handed)
    return [(texts[k], surface_index(compiled, k)) for k in compiled.batches.planes]
