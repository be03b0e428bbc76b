"""The blocks of BLOCK x BLOCK pixels of a tile: which are still drawn on, and what is found of each."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.gpu.cell_draw import Mask, Rectangle, Squares, runs, viewport
from raytracer.gpu.gl import release, set_uniforms
from raytracer.rendering.passes import Passes

_PER_CELL = CELL // BLOCK


class Blocks:
    """Those of one tile's area, whole cells. Arrays are (rows, columns), the lowest row first, as OpenGL has it.

    `active`: which get more samples; `samples`: how many each has got.
    """

    def __init__(self, area: Rectangle, passes: Passes) -> None:
        """Have `passes` draw all of the area."""
        self.area = area
        self.cells = passes.cells(area)  # those with active blocks
        shape = [_PER_CELL * side for side in self.cells.shape]
        self.samples: NDArray[np.int32] = np.zeros(shape, np.int32)
        self.active: Mask = np.ones(shape, bool)
        self._passes = passes
        passes.draw_all()

    def keep(self, wanted: Mask) -> None:
        """Have only those of the active blocks drawn that are `wanted`."""
        self.active &= wanted
        by_cell = self.active.reshape(len(self.cells), _PER_CELL, -1, _PER_CELL)
        self.cells = np.asarray(by_cell.any(axis=(1, 3)))
        self._passes.draw_only(self.active, self.area[:2])

    def samples_in(self, tile: Rectangle) -> NDArray[np.int32]:
        """(H, W), top row first: how many samples each pixel got in a part of the area."""
        x, y, width, height = tile[0] - self.area[0], tile[1] - self.area[1], tile[2], tile[3]
        samples = self.samples.repeat(BLOCK, axis=1)[:, x : x + width].repeat(BLOCK, axis=0)[y : y + height]
        return samples[::-1]

    def divisors_in(self, tile: Rectangle) -> NDArray[np.float32]:
        """(H, W, 3): the same for each channel. By broadcasting, a division takes three times as long."""
        x, y, width, height = tile[0] - self.area[0], tile[1] - self.area[1], tile[2], tile[3]
        # Rows last: they are copied whole.
        each = self.samples.astype(np.float32).repeat(3 * BLOCK, axis=1)[:, 3 * x : 3 * (x + width)]
        return each.repeat(BLOCK, axis=0)[y : y + height][::-1].reshape(height, width, 3)

    def part(self, tile: Rectangle) -> tuple[slice, slice]:
        """Where the blocks of a tile are in the arrays."""
        x, y = tile[0] - self.area[0], tile[1] - self.area[1]
        return slice(y // BLOCK, -(-(y + tile[3]) // BLOCK)), slice(x // BLOCK, -(-(x + tile[2]) // BLOCK))


class BlockPass:
    """Draws what one fragment shader finds of each block: a pixel there is a block here. On the GPU until closed."""

    def __init__(
        self, context: moderngl.Context, program: moderngl.Program, target: tuple[int, int], components: int
    ) -> None:
        """`target` is the size in pixels of the largest area."""
        self._context = context
        self._squares = Squares(context, program)
        columns, rows = (-(-side // CELL) * _PER_CELL for side in target)
        self._found = context.texture((columns, rows), components, dtype="f4")
        self._target = context.framebuffer([self._found])

    def find(self, blocks: Blocks, cells: Mask, **uniforms: object) -> NDArray[np.float32]:
        """(rows, columns, components): 0 in all but these of the blocks' cells. Textures must be bound."""
        rows, columns = blocks.active.shape
        port, shown = viewport((0, 0, columns, rows))
        draw: dict[str, Any] = {"draw.viewport": shown}
        set_uniforms(self._squares.program, side=_PER_CELL, drawn=blocks.area[2:], **draw, **uniforms)
        self._squares.set(runs(cells))
        self._target.use()
        self._target.viewport, self._target.scissor = port, (0, 0, columns, rows)
        self._target.clear()
        self._squares.draw()
        data = self._target.read((0, 0, columns, rows), components=self._found.components, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(rows, columns, -1)

    def close(self) -> None:
        """Give back everything on the GPU but the program."""
        self._squares.release()
        release(self._context, self._target, self._found)
