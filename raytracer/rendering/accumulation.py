"""The samples of a picture or of a part, drawn one by one until the stopping rule ends them: for render() and for the
window.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.draws import SUMMED, TOGETHER, Sample, sample_at
from raytracer.compiler.features import Features
from raytracer.compiler.meshes import Mask, Rectangle
from raytracer.formats.estimate import Estimate
from raytracer.rendering import stopping_rule
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import BlockStatistics, after_look, before_any_look
from raytracer.rendering.pixel_blocks import MARGIN, Blocks, surrounded
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tile_sums import Counts, TileSums
from raytracer.rendering.tiles import place
from raytracer.scene.options import SamplingOptions


def is_measured(options: SamplingOptions, *, estimates: bool) -> bool:
    """Whether samples need measurements: to choose blocks, or for `estimates` of the error."""
    return stopping_rule.chooses_blocks(options) or (estimates and options.estimates_error)


def margin(options: SamplingOptions) -> int:
    """The most pixels that are drawn around a tile."""
    return MARGIN if stopping_rule.chooses_blocks(options) else 0


class Accumulation:
    """The samples of a `part` of a picture of `size`, which consists of `tiles`.

    Each tile gets a sample before any gets the next, so that decisions are made on the blocks of all tiles together.
    `measurements` choose where samples go on, and with a stopping rule or `always_estimates` tell the error while
    samples are added; without them nothing does either.
    """

    def __init__(
        self,
        renderer: TileRenderer,
        measurements: BlockMeasurements | None,
        options: SamplingOptions,
        part: Rectangle,
        tiles: Sequence[Rectangle],
        size: tuple[int, int],
        *,
        features: Features | None = None,
        always_estimates: bool = False,
    ) -> None:
        """`features`: the bright features of the whole picture, if the options have `max_error`.

        Blocks with features that samples may have missed go on.
        """
        self._renderer, self._measurements, self._options = renderer, measurements, options
        self._part, self._size, self._features = part, size, features
        self._chooses = measurements is not None and stopping_rule.chooses_blocks(options)
        area, *areas = (surrounded(each, size) if self._chooses else each for each in (part, *tiles))
        self._sums = [TileSums(renderer, i, *each) for i, each in enumerate(zip(tiles, areas, strict=True))]
        cells = renderer.seen_cells(area)
        self._blocks = Blocks.all_of(area, cells)
        self._spare: Mask | None = None
        self._statistics: BlockStatistics | None = None
        if measurements and options.estimates_error and (always_estimates or options.has_stopping_rule):
            self._statistics = before_any_look(self._blocks.active.shape)
        self._light_scale = 1.0  # times which light the sums are of
        self._correction = 1.0  # times which the estimate's errors are right
        self._kept = 0  # of how many samples the sums are kept
        self._is_enough = False
        self._looking_seconds = 0.0  # that the last look took
        self.drawing_seconds = 0.0  # that the last sample took
        self.samples = 0

    @property
    def options(self) -> SamplingOptions:
        """The options of the samples."""
        return self._options

    @property
    def light_scale(self) -> float:
        """The power of two times which light the sums are of."""
        return self._light_scale

    @property
    def blocks(self) -> Blocks:
        """The blocks of the part's area."""
        return self._blocks

    def step(self, seconds_left: float = math.inf, *, together: bool = False) -> None:
        """Draw one more sample, and decide where more are needed, and whether; `seconds_left` are for all of them.

        If `together`, TOGETHER samples are drawn where nothing is to be decided before the last of them.

        Raises ShaderError for a mistake in the shaders of measurements, and InputError as TileRenderer.draw().
        """
        begin = time.perf_counter()
        index, options, blocks = self.samples, self._options, self._blocks
        more = TOGETHER if together and self._can_draw_together() else 1
        samples = [sample_at(index + k, options) for k in range(more)]
        for sums, around in self._active_tiles():
            if index and index % SUMMED == 0:
                sums.read_before_new(self._counts(around), self._measurements)
            sums.draw(around, samples, self._light_scale)
        self.samples += more
        self._is_enough = self.samples == options.samples
        self._blocks = blocks.sampled(more)
        drawn = time.perf_counter()
        self.drawing_seconds = drawn - begin
        if self._measurements:
            if not index and options.samples > 1:
                self._choose_light_scale(self._measurements, samples)
            self._look(self._measurements)
            left = seconds_left - (time.perf_counter() - begin)
            growth = min(1.0 + left / max(drawn - begin, 1e-9) / self.samples, options.samples / self.samples)
            self._decide(self._measurements, growth)
        if self._is_look_due(self.samples):
            self._looking_seconds = time.perf_counter() - drawn

    def _choose_light_scale(self, measurements: BlockMeasurements, samples: Sequence[Sample]) -> None:
        """Choose the scale of all light by the first `samples`, and draw these again if it is not 1."""
        brightest = max(measurements.brightest(around.area) for _, around in self._active_tiles())
        self._light_scale = self._renderer.light_scale(brightest)
        if self._light_scale != 1.0:
            for sums, around in self._active_tiles():
                sums.draw(around, samples, self._light_scale)

    def is_done(self, seconds_left: float = math.inf) -> bool:
        """Whether there are enough samples, or none more would be done in the seconds that are left."""
        looking = self._looking_seconds if self._is_look_due(self.samples + 1) else 0.0
        return self._is_enough or self.drawing_seconds + looking > seconds_left

    def _can_draw_together(self) -> bool:
        """Whether it saves time to draw TOGETHER more samples at once, and nothing is due before the last of them."""
        after = self.samples + TOGETHER
        # A sum ends at a multiple.
        if not self._renderer.draws_together or after > self._options.samples or after % TOGETHER:
            return False
        return not any(self._is_anything_due(n) for n in range(self.samples + 1, after))

    def _is_anything_due(self, samples: int) -> bool:
        ends = self._options.max_error is not None and stopping_rule.may_end_by_error(samples)
        return ends or self._is_look_due(samples) or stopping_rule.is_choice_due(self._options, samples)

    def _is_look_due(self, samples: int) -> bool:
        # The points are spread best where their number is a power of two.
        return self._statistics is not None and not samples & (samples - 1)

    def _look(self, measurements: BlockMeasurements) -> None:
        """Measure how far means moved, if that is due."""
        n, blocks, statistics = self.samples, self._blocks, self._statistics
        if statistics is None or not self._is_look_due(n):
            return
        summed = (n - 1) % SUMMED + 1
        if self._kept:
            movement = self._measured(lambda around: measurements.movement(around, n, summed, self._kept))
            self._statistics = after_look(statistics, n, self._squares(movement), blocks.active)
        if 2 * n <= self._options.samples:
            for _, around in self._active_tiles():
                measurements.keep_sums(around.area, around.cells, before=n > summed)
            self._kept = n

    def _squares(self, measured: NDArray[np.float32]) -> NDArray[np.floating]:
        """Unscale `measured` squares of light. Squares that overflowed become large numbers."""
        most = float(np.finfo(np.float32).max)
        finite = (
            measured if math.isfinite(measured.max(initial=0.0)) else np.nan_to_num(measured, nan=most, posinf=most)
        )
        return finite if self._light_scale == 1.0 else finite / np.float64(self._light_scale) ** 2

    def _decide(self, measurements: BlockMeasurements, growth: float) -> None:
        """Choose the blocks that get more samples, if that is due. At last there are `growth` times as many."""
        n, options, blocks = self.samples, self._options, self._blocks
        rmse = self._rmse()
        if options.max_error is not None and rmse is not None:
            self._is_enough |= stopping_rule.is_surely_below(options.max_error, self._correction * rmse, n)
        if self._is_enough or n == options.samples or not stopping_rule.is_choice_due(options, n):
            return
        squared_errors = None
        if self._statistics is not None:
            squared_errors = self._correction**2 * self._statistics.squared_errors(blocks.samples)
        scale = self._light_scale
        errors = self._measured(lambda around: measurements.errors(around, n, (n - 1) % SUMMED + 1, scale))
        choice = stopping_rule.choose_blocks(
            options,
            blocks.active,
            errors if scale == 1.0 else errors / scale,
            squared_errors,
            spare=self._spare,
            pixels=blocks.area[2] * blocks.area[3],
            growth=growth,
        )
        self._spare = choice.spare
        active = choice.active
        if self._features is not None and options.max_error is not None:
            # A block whose samples met none of its features looks as if it had enough of them.
            active = active | blocks.active & self._features.unmet(n, options.max_error, self._size, active.shape)
        if not active.any():
            self._is_enough = True
        elif not np.array_equal(active, blocks.active):
            self._blocks = blocks.narrowed(active)

    def resume(self, measured: Estimate, seconds_left: float) -> bool:
        """Whether samples go on: the `measured` error is not the one asked for, and one more fits the `seconds_left`.

        From then on the estimate of the error is as large as the measured error, if it was smaller.
        """
        is_over = self.samples == self._options.samples or self.drawing_seconds >= seconds_left
        if measured.reached is not False or is_over:
            return False
        rmse = self._rmse()
        self._correction = max(self._correction, (measured.rmse or 0.0) / rmse if rmse else 1.0)
        self._is_enough = False
        return True

    def _active_tiles(self) -> Iterator[tuple[TileSums, Blocks]]:
        """The tiles with active blocks, one by one in the renderer, with their blocks and those around."""
        for sums in self._sums:
            around = self._around(sums)
            if around.active.any():
                sums.take_turn()
                yield sums, around

    def _around(self, sums: TileSums) -> Blocks:
        return self._blocks.around(sums.tile, sums.area)

    def _measured(self, measure: Callable[[Blocks], NDArray[np.float32]]) -> NDArray[np.float32]:
        """Apply `measure` to the blocks of each tile, and join the results; 0 in tiles without active blocks."""
        joined = np.zeros(0, np.float32)
        for sums, around in self._active_tiles():
            measured = measure(around)
            if around is self._blocks:
                return measured
            if not len(joined):
                joined = np.zeros((*self._blocks.active.shape, *measured.shape[2:]), np.float32)
            joined[self._blocks.where(sums.tile)] = measured[around.where(sums.tile)]
        return joined

    def _counts(self, blocks: Blocks) -> Counts:
        """The numbers of samples of some blocks."""
        return blocks.samples if self._chooses else self.samples

    def stop_measuring(self) -> None:
        """Go on without measurements, and so without an error."""
        self._measurements = self._statistics = None

    @property
    def knows_error(self) -> bool:
        """Whether anything is known of the error (yet)."""
        return self._known is not None

    @property
    def _known(self) -> BlockStatistics | None:
        """The statistics, once they tell an error."""
        return self._statistics if self.samples >= 2 else None

    def _rmse(self) -> float | None:
        """The estimate of the part's root mean square error; None where it is not known (yet)."""
        statistics, blocks, part = self._known, self._blocks, self._part
        if statistics is None:
            return None
        return statistics.rmse(blocks.samples, blocks.part(part), part[2] * part[3])

    def estimate(self, seconds: float) -> Estimate | None:
        """The estimate of the part's error, whose samples took `seconds`; None where it is not known (yet)."""
        statistics, blocks, part, max_error = self._known, self._blocks, self._part, self._options.max_error
        if statistics is None:
            return None
        samples = float(np.mean(self._samples))
        return statistics.estimate(blocks.samples, blocks.part(part), part[2:], samples, seconds, max_error)

    @property
    def _samples(self) -> Counts:
        """The number of samples of the part's pixels: (H, W), the top row first, or of all alike."""
        return self._blocks.samples_in(self._part) if self._chooses else self.samples

    def read(self, mean: NDArray[np.float32], deviation: NDArray[np.float32] | None = None) -> Counts:
        """Read the mean of the samples so far into `mean` (H, W, 3), and the root of their variance, summed over
        channels, into `deviation` (H, W), if there is such an array.

        Returns the number of samples: (H, W), or of all alike. Arrays have the top row first.
        """
        x, y, _, height = self._part
        is_even = self.samples == 1 or not self._chooses
        for sums in self._sums:
            sums.take_turn()
            tile = sums.tile
            where = place((tile[0] - x, tile[1] - y, *tile[2:]), height)
            sums.read_mean(self.samples if is_even else self._blocks, mean[where])
            if self._light_scale != 1.0:
                mean[where] /= np.float32(self._light_scale)
            if deviation is not None:
                assert self._measurements
                variance = sums.variance(self._counts(self._around(sums)), self._measurements)
                deviation[where] = self._deviation(variance, mean[where])
        return self._samples

    def _deviation(self, variance: NDArray[np.float32], mean: NDArray[np.float32]) -> NDArray[np.float32]:
        """(H, W): the root of the `variance` of pixels' samples, unscaled."""
        deviation = np.sqrt(variance)
        if self._light_scale != 1.0:
            deviation /= np.float32(self._light_scale)
        if not math.isfinite(deviation.max(initial=0.0)):
            # Squares overflowed. Samples that are not negative deviate by less than the root of their number times the
            # mean.
            bound = math.sqrt(self.samples) * np.linalg.norm(mean.astype(np.float64), axis=-1)
            deviation = np.where(np.isfinite(deviation), deviation, np.minimum(bound, np.finfo(np.float32).max))
        return deviation
