"""Programs, uniforms, passes, read-back: a Scene to an Image on the GPU."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from weakref import WeakKeyDictionary

import moderngl
import msgspec
import numpy as np

from raytracer.compiler.batches import groups
from raytracer.compiler.culling import has_quiet
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.glsl.preprocessor import ShaderError, Source, assemble
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
from raytracer.core.interrupts import deferred
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.context import chosen, open_context
from raytracer.gpu.devices import Device, leave
from raytracer.gpu.turns import alone, check_process, turn
from raytracer.rendering.error_estimate import Moved, estimated
from raytracer.rendering.limits import Limits
from raytracer.rendering.passes import Passes, Programs, Rectangle
from raytracer.rendering.sampler import Sampler
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Side of a tile in pixels. A tile's targets take up to 60 bytes a pixel, 252 MB at this size.
TILE = 2048
# Samples of all pixels together, adaptive ones as if none were left out: a picture of fewer gains less by a program for
# quiet cells than it takes to compile.
_WORTH_QUIET = 2**20
# Characters of the texts of all programs that are kept, but for those that every text has: llvmpipe takes some 4 MB for
# the program of a tree of 8 spheres, 200 MB for one of 300, in all 0.8 to 2.3 kB a character. So many are up to 1 GB,
# most often half of it. A page of all knobs (trade/) has 58 programs of 275,000, which it times in turns.
KEPT_TEXT = 400_000
_COMMON_TEXT = 24_000
# Pixels of a tile of a picture with 1 sample: rows of cells in the processor's cache.
_STRIP = 2**18


_shared: dict[tuple[str, Device | None], Renderer] = {}


def shared_renderer(backend: str | None = None, device: Device | None = None) -> Renderer:
    """The renderer on this process's one context of that kind, on that device, opened when first asked for.

    Raises InputError for a backend or device that there is none of, ContextError if no context opens or in a process
    that was forked from one that had begun with OpenGL (turns.py), RuntimeError within a progress callback.
    """
    key = chosen(backend, device)
    check_process()
    if key not in _shared:
        with alone():
            if key not in _shared:  # another thread may have been before
                _shared[key] = _opened(backend, device)
    return _shared[key]


def _opened(backend: str | None, device: Device | None) -> Renderer:
    context = open_context(backend, device)
    try:
        return Renderer(context)
    finally:
        leave(context)  # also where that failed before its own end


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
    """Renders scenes on one OpenGL context. The programs used last are kept, by their text."""

    def __init__(self, context: moderngl.Context) -> None:
        """Ask `context` for its limits, after which no context is current."""
        self.context = context
        self._programs: dict[tuple[str, str], moderngl.Program] = {}  # the least recently used first
        # The programs that windows draw with, while other pictures are made on the same context.
        self.held: WeakKeyDictionary[object, Collection[moderngl.Program]] = WeakKeyDictionary()
        with context:
            self.limits = Limits(context)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Have the context current for a block, in which no program is released. Errors are those of turns.turn()."""
        with turn(self.context):
            self.trim()
            yield

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
        self.limits.check(scene, settings)
        width, height = size
        margin = Sampler.margin(settings)
        tile = min(tile, self.limits.target - 2 * margin)
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
        with self.turn(), ExitStack() as stack:
            if geometry:
                self._find_geometry(image, scene, settings, tiles, shape)
            passes = stack.enter_context(closing(Passes(self.context, target, once=True)))
            quiet = not only or width * height * settings.samples >= _WORTH_QUIET
            passes.load(self.programs(scene, settings, quiet=quiet), scene, settings, size)
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
        scene: Scene,
        settings: Settings,
        tiles: Sequence[Rectangle],
        target: tuple[int, int],
    ) -> None:
        """Fill in what the centre rays of an image's pixels see."""
        size = image.radiance.shape[1], image.radiance.shape[0]
        settings = msgspec.structs.replace(settings, samples=1, sequence="sobol")  # that sample is the centre
        with closing(Passes(self.context, target, geometry=True)) as passes:
            passes.load(self.programs(scene, settings, None), scene, settings, size)
            for rectangle in tiles:
                passes.draw(rectangle, 0, anew=True)
                passes.read_geometry(image, _place(rectangle, size))

    def sampler(self, settings: Settings, target: tuple[int, int], *, estimates: bool = True) -> Sampler:
        """What draws samples into targets of that size; else as Sampler's. `context` must be current."""
        program = partial(self.program, vertex=plain_vertex_source())
        return Sampler(self.context, program, settings, target, estimates=estimates)

    def programs(
        self, scene: Scene, settings: Settings, show: Show | None = "picture", *, quiet: bool = True
    ) -> Programs:
        """What draws `scene`; with `show` None only what each pixel sees. `context` must be current.

        Without `quiet`, quiet cells that are not empty are drawn as all others are.
        """
        sources = _sources(scene, settings, show, self.limits.varyings, quiet=quiet)
        return Programs(**{"see": None} | {name: self.program(*source) for name, source in sources.items()})

    def has_programs(self, scene: Scene, settings: Settings, show: Show | None = "picture") -> bool:
        """Whether programs() compiles nothing. Raises ShaderError as that does."""
        sources = _sources(scene, settings, show, self.limits.varyings, quiet=True).values()
        return all((vertex.text, fragment.text) in self._programs for fragment, vertex in sources)

    def program(self, source: Source, vertex: Source | None = None) -> moderngl.Program:
        """The program with this fragment shader, and screen.vert or another; `context` must be current.

        Raises ShaderError with files and lines.
        """
        vertex = vertex or assemble("passes/screen.vert")
        key = vertex.text, source.text
        program = self._programs.pop(key, None)
        if program is None:
            try:
                with deferred():
                    program = self.context.program(vertex_shader=vertex.text, fragment_shader=source.text)
            except moderngl.Error as error:
                heading, _, log = str(error).rpartition("===\n")
                wrong = vertex if "vertex" in heading else source
                raise ShaderError(wrong.explain(log.strip())) from None
        self._programs[key] = program
        return program

    def forget(self, keep: Collection[moderngl.Program]) -> None:
        """Release all programs but these. `context` must be current."""
        for key, program in list(self._programs.items()):
            if program not in keep:
                self._programs.pop(key).release()

    def trim(self) -> None:
        """Release the least recently used programs but those that are held, if there are more than KEPT_TEXT.

        `context` must be current, and no other program than those in use.
        """
        lengths = {key: max(len(key[0]) + len(key[1]) - _COMMON_TEXT, 0) for key in self._programs}
        total = sum(lengths.values())
        held = {program for programs in self.held.values() for program in programs}
        for key, program in list(self._programs.items()):
            if total <= KEPT_TEXT:
                break
            if program not in held:
                total -= lengths[key]
                self._programs.pop(key).release()


def _sources(
    scene: Scene, settings: Settings, show: Show | None, varyings: int, *, quiet: bool
) -> dict[str, tuple[Source, Source]]:
    """The fragment and the vertex shader of each of the programs that draw `scene`, by its name in Programs."""
    sources: dict[str, tuple[Source, Source]] = {}
    cells = vertex_source(scene, settings, varyings)
    if show != "picture" or not is_over_planes(scene, settings):
        sources["see"] = visibility_source(scene, settings, varyings, geometry=show != "picture"), cells
    if show:
        sources["shade"] = show_source(scene, settings, show, varyings), cells
    if is_listed(scene, settings) and groups(scene).kinds:
        vertex, fragment = kinds_source(scene, settings, varyings, geometry=show != "picture")
        sources["kinds"] = fragment, vertex
    if show == "picture" and has_quiet(scene, settings):
        if quiet and groups(scene).planes:
            sources["quiet"] = quiet_source(scene, settings, varyings), cells
        sources["empty"] = assemble("passes/empty.frag"), plain_vertex_source()
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
