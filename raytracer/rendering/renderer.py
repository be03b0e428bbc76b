"""Programs, uniforms, passes, read-back: a Scene to an Image on the GPU."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from functools import partial

import msgspec
import numpy as np

from raytracer.compiler.batches import groups
from raytracer.compiler.culling import has_quiet
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.draws import SUMMED, sample_at
from raytracer.compiler.glsl.preprocessor import Source, assemble
from raytracer.compiler.glsl.shaders import (
    Show,
    is_listed,
    is_over_planes,
    kinds_source,
    plain_vertex_source,
    quiet_source,
    show_source,
    vertex_source,
    visibility_source,
)
from raytracer.compiler.meshes import EMPTY, PLANE_ONLY, SEE, SHADE, SHAPES, Rectangle
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Program
from raytracer.rendering.accumulation import Accumulation, is_measured, margin
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import TileStatistics, estimate
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.options import SamplingOptions
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Side of a tile in pixels. A tile's targets take up to 60 bytes a pixel, 252 MB at this size.
TILE = 2048
# Samples of all pixels together, adaptive ones as if none were left out: a picture of fewer gains less by a program for
# plane-only cells than it takes to compile.
_WORTH_PLANE_ONLY = 2**20
# Pixels of a tile of a picture with 1 sample: rows of cells in the processor's cache.
_STRIP = 2**18
# The time that reading a tile takes is taken longer than it was, as what comes after it takes some, too.
_READING = 1.25


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
        self.device.limits.check(scene, settings)
        width, height = size
        around = margin(options)
        tile = min(tile, self.device.limits.target - 2 * around)
        if tile > CELL:
            tile = tile // CELL * CELL
        image = Image(
            radiance=np.empty((height, width, 3), np.float32),
            depth=np.empty((height, width), np.float32) if geometry else None,
            normal=np.empty((height, width, 3), np.float32) if geometry else None,
            material=np.empty((height, width), np.int32) if geometry else None,
            samples=np.empty((height, width), np.int32) if options.is_adaptive else None,
            error=np.empty((height, width), np.float32) if geometry and estimates else None,
        )
        # What is drawn only once costs less than the memory that it is drawn into, the first time that is used.
        rows = tile if settings.samples > 1 else max(CELL, _STRIP // min(width, tile) // CELL * CELL)
        shape = min(width, tile), min(height, tile, rows)
        tiles = list(_tiles(size, shape))
        target = min(width, shape[0] + 2 * around), min(height, shape[1] + 2 * around)
        with self.device.turn(), ExitStack() as stack:
            if geometry:
                self._find_geometry(image, scene, settings, tiles, shape)
            tile_renderer = stack.enter_context(closing(TileRenderer(self.device, target, one_shot=True)))
            plane_only = not only or width * height * settings.samples >= _WORTH_PLANE_ONLY
            tile_renderer.load(self.programs(scene, settings, plane_only=plane_only), scene, settings, size)
            measurements = None
            if is_measured(options, estimates=estimates):
                measurements = BlockMeasurements(self.device, tile_renderer.player, target)
            if options.time is not None:
                tile_renderer.warm()
                if measurements:
                    measurements.warm()
            begin = time.perf_counter()
            for i, rectangle in enumerate(tiles):
                accumulation = Accumulation(tile_renderer, measurements, options, rectangle, size, estimates=estimates)
                done = partial(_add_progress, progress, i * settings.samples, len(tiles) * settings.samples)
                # Until when this tile's share, and those of all before it, is over.
                pixels += rectangle[2] * rectangle[3]
                until = math.inf
                if options.time is not None:
                    until = begin + options.time * pixels / (width * height)
                _draw_samples(accumulation, options, until, done)
                result = accumulation.result(errors=image.error is not None)
                where = _place(rectangle, size)
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

    def _find_geometry(
        self,
        image: Image,
        scene: Scene,
        settings: Settings,
        tiles: Sequence[Rectangle],
        target: tuple[int, int],
    ) -> None:
        """Fill in what the centre rays of an image's pixels see."""
        size = image.radiance.shape[1], image.radiance.shape[0]
        settings = msgspec.structs.replace(settings, samples=1, sequence="sobol")  # that sample is the centre
        with closing(TileRenderer(self.device, target, geometry=True)) as tile_renderer:
            tile_renderer.load(self.programs(scene, settings, None), scene, settings, size)
            for rectangle in tiles:
                tile_renderer.draw(rectangle, sample_at(0, settings.sampling))
                tile_renderer.read_geometry(image, _place(rectangle, size))

    def programs(
        self, scene: Scene, settings: Settings, show: Show | None = "picture", *, plane_only: bool = True
    ) -> dict[str, Program]:
        """The programs that draw `scene`, by their names (compiler/meshes.py). The device's context must be current.

        With `show` None they draw only what each pixel sees. Without `plane_only`, plane-only cells that are not empty
        are drawn as all others are.
        """
        sources = _sources(scene, settings, show, self.device.limits.varyings, plane_only=plane_only)
        return {name: self.device.program(*source) for name, source in sources.items()}

    def has_programs(self, scene: Scene, settings: Settings, show: Show | None = "picture") -> bool:
        """Whether programs() compiles nothing. Raises ShaderError as that does."""
        sources = _sources(scene, settings, show, self.device.limits.varyings, plane_only=True).values()
        return all(self.device.has_program(*source) for source in sources)


