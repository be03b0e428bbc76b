"""The passes that draw one tile: what each pixel sees, then its light, summed over samples."""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer import view_space
from raytracer.cells import CELL
from raytracer.film import Image
from raytracer.glsl_source import ShaderError
from raytracer.numbers import Numbers
from raytracer.sampling import sample_point
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.sight import quiet_cells, runs
from raytracer.table import table

Rectangle = tuple[int, int, int, int]  # x, y, width, height; x, y the lower left pixel of the picture
# Seconds that a draw may take for the next one to be larger: an order below what stalls a desktop.
_SHORT_DRAW = 0.04
_FIRST_DRAW = 2**16  # pixels


class Programs(NamedTuple):
    """What draws a scene: two passes and, if there may be quiet cells (sight.py), the one pass for these."""

    see: moderngl.Program  # visibility.frag
    shade: moderngl.Program | None = None  # shade.frag, or show_*.frag
    quiet: moderngl.Program | None = None  # picture.frag
    empty: moderngl.Program | None = None  # empty.frag


class Passes:
    """Targets of `target` (width, height) pixels, and a scene's numbers, on the GPU until closed.

    With `geometry` there are targets for distances and normals, too, for a `see` that gives them.
    """

    def __init__(self, context: moderngl.Context, target: tuple[int, int], *, geometry: bool = False) -> None:
        self._context = context
        self.geometry = geometry
        self._programs: Programs | None = None
        self._arrays: dict[moderngl.Program, moderngl.VertexArray] = {}
        self._cells: dict[moderngl.Program, moderngl.Buffer] = {}  # the runs of cells that each program draws
        self._numbers = Numbers(context)
        self._draw_size = _FIRST_DRAW
        self._surface = context.texture(target, 1, dtype="i4")
        self._normal_depth = context.texture(target, 4, dtype="f4") if geometry else None
        self.radiance = context.texture(target, 4, dtype="f4")  # the sum of the samples
        self._seen = context.framebuffer([self._surface, *([self._normal_depth] if self._normal_depth else [])])
        self._light = context.framebuffer([self.radiance])

    def load(self, programs: Programs, scene: Scene, settings: Settings, size: tuple[int, int]) -> None:
        """Take the numbers of `scene` for a picture of `size`. `programs` draw its structure.

        Raises ShaderError if a program has a uniform of another type than it should have.
        """
        self._to_world = view_space.rotation(scene.camera).astype(np.float32)
        self._numbers.load(scene, settings, size)
        self._material_index = np.append(table(scene).material, np.int32(-1))  # so also at index -1
        self._programs = programs
        self._set_cells(programs, scene, settings, size)
        for program in filter(None, programs):
            set_uniforms(
                program,
                resolution=size,
                pixelScale=view_space.pixel_scale(scene.camera, size[1]),
                ambient=scene.ambient,
                background=scene.background,
                toWorld=tuple(self._to_world.ravel().tolist()),  # rows of the way there are columns of the way back
                focus=math.dist(scene.camera.position, scene.camera.look_at),
                surface=0,
                normalDepth=1,
                firstPlane=len(table(scene).radii),
                tileOrigin=(0, 0),
                tileSize=(1, 1),
                samplePoint=(0.0, 0.0),
            )
            self._numbers.attach(program)

    def _set_cells(self, programs: Programs, scene: Scene, settings: Settings, size: tuple[int, int]) -> None:
        """Say which program draws which cells."""
        listed = self._numbers.camera_lists()
        busy = np.ones((-(-size[1] // CELL), -(-size[0] // CELL)), bool)
        drawn = {program: busy for program in programs[:2] if program}
        if programs.empty:
            quiet, empty = quiet_cells(scene, size, settings, self._numbers.met())
            busy[quiet] = False
            drawn[programs.empty] = empty
            if programs.quiet:
                drawn[programs.quiet] = quiet & ~empty
        for program in self._arrays.keys() - drawn.keys():
            release(self._context, self._arrays.pop(program), self._cells.pop(program))
        for program, cells in drawn.items():
            attributes, data = ("run",), runs(cells)
            if program is programs.see and listed is not None:
                rows, columns = np.nonzero(cells)
                data = np.column_stack([columns, rows, np.ones_like(rows), listed[cells.ravel()]]).astype(np.int32)
                attributes = "run", "list"
            self._set_array(program, attributes, data)

    def _set_array(self, program: moderngl.Program, attributes: tuple[str, ...], data: NDArray[np.int32]) -> None:
        """Have the program draw an instance for each row of `data`."""
        buffer = self._cells.get(program)
        if buffer is None or buffer.size < data.nbytes:
            if buffer:
                release(self._context, self._arrays.pop(program), self._cells.pop(program))
            buffer = self._cells[program] = self._context.buffer(reserve=max(1024, 2 * data.nbytes), dynamic=True)
            layout = "3i 2i/i" if len(attributes) > 1 else "3i/i"
            self._arrays[program] = self._context.vertex_array(program, [(buffer, layout, *attributes)])
        buffer.write(data.tobytes())
        self._arrays[program].instances = len(data)

    def draw(self, tile: Rectangle, k: int, *, anew: bool) -> None:
        """Draw sample k = 0, 1, ... of a tile and wait for it; add it to the sum, or begin one `anew`."""
        assert self._programs
        sx, sy = sample_point(k)
        for program in filter(None, self._programs):
            set_uniforms(program, tileOrigin=tile[:2], tileSize=tile[2:], samplePoint=(2.0 * sx - 1.0, 1.0 - 2.0 * sy))
        self._numbers.bind()
        for target in (self._seen, self._light):
            target.viewport = (0, 0, *tile[2:])
        if anew:
            self._light.scissor = (0, 0, *tile[2:])
            self._light.clear()
        for band in self._bands(tile):
            self._seen.use()
            self._seen.scissor = band
            self._context.disable(moderngl.BLEND)
            self._render(self._programs.see)
            self._light.use()
            self._light.scissor = band
            # Always blending: llvmpipe would compile the shader a second time to draw without.
            self._context.enable(moderngl.BLEND)
            self._context.blend_func = moderngl.ONE, moderngl.ONE
            self._surface.use(0)
            if self._normal_depth:
                self._normal_depth.use(1)
            # Once each: without half-spaces, the quiet cells' program is that of the empty ones.
            for program in dict.fromkeys(self._programs[1:]):
                self._render(program)
            self._context.disable(moderngl.BLEND)
            self._context.finish()

    def _render(self, program: moderngl.Program | None) -> None:
        if program and self._arrays[program].instances:
            self._arrays[program].render(moderngl.TRIANGLE_STRIP, 4)

    def _bands(self, tile: Rectangle) -> Iterator[Rectangle]:
        """The tile in rows of pixels that take long enough to be worth a draw, and no longer."""
        width, height = tile[2:]
        y = 0
        while y < height:
            rows = min(height - y, -(-self._draw_size // width))
            begin = time.perf_counter()
            yield 0, y, width, rows
            if time.perf_counter() - begin < _SHORT_DRAW:
                self._draw_size = max(self._draw_size, 2 * rows * width)
            else:
                self._draw_size = max(_FIRST_DRAW // 16, rows * width // 2)
            y += rows

    def read_sum(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """(H, W, 3): the sum of the samples, top row first."""
        width, height = size
        data = self._light.read((0, 0, width, height), components=3, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(height, width, 3)[::-1]

    def read_geometry(self, image: Image, where: tuple[slice, slice]) -> None:
        """Put what the sample just drawn sees into the other arrays of `image`."""
        assert image.depth is not None and image.normal is not None and image.material is not None
        height, width = image.depth[where].shape
        area = (0, 0, width, height)
        data = np.frombuffer(self._seen.read(area, components=4, attachment=1, dtype="f4"), np.float32)
        seen = data.reshape(height, width, 4)[::-1]
        data = np.frombuffer(self._seen.read(area, components=1, dtype="i4"), np.int32)
        surface = data.reshape(height, width)[::-1]
        image.normal[where] = seen[..., :3] @ self._to_world
        image.depth[where] = np.where(surface == 0, np.float32(np.inf), seen[..., 3])
        image.material[where] = self._material_index[np.abs(surface) - 1]

    def close(self) -> None:
        """Give back everything on the GPU."""
        targets = (self._surface, self.radiance, *([self._normal_depth] if self._normal_depth else []))
        release(self._context, *self._arrays.values(), self._seen, self._light, *targets, *self._cells.values())
        self._numbers.close()


def release(context: moderngl.Context, *things: Any) -> None:
    """Release OpenGL objects, framebuffers among them.

    When moderngl makes a framebuffer it binds the one used last again, which must not be gone by then.
    """
    context.detect_framebuffer(0).use()
    for thing in things:
        thing.release()


def set_uniforms(program: moderngl.Program, **values: object) -> None:
    """Set those of `values` that the program has: a compiler removes uniforms that do nothing.

    Raises ShaderError for one that the shader declares as another type.
    """
    for name, value in values.items():
        if name in program:
            try:
                program[name] = value
            except (struct.error, TypeError, ValueError, moderngl.Error) as error:
                raise ShaderError(f"uniform {name}: expected a type that takes {value!r}: {error}") from None
