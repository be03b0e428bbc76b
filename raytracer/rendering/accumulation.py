"""The samples of one tile, drawn one by one until the stopping rule ends them: for render() and for the window."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.draws import SUMMED, TOGETHER, sample_at
from raytracer.compiler.meshes import Mask, Rectangle
from raytracer.rendering import stopping_rule
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import (
    TileStatistics,
    after_look,
    before_any_look,
    is_look_due,
    pixel_errors,
    tile_statistics,
)
from raytracer.rendering.pixel_blocks import MARGIN, Blocks, surrounded
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.options import SamplingOptions

# The time that reading a tile takes is taken longer than it was, as what comes after it takes some, too.
_READING = 1.25


def is_measured(options: SamplingOptions, *, estimates: bool) -> bool:
    """Whether samples of a tile need measurements: to choose blocks, or for `estimates` of the error."""
    return stopping_rule.chooses_blocks(options) or (estimates and options.estimates_error)


def margin(options: SamplingOptions) -> int:
    """The most pixels that are drawn around a tile."""
    return MARGIN if stopping_rule.chooses_blocks(options) else 0


class TileResult(NamedTuple):
    """The result of one tile. Arrays have the top row first."""

    mean: NDArray[np.floating]  # (H, W, 3)
    samples: NDArray[np.int32] | int  # (H, W), or of all alike
    statistics: TileStatistics | None  # None where nothing tells the error
    error: NDArray[np.float32] | None  # (H, W)


class Accumulation:
    """The samples of one tile of a picture of `size`, in the targets of `tiles`.

    `measurements` tell the tile's error, unless no `estimates` are wanted, and choose where samples go on; without them
    nothing does either. With `always_estimates` the error is known from 2 samples on, else at the end.
    """

    def __init__(
        self,
        tiles: TileRenderer,
        measurements: BlockMeasurements | None,
        options: SamplingOptions,
        tile: Rectangle,
        size: tuple[int, int],
        *,
        estimates: bool = True,
        always_estimates: bool = False,
    ) -> None:
        self._tiles, self._measurements, self._options = tiles, measurements, options
        self._tile = tile
        self._chooses = measurements is not None and stopping_rule.chooses_blocks(options)
        area = surrounded(tile, size) if self._chooses else tile
        self._seen = cells = tiles.seen_cells(area)
        self._blocks = Blocks.all_of(area, cells)
        self._spare: Mask | None = None
        self._statistics = None
        if measurements and options.estimates_error and (estimates or options.has_stopping_rule):
            self._statistics = before_any_look(cells, is_sparse=not options.has_stopping_rule)
        self._looks_always = always_estimates or options.is_adaptive
        self._light_scale = 1.0  # times which light the sums are of
        self._kept = 0  # of how many samples the sums are kept
        self._total: Any = None  # (H, W, 3): the sums of the area's samples that were read
        self._variance: NDArray[np.float32] | None = None  # (H, W), the lowest row first: of the first of them
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
        """The blocks of the tile's area."""
        return self._blocks

    def step(self, seconds_left: float = math.inf, *, together: bool = False) -> None:
        """Draw one more sample, and decide where more are needed, and whether; `seconds_left` are for all of them.

        If `together`, TOGETHER samples are drawn where nothing is to be decided before the last of them.

        Raises ShaderError for a mistake in the shaders of measurements, and InputError as TileRenderer.draw().
        """
        begin = time.perf_counter()
        index, options, blocks = self.samples, self._options, self._blocks
        if index and index % SUMMED == 0:
            self._read_sums()
        more = TOGETHER if together and self._can_draw_together() else 1
        samples = [sample_at(index + k, options) for k in range(more)]
        mask = None if blocks.is_whole else blocks.active
        self._tiles.draw(blocks.area, samples, mask, light_scale=self._light_scale)
        self.samples += more
        self._is_enough = self.samples == options.samples
        self._blocks = blocks.sampled(more)
        drawn = time.perf_counter()
        self.drawing_seconds = drawn - begin
        if self._measurements:
            if not index and options.samples > 1:
                self._light_scale = self._tiles.light_scale(self._measurements.brightest(blocks.area))
                if self._light_scale != 1.0:
                    self._tiles.draw(blocks.area, samples, mask, light_scale=self._light_scale)
            self._look(self._measurements)
            left = seconds_left - (time.perf_counter() - begin)
            growth = min(1.0 + left / max(drawn - begin, 1e-9) / self.samples, options.samples / self.samples)
            self._decide(self._measurements, growth)
        if self._is_look_due(self.samples):
            self._looking_seconds = time.perf_counter() - drawn

    def is_done(self, seconds_left: float = math.inf) -> bool:
        """Whether there are enough samples, or none more would be done in the seconds that are left."""
        looking = self._looking_seconds if self._is_look_due(self.samples + 1) else 0.0
        return self._is_enough or self.drawing_seconds + looking > seconds_left

    def _can_draw_together(self) -> bool:
        """Whether it saves time to draw TOGETHER more samples at once, and nothing is due before the last of them."""
        after = self.samples + TOGETHER
        # A sum ends at a multiple.
        if not self._tiles.draws_together or after > self._options.samples or after % TOGETHER:
            return False
        return not any(self._is_anything_due(n) for n in range(self.samples + 1, after))

    def _is_anything_due(self, samples: int) -> bool:
        ends = self._options.max_error is not None and stopping_rule.may_end_by_error(samples)
        return ends or self._is_look_due(samples) or stopping_rule.is_choice_due(self._options, samples)

    def _is_look_due(self, samples: int) -> bool:
        return self._statistics is not None and is_look_due(samples, self._options.samples, has_all=self._looks_always)

    def _look(self, measurements: BlockMeasurements) -> None:
        """Measure how far means moved, if that is due."""
        n, blocks, statistics = self.samples, self._blocks, self._statistics
        if statistics is None or not self._is_look_due(n):
            return
        summed = (n - 1) % SUMMED + 1
        if self._kept:
            movement = measurements.movement(blocks, n, summed, self._kept)
            self._statistics = statistics = after_look(statistics, n, movement, blocks.active)
        if 2 * n <= self._options.samples:
            watched = blocks.by_cell(statistics.watched)
            measurements.keep_sums(blocks.area, blocks.cells & watched, before=n > summed)
            self._kept = n

    def _decide(self, measurements: BlockMeasurements, growth: float) -> None:
        """Choose the blocks that get more samples, if that is due. At last there are `growth` times as many."""
        n, options, blocks = self.samples, self._options, self._blocks
        if options.max_error is not None and stopping_rule.may_end_by_error(n):
            rmse = self.rmse()
            self._is_enough |= rmse is not None and stopping_rule.is_surely_below(options.max_error, rmse, n)
        if self._is_enough or n == options.samples or not stopping_rule.is_choice_due(options, n):
            return
        choice = stopping_rule.choose_blocks(
            options,
            blocks.active,
            measurements.errors(blocks, n, (n - 1) % SUMMED + 1, self._light_scale) / self._light_scale,
            self._statistics.squared_errors(blocks.samples) / self._light_scale**2 if self._statistics else None,
            spare=self._spare,
            pixels=blocks.area[2] * blocks.area[3],
            growth=growth,
        )
        self._spare = choice.spare
        if not np.array_equal(choice.active, blocks.active):
            self._blocks = blocks.narrowed(choice.active)
            self._is_enough = not choice.active.any()

    def stop_measuring(self) -> None:
        """Go on without measurements, and so without an error."""
        self._measurements = self._statistics = None

    def rmse(self) -> float | None:
        """The estimate of the tile's root mean square error; None where it is not known (yet)."""
        if self._statistics is None or self.samples < 2:
            return None
        part = self._blocks.part(self._tile)
        return self._statistics.rmse(self._blocks.samples, part, self._tile[2] * self._tile[3]) / self._light_scale

    def statistics(self) -> TileStatistics | None:
        """The squared errors of the tile; None where they are not known (yet)."""
        if self._statistics is None or self.samples < 2:
            return None
        blocks = self._blocks
        scaled = tile_statistics(self._statistics, blocks.samples, blocks.part(self._tile), blocks.area[:2])
        square = self._light_scale**2
        return scaled._replace(
            total=scaled.total / square, fourth=scaled.fourth / square**2, worst=scaled.worst / square
        )

    def mean_samples(self) -> float:
        """The number of samples that a pixel of the tile got on average."""
        return float(self._blocks.samples_in(self._tile).mean()) if self._chooses else float(self.samples)

    def result(self, *, errors: bool, out: NDArray[np.float32] | None = None) -> TileResult:
        """The mean of the samples so far, in the array `out` if there is one; with `errors` each pixel's error, too."""
        tile, area, blocks = self._tile, self._blocks.area, self._blocks
        # The tile's part of the area, from the area's top.
        x, top = tile[0] - area[0], area[1] + area[3] - tile[1] - tile[3]
        where = slice(top, top + tile[3]), slice(x, x + tile[2])
        samples = blocks.samples_in(tile) if self._chooses else self.samples
        count = blocks.divisors_in(tile) if self._chooses else self.samples
        if self._light_scale != 1.0:
            count = count * self._light_scale
        is_direct = self._total is None and area == tile and out is not None and out.flags.c_contiguous
        sums = self._sums_so_far(out if is_direct else None)
        is_mean = is_direct and self.samples == 1 and self._light_scale == 1.0
        mean = sums if is_mean else np.divide(sums[where], count, out=out, casting="same_kind")
        statistics, error = self.statistics(), None
        if statistics and errors:
            variance = self._variance if self._variance is not None else self._variance_so_far()
            error = _pixel_errors(variance[::-1][where], samples, statistics, mean, self._light_scale)
        return TileResult(mean, samples, statistics, error)

    def _read_sums(self) -> None:
        """Read the sums before new ones begin."""
        total = self._sums_so_far()
        if self._statistics is not None and self._variance is None:
            self._variance = self._variance_so_far()
        self._total = total
        self._tiles.write_sums_before(total)

    def _sums_so_far(self, out: NDArray[np.float32] | None = None) -> Any:
        """(H, W, 3): the sums of all samples of the area.

        They are read into the array `out`, if there is one and none were read before.
        """
        sums = self._tiles.read_sums((0, 0, *self._blocks.area[2:]), out)
        # A second part makes it float64. Until then that would change no bit of the quotient.
        return sums if self._total is None else np.add(self._total, sums, dtype=np.float64)

    def _variance_so_far(self) -> NDArray[np.float32]:
        """(H, W), the lowest row first: the variance of the area's samples, of which there are at most SUMMED."""
        assert self._measurements
        samples = self._blocks.samples if self._chooses else self.samples
        return self._measurements.variance(self._blocks.area, self._seen, samples)


