"""The programs that draw a scene."""

from __future__ import annotations

from raytracer.compiler.batches import groups
from raytracer.compiler.culling import has_quiet
from raytracer.compiler.glsl.preprocessor import Source, assemble
from raytracer.compiler.glsl.shaders import (
    Show,
    is_listed,
    is_over_planes,
    kinds_source,
    plain_vertex_source,
    quiet_source,
    show_source,
    vertex_source,
    visibility_source,
)
from raytracer.compiler.meshes import EMPTY, PLANE_ONLY, SEE, SHADE, SHAPES
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Program
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings


def find_programs(
    device: Device, scene: Scene, settings: Settings, show: Show | None = "picture", *, plane_only: bool = True
) -> dict[str, Program]:
    """The programs that draw `scene`, by name; with `show` None they draw only what each pixel sees.

    Without `plane_only`, cells with nothing but half-spaces are drawn as all others are. The context must be current.
    """
    sources = _sources(scene, settings, show, device.limits.varyings, plane_only=plane_only)
    return {name: device.program(*source) for name, source in sources.items()}


def are_compiled(device: Device, scene: Scene, settings: Settings, show: Show | None = "picture") -> bool:
    """Whether find_programs() compiles nothing. Raises ShaderError as find_programs()."""
    sources = _sources(scene, settings, show, device.limits.varyings, plane_only=True).values()
    return all(device.has_program(*source) for source in sources)


def _sources(
    scene: Scene, settings: Settings, show: Show | None, varyings: int, *, plane_only: bool
) -> dict[str, tuple[Source, Source]]:
    """The fragment and the vertex shader of each of the programs that draw `scene`, by its name."""
    sources: dict[str, tuple[Source, Source]] = {}
    cells = vertex_source(scene, settings, varyings)
    if show != "picture" or not is_over_planes(scene, settings):
        sources[SEE] = visibility_source(scene, settings, varyings, geometry=show != "picture"), cells
    if show:
        sources[SHADE] = show_source(scene, settings, show, varyings), cells
    if is_listed(scene, settings) and groups(scene).kinds:
        vertex, fragment = kinds_source(scene, settings, varyings, geometry=show != "picture")
        sources[SHAPES] = fragment, vertex
    if show == "picture" and has_quiet(scene, settings):
        if plane_only and groups(scene).planes:
            sources[PLANE_ONLY] = quiet_source(scene, settings, varyings), cells
        sources[EMPTY] = assemble("passes/empty.frag"), plain_vertex_source()
    return sources
