"""The draws of one sample, as a list of values: no OpenGL here, so that any player can play the same list.

A player has programs and textures by the names that are used here. For each `Draw` it binds the textures of `inputs`,
sets the `uniforms` as far as the program has them, and draws the mesh into the textures of `target`. gpu/draw_player.py
is the player for OpenGL.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import msgspec

from raytracer.compiler.meshes import (
    EMPTY,
    PICTURE,
    PLANE_ONLY,
    SEE,
    SEVERAL,
    SHADE,
    SHAPES,
    Cells,
    Meshes,
    Rectangle,
    Rectangles,
)
from raytracer.scene.options import SamplingOptions
from raytracer.scene.sequences import light_index, replicate_place, sample_place, scatters

# Samples that are summed in float32. Then a new sum begins, and the host adds both in float64: rounding of a longer
# sum would outweigh the gain by more samples.
SUMMED = 256
# Pixels of a viewport around its tile: points with a centre beyond it are not drawn.
MARGIN = 128
# The lowest of the bits of a light's index that number its scrambling (shaders/sampling/sobol.glsl).
_SCRAMBLING_BITS = 24
# Samples that are drawn at once where nothing is to be done between them: as many as picture.frag has written out.
# Twice as many take 10 % less time a sample, and twice as long to compile.
TOGETHER = 4
# The new value of a pixel replaces the old value, is added to it, or covers it by an alpha.
Blending = Literal["replace", "add", "over"]


class Screen(msgspec.Struct, frozen=True):
    """A mesh for screen.vert: one triangle that covers the whole viewport."""


class Clear(msgspec.Struct, frozen=True):
    """The value that all pixels of an `area` of a texture get: the first component in a texture of depths. All of a
    texture of integers gets 0.
    """

    texture: str
    value: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    area: Rectangle | None = None  # the whole texture


class Draw(msgspec.Struct, frozen=True):
    """A mesh that a program draws.

    `target` names textures, or is "screen" alone; `depth` names the depth texture of a depth test. `area` is where
    pixels are drawn, `viewport` where the picture is. If `is_long`, a player may draw one part of the area after
    another; draws in a row into the same part then follow each other.
    """

    program: str
    mesh: Cells | Rectangles | Screen
    target: tuple[str, ...]
    area: Rectangle
    viewport: Rectangle
    uniforms: Mapping[str, Any]
    inputs: Mapping[str, str] = {}  # names of textures, by samplers
    blending: Blending = "replace"
    depth: str | None = None
    is_long: bool = False
    constants: Mapping[str, Any] = {}  # uniforms that many draws share: the same object in all of them


Step = Clear | Draw


class Sample(NamedTuple):
    """One sample of each pixel."""

    number: int  # 0, 1, ...
    place: tuple[int, int]  # in the pixel, from its upper left corner, in 2^-24 of it
    is_scattered: bool  # whether each pixel exchanges digits of the place
    light_index: int  # of the point on each light (shaders/sampling/sobol.glsl)

    @property
    def starts_sum(self) -> bool:
        """Whether a new sum of samples begins."""
        return self.number % SUMMED == 0


def sample_at(number: int, options: SamplingOptions) -> Sample:
    """The sample with that number of a picture with these options."""
    place = sample_place(number, options.sequence, options.samples)
    return Sample(number, place, scatters(options.sequence, options.samples), light_index(number))


def replicate_at(number: int) -> Sample:
    """The sample with that number of a picture's replicate: by the sequence "sobol", in another scrambling."""
    return Sample(number, replicate_place(number), True, light_index(number) | 1 << _SCRAMBLING_BITS)


def viewport(area: Rectangle) -> tuple[Rectangle, Rectangle]:
    """The viewport for an area of the picture in the lower left of a target, and the part of the picture it shows."""
    x, y, width, height = area
    size = width + 2 * MARGIN, height + 2 * MARGIN
    return (-MARGIN, -MARGIN, *size), (x - MARGIN, y - MARGIN, *size)


def sample_draws(
    meshes: Meshes,
    tile: Rectangle,
    samples: Sequence[Sample],
    seen: Collection[str],
    *,
    shades: bool,
    constants: Mapping[str, Any],
    target: str = "radiance",
) -> list[Step]:
    """The draws of some samples of a tile, 1 or TOGETHER of them, in the lower left of targets of its size or larger.

    `seen` names the textures that SEE draws into, in its order: "surface", and "others", for the distances that SHAPES
    compares with, and "normalDepth", where there are such. If `shades`, light is summed in the texture `target`.
    `constants` are uniforms that all samples share.
    """
    port, shown = viewport(tile)
    area, inputs = (0, 0, *tile[2:]), {name: name for name in seen if name != "others"}
    steps: list[Step] = []
    starts_sum = samples[0].starts_sum
    if shades and starts_sum and not meshes.is_whole:
        steps.append(Clear(target))
    # All pixels are drawn, so a first sample need neither find 0 there nor be added to it.
    first: Blending = "replace" if starts_sum and meshes.is_whole else "add"

    def light(programs: Sequence[str], uniforms: Mapping[str, Any], blending: Blending) -> None:
        for name in programs:
            if shades and name in meshes.cells:
                mesh, into = meshes.cells[name], (target,)
                steps.append(
                    Draw(name, mesh, into, area, port, uniforms, inputs, blending, is_long=True, constants=constants)
                )

    together, alone = _programs(meshes, len(samples))
    for i, sample in enumerate(samples):
        uniforms = {
            "draw.tileOrigin": tile[:2],
            "draw.viewport": shown,
            "draw.samplePlace": sample.place,
            "draw.scatter": -1 if sample.is_scattered else 0,
            "draw.lightIndex": sample.light_index,
            "samples": 1,
        }
        steps += _seeing(meshes, area, port, uniforms, tuple(seen), constants)
        if i == 0:
            all_samples = {"samples": len(samples), "samplePlaces": [each.place for each in samples]}
            light(together, uniforms | all_samples, first)
        light(alone, uniforms, first if i == 0 else "add")
    return steps


def _programs(meshes: Meshes, samples: int) -> tuple[Sequence[str], Sequence[str]]:
    """The programs of light that draw all of so many `samples` in one draw, and those that draw one after another."""
    if samples == 1:
        return (), (SHADE, PICTURE, PLANE_ONLY, EMPTY)
    if SEVERAL in meshes.cells:
        return (SEVERAL, EMPTY), (SHADE, PICTURE)
    return (EMPTY,), (SHADE, PICTURE, PLANE_ONLY)


def _seeing(
    meshes: Meshes,
    area: Rectangle,
    port: Rectangle,
    uniforms: Mapping[str, Any],
    seen: tuple[str, ...],
    constants: Mapping[str, Any],
) -> list[Step]:
    """The draws that find what pixels see."""
    steps: list[Step] = []
    if SEE in meshes.cells:
        mesh = meshes.cells[SEE]
        steps.append(Draw(SEE, mesh, seen, area, port, uniforms, is_long=True, constants=constants))
    elif meshes.rectangles:
        steps.append(Clear("surface"))
    if meshes.rectangles:
        inputs = {"others": "others"} if "others" in seen else {}
        target = tuple(name for name in seen if name != "others")
        steps.append(Clear("depth", (1.0, 0.0, 0.0, 0.0), area))
        steps.append(
            Draw(SHAPES, meshes.rectangles, target, area, port, uniforms, inputs, depth="depth", constants=constants)
        )
    return steps