def _pixel_errors(
    variance: NDArray[np.float32],
    samples: NDArray[np.int32] | int,
    statistics: TileStatistics,
    mean: NDArray[np.floating],
    light_scale: float,
) -> NDArray[np.float32]:
    """(H, W): the error of each pixel. The `variance` (H, W) of its samples is times light_scale^2, or infinite."""
    overflows = None
    if math.isinf(variance.max(initial=0.0)):
        overflows = np.isinf(variance)
        variance = np.where(overflows, np.float32(0.0), variance)
    error = pixel_errors(variance, samples, statistics.scales)
    if light_scale != 1.0:
        error /= np.float32(light_scale)
    if overflows is not None:
        # The standard error of a mean of numbers that are not negative is at most the mean.
        error[overflows] = np.sqrt(np.mean(np.square(mean[overflows], dtype=np.float64), axis=-1))
    return error


def complete(accumulation: Accumulation, until: float, progress: Callable[[int], None]) -> None:
    """Draw all samples of a tile, which is to be read by the time `until`. `progress` gets their number so far."""
    reading = 0.0
    while True:
        # A second part of the sum is read besides, and added in float64.
        end = until - (reading if accumulation.samples < SUMMED else 2.0 * reading)
        accumulation.step(end - time.perf_counter(), together=until == math.inf)
        if accumulation.samples == 1 and until < math.inf and not accumulation.is_done(until - time.perf_counter()):
            begin = time.perf_counter()
            accumulation.result(errors=True)
            reading = _READING * (time.perf_counter() - begin)
            end = until - reading
        if accumulation.is_done(end - time.perf_counter()):
            break
        progress(accumulation.samples)
    progress(accumulation.options.samples)
