"""Which pixels need more samples: those whose mean is still uncertain, and those beside them.

What is estimated of a pixel, from its n samples c (linear RGB), is the standard error of their mean,
sqrt(sum |c - mean|^2 / (n (n - 1))): Painter and Sloan 1989, "Antialiased ray tracing by adaptive progressive
refinement". |.| is the length over red, green and blue, so no channel's error is estimated higher, and
edges between colours of equal brightness count. Where all samples surely are 1 or more in all channels it is
0: they are shown alike. Where only some are above 1, which is shown as 1, it may be too high. Samples lie
more evenly than random ones, which makes it too high as well.

All pixels get FIRST samples. Then blocks of BLOCK x BLOCK pixels, at fixed places of the picture, go on if a
pixel in them, or one that touches them, has an error above the threshold; or if means of two of these
pixels, shown (clipped to [0, 1]), differ by more than 2 n times the threshold: an edge between the two
may cut 1 / n off a pixel that no sample of it sees, 1 / (2 n) on average. That compares neighbours as Mitchell
1987 does, "Generating antialiased images at low sampling densities". After NEXT samples, and twice, 4 times, ...
as many, a block stops if no pixel of its own has an error above the threshold. So what is decided on a block depends on
no pixel more than APRON away.

What cannot be seen is what none of the FIRST samples of all these pixels meets: a ball of a quarter of a pixel,
a thin line. The sums' rounding to float32 makes an error of about 2e-4 times a pixel's radiance where there is
none: a threshold as low as that chooses by chance, though always the same.
"""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.cells import BLOCK, CELL
from raytracer.opengl import release, set_uniforms
from raytracer.passes import Passes
from raytracer.squares import Rectangle, Squares, runs, viewport

# Samples that all pixels get. Of discs with a radius of a quarter of a pixel, 2 samples meet 39 %, 3 meet 59 %,
# 4 meet 76 %; of those twice as large 3 meet all.
FIRST = 3
# A power of two. After fewer, the samples of a pixel on an edge often agree still.
NEXT = 8
APRON = 1
_PER_CELL = CELL // BLOCK
# The most pixels beyond each of a tile's sides that surrounded() adds to it.
MARGIN = CELL + BLOCK + APRON


def surrounded(tile: Rectangle, size: tuple[int, int]) -> Rectangle:
    """What must be drawn to decide on a tile's pixels: its blocks and APRON pixels around, in whole cells."""
    (x, right), (y, top) = (
        (
            max(0, (at // BLOCK * BLOCK - APRON) // CELL * CELL),
            min(side, -(-(-(-(at + length) // BLOCK) * BLOCK + APRON) // CELL) * CELL),
        )
        for side, at, length in zip(size, tile[:2], tile[2:], strict=True)
    )
    return x, y, right - x, top - y


class Refinement:
    """Decides, for one tile after another, which blocks get more samples. Has a target on the GPU until closed."""

    def __init__(
        self,
        context: moderngl.Context,
        programs: tuple[moderngl.Program, moderngl.Program],
        target: tuple[int, int],
        threshold: float,
    ) -> None:
        """`programs` are error.frag with and without the APRON, `target` is the size of the largest surrounded tile,
        and `threshold` is linear radiance.
        """
        self._context = context
        self._threshold = threshold
        self._squares = [Squares(context, program) for program in programs]
        self._errors = context.texture(_blocks(target), 1, dtype="f4")
        self._target = context.framebuffer([self._errors])

    def begin(self, area: Rectangle, passes: Passes) -> None:
        """Turn to a tile, surrounded(), and have `passes` draw all of it."""
        self._area = area
        self._cells = passes.cells(area)  # the lowest row first, as in all that OpenGL draws
        self._samples: NDArray[np.int32] = np.zeros([_PER_CELL * side for side in self._cells.shape], np.int32)
        self._active: NDArray[np.bool_] = np.ones(self._samples.shape, bool)
        self._done = 0
        passes.draw_all()

    def add(self, passes: Passes, summed: int, last: bool) -> bool:
        """Take note of one more sample, the `summed`-th of the sum, and have `passes` draw what needs the next one.

        True if nothing does. With `last`, nothing is decided.
        """
        self._samples += self._active
        self._done += 1
        decides = self._done == FIRST or (self._done >= NEXT and not self._done & (self._done - 1))
        if last or not decides:
            return False
        self._active &= self._find_errors(passes.radiance, summed) > self._threshold
        by_cell = self._active.reshape(len(self._cells), _PER_CELL, -1, _PER_CELL)
        self._cells = np.asarray(by_cell.any(axis=(1, 3)))
        passes.draw_only(self._active, self._area[:2])
        return not self._active.any()

    def _find_errors(self, radiance: moderngl.Texture, summed: int) -> NDArray[np.float32]:
        """(rows, columns): the error of each block, 0 in cells that nothing is decided of any more."""
        rows, columns = self._active.shape
        port, shown = viewport((0, 0, columns, rows))
        # Later, pixels around a block may have fewer samples.
        squares = self._squares[0 if self._done == FIRST else 1]
        set_uniforms(
            squares.program,
            side=_PER_CELL,
            **{"draw.viewport": shown},
            radianceSum=0,
            summed=float(summed),
            samples=float(self._done),
            drawn=self._area[2:],
        )
        squares.set(runs(self._cells))
        radiance.use(0)
        self._target.use()
        self._target.viewport, self._target.scissor = port, (0, 0, columns, rows)
        self._target.clear()
        squares.draw()
        data = self._target.read((0, 0, columns, rows), components=1, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(rows, columns)

    def samples_in(self, tile: Rectangle) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """(H, W) and, the same for each channel, (H, W, 3): how many samples each pixel got in a part of the area,
        top row first.
        """
        x, y, width, height = tile[0] - self._area[0], tile[1] - self._area[1], tile[2], tile[3]
        samples = self._samples.repeat(BLOCK, axis=1)[:, x : x + width].repeat(BLOCK, axis=0)[y : y + height]
        # Rows last: they are copied whole. By broadcasting, a division takes three times as long.
        each = self._samples.astype(np.float32).repeat(3 * BLOCK, axis=1)[:, 3 * x : 3 * (x + width)]
        return samples[::-1], each.repeat(BLOCK, axis=0)[y : y + height][::-1].reshape(height, width, 3)

    def close(self) -> None:
        """Give back everything on the GPU but the program."""
        for squares in self._squares:
            squares.release()
        release(self._context, self._target, self._errors)


def _blocks(size: tuple[int, int]) -> tuple[int, int]:
    """How many blocks whole cells over so many pixels have."""
    columns, rows = (-(-side // CELL) * _PER_CELL for side in size)
    return columns, rows
