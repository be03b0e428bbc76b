"""Compiled scenes, their shader texts and their frames, without a driver."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.compiled_scene import compile as compile_scene
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.glsl.constants import UNLIMITED_VARYINGS
from raytracer.compiler.glsl.shaders import ProgramSource, Show, program_sources
from raytracer.compiler.limits import DriverLimits
from raytracer.scene.settings import Settings

Mask = NDArray[np.bool_]

# The limits of an imaginary driver, too large to affect any scene.
LIMITS = DriverLimits(
    driver="none",
    version=450,
    target=2**14,
    varyings=UNLIMITED_VARYINGS,
    uniform_block=2**16,
    buffer_texels=2**27,
    volume_layers=2**11,
)


def compiled(scene: rt.Scene, settings: Settings | None = None) -> CompiledScene:
    return compile_scene(scene, (settings or Settings()).compile_options)


def sources(
    scene: rt.Scene,
    settings: Settings | None = None,
    show: Show | None = "picture",
    varyings: int = UNLIMITED_VARYINGS,
    *,
    several: bool = False,
) -> Mapping[str, ProgramSource]:
    return program_sources(compiled(scene, settings), show, varyings, several=several)


def fragment(scene: rt.Scene, name: str, settings: Settings | None = None) -> str:
    """Return the text of a program's fragment shader."""
    return sources(scene, settings)[name].fragment.text


def frame(scene: rt.Scene, size: tuple[int, int], settings: Settings | None = None) -> Frame:
    return make_frame(compiled(scene, settings), size, LIMITS)


def cell_masks(scene: rt.Scene, size: tuple[int, int], settings: Settings | None = None) -> tuple[Mask, Mask]:
    """Return two masks of cells, the lowest row first: only half-spaces or background visible, and only background.

    Shape of each: [rows, columns].
    """
    masks = frame(scene, size, settings).cells
    return masks.plane_only | masks.empty, masks.empty
