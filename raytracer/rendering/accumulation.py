"""Sampling loop of a picture, or of a part of it: draws samples until the stopping rule ends it, for render() and
window.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.draws import SAMPLES_AT_ONCE, SAMPLES_PER_SUM, Sample, sample_at
from raytracer.compiler.features import Features
from raytracer.compiler.meshes import Mask, Rectangle
from raytracer.formats.estimate import Estimate
from raytracer.rendering import stopping_rule
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import BlockStatistics, P, empty_statistics, update_statistics
from raytracer.rendering.pixel_blocks import MARGIN, Blocks, surrounding_area
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tile_sums import Counts, TileSums
from raytracer.rendering.tiles import place
from raytracer.scene.options import SamplingOptions

MaybeArray = NDArray[np.float32] | None


def is_measured(options: SamplingOptions, *, estimates: bool) -> bool:
    """Whether samples must be measured: to choose blocks, or for `estimates` of the error."""
    return stopping_rule.chooses_blocks(options) or (estimates and options.estimates_error)


def margin(options: SamplingOptions) -> int:
    """Return the largest number of pixels that are drawn beyond each side of a tile."""
    return MARGIN if stopping_rule.chooses_blocks(options) else 0


class Accumulation:
    """The samples of a `part` of a picture, which consists of `tiles`.

    All tiles get a sample before any tile gets the next one, so that decisions see the blocks of all tiles together.
    `measurements` are the basis of the choice of blocks and, with a stopping rule or `always_estimates`, of the error
    estimate while samples are added. Without measurements there is neither.
    """

    def __init__(
        self,
        renderer: TileRenderer,
        measurements: BlockMeasurements | None,
        options: SamplingOptions,
        part: Rectangle,
        tiles: Sequence[Rectangle],
        bounds: Rectangle,
        *,
        features: Features | None = None,
        always_estimates: bool = False,
    ) -> None:
        """Start without samples.

        `bounds` are the pixels on which decisions may depend: the whole picture, or the part alone, so that the part
        is a picture of its own. `features` are the bright features of the part, if the options have `max_error`. Blocks
        with features that samples may have missed get more samples.
        """
        self._renderer, self._measurements, self._options = renderer, measurements, options
        self._part, self._features = part, features
        self._chooses = measurements is not None and stopping_rule.chooses_blocks(options)
        area, *areas = (surrounding_area(item, bounds) if self._chooses else item for item in (part, *tiles))
        self._sums = [TileSums(renderer, i, *item) for i, item in enumerate(zip(tiles, areas, strict=True))]
        cells = renderer.seen_cells(area)
        self._blocks = Blocks.make_all(area, cells)
        self._spare: Mask | None = None
        self._statistics: BlockStatistics | None = None
        if measurements and options.estimates_error and (always_estimates or options.has_stopping_rule):
            self._statistics = empty_statistics(self._blocks.active.shape)
        self._light_scale = 1.0  # the factor of all light in the sums
        self._correction = 1.0  # the factor that corrects the estimate's errors
        self._kept = 0  # the number of samples in the kept sums
        self._is_enough = False
        self._looking_seconds = 0.0  # duration of the last look
        self.drawing_seconds = 0.0  # duration of the last sample
        self.samples = 0

    @property
    def options(self) -> SamplingOptions:
        """The options of the samples."""
        return self._options

    @property
    def light_scale(self) -> float:
        """The power of two by which all light in the sums is multiplied."""
        return self._light_scale

    @property
    def blocks(self) -> Blocks:
        """The blocks of the part's area."""
        return self._blocks

    def step(self, seconds_left: float = math.inf, *, together: bool = False) -> None:
        """Draw one more sample, and decide whether and where more samples are needed.

        Args:
            seconds_left: the time for all further samples
            together: draw SAMPLES_AT_ONCE samples at once if no decision is due before the last of them

        Raises ShaderError for a mistake in the shaders of measurements, and InputError as TileRenderer.draw() does.
        """
        begin = time.perf_counter()
        index, options, blocks = self.samples, self._options, self._blocks
        more = SAMPLES_AT_ONCE if together and self._can_draw_together() else 1
        samples = [sample_at(index + k, options) for k in range(more)]
        for sums, around in self._active_tiles():
            if index and index % SAMPLES_PER_SUM == 0:
                sums.read_before_new(self._counts(around), self._measurements)
            sums.draw(around, samples, self._light_scale)
        self.samples += more
        self._is_enough = self.samples == options.samples
        self._blocks = blocks.add_samples(more)
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
        """Choose the scale of all light from the first `samples`, and draw them again if the scale is not 1."""
        brightest = max(measurements.brightest(around.area) for _, around in self._active_tiles())
        self._light_scale = self._renderer.light_scale(brightest)
        if self._light_scale != 1.0:
            for sums, around in self._active_tiles():
                sums.draw(around, samples, self._light_scale)

    def is_done(self, seconds_left: float = math.inf) -> bool:
        """Whether there are enough samples, or one more sample would take longer than `seconds_left`."""
        looking = self._looking_seconds if self._is_look_due(self.samples + 1) else 0.0
        return self._is_enough or self.drawing_seconds + looking > seconds_left

    def expected_samples(self, seconds_left: float = math.inf) -> int:
        """Predict the number of samples at which the part ends: by its error, by its time, or at the limit.

        The error is expected to fall as samples^-P.
        """
        most = self._options.samples
        expected = self.samples + seconds_left / max(self.drawing_seconds, 1e-9)
        rmse, max_error = self._rmse(), self._options.max_error
        if rmse is not None and max_error is not None:
            # A quotient above `most` needs more than `most` samples, and its power might overflow.
            excess = min(most, self._correction * rmse / max_error)
            expected = min(expected, self.samples * excess ** (1.0 / P))
        return round(min(max(expected, self.samples + 1), most))

    def _can_draw_together(self) -> bool:
        """Whether SAMPLES_AT_ONCE samples at once save time, and no decision is due before the last of them."""
        after = self.samples + SAMPLES_AT_ONCE
        # Samples that are drawn at once must not belong to two sums. SAMPLES_PER_SUM is a multiple of SAMPLES_AT_ONCE.
        if not self._renderer.draws_together or after > self._options.samples or after % SAMPLES_AT_ONCE:
            return False
        return not any(self._is_anything_due(n) for n in range(self.samples + 1, after))

    def _is_anything_due(self, samples: int) -> bool:
        ends = self._options.max_error is not None and stopping_rule.may_end_by_error(samples)
        return ends or self._is_look_due(samples) or stopping_rule.is_choice_due(self._options, samples)

    def _is_look_due(self, samples: int) -> bool:
        # Sobol' points are spread best if their number is a power of two.
        return self._statistics is not None and not samples & (samples - 1)

    def _look(self, measurements: BlockMeasurements) -> None:
        """Measure the movement of means, if a look is due."""
        n, blocks, statistics = self.samples, self._blocks, self._statistics
        if statistics is None or not self._is_look_due(n):
            return
        summed = (n - 1) % SAMPLES_PER_SUM + 1
        if self._kept:
            movement = self._measure_tiles(lambda around: measurements.movement(around, n, summed, self._kept))
            self._statistics = update_statistics(statistics, n, self._squares(movement), blocks.active)
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
        """Choose the blocks that get more samples, if a choice is due. `growth`: final over present samples."""
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
        errors = self._measure_tiles(
            lambda around: measurements.errors(around, n, (n - 1) % SAMPLES_PER_SUM + 1, scale)
        )
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
            # A block whose samples all missed its bright features seems to have enough samples.
            active = active | blocks.active & self._features.find_missed_blocks(
                n, options.max_error, self._part[2:], active.shape
            )
        if not active.any():
            self._is_enough = True
        elif not np.array_equal(active, blocks.active):
            self._blocks = blocks.narrow(active)

    def resume(self, measured: Estimate, seconds_left: float) -> bool:
        """Continue sampling if the `measured` error is too large and `seconds_left` allows a sample; return whether so.

        An estimate that was smaller than the measured error is scaled up to it from now on.
        """
        is_over = self.samples == self._options.samples or self.drawing_seconds >= seconds_left
        if measured.reached is not False or is_over:
            return False
        rmse = self._rmse()
        self._correction = max(self._correction, (measured.rmse or 0.0) / rmse if rmse else 1.0)
        self._is_enough = False
        return True

    def _active_tiles(self) -> Iterator[tuple[TileSums, Blocks]]:
        """Yield the tiles with active blocks, with the blocks of their areas. The renderer turns to each tile."""
        for sums in self._sums:
            around = self._surrounding_blocks(sums)
            if around.active.any():
                sums.take_turn()
                yield sums, around

    def _surrounding_blocks(self, sums: TileSums) -> Blocks:
        return self._blocks.surround(sums.tile, sums.area)

    def _measure_tiles(self, measure: Callable[[Blocks], NDArray[np.float32]]) -> NDArray[np.float32]:
        """Apply `measure` to the blocks of all tiles, and join the results: 0 in tiles without active blocks."""
        joined = np.zeros(0, np.float32)
        for sums, around in self._active_tiles():
            measured = measure(around)
            if around is self._blocks:
                return measured
            if not len(joined):
                joined = np.zeros((*self._blocks.active.shape, *measured.shape[2:]), np.float32)
            joined[self._blocks.block_slices(sums.tile)] = measured[around.block_slices(sums.tile)]
        return joined

    def _counts(self, blocks: Blocks) -> Counts:
        """Return the numbers of samples of some blocks."""
        return blocks.samples if self._chooses else self.samples

    def stop_measuring(self) -> None:
        """Continue without measurements, and so without an error estimate."""
        self._measurements = self._statistics = None

    @property
    def knows_error(self) -> bool:
        """Whether there is an error estimate (yet)."""
        return self._known is not None

    @property
    def _known(self) -> BlockStatistics | None:
        """The statistics, if there are enough samples for an error estimate."""
        return self._statistics if self.samples >= 2 else None

    def _rmse(self) -> float | None:
        """Estimate the root mean square error of the part of the picture; None if there is no estimate (yet)."""
        statistics, blocks, part = self._known, self._blocks, self._part
        if statistics is None:
            return None
        return statistics.rmse(blocks.samples, blocks.part(part), part[2] * part[3])

    def estimate(self, seconds: float) -> Estimate | None:
        """Estimate the error of the part, whose samples took `seconds`; None if there is no estimate (yet)."""
        statistics, blocks, part, max_error = self._known, self._blocks, self._part, self._options.max_error
        if statistics is None:
            return None
        samples = float(np.mean(self._samples))
        return statistics.estimate(blocks.samples, blocks.part(part), part[2:], samples, seconds, max_error)

    @property
    def _samples(self) -> Counts:
        """The numbers of samples of the part's pixels: (H, W), the top row first, or one number for all."""
        return self._blocks.samples_in(self._part) if self._chooses else self.samples

    def read(self, mean: NDArray[np.float32], deviation: MaybeArray = None, alpha: MaybeArray = None) -> Counts:
        """Read the samples so far, and return their number: (H, W), or one number for all pixels.

        `mean` is an array for the mean of the samples (H, W, 3), `deviation` for the root of their variance, summed
        over channels (H, W), and `alpha` for the coverage (H, W). The top row is first. None: not needed.
        """
        is_even = self.samples == 1 or not self._chooses
        for sums in self._sums:
            sums.take_turn()
            tile = sums.tile
            where = place(tile, self._part)
            counts = self.samples if is_even else self._blocks
            sums.read_mean(counts, mean[where])
            if alpha is not None:
                sums.read_alpha(counts, alpha[where])
            if self._light_scale != 1.0:
                mean[where] /= np.float32(self._light_scale)
            if deviation is not None:
                assert self._measurements
                variance = sums.variance(self._counts(self._surrounding_blocks(sums)), self._measurements)
                deviation[where] = self._deviation(variance, mean[where])
        return self._samples

    def _deviation(self, variance: NDArray[np.float32], mean: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the root of the `variance` of pixels' samples, without the light scale (H, W)."""
        deviation = np.sqrt(variance)
        if self._light_scale != 1.0:
            deviation /= np.float32(self._light_scale)
        if not math.isfinite(deviation.max(initial=0.0)):
            # Squares overflowed. The deviation of samples >= 0 is at most the root of their number times their mean.
            bound = math.sqrt(self.samples) * np.linalg.norm(mean.astype(np.float64), axis=-1)
            deviation = np.where(np.isfinite(deviation), deviation, np.minimum(bound, np.finfo(np.float32).max))
        return deviation
