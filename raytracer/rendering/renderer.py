"""Programs, uniforms, passes, read-back: a Scene to an Image on the GPU."""

from __future__ import annotations

import time
from contextlib import ExitStack, closing
from functools import partial
from typing import Any

import msgspec
import numpy as np

from raytracer.compiler.glsl.shaders import plain_vertex_source
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.rendering.error_estimate import Moved, estimated
from raytracer.rendering.geometry import DrawnGeometry, View
from raytracer.rendering.passes import Passes
from raytracer.rendering.programs import find_programs
from raytracer.rendering.sampler import Sampler
from raytracer.rendering.tiles import TILE, place, split, tile_size
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Samples of all pixels together, adaptive ones as if none were left out: a picture of fewer gains less by a program for
# quiet cells than it takes to compile.
_WORTH_QUIET = 2**20


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
        self.device.limits.check(scene, settings)
        width, height = size
        margin = Sampler.margin(settings)
        tile = min(tile, self.device.limits.target - 2 * margin)
        source: Any = DrawnGeometry(self.device, View(scene, settings, size, tile)) if geometry else None
        image = Image(
            radiance=np.empty((height, width, 3), np.float32),
            depth=source,
            normal=source,
            material=source,
            samples=np.empty((height, width), np.int32) if settings.refines else None,
            error=np.empty((height, width), np.float32) if geometry and estimates else None,
        )
        shape = tile_size(size, tile, is_drawn_once=settings.samples == 1)
        tiles = list(split(size, shape))
        target = min(width, shape[0] + 2 * margin), min(height, shape[1] + 2 * margin)
        with self.device.turn(), ExitStack() as stack:
            passes = stack.enter_context(closing(Passes(self.device.context, target, once=True)))
            quiet = not only or width * height * settings.samples >= _WORTH_QUIET
            passes.load(find_programs(self.device, scene, settings, quiet=quiet), scene, settings, size)
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
                where = place(rectangle, height)
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

    def sampler(self, settings: Settings, target: tuple[int, int], *, estimates: bool = True) -> Sampler:
        """What draws samples into targets of that size; else as Sampler's. The device's context must be current."""
        program = partial(self.device.program, vertex=plain_vertex_source())
        return Sampler(self.device.context, program, settings, target, estimates=estimates)


def _add_progress(progress: Progress | None, before: int, total: int, done: int) -> None:
    if progress:
        progress(before + done, total)
