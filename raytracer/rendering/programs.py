"""The compiled OpenGL programs that draw a scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.glsl.preprocessor import FileVersion, is_current
from raytracer.compiler.glsl.shaders import ProgramSource, Show, program_sources
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Program


class ScenePrograms(NamedTuple):
    """The programs that draw a scene, and the versions of their shader files."""

    by_name: Mapping[str, Program]
    versions: Mapping[str, FileVersion]

    def are_current(self) -> bool:
        """Whether no shader file has changed since the compilation."""
        return is_current(self.versions)


def picture_programs(
    device: Device, compiled: CompiledScene, *, plane_only: bool, several: bool, transparent: bool = False
) -> ScenePrograms:
    """Compile the programs that draw pictures of a scene. Keywords: see program_sources()."""
    varyings = device.limits.varyings
    sources = program_sources(
        compiled, "picture", varyings, plane_only=plane_only, several=several, transparent=transparent
    )
    versions: dict[str, FileVersion] = {}
    for source in sources.values():
        versions |= dict(source.vertex.versions + source.fragment.versions)
    return ScenePrograms(_programs(device, sources), versions)


def find_programs(device: Device, compiled: CompiledScene, show: Show | None = "picture") -> dict[str, Program]:
    """Compile the programs that draw a scene, and return them by name. The context must be current.

    With `show` None, the programs draw only the geometry: the surface of each pixel.
    """
    return _programs(device, program_sources(compiled, show, device.limits.varyings))


def _programs(device: Device, sources: Mapping[str, ProgramSource]) -> dict[str, Program]:
    return {name: device.program(source.fragment, source.vertex) for name, source in sources.items()}


def are_compiled(device: Device, compiled: CompiledScene, show: Show | None = "picture") -> bool:
    """Whether find_programs() would compile nothing. Raises ShaderError as find_programs() does."""
    sources = program_sources(compiled, show, device.limits.varyings).values()
    return all(device.has_program(source.fragment, source.vertex) for source in sources)
