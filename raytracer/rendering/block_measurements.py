"""Measurements of a tile's blocks on the GPU: the movement of means, and the spread of samples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.draws import Clear, Draw, viewport
from raytracer.compiler.glsl.preprocessor import FileVersion, Source, assemble, is_current
from raytracer.compiler.glsl.shaders import plain_vertex_source
from raytracer.compiler.meshes import PER_CELL, Cells, Mask, Rectangle, cell_blocks
from raytracer.gpu.device import Device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.rendering.pixel_blocks import Blocks
from raytracer.rendering.stopping_rule import APRON, NEXT

_SUMMED_BEFORE = {"summedBefore": "summedBefore"}
# The number of pixels of which brightest() takes the maximum. To read all 1280x720 pixels takes as long as a sample.
_PIXELS_READ = 4096


def _source(name: str, **defines: int) -> Source:
    return assemble(f"sampling/{name}.frag", {"BLOCK": BLOCK} | defines)


# The fragment shader of each program, by name.
_SOURCES = {
    "brightest": partial(_source, "brightest", SIDE=BLOCK),
    "error": partial(_source, "error", APRON=0),
    "error_around": partial(_source, "error", APRON=APRON),
    "movement": partial(_source, "movement"),
    "movement_of_sums": partial(_source, "movement", SUMMED_BEFORE=1),
    "variance": partial(_source, "variance"),
    "variance_of_chosen": partial(_source, "variance", CHOSEN=1),
    "kept": partial(_source, "sums"),
    "kept_sums": partial(_source, "sums", SUMMED_BEFORE=1),
}


class BlockMeasurements:
    """Measures a tile's blocks, by draws in which each pixel is a block. They read the tile's sums from `player`.

    The sums, and so the results, contain the light_scale of TileRenderer.draw() as a factor; squares contain its
    square. The textures belong to the player: "blocks", "earlierSum" for kept sums, "variance" and "sampledBlocks".
    """

    def __init__(self, device: Device, player: DrawPlayer, target: tuple[int, int]) -> None:
        """Create the textures. `target` is the size of the largest area in pixels."""
        self._device, self._player, self._target = device, player, target
        columns, rows = (-(-side // CELL) * PER_CELL for side in target)
        self._versions: dict[str, FileVersion] = {}  # the versions of the files of all programs so far
        player.use({}, replaced=_SOURCES)
        player.add_texture("blocks", (columns, rows), 4)
        player.add_texture("earlierSum", target, 4)

    def are_current(self) -> bool:
        """Whether no file has changed since its program was compiled."""
        return is_current(self._versions)

    def brightest(self, area: Rectangle) -> float:
        """Return the brightest channel of the sums in an area: of about _PIXELS_READ of its pixels, or of all."""
        stride = max(1, math.isqrt(area[2] * area[3] // _PIXELS_READ))
        columns, rows = (-(-side // (stride * BLOCK)) for side in area[2:])
        mesh = Cells(cell_blocks(np.ones((rows, columns), bool)), 1)
        draw = self._draw("brightest", "blocks", (columns, rows), mesh, {}, stride=stride, drawn=area[2:])
        self._player.play([draw])
        return float(self._player.read("blocks", draw.area, 1).max(initial=0.0))

    def errors(self, blocks: Blocks, samples: int, summed: int, white: float) -> NDArray[np.float32]:
        """Return the error of each block by error.frag, 0 in cells without active blocks (rows, columns).

        Args:
            blocks: the blocks to measure
            samples: number of samples so far
            summed: number of samples in the tile's current sums
            white: the light_scale, which stands for white
        """
        # Once blocks have stopped, pixels around a block may have fewer samples.
        program = "error_around" if blocks.is_whole else "error"
        uniforms = {"samples": float(samples), "summed": float(summed), "white": white}
        return self._measure(program, blocks, {}, **uniforms)[..., 0]

    def movement(self, blocks: Blocks, samples: int, summed: int, earlier: int) -> NDArray[np.float32]:
        """Return each block's movement and largest variance by movement.frag (rows, columns, 2).

        Cells without active blocks have 0.

        Args:
            blocks: the blocks to measure
            samples: number of samples so far
            summed: number of samples in the tile's current sums
            earlier: number of samples in the kept sums
        """
        before = samples > summed
        inputs = {"earlierSum": "earlierSum"} | (_SUMMED_BEFORE if before else {})
        program = "movement_of_sums" if before else "movement"
        uniforms = {"samples": float(samples), "summed": float(summed), "earlier": float(earlier)}
        return self._measure(program, blocks, inputs, **uniforms)

    def keep_sums(self, area: tuple[int, int, int, int], cells: Mask, *, before: bool) -> None:
        """Keep a copy of the sums in some cells of an area, with `before` together with the sums before them."""
        # Compile the program that will read the copy, too, so that a mistake in it appears with the first sample.
        self._compile("movement_of_sums" if before else "movement")
        program, inputs = "kept_sums" if before else "kept", _SUMMED_BEFORE if before else {}
        mesh = Cells(cell_blocks(cells), CELL)
        self._player.play([self._draw(program, "earlierSum", area[2:], mesh, inputs)])

    def variance(self, area: Rectangle, cells: Mask, samples: NDArray[np.int32] | int) -> NDArray[np.float32]:
        """Return the variance of each pixel's samples in some `cells` of an area (H, W), the lowest row first.

        The variance is 0 in other cells, and infinite if squares overflow. `samples` is the number of samples in the
        tile's sums: (rows, columns) of blocks, or one number for all.
        """
        if not self._player.has_texture("variance"):
            self._player.add_texture("variance", self._target, 1)
        mesh, size = Cells(cell_blocks(cells), CELL), area[2:]
        if isinstance(samples, int):
            draw = self._draw("variance", "variance", size, mesh, {}, samples=float(samples))
        else:
            rows, columns = samples.shape
            # Not "blockSamples": the window has a texture of that name, with other numbers.
            self._player.add_texture("sampledBlocks", (columns, rows), 1, "i4")
            self._player.write("sampledBlocks", samples)
            draw = self._draw("variance_of_chosen", "variance", size, mesh, {"blockSamples": "sampledBlocks"})
        self._player.play([Clear("variance", area=draw.area), draw])
        return self._player.read("variance", draw.area, 1)[..., 0]

    def warm(self) -> None:
        """Warm up: make the driver compile the draws of all other methods, by drawing one cell."""
        area = 0, 0, min(CELL, self._target[0]), min(CELL, self._target[1])
        self._player.add_texture("summedBefore", self._target, 3)
        blocks = Blocks.make_all(area, np.ones((1, 1), bool))
        self.brightest(area)
        for samples in (NEXT, 2 * NEXT):
            self.keep_sums(area, blocks.cells, before=samples > NEXT)
            self.movement(blocks, samples, NEXT, 1)
        some = blocks.active.copy()
        some[0, 0] = False
        for measured in (blocks, blocks.narrow(some)):
            self.errors(measured, NEXT, NEXT, 1.0)
        self.variance(area, blocks.cells, blocks.samples)
        self.variance(area, blocks.cells, NEXT)

    def _measure(self, program: str, blocks: Blocks, inputs: dict[str, str], **uniforms: float) -> NDArray[np.float32]:
        """Return the output of a program for each block (rows, columns, 1 or 2)."""
        rows, columns = blocks.active.shape
        mesh = Cells(cell_blocks(blocks.cells), PER_CELL)
        draw = self._draw(program, "blocks", (columns, rows), mesh, inputs, drawn=blocks.area[2:], **uniforms)
        self._player.play([Clear("blocks", area=draw.area), draw])
        return self._player.read("blocks", draw.area, 1 if program.startswith("error") else 2)

    def _draw(
        self, program: str, target: str, size: tuple[int, int], mesh: Cells, inputs: Mapping[str, str], **uniforms: Any
    ) -> Draw:
        """Return the draw of a mesh into the lower left `size` (width, height) of a texture. It reads the sums."""
        area = 0, 0, *size
        port, shown = viewport(area)
        uniforms["draw.viewport"] = shown
        inputs = {"radianceSum": "radiance", **inputs}
        return Draw(self._compile(program), mesh, (target,), area, port, uniforms, inputs)

    def _compile(self, name: str) -> str:
        """Compile a program for the player, if the player does not have it, and return its name."""
        if not self._player.has_program(name):
            source, vertex = _SOURCES[name](), plain_vertex_source()
            # A file that is part of an earlier program keeps the version of that program.
            self._versions = dict(source.versions + vertex.versions) | self._versions
            self._player.use({name: self._device.program(source, vertex)})
        return name
