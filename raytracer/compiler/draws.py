"""The draws of one sample, as a list of values without OpenGL, so that any player can play the list.

A player has programs and textures by the names that this module uses. For each `Draw` it binds the textures of
`inputs`, sets the `uniforms` that the program has, and draws the mesh into the textures of `target`. gpu/draw_player.py
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
from raytracer.scene.sequences import is_scattered, light_index, replicate_place, sample_place

# The number of samples in one float32 sum. Then a new sum begins, and the host adds the sums in float64: in a longer
# sum, rounding would outweigh the gain by more samples.
SAMPLES_PER_SUM = 256
# The margin of a viewport around its tile, in pixels: OpenGL does not draw points whose centre is outside the viewport.
MARGIN = 128
# The lowest bit of the scrambling's number in a light's index (shaders/sampling/sobol.glsl).
_SCRAMBLING_BITS = 24
# The number of samples that one draw may compute if nothing happens between them, as written out in picture.frag. Twice
# as many would take 10 % less time for each sample, and twice as long to compile.
SAMPLES_AT_ONCE = 4
# The new value of a pixel replaces the old value, is added to it, or covers it in proportion to its alpha.
Blending = Literal["replace", "add", "over"]


class Screen(msgspec.Struct, frozen=True):
    """A mesh for screen.vert: one triangle that covers the whole viewport."""


class Clear(msgspec.Struct, frozen=True):
    """A value for all pixels of an `area` of a texture.

    A depth texture gets the first component. A texture of integers is set to 0 as a whole.
    """

    texture: str
    value: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    area: Rectangle | None = None  # the whole texture


class Draw(msgspec.Struct, frozen=True):
    """A mesh that a program draws.

    `target` names textures, or is "screen" alone. `depth` names the depth texture of a depth test. `area` limits the
    pixels that are drawn, and `viewport` is the place of the picture. If `is_long`, a player may draw one part of the
    area after another; successive long draws into one area are then drawn part by part.
    """

    program: str
    mesh: Cells | Rectangles | Screen
    target: tuple[str, ...]
    area: Rectangle
    viewport: Rectangle
    uniforms: Mapping[str, Any]
    inputs: Mapping[str, str] = {}  # the names of textures, by the names of samplers
    blending: Blending = "replace"
    depth: str | None = None
    is_long: bool = False
    constants: Mapping[str, Any] = {}  # uniforms that many draws share, as one object


Step = Clear | Draw


class Sample(NamedTuple):
    """One sample of each pixel."""

    number: int  # 0, 1, ...
    place: tuple[int, int]  # the sample point, from the pixel's upper left corner, in units of 2^-24 pixel
    is_scattered: bool  # whether each pixel flips digits of the place
    light_index: int  # index of the point on each light (shaders/sampling/sobol.glsl)

    @property
    def starts_sum(self) -> bool:
        """Whether a new sum of samples begins."""
        return self.number % SAMPLES_PER_SUM == 0


def sample_at(number: int, options: SamplingOptions) -> Sample:
    """Return sample `number` of a picture with these options."""
    place = sample_place(number, options.sequence, options.samples)
    return Sample(number, place, is_scattered(options.sequence, options.samples), light_index(number))


def replicate_at(number: int) -> Sample:
    """Return sample `number` of a picture's replicate: the sequence "sobol" with another scrambling."""
    return Sample(number, replicate_place(number), True, light_index(number) | 1 << _SCRAMBLING_BITS)


def viewport(area: Rectangle) -> tuple[Rectangle, Rectangle]:
    """Return the viewport for an area of the picture, and the part of the picture that the viewport shows.

    The area is drawn into the lower left of a target. The viewport is larger by MARGIN pixels on each side. Both
    results are (x, y, width, height).
    """
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
    targets: tuple[str, ...] = ("radiance",),
) -> list[Step]:
    """Return the draws of samples of a tile, in the lower left of targets of the tile's size or larger.

    Args:
        meshes: The tile's meshes, by program.
        tile: The tile's pixels.
        samples: 1 or SAMPLES_AT_ONCE samples.
        seen: The names of the textures that SEE draws into, in order: "surface"; "others" if SHAPES compares distances
            with it; "normalDepth" if the geometry is wanted.
        shades: Whether to add the light to the textures `targets`.
        constants: Uniforms that all samples share.
        targets: The texture of the sums of light; in a transparent picture, then the texture of the coverage.
    """
    port, shown = viewport(tile)
    area, inputs = (0, 0, *tile[2:]), {name: name for name in seen if name != "others"}
    steps: list[Step] = []
    starts_sum = samples[0].starts_sum
    if shades and starts_sum and not meshes.is_whole:
        steps += map(Clear, targets)
    # If all pixels are drawn, the first sample replaces the old values, so that no clear is needed.
    first: Blending = "replace" if starts_sum and meshes.is_whole else "add"

    def light(programs: Sequence[str], uniforms: Mapping[str, Any], blending: Blending) -> None:
        for name in programs:
            if shades and name in meshes.cells:
                mesh = meshes.cells[name]
                steps.append(
                    Draw(name, mesh, targets, area, port, uniforms, inputs, blending, is_long=True, constants=constants)
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
        steps += _visibility_draws(meshes, area, port, uniforms, tuple(seen), constants)
        if i == 0:
            all_samples = {"samples": len(samples), "samplePlaces": [one.place for one in samples]}
            light(together, uniforms | all_samples, first)
        light(alone, uniforms, first if i == 0 else "add")
    return steps


def _programs(meshes: Meshes, samples: int) -> tuple[Sequence[str], Sequence[str]]:
    """Return the programs that shade all `samples` in one draw, and the programs that shade one after another."""
    if samples == 1:
        return (), (SHADE, PICTURE, PLANE_ONLY, EMPTY)
    if SEVERAL in meshes.cells:
        return (SEVERAL, EMPTY), (SHADE, PICTURE)
    return (EMPTY,), (SHADE, PICTURE, PLANE_ONLY)


def _visibility_draws(
    meshes: Meshes,
    area: Rectangle,
    port: Rectangle,
    uniforms: Mapping[str, Any],
    seen: tuple[str, ...],
    constants: Mapping[str, Any],
) -> list[Step]:
    """Return the draws that find the surface of each pixel."""
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
