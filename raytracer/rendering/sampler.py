"""How many samples a tile's pixels get, and their sum."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.glsl.preprocessor import Source
from raytracer.gpu.cell_draw import Rectangle
from raytracer.rendering.adaptive import MARGIN, Refinement, surrounded
from raytracer.rendering.convergence import Movement
from raytracer.rendering.error_estimate import Moved, is_surely_below
from raytracer.rendering.passes import Passes
from raytracer.rendering.pixel_blocks import Blocks
from raytracer.scene.settings import Settings

# Samples summed in float32 on the GPU before the sum goes on in float64 here: rounding of a longer
# sum would outweigh what more samples gain.
SUMMED = 256


# Of the time that it takes to end a tile: that is taken longer than it was, as what comes after it takes some, too.
_ENDING = 1.25


class Summed(NamedTuple):
    """What one tile came to. Arrays have the top row first."""

    mean: NDArray[np.floating]  # (H, W, 3)
    samples: NDArray[np.int32] | int  # (H, W), or of all alike
    moved: Moved | None  # None where nothing moved can be told from
    error: NDArray[np.float32] | None  # (H, W)


class _Sums:
    """The sums of a tile's samples, as they are read from the GPU, and of the first of them their variance."""

    def __init__(self, passes: Passes, blocks: Blocks, *, errors: bool) -> None:
        self.passes, self.blocks, self.errors = passes, blocks, errors
        self.total: Any = None  # (H, W, 3) of the area
        self.variance: NDArray[np.float32] | None = None  # (H, W)

    def read(self) -> None:
        """Add what has been summed since the last time."""
        whole = (0, 0, *self.blocks.area[2:])
        found = self.passes.read_sum(whole)
        if self.errors and self.variance is None:
            self.variance = self.passes.read_variance(whole, self.blocks.samples_in(self.blocks.area))
        # A second part makes it float64. Until then that would change no bit of the quotient.
        self.total = found if self.total is None else np.add(self.total, found, dtype=np.float64)


def _decides(settings: Settings) -> bool:
    """Whether it is decided where more samples are needed: where an error or a time is asked for, by what tells it."""
    return settings.adaptive is not None or (settings.asks and settings.tells)


class Sampler:
    """Draws samples of one tile after another, as many as the settings want. On the GPU until closed."""

    def __init__(
        self,
        context: moderngl.Context,
        program: Callable[[Source], moderngl.Program],
        settings: Settings,
        target: tuple[int, int],
        *,
        estimates: bool = True,
    ) -> None:
        """`program` compiles a fragment shader for cells; `target` is the size of the largest tile with its margin().
        With `estimates` tiles are told how wrong they are, which takes a while.
        """
        self._settings, self._target = settings, target
        told = settings.tells and (estimates or settings.asks)
        self._movement = Movement(context, program, target) if told else None
        decides = _decides(settings)
        self._refinement = Refinement(context, program, target, settings, self._movement) if decides else None

    @staticmethod
    def margin(settings: Settings) -> int:
        """How many pixels are drawn around a tile at most."""
        return MARGIN if _decides(settings) else 0

    def sum(
        self,
        passes: Passes,
        tile: Rectangle,
        size: tuple[int, int],
        *,
        seconds: float | None = None,
        errors: bool = False,
        progress: Callable[[int], None] = lambda done: None,
    ) -> Summed:
        """The mean of a tile's samples, which take `seconds` if a time is asked for; with `errors` those of each pixel.

        `progress` is told how many samples there are.
        """
        settings, movement, refinement = self._settings, self._movement, self._refinement
        until = math.inf if seconds is None else time.perf_counter() + seconds
        drawing = judging = ending = 0.0  # seconds that each took last
        area = surrounded(tile, size) if refinement else tile
        blocks = Blocks(area, passes)
        if movement:
            movement.begin(blocks, sparse=not settings.asks)
        if refinement:
            refinement.begin(blocks)
        sums = _Sums(passes, blocks, errors=errors and movement is not None)
        done, last = 0, False
        while not last:
            done += 1
            summed = (done - 1) % SUMMED + 1
            begin = time.perf_counter()
            passes.draw(area, done - 1, anew=summed == 1)
            drawing = time.perf_counter() - begin
            blocks.samples += blocks.active
            begin = time.perf_counter()
            if done == 1 and begin + drawing < until < math.inf:  # to know how long it takes, or a little less
                self._ended(_Sums(passes, blocks, errors=sums.errors), tile, done)
                ending = _ENDING * (time.perf_counter() - begin)
                begin = time.perf_counter()
            last = done == settings.samples
            looks = movement and self._looks(done)
            if movement and looks:
                movement.look(done, summed, passes.radiance, sums.total, last=2 * done > settings.samples)
            if movement and settings.max_error is not None:
                last |= is_surely_below(settings.max_error, partial(movement.rmse, tile), done)
            if refinement and not last:
                expected = done + (until - ending - time.perf_counter()) / max(drawing, 1e-9)
                refinement.decide(done, summed, passes.radiance, min(expected, settings.samples))
                last = not blocks.active.any()
            now = time.perf_counter()
            if looks:
                judging = now - begin
            # A second part of the sum is read besides, and added in float64.
            end = ending if done < SUMMED else 2.0 * ending
            last |= now + drawing + (judging if self._looks(done + 1) else 0.0) + end > until
            if summed == SUMMED and not last:
                sums.read()
            progress(settings.samples if last else done)
        return self._ended(sums, tile, done)

    def _ended(self, sums: _Sums, tile: Rectangle, done: int) -> Summed:
        """What a tile came to, after `done` passes."""
        sums.read()
        area, blocks = sums.blocks.area, sums.blocks
        samples = blocks.samples_in(tile) if self._refinement else done
        count = blocks.divisors_in(tile) if self._refinement else done
        moved = self._movement.moved(tile) if self._movement else None
        if done == 1:
            moved = None  # which takes as long, but is no movement
        error = None
        # Of the area, from its top, what is the tile's.
        x, top = tile[0] - area[0], area[1] + area[3] - tile[1] - tile[3]
        where = slice(top, top + tile[3]), slice(x, x + tile[2])
        if moved and sums.variance is not None:
            error = np.sqrt(sums.variance[where] * (moved.scales[samples] / samples / 3.0), dtype=np.float32)
        return Summed(np.divide(sums.total[where], count), samples, moved, error)

    def warm(self, passes: Passes) -> None:
        """Have the driver compile all that sum() may draw, so that it takes nothing of a picture's time."""
        area = (0, 0, min(CELL, self._target[0]), min(CELL, self._target[1]))
        passes.warm(area)
        blocks = Blocks(area, passes)
        blocks.cells[:], blocks.samples[:] = True, 2
        for thing in filter(None, (self._movement, self._refinement)):
            thing.warm(blocks, passes.radiance)
        self._ended(_Sums(passes, blocks, errors=True), area, 2)

    def _looks(self, done: int) -> bool:
        """Whether to see what moved: at all powers of two, or at the last two."""
        last = 1 << self._settings.samples.bit_length() - 1
        return not done & (done - 1) and (self._settings.refines or 2 * done >= last)

    def close(self) -> None:
        """Give back everything on the GPU but the programs."""
        for thing in filter(None, (self._movement, self._refinement)):
            thing.close()
