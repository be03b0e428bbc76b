"""The renderer: a scene becomes an image on one device."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import closing
from functools import partial
from typing import Any

import numpy as np

from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.meshes import Rectangle
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Program
from raytracer.rendering.accumulation import Accumulation, TileResult, complete, is_measured, margin
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import TileStatistics, estimate
from raytracer.rendering.geometry import DrawnGeometry, GeometryRequest
from raytracer.rendering.programs import find_programs
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tiles import TILE, place, split, tile_size
from raytracer.scene.options import SamplingOptions
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SEQUENCES
from raytracer.scene.settings import Settings

# Samples of all pixels together, adaptive ones as if none were left out: a picture of fewer gains less by a program for
# plane-only cells than it takes to compile.
_WORTH_PLANE_ONLY = 2**20


def metadata(
    scene: Scene, size: tuple[int, int], settings: Settings, estimate: Estimate | None = None
) -> dict[str, str]:
    """The text in a picture's file: names and values."""
    from raytracer.version import __version__

    text = {
        "Title": scene.name,
        "Software": f"raytracer {__version__}",
        "Description": f"{size[0]}x{size[1]}, {settings}",
    }
    if estimate:
        text |= {"Samples": f"{estimate.samples:.6g}", "Seconds": f"{estimate.seconds:.3g}", "Error": str(estimate)}
    return text


def _why_unknown(settings: Settings, estimates: bool) -> str:
    """Why a picture does not know its error."""
    if not SEQUENCES[settings.sequence].estimates_error:
        return f"samples of the sequence {settings.sequence} do not tell it"
    if not estimates:
        return "not asked for"
    return "1 sample a pixel" if settings.samples == 1 else "some pixels got 1 sample, for want of time"


class Renderer:
    """Renders scenes on one device."""

    def __init__(self, device: Device) -> None:
        self.device = device

    def render(
        self,
        scene: Scene,
        size: tuple[int, int],
        settings: Settings,
        *,
        geometry: bool = True,
        progress: Progress | None = None,
        tile: int = TILE,
        single_picture: bool = False,
        estimates: bool = True,
    ) -> Image:
        """Render `scene` as `rt.render()` does. `tile` is the side of the largest target in pixels.

        A `single_picture` is the process's only one: programs that take longer to compile than they save are left out.
        Without `estimates` the image has no estimate of its error, unless samples are taken by the estimate.
        """
        options, (width, height) = settings.sampling, size
        estimates |= options.has_stopping_rule
        compiled = compile(scene, settings.compile_options)
        self.device.limits.check(compiled)
        tile = min(tile, self.device.limits.target - 2 * margin(options))
        arrays = _Arrays(size, is_adaptive=options.is_adaptive, has_errors=geometry and estimates)
        # Plane-only cells have a program of their own where that saves more than its compilation takes.
        plane_only = not single_picture or width * height * options.samples >= _WORTH_PLANE_ONLY
        with self.device.turn():
            frame = make_frame(compiled, size, self.device.limits, plane_only=plane_only)
            programs = find_programs(self.device, compiled, plane_only=plane_only)
            seconds = _draw(self.device, programs, frame, options, tile, arrays, progress, estimates=estimates)
        source: Any = DrawnGeometry(self.device, GeometryRequest(compiled, size, tile)) if geometry else None
        error = arrays.estimate(seconds, _why_unknown(settings, estimates))
        return Image(
            arrays.radiance,
            depth=source,
            normal=source,
            material=source,
            samples=arrays.samples,
            error=arrays.error,
            estimate=error,
            metadata=metadata(scene, size, settings, error),
        )


class _Arrays:
    """The arrays of a picture, filled tile by tile, and the statistics of its tiles."""

    def __init__(self, size: tuple[int, int], *, is_adaptive: bool, has_errors: bool) -> None:
        self.size = size
        shape = size[1], size[0]
        self.radiance = np.empty((*shape, 3), np.float32)
        self.samples = np.empty(shape, np.int32) if is_adaptive else None
        self.error = np.empty(shape, np.float32) if has_errors else None
        self._statistics: list[TileStatistics | None] = []
        self._count = 0.0  # of the samples of all pixels

    def add(self, tile: Rectangle, result: TileResult) -> None:
        """Take the result of a tile."""
        rows_columns = place(tile, self.size[1])
        self.radiance[rows_columns] = result.mean
        if self.samples is not None:
            self.samples[rows_columns] = result.samples
        if self.error is not None:
            self.error[rows_columns] = np.nan if result.error is None else result.error
        self._count += float(np.mean(result.samples) * tile[2] * tile[3])
        self._statistics.append(result.statistics)

    def estimate(self, seconds: float, why_unknown: str) -> Estimate:
        """The estimate of the picture's error, which took `seconds` to draw."""
        samples = self._count / (self.size[0] * self.size[1])
        known = [statistics for statistics in self._statistics if statistics]
        if len(known) < len(self._statistics):
            return Estimate(samples, seconds, unknown=why_unknown)
        return estimate(known, self.size, samples, seconds)


def _draw(
    device: Device,
    programs: Mapping[str, Program],
    frame: Frame,
    options: SamplingOptions,
    side: int,
    arrays: _Arrays,
    progress: Progress | None,
    *,
    estimates: bool,
) -> float:
    """Draw a frame into `arrays`, in tiles of at most `side` pixels a side; the seconds without those of compilers."""
    size = width, height = frame.size
    largest = tile_size(size, side, is_drawn_once=options.samples == 1)
    tiles = list(split(size, largest))
    around = 2 * margin(options)
    target = min(width, largest[0] + around), min(height, largest[1] + around)
    with closing(TileRenderer(device, target, one_shot=True)) as renderer:
        renderer.load(programs, frame)
        is_needed = is_measured(options, estimates=estimates)
        measurements = BlockMeasurements(device, renderer.player, target) if is_needed else None
        if options.time is not None:
            renderer.warm()
            if measurements:
                measurements.warm()
        begin, pixels = time.perf_counter(), 0
        for i, tile in enumerate(tiles):
            accumulation = Accumulation(renderer, measurements, options, tile, size, estimates=estimates)
            # The end of the time of this tile and of all tiles before it, each with its share.
            pixels += tile[2] * tile[3]
            until = math.inf if options.time is None else begin + options.time * pixels / (width * height)
            done = partial(_add_progress, progress, i * options.samples, len(tiles) * options.samples)
            complete(accumulation, until, done)
            arrays.add(tile, accumulation.result(errors=arrays.error is not None))
        return time.perf_counter() - begin


def _add_progress(progress: Progress | None, before: int, total: int, done: int) -> None:
    if progress:
        progress(before + done, total)
