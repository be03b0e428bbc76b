"""The programs that draw a scene."""

from __future__ import annotations

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.glsl.shaders import Show, program_sources
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Program


def find_programs(
    device: Device, compiled: CompiledScene, show: Show | None = "picture", *, plane_only: bool = True
) -> dict[str, Program]:
    """The programs that draw a scene, by name; with `show` None they draw only what each pixel sees.

    Without `plane_only`, cells with nothing but half-spaces are drawn as all others are. The context must be current.
    """
    sources = program_sources(compiled, show, device.limits.varyings, plane_only=plane_only)
    return {name: device.program(source.fragment, source.vertex) for name, source in sources.items()}


def are_compiled(device: Device, compiled: CompiledScene, show: Show | None = "picture") -> bool:
    """Whether find_programs() compiles nothing. Raises ShaderError as find_programs()."""
    sources = program_sources(compiled, show, device.limits.varyings).values()
    return all(device.has_program(source.fragment, source.vertex) for source in sources)