def _draw_samples(
    accumulation: Accumulation, options: SamplingOptions, until: float, done: Callable[[int], None]
) -> None:
    """Draw all samples of a tile, within the time `until` which it must be read. `done` is told how many there are."""
    reading = 0.0
    while True:
        # A second part of the sum is read besides, and added in float64.
        end = until - (reading if accumulation.samples < SUMMED else 2.0 * reading)
        accumulation.step(end - time.perf_counter())
        if accumulation.samples == 1 and until < math.inf and not accumulation.is_done(until - time.perf_counter()):
            begin = time.perf_counter()
            accumulation.result(errors=True)
            reading = _READING * (time.perf_counter() - begin)
            end = until - reading
        if accumulation.is_done(end - time.perf_counter()):
            break
        done(accumulation.samples)
    done(options.samples)


def _sources(
    scene: Scene, settings: Settings, show: Show | None, varyings: int, *, plane_only: bool
) -> dict[str, tuple[Source, Source]]:
    """The fragment and the vertex shader of each of the programs that draw `scene`, by its name."""
    sources: dict[str, tuple[Source, Source]] = {}
    cells = vertex_source(scene, settings, varyings)
    if show != "picture" or not is_over_planes(scene, settings):
        sources[SEE] = visibility_source(scene, settings, varyings, geometry=show != "picture"), cells
    if show:
        sources[SHADE] = show_source(scene, settings, show, varyings), cells
    if is_listed(scene, settings) and groups(scene).kinds:
        vertex, fragment = kinds_source(scene, settings, varyings, geometry=show != "picture")
        sources[SHAPES] = fragment, vertex
    if show == "picture" and has_quiet(scene, settings):
        if plane_only and groups(scene).planes:
            sources[PLANE_ONLY] = quiet_source(scene, settings, varyings), cells
        sources[EMPTY] = assemble("passes/empty.frag"), plain_vertex_source()
    return sources


def _add_progress(progress: Progress | None, before: int, total: int, done: int) -> None:
    if progress:
        progress(before + done, total)


def _place(tile: Rectangle, size: tuple[int, int]) -> tuple[slice, slice]:
    """A tile's rows and columns in arrays with the top row first."""
    x, y, width, height = tile
    return slice(size[1] - y - height, size[1] - y), slice(x, x + width)


def _tiles(size: tuple[int, int], tile: tuple[int, int]) -> Iterator[Rectangle]:
    """The tiles of a picture, from the top row down; `tile` is the size of the largest."""
    width, height = size
    # Counted from the lowest row, as the cells and blocks are that they consist of.
    for y in reversed(range(0, height, tile[1])):
        for x in range(0, width, tile[0]):
            yield x, y, min(tile[0], width - x), min(tile[1], height - y)
