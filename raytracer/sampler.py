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

from raytracer.adaptive import MARGIN, Refinement, surrounded
from raytracer.blocks import Blocks
from raytracer.cells import CELL
from raytracer.estimate import Moved, is_surely_below
from raytracer.glsl_source import Source
from raytracer.movement import Movement
from raytracer.passes import Passes
from raytracer.settings import Settings
from raytracer.squares import Rectangle

# Samples summed in float32 on the GPU before the sum goes on in float64 here: rounding of a longer
# sum would outweigh what more samples gain.
SUMMED = 256


class Summed(NamedTuple):
    """What one tile came to. Arrays have the top row first."""

    mean: NDArray[np.floating]  # (H, W, 3)
    samples: NDArray[np.int32] | int  # (H, W), or of all alike
    moved: Moved | None  # None where nothing moved can be told from
    error: NDArray[np.float32] | None  # (H, W)


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
        self._settings = settings
        tells = settings.sequence == "sobol" and settings.samples > 1
        self._movement = Movement(context, program, target) if tells and (estimates or settings.asks) else None
        # Of other sequences' samples nothing is known that decides where more are needed.
        decides = settings.adaptive is not None or (settings.asks and tells)
        self._refinement = Refinement(context, program, target, settings, self._movement) if decides else None

    @staticmethod
    def margin(settings: Settings) -> int:
        """How many pixels are drawn around a tile at most."""
        return MARGIN if settings.refines else 0

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
        drawing = judging = reading = 0.0  # what each took last, in seconds
        area = surrounded(tile, size) if refinement else tile
        blocks = Blocks(area, passes)
        if movement:
            movement.begin(blocks, sparse=not settings.asks)
        if refinement:
            refinement.begin(blocks)
        total: Any = None
        done, last = 0, False
        variance: NDArray[np.float32] | None = None
        while not last:
            done += 1
            summed = (done - 1) % SUMMED + 1
            begin = time.perf_counter()
            passes.draw(area, done - 1, anew=summed == 1)
            drawing = time.perf_counter() - begin
            blocks.samples += blocks.active
            if done == 1 and seconds is not None:  # to know how long it takes
                begin = time.perf_counter()
                self._read(passes, blocks, errors=errors)
                reading = time.perf_counter() - begin
            last = done == settings.samples
            begin = time.perf_counter()
            looks = movement and self._looks(done)
            if movement and looks:
                movement.look(done, summed, passes.radiance, total, last=2 * done > settings.samples)
            if movement and settings.max_error is not None:
                last |= is_surely_below(settings.max_error, partial(movement.rmse, tile), done)
            if refinement and not last:
                expected = done + (until - reading - time.perf_counter()) / max(drawing, 1e-9)
                refinement.decide(done, summed, passes.radiance, min(expected, settings.samples))
                last = not blocks.active.any()
            now = time.perf_counter()
            if looks:
                judging = now - begin
            last |= now + drawing + (judging if self._looks(done + 1) else 0.0) + reading > until
            if last or summed == SUMMED:
                found, its = self._read(passes, blocks, errors=errors and variance is None)
                variance = its if variance is None else variance
                # A second part makes it float64. Until then that would change no bit of the quotient.
                total = found if total is None else np.add(total, found, dtype=np.float64)
            progress(settings.samples if last else done)
        samples, count = blocks.samples_in(tile) if refinement else (done, done)
        moved = movement.moved(tile) if movement and done > 1 else None
        error = None
        # Of the area, from its top, what is the tile's.
        x, top = tile[0] - area[0], area[1] + area[3] - tile[1] - tile[3]
        where = slice(top, top + tile[3]), slice(x, x + tile[2])
        if moved and variance is not None:
            error = np.sqrt(variance[where] * (moved.scales[samples] / samples / 3.0), dtype=np.float32)
        return Summed(np.divide(total[where], count), samples, moved, error)

    def _read(
        self, passes: Passes, blocks: Blocks, *, errors: bool
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """The sums in an area (H, W, 3) and, if that is wanted and can be told, their variance (H, W)."""
        whole = (0, 0, *blocks.area[2:])
        if errors and self._movement:
            return passes.read_sum(whole), passes.read_variance(whole, blocks.samples_in(blocks.area)[0])
        return passes.read_sum(whole), None

    def warm(self, passes: Passes) -> None:
        """Have the driver compile all that sum() may draw, so that it takes nothing of a picture's time."""
        area = (0, 0, CELL, CELL)
        passes.warm(area)
        blocks = Blocks(area, passes)
        blocks.cells[:] = True
        for thing in filter(None, (self._movement, self._refinement)):
            thing.warm(blocks, passes.radiance)
        passes.read_sum(area)

    def _looks(self, done: int) -> bool:
        """Whether to see what moved: at all powers of two, or at the last two."""
        last = 1 << self._settings.samples.bit_length() - 1
        return not done & (done - 1) and (self._settings.refines or 2 * done >= last)

    def close(self) -> None:
        """Give back everything on the GPU but the programs."""
        for thing in filter(None, (self._movement, self._refinement)):
            thing.close()
