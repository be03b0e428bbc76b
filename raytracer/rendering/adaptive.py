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

Where an error or a time is asked for, blocks stop by what convergence.py tells of them instead: with 8, 16, 32, ...
samples those stop that together hold next to none of the squared error asked for, or to be had in the time. They must
have held as little with half the samples already; and none stops if all that held as little then turned out to hold
much more.

What cannot be seen is what none of the FIRST samples of all these pixels meets: a ball of a quarter of a pixel,
a thin line. The sums' rounding to float32 makes an error of about 2e-4 times a pixel's radiance where there is
none: a threshold as low as that chooses by chance, though always the same.
"""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np

from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.glsl.preprocessor import Source, assemble
from raytracer.gpu.cell_draw import Mask, Rectangle
from raytracer.rendering.convergence import Movement
from raytracer.rendering.error_estimate import P
from raytracer.rendering.pixel_blocks import BlockPass, Blocks
from raytracer.scene.settings import Settings

# Samples that all pixels get. Of discs with a radius of a quarter of a pixel, 2 samples meet 37 %, 3 meet 53 %,
# 4 meet 67 %, 8 meet 98 %; of those twice as large 3 meet all.
FIRST = 3
# A power of two. After fewer, the samples of a pixel on an edge often agree still.
NEXT = 8
APRON = 1
# The most pixels beyond each of a tile's sides that surrounded() adds to it.
MARGIN = CELL + BLOCK + APRON
# The share of the squared error asked for that blocks may hold which get no more samples: a fortieth of the error.
_LEFT = 0.05
# How much more than that the blocks may hold that could have been left with half the samples.
_MISJUDGED = 2.0


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
        program: Callable[[Source], moderngl.Program],
        target: tuple[int, int],
        settings: Settings,
        movement: Movement | None,
    ) -> None:
        """`program` compiles a fragment shader for blocks, `target` is the size of the largest surrounded tile. Where
        an error or a time is asked for, `movement` tells what the blocks' errors are.
        """
        self._settings, self._movement = settings, movement
        self._errors = [
            BlockPass(context, program(assemble("sampling/error.frag", {"BLOCK": BLOCK, "APRON": apron})), target, 1)
            for apron in (APRON, 0)
        ]

    def begin(self, blocks: Blocks) -> None:
        """Turn to a tile."""
        self._blocks = blocks
        self._surest: Mask | None = None  # what could be left as it is, at the last look

    def warm(self, blocks: Blocks, radiance: moderngl.Texture) -> None:
        """Have the driver compile all that decide() draws."""
        self.begin(blocks)
        for find in self._errors:
            self._find(find, NEXT, NEXT, radiance)

    def decide(self, done: int, summed: int, radiance: moderngl.Texture, expected: float) -> None:
        """Have those blocks drawn that need more samples than the `done` ones, `summed` of them in `radiance`.

        `expected`: how many there will be at last if they take as long as the last one did.
        """
        if self._settings.adaptive is not None:
            if done == FIRST or (done >= NEXT and not done & (done - 1)):
                self._blocks.keep(self._found(done, summed, radiance) > self._settings.adaptive)
        elif self._movement and done >= NEXT // 2 and not done & (done - 1):
            unneeded = self._without(self._found(done, summed, radiance), self._movement.squares(), expected / done)
            if unneeded.any():
                self._blocks.keep(~unneeded)

    def _found(self, done: int, summed: int, radiance: moderngl.Texture) -> np.ndarray:
        """(rows, columns): the error of each block, 0 in cells that nothing is decided of any more."""
        # Later, pixels around a block may have fewer samples.
        return self._find(self._errors[0 if self._blocks.active.all() else 1], done, summed, radiance)

    def _find(self, errors: BlockPass, done: int, summed: int, radiance: moderngl.Texture) -> np.ndarray:
        radiance.use(0)
        blocks, numbers = self._blocks, {"summed": float(summed), "samples": float(done)}
        return errors.find(blocks, blocks.cells, radianceSum=0, **numbers)[..., 0]

    def _without(self, errors: np.ndarray, squares: np.ndarray, more: float) -> Mask:
        """Which active blocks can be left as they are: of the surest ones, that together hold a small share of the
        squared error that there is to be at last, those that were among the surest with half the samples, too. But none
        if what was found so then turns out to hold much more now: then there are things that so many samples often
        miss.
        """
        asked = squares.sum() / max(more, 1.0) ** (2.0 * P)
        if self._settings.max_error is not None:
            asked = max(asked, self._settings.max_error**2 * 3 * self._blocks.area[2] * self._blocks.area[3])
        active = self._blocks.active
        left = _LEFT * asked - squares[~active].sum()
        surest = np.argsort(errors[active], kind="stable")
        count = np.searchsorted(np.cumsum(squares[active][surest]), left, side="right")
        chosen = np.zeros(len(surest), bool)
        chosen[surest[:count]] = True
        now = np.zeros(active.shape, bool)
        now[active] = chosen
        before, self._surest = self._surest, now
        if before is None or squares[before & active].sum() > _MISJUDGED * _LEFT * asked:
            return np.zeros(active.shape, bool)
        return before & now

    def close(self) -> None:
        """Give back everything on the GPU but the programs."""
        for errors in self._errors:
            errors.close()
