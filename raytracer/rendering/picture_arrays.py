"""The arrays of a picture, filled tile by tile, or with a stopping rule for the whole picture at once."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.draws import SAMPLES_PER_SUM
from raytracer.compiler.features import Features
from raytracer.compiler.meshes import Rectangle
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.rendering import replicate
from raytracer.rendering.accumulation import Accumulation
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tiles import place
from raytracer.scene.options import SamplingOptions
from raytracer.scene.sequences import SEQUENCES

# The time reserved for the read-back and the replicate of a picture, over the time that they took in a first trial:
# later steps take time, too.
_RESERVE = 1.25
_WHY_ONE_SAMPLE = "1 sample per pixel"
_WHY_NO_TIME = "the time was enough for only 1 sample in some pixels"


class PictureArrays:
    """The arrays of a `part` of a picture, the top row first.

    `features` are the small bright features of the part; None: no error estimate is needed. `transparent`: whether the
    picture has an alpha.
    """

    def __init__(
        self, part: Rectangle, options: SamplingOptions, features: Features | None, *, transparent: bool = False
    ) -> None:
        shape = part[3], part[2]
        self.part = part
        self.options = options
        self.radiance = np.empty((*shape, 3), np.float32)
        self.alpha = np.empty(shape, np.float32) if transparent else None
        self.samples = np.empty(shape, np.int32) if options.is_adaptive else None
        # The root of the variance of a pixel's samples, summed over channels.
        self.deviation = np.empty(shape, np.float32) if features is not None and options.estimates_error else None
        self._features = features
        self._fewest = 0  # the fewest samples of a pixel
        # If the user set a time: seconds reserved for the read-back of a sum, and for one sample of the replicate.
        self._reading_seconds = self._replicate_seconds = 0.0
        self._measurement: replicate.Measurement | None = None

    def draw(
        self,
        renderer: TileRenderer,
        measurements: BlockMeasurements | None,
        tiles: Sequence[Rectangle],
        size: tuple[int, int],
        progress: Progress | None,
    ) -> float:
        """Draw all tiles of a picture of `size`, and return the duration in seconds, without compilation.

        With a stopping rule, which decides on the whole part, all tiles get their samples together; without, one tile
        after the other.
        """
        if self.options.time is not None:
            renderer.warm()
            if measurements:
                measurements.warm()
        begin = time.perf_counter()
        if self.options.has_stopping_rule:
            self._draw_by_rule(renderer, measurements, tiles, progress)
        else:
            for i, tile in enumerate(tiles):
                accumulation = Accumulation(renderer, measurements, self.options, tile, [tile], (0, 0, *size))
                self._complete(
                    renderer, accumulation, tile, math.inf, partial(_report_progress, progress, i, len(tiles))
                )
            for _ in self.measure(renderer, tiles):
                pass
        return time.perf_counter() - begin

    def _draw_by_rule(
        self,
        renderer: TileRenderer,
        measurements: BlockMeasurements | None,
        tiles: Sequence[Rectangle],
        progress: Progress | None,
    ) -> None:
        """Add samples until the error measured by a replicate is small enough, or samples or time are used up."""
        options, part = self.options, self.part
        until = math.inf if options.time is None else time.perf_counter() + options.time
        accumulation = Accumulation(renderer, measurements, options, part, tiles, part, features=self._features)
        while True:
            self._complete(renderer, accumulation, part, until, partial(_report_progress, progress, 0, 1))
            for _ in self.measure(renderer, tiles):
                pass
            if not accumulation.resume(self.estimate(0.0), self._seconds_left(accumulation, until)):
                break
        renderer.drop_others()

    def _complete(
        self,
        renderer: TileRenderer,
        accumulation: Accumulation,
        part: Rectangle,
        until: float,
        progress: Callable[[int, int], None],
    ) -> None:
        """Draw all samples of a part and read them, early enough to measure their error by the time `until`.

        `progress` gets the number of samples so far, and the number that the part probably needs.
        """
        while True:
            accumulation.step(self._seconds_left(accumulation, until), together=until == math.inf)
            if accumulation.samples == 1 and until < math.inf and not accumulation.is_done(until - time.perf_counter()):
                begin = time.perf_counter()
                self.read(accumulation, part)
                self._reading_seconds = _RESERVE * (time.perf_counter() - begin)
                self._replicate_seconds = _RESERVE * replicate.replicate_seconds(renderer, part)
            if accumulation.is_done(self._seconds_left(accumulation, until)):
                break
            progress(accumulation.samples, accumulation.expected_samples(until - time.perf_counter()))
        progress(self.options.samples, self.options.samples)
        self.read(accumulation, part)

    def _seconds_left(self, accumulation: Accumulation, until: float) -> float:
        """Return the seconds left for samples, if the read-back and the replicate must end by the time `until`."""
        # From SAMPLES_PER_SUM samples on, the sum has a second part, which is read and added in float64.
        parts = 1 if accumulation.samples < SAMPLES_PER_SUM else 2
        reserve = parts * self._reading_seconds + (accumulation.samples + 1) * self._replicate_seconds
        return until - reserve - time.perf_counter()

    def read(self, accumulation: Accumulation, part: Rectangle) -> None:
        """Read the samples of a part into the arrays."""
        where = place(part, self.part)
        others = (None if array is None else array[where] for array in (self.deviation, self.alpha))
        samples = accumulation.read(self.radiance[where], *others)
        if self.samples is not None:
            self.samples[where] = samples
        self._fewest = samples if isinstance(samples, int) else int(samples.min())

    @property
    def _spread(self) -> replicate.Spread | None:
        """The spread of the samples; None if the samples do not support an error estimate."""
        if self.deviation is None or self._fewest < 2:
            return None
        return replicate.Spread(self.deviation, self._fewest if self.samples is None else self.samples)

    def measure(self, renderer: TileRenderer, tiles: Sequence[Rectangle]) -> Iterator[None]:
        """Measure the error of the picture in the arrays. Yields after each step."""
        spread = self._spread
        if spread:
            self._measurement = yield from replicate.measure(renderer, tiles, self.part[:2], self.radiance, spread)

    def estimate(self, seconds: float) -> Estimate:
        """Estimate the error of the picture, which took `seconds` to draw."""
        samples = float(self._fewest if self.samples is None else self.samples.mean())
        spread, max_error = self._spread, self.options.max_error
        if spread is None or self._measurement is None or self._features is None:
            return Estimate(samples, seconds, unknown=self._reason_unknown(), max_error=max_error)
        unseen = self._features.missed_error(spread.samples)
        return replicate.estimate(self._measurement, spread, unseen, samples, seconds, max_error)

    def errors(self) -> NDArray[np.float32]:
        """Return the error of each pixel, nan if it is unknown (H, W)."""
        spread = self._spread
        if spread is None or self._measurement is None:
            return np.full(self.radiance.shape[:2], np.nan, np.float32)
        return replicate.pixel_errors(self._measurement, spread)

    def _reason_unknown(self) -> str:
        if not SEQUENCES[self.options.sequence].estimates_error:
            return f"the sequence {self.options.sequence} does not support an error estimate"
        if self._features is None:
            return "not requested"
        return _WHY_ONE_SAMPLE if self.options.samples == 1 else _WHY_NO_TIME


def _report_progress(progress: Progress | None, part: int, parts: int, done: int, most: int) -> None:
    """Report progress: `done` of about `most` samples of the part with the index `part`, of `parts` parts."""
    if progress:
        progress(part * most + done, parts * most)
