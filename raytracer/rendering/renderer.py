"""Programs, uniforms, passes, read-back: a Scene to an Image on the GPU."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from functools import partial

import msgspec
import numpy as np

from raytracer.compiler.compiled_scene import CompiledScene, compile
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.glsl.shaders import Show, plain_vertex_source, program_sources
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.rendering.error_estimate import Moved, estimated
from raytracer.rendering.passes import Passes, Programs, Rectangle
from raytracer.rendering.sampler import Sampler
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
        estimates |= settings.asks
        moved: list[Moved] = []
        pixels, count = 0, 0.0
        compiled = compile(scene, settings.compile_options)
        self.device.limits.check(compiled)
        width, height = size
        margin = Sampler.margin(settings)
        tile = min(tile, self.device.limits.target - 2 * margin)
        if tile > CELL:
            tile = tile // CELL * CELL
        image = Image(
            radiance=np.empty((height, width, 3), np.float32),
            depth=np.empty((height, width), np.float32) if geometry else None,
            normal=np.empty((height, width, 3), np.float32) if geometry else None,
            material=np.empty((height, width), np.int32) if geometry else None,
            samples=np.empty((height, width), np.int32) if settings.refines else None,
            error=np.empty((height, width), np.float32) if geometry and estimates else None,
        )
        # What is drawn only once costs less than the memory that it is drawn into, the first time that is used.
        rows = tile if settings.samples > 1 else max(CELL, _STRIP // min(width, tile) // CELL * CELL)
        shape = min(width, tile), min(height, tile, rows)
        tiles = list(_tiles(size, shape))
        target = min(width, shape[0] + 2 * margin), min(height, shape[1] + 2 * margin)
        with self.device.turn(), ExitStack() as stack:
            plane_only = not only or width * height * settings.samples >= _WORTH_PLANE_ONLY
            frame = make_frame(compiled, size, self.device.limits, plane_only=plane_only)
            if geometry:
                self._find_geometry(image, frame, tiles, shape)
            passes = stack.enter_context(closing(Passes(self.device.context, target, once=True)))
            passes.load(self.programs(compiled, plane_only=plane_only), frame, settings.sampling)
            sampler = stack.enter_context(closing(self.sampler(settings, target, estimates=estimates)))
            if settings.time is not None:
                sampler.warm(passes)
            begin = time.perf_counter()
            for i, rectangle in enumerate(tiles):
                done = partial(_add_progress, progress, i * settings.samples, len(tiles) * settings.samples)
                # Until when this tile's share, and those of all before it, is over.
                pixels += rectangle[2] * rectangle[3]
                seconds = None
                if settings.time is not None:
                    seconds = begin + settings.time * pixels / (width * height) - time.perf_counter()
                summed = sampler.sum(
                    passes, rectangle, size, seconds=seconds, errors=image.error is not None, progress=done
                )
                where = _place(rectangle, size)
                image.radiance[where] = summed.mean
                count += np.mean(summed.samples) * rectangle[2] * rectangle[3]
                if summed.moved:
                    moved.append(summed.moved)
                if image.samples is not None:
                    image.samples[where] = summed.samples
                if image.error is not None:
                    image.error[where] = np.nan if summed.error is None else summed.error
            took = time.perf_counter() - begin
        samples = float(count) / (width * height)
        if len(moved) == len(tiles):
            estimate = estimated(moved, size, samples, took)
        else:
            estimate = Estimate(samples, took, unknown=_why_unknown(settings, estimates))
        return msgspec.structs.replace(image, estimate=estimate, metadata=metadata(scene, size, settings, estimate))

    def _find_geometry(
        self,
        image: Image,
        frame: Frame,
        tiles: Sequence[Rectangle],
        target: tuple[int, int],
    ) -> None:
        """Fill in what the centre rays of an image's pixels see."""
        with closing(Passes(self.device.context, target, geometry=True)) as passes:
            passes.load(self.programs(frame.compiled, None), frame, SamplingOptions())  # its sample is the centre
            for rectangle in tiles:
                passes.draw(rectangle, 0, anew=True)
                passes.read_geometry(image, _place(rectangle, frame.size))

    def sampler(self, settings: Settings, target: tuple[int, int], *, estimates: bool = True) -> Sampler:
        """What draws samples into targets of that size; else as Sampler's. The device's context must be current."""
        program = partial(self.device.program, vertex=plain_vertex_source())
        return Sampler(self.device.context, program, settings, target, estimates=estimates)

    def programs(self, compiled: CompiledScene, show: Show | None = "picture", *, plane_only: bool = True) -> Programs:
        """What draws a scene; with `show` None only what each pixel sees. The device's context must be current.

        Without `plane_only`, plane-only cells that are not empty are drawn as all others are.
        """
        sources = program_sources(compiled, show, self.device.limits.varyings, plane_only=plane_only)
        programs = {name: self.device.program(source.fragment, source.vertex) for name, source in sources.items()}
        return Programs(**{"see": None} | programs)

    def has_programs(self, compiled: CompiledScene, show: Show | None = "picture") -> bool:
        """Whether programs() compiles nothing. Raises ShaderError as that does."""
        sources = program_sources(compiled, show, self.device.limits.varyings).values()
        return all(self.device.has_program(source.fragment, source.vertex) for source in sources)


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
