"""How far the means of a tile's pixels moved as samples were added, found on the GPU for error_estimate.py."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.glsl.preprocessor import Source, assemble
from raytracer.gpu.cell_draw import Mask, Rectangle, Squares, runs, viewport
from raytracer.gpu.gl import release, set_uniforms
from raytracer.rendering.error_estimate import FACTOR, Moved
from raytracer.rendering.pixel_blocks import BlockPass, Blocks

Array = NDArray[np.float64]

# In a tile in whose cells with anything in them are more pixels, every fifth cell tells what moved: they are a knight's
# moves apart, so that some are in each row, column and diagonal.
_ENOUGH, _PART = 2**18, 5


class Movement:
    """Of one tile after another, at 2, 4, 8, ... samples. Has a copy of the sums on the GPU until closed."""

    def __init__(
        self, context: moderngl.Context, program: Callable[[Source], moderngl.Program], target: tuple[int, int]
    ) -> None:
        """`program` compiles a fragment shader for blocks or cells; `target` is the size of the largest area."""
        self._context, self._program, self._size = context, program, target
        self._earlier = context.texture(target, 4, dtype="f4")
        self._copy = context.framebuffer([self._earlier])
        self._before: moderngl.Texture | None = None
        self._passes: dict[bool, tuple[BlockPass, Squares]] = {}

    def begin(self, blocks: Blocks, *, sparse: bool) -> None:
        """Turn to a tile. `sparse`: of a large one it may be a part of it that tells what moved."""
        self._blocks = blocks
        self._looked = np.ones_like(blocks.cells)
        if sparse and blocks.cells.sum() * CELL**2 > _ENOUGH:
            row, column = np.indices(blocks.cells.shape)
            self._looked = (column + 2 * row) % _PART == 0
        self._share = self._looked[blocks.cells].mean() if blocks.cells.any() else 1.0
        self._copied = 0  # of how many samples `_earlier` holds the sums
        shape = blocks.active.shape
        # Of each block, when it was looked at last: after how many samples, how far its means had moved, and how far
        # apart its samples lie, which is found of all blocks.
        self.at: NDArray[np.int32] = np.zeros(shape, np.int32)
        self._moved, self._variance, self._most = (np.zeros(shape, np.float32) for _ in range(3))

    def warm(self, blocks: Blocks, radiance: moderngl.Texture) -> None:
        """Have the driver compile all that look() draws."""
        self.begin(blocks, sparse=False)
        total = np.zeros((blocks.area[3], blocks.area[2], 3), np.float32)
        for n in (2, 4, 8):
            self.look(n, min(n, 4), radiance, total, last=False)

    def look(
        self, n: int, summed: int, radiance: moderngl.Texture, total: NDArray[np.floating] | None, *, last: bool
    ) -> None:
        """There are n samples now, a power of two: find what moved since n / 2, if that was looked at.

        `radiance` has the sums of the last `summed`, and `total` (H, W, 3), the top row first, those before, of a tile
        in the area's lower left. The `last` look keeps nothing for another one.
        """
        before = n > summed
        if before:
            assert total is not None
            self._before = self._before or self._context.texture(self._size, 3, dtype="f4")
            height, width = total.shape[:2]
            self._before.write(np.ascontiguousarray(total[::-1], np.float32), viewport=(0, 0, width, height))
            self._before.use(2)
        radiance.use(0)
        blocks, (find, squares) = self._blocks, self._compiled(before)
        if self._copied:
            self._earlier.use(1)
            found = find.find(
                blocks,
                blocks.cells,
                radianceSum=0,
                earlierSum=1,
                summedBefore=2,
                earlier=float(self._copied),
                summed=float(summed),
                samples=float(n),
            )
            self._note(n, found)
        if not last:
            self._keep(squares, blocks.cells & self._looked)
            self._copied = n

    def _compiled(self, before: bool) -> tuple[BlockPass, Squares]:
        if before not in self._passes:
            defines: dict[str, int] = {"BLOCK": BLOCK} | ({"SUMMED_BEFORE": 1} if before else {})
            find, keep = (self._program(assemble(f"sampling/{name}.frag", defines)) for name in ("movement", "sums"))
            self._passes[before] = BlockPass(self._context, find, self._size, 4), Squares(self._context, keep)
        return self._passes[before]

    def _keep(self, squares: Squares, cells: Mask) -> None:
        """Copy the sums in these cells."""
        area = (0, 0, *self._blocks.area[2:])
        port, shown = viewport(area)
        set_uniforms(squares.program, side=CELL, radianceSum=0, summedBefore=2, **{"draw.viewport": shown})
        squares.set(runs(cells))
        self._copy.use()
        self._copy.viewport, self._copy.scissor = port, area
        squares.draw()

    def _note(self, n: int, found: NDArray[np.float32]) -> None:
        active = self._blocks.active
        self._variance[active], self._most[active] = found[active, 1], found[active, 2]
        per = CELL // BLOCK
        active = active & self._looked.repeat(per, axis=0).repeat(per, axis=1)
        self.at[active], self._moved[active] = n, found[active, 0]

    def squares(self) -> Array:
        """(rows, columns): of each block the squared error of all its pixels and channels together."""
        # From where it was looked at on as that of independent samples.
        later = self.at / np.maximum(self._blocks.samples, 1)
        return FACTOR * self._moved * later

    def rmse(self, tile: Rectangle) -> float:
        """The estimated root mean square error of a tile."""
        total = self.squares()[self._blocks.part(tile)].sum() / self._share
        return float(np.sqrt(total / (3 * tile[2] * tile[3])))

    def moved(self, tile: Rectangle) -> Moved:
        """What is found of a tile's blocks."""
        part = self._blocks.part(tile)
        squares, samples = self.squares()[part], np.maximum(self._blocks.samples[part], 1)
        spread, looked = self._variance[part] / samples, self.at[part] > 0
        scales = np.full(samples.max() + 1, _scale(squares, spread, looked))
        for n in np.unique(samples):
            those = looked & (samples == n)
            if those.any():
                scales[n] = _scale(squares, spread, those)
        worst = scales[samples] * self._most[part] / samples
        row, column = np.unravel_index(int(worst.argmax()), worst.shape)
        y, x = (int(index + where.start) * BLOCK + BLOCK // 2 for index, where in zip((row, column), part, strict=True))
        return Moved(
            float(squares.sum()) / self._share,
            float(np.square(squares).sum()) / self._share,
            float(worst[row, column]),
            (self._blocks.area[0] + x, self._blocks.area[1] + y),
            scales,
        )

    def close(self) -> None:
        """Give back everything on the GPU but the programs."""
        for find, squares in self._passes.values():
            find.close()
            squares.release()
        release(self._context, self._copy, self._earlier, *filter(None, [self._before]))


def _scale(squares: Array, spread: Array, those: Mask) -> float:
    """What the squared errors of some blocks are of what they would be if their samples were independent."""
    total = float(spread[those].sum(dtype=float))
    return float(squares[those].sum()) / total if total else 0.0
