"""Programs, uniforms, passes, read-back: a Scene to an Image on the GPU."""

from __future__ import annotations

import math
import time
from contextlib import ExitStack, closing
from functools import partial
from typing import Any

import msgspec
import numpy as np

from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.frame import make_frame
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.rendering.accumulation import Accumulation, complete, is_measured, margin
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import TileStatistics, estimate
from raytracer.rendering.geometry import DrawnGeometry, View
from raytracer.rendering.programs import find_programs
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tiles import TILE, place, split, tile_size
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Samples of all pixels together, adaptive ones as if none were left out: a picture of fewer gains less by a program for
# plane-only cells than it takes to compile.
_WORTH_PLANE_ONLY = 2**20


def metadata(
    scene: Scene, size: tuple[int, int], settings: Settings, estimate: Estimate | None = None
) -> dict[str, str]:
    """What a picture's file says of it."""
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
    if settings.sequence != "sobol":
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
        only: bool = False,
        estimates: bool = True,
    ) -> Image:
        """An image of `scene`; `tile` is the side of the largest target in pixels. Else as `render()`.

        `only`: it is the process's only one, so programs that take longer to compile than they save are done without.
        Without `estimates` it is not told how wrong it is, unless that is what samples are taken for.
        """
        options = settings.sampling
        estimates |= options.has_stopping_rule
        statistics: list[TileStatistics] = []
        pixels, count = 0, 0.0
        compiled = compile(scene, settings.compile_options)
        self.device.limits.check(compiled)
        width, height = size
        around = margin(options)
        tile = min(tile, self.device.limits.target - 2 * around)
        source: Any = DrawnGeometry(self.device, View(compiled, size, tile)) if geometry else None
        image = Image(
            radiance=np.empty((height, width, 3), np.float32),
            depth=source,
            normal=source,
            material=source,
            samples=np.empty((height, width), np.int32) if options.is_adaptive else None,
            error=np.empty((height, width), np.float32) if geometry and estimates else None,
        )
        shape = tile_size(size, tile, is_drawn_once=settings.samples == 1)
        tiles = list(split(size, shape))
        target = min(width, shape[0] + 2 * around), min(height, shape[1] + 2 * around)
        with self.device.turn(), ExitStack() as stack:
            renderer = stack.enter_context(closing(TileRenderer(self.device, target, one_shot=True)))
            plane_only = not only or width * height * settings.samples >= _WORTH_PLANE_ONLY
            frame = make_frame(compiled, size, self.device.limits, plane_only=plane_only)
            renderer.load(find_programs(self.device, compiled, plane_only=plane_only), frame)
            measurements = None
            if is_measured(options, estimates=estimates):
                measurements = BlockMeasurements(self.device, renderer.player, target)
            if options.time is not None:
                renderer.warm()
                if measurements:
                    measurements.warm()
            begin = time.perf_counter()
            for i, rectangle in enumerate(tiles):
                accumulation = Accumulation(renderer, measurements, options, rectangle, size, estimates=estimates)
                done = partial(_add_progress, progress, i * settings.samples, len(tiles) * settings.samples)
                # Until when this tile's share, and those of all before it, is over.
                pixels += rectangle[2] * rectangle[3]
                until = math.inf
                if options.time is not None:
                    until = begin + options.time * pixels / (width * height)
                complete(accumulation, until, done)
                result = accumulation.result(errors=image.error is not None)
                where = place(rectangle, height)
                image.radiance[where] = result.mean
                count += np.mean(result.samples) * rectangle[2] * rectangle[3]
                if result.statistics:
                    statistics.append(result.statistics)
                if image.samples is not None:
                    image.samples[where] = result.samples
                if image.error is not None:
                    image.error[where] = np.nan if result.error is None else result.error
            took = time.perf_counter() - begin
        samples = float(count) / (width * height)
        if len(statistics) == len(tiles):
            error = estimate(statistics, size, samples, took)
        else:
            error = Estimate(samples, took, unknown=_why_unknown(settings, estimates))
        return msgspec.structs.replace(image, estimate=error, metadata=metadata(scene, size, settings, error))


def _add_progress(progress: Progress | None, before: int, total: int, done: int) -> None:
    if progress:
        progress(before + done, total)
