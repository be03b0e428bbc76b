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
from raytracer.cells import BLOCK, CELL
from raytracer.film import Image
from raytracer.glsl_source import ShaderError
from raytracer.numbers import Numbers
from raytracer.sampling import sample_point
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.sight import Mask, quiet_cells, runs
from raytracer.table import table

Rectangle = tuple[int, int, int, int]  # x, y, width, height; x, y the lower left pixel of the picture
# Seconds that a draw may take for the next one to be larger: an order below what stalls a desktop.
_SHORT_DRAW = 0.04
_FIRST_DRAW = 2**16  # pixels
# GL_COLOR_LOGIC_OP, by default a copy: it changes nothing. But llvmpipe, which compiles a program's fragment shader
# twice, for blocks of pixels that are covered wholly and for others, does it once where it may need what was there.
_LOGIC_OP = 0x0BF2


class Programs(NamedTuple):
    """What draws a scene: two passes and, if there may be quiet cells (sight.py), the one pass for these."""

    see: moderngl.Program  # visibility.frag
    shade: moderngl.Program | None = None  # shade.frag, or show_*.frag
    quiet: moderngl.Program | None = None  # picture.frag
    empty: moderngl.Program | None = None  # empty.frag


class Squares:
    """What one program draws with cells.vert: runs of squares."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program) -> None:
        self._context = context
        self._program = program
        self._buffer: moderngl.Buffer | None = None
        self._array: moderngl.VertexArray | None = None

    def set(self, runs: NDArray[np.int32]) -> None:
        """Have an instance for each row of `runs`: (N, 3), or (N, 5) with the `list` of each."""
        if self._buffer is None or self._buffer.size < runs.nbytes:
            self.release()
            self._buffer = self._context.buffer(reserve=max(1024, 2 * runs.nbytes), dynamic=True)
            layout = ("3i 2i/i", "run", "list") if runs.shape[1] > 3 else ("3i/i", "run")
            self._array = self._context.vertex_array(self._program, [(self._buffer, *layout)])
        assert self._array
        self._buffer.write(np.ascontiguousarray(runs))
        self._array.instances = len(runs)

    def draw(self) -> None:
        """Draw them into the framebuffer in use."""
        if self._array and self._array.instances:
            self._array.render(moderngl.TRIANGLE_STRIP, 4)

    def release(self) -> None:
        """Give back everything on the GPU but the program."""
        if self._array and self._buffer:
            release(self._context, self._array, self._buffer)


class Passes:
    """Targets of `target` (width, height) pixels, and a scene's numbers, on the GPU until closed.

    With `geometry` there are targets for distances and normals, too, for a `see` that gives them. For one picture
    (`once`) what is quicker to draw by a program of its own is not worth compiling that.
    """

    def __init__(
        self, context: moderngl.Context, target: tuple[int, int], *, geometry: bool = False, once: bool = False
    ) -> None:
        self._context = context
        self.geometry = geometry
        self._once = once
        self._programs: Programs | None = None
        self._drawn: dict[moderngl.Program, Mask] = {}  # which cells each program draws
        self._squares: dict[moderngl.Program, Squares] = {}  # the same on the GPU, or blocks of them
        self._side = CELL  # of those squares, in pixels
        self._numbers = Numbers(context)
        self._draw_size = _FIRST_DRAW
        self._surface = context.texture(target, 1, dtype="i4")
        self._normal_depth = context.texture(target, 4, dtype="f4") if geometry else None
        self.radiance = context.texture(target, 4, dtype="f4")  # the sums of the samples, and in a of their squares
        self._seen = context.framebuffer([self._surface, *([self._normal_depth] if self._normal_depth else [])])
        self._light = context.framebuffer([self.radiance])

    def load(self, programs: Programs, scene: Scene, settings: Settings, size: tuple[int, int]) -> None:
        """Take the numbers of `scene` for a picture of `size`. `programs` draw its structure.

        Raises ShaderError if a program has a uniform of another type than it should have.
        """
        self._to_world = view_space.rotation(scene.camera).astype(np.float32)
        self._numbers.load(scene, settings, size)
        self._material_index = np.append(table(scene).material, np.int32(-1))  # so also at index -1
        r, g, b = scene.background
        self._background = r, g, b, r * r + g * g + b * b  # as empty.frag has it
        self._programs = programs
        self._find_cells(programs, scene, settings, size)
        self.draw_all()
        for program in filter(None, programs):
            set_uniforms(
                program,
                **{
                    "draw.resolution": size,
                    "draw.pixelScale": view_space.pixel_scale(scene.camera, size[1]),
                    "draw.ambient": scene.ambient,
                    "draw.background": scene.background,
                    "draw.firstPlane": len(table(scene).radii),
                },
                toWorld=tuple(self._to_world.ravel().tolist()),  # rows of the way there are columns of the way back
                focus=math.dist(scene.camera.position, scene.camera.look_at),
                surface=0,
                normalDepth=1,
            )
            self._numbers.attach(program)

    def _find_cells(self, programs: Programs, scene: Scene, settings: Settings, size: tuple[int, int]) -> None:
        """Say which program draws which cells."""
        busy = np.ones((-(-size[1] // CELL), -(-size[0] // CELL)), bool)
        drawn = {program: busy for program in programs[:2] if program}
        if programs.empty:
            quiet, empty = quiet_cells(scene, size, settings, self._numbers.met())
            busy[quiet] = False
            drawn[programs.empty] = empty
            if programs.quiet:
                drawn[programs.quiet] = quiet & ~empty
        for program in self._squares.keys() - drawn.keys():
            self._squares.pop(program).release()
        for program in drawn.keys() - self._squares.keys():
            self._squares[program] = Squares(self._context, program)
        self._drawn = drawn

    def draw_all(self) -> None:
        """Let the next draws be of all pixels."""
        self._side = CELL
        for program, cells in self._drawn.items():
            self._set_runs(program, cells, (0, 0))

    def draw_only(self, blocks: Mask, corner: tuple[int, int]) -> None:
        """Let the next draws be only of those blocks that are True: (rows, columns) of them, whole cells, the
        lowest row first, from the pixel `corner` (x, y) of the picture on, which is a cell's.
        """
        self._side = BLOCK
        per = CELL // BLOCK
        x, y = corner[0] // CELL, corner[1] // CELL
        part = slice(y, y + blocks.shape[0] // per), slice(x, x + blocks.shape[1] // per)
        for program, cells in self._drawn.items():
            self._set_runs(program, cells[part].repeat(per, axis=0).repeat(per, axis=1) & blocks, (x, y))

    def cells(self, area: Rectangle) -> Mask:
        """(rows, columns): in which cells of an area, whole ones, something may be seen."""
        assert self._programs
        x, y, width, height = area
        part = slice(y // CELL, -(-(y + height) // CELL)), slice(x // CELL, -(-(x + width) // CELL))
        if self._programs.empty:
            return ~self._drawn[self._programs.empty][part]
        return self._drawn[self._programs.see][part]  # all of them

    def _set_runs(self, program: moderngl.Program, mask: Mask, corner: tuple[int, int]) -> None:
        """Have the program draw what is True of cells, or of their blocks, from the cell `corner` on."""
        assert self._programs
        listed = self._numbers.camera_lists() if program is self._programs.see else None
        per = CELL // self._side
        shift = np.multiply(corner, per)
        if listed is None:
            data = runs(mask)
            data[:, :2] += shift
            self._squares[program].set(data)
            return
        # Each cell has a list of its own, so no run goes beyond one.
        columns = mask.shape[1] // per
        first, at, length = runs(mask.reshape(-1, per)).T
        row, column = np.divmod(at, columns)
        cell = (row // per + corner[1]) * self._drawn[program].shape[1] + column + corner[0]
        data = np.column_stack([column * per + first + shift[0], row + shift[1], length, listed[cell]])
        self._squares[program].set(data.astype(np.int32))

    def draw(self, tile: Rectangle, k: int, *, anew: bool) -> None:
        """Draw sample k = 0, 1, ... of a tile and wait for it; add it to the sum, or begin one `anew`."""
        assert self._programs
        sx, sy = sample_point(k)
        for program in filter(None, self._programs):
            set_uniforms(
                program,
                side=self._side,
                **{
                    "draw.tileOrigin": tile[:2],
                    "draw.tileSize": tile[2:],
                    "draw.samplePoint": (2.0 * sx - 1.0, 1.0 - 2.0 * sy),
                },
            )
        self._numbers.bind()
        for target in (self._seen, self._light):
            target.viewport = (0, 0, *tile[2:])
        # All pixels are drawn, so a first sample need neither find 0 there nor be added to it.
        first = anew and self._side == CELL
        cleared = first and self._once  # to what is in empty cells
        if anew and (cleared or not first):
            # All of it: a part llvmpipe clears by drawing, with a program to be compiled.
            self._light.scissor = (0, 0, *self._light.size)
            self._light.use()
            self._light.clear(color=self._background if cleared else (0.0, 0.0, 0.0, 0.0))
        for band in self._bands(tile):
            self._seen.use()
            self._seen.scissor = band
            self._context.disable(moderngl.BLEND)
            self._context.enable_direct(_LOGIC_OP)
            self._squares[self._programs.see].draw()
            self._light.use()
            self._light.scissor = band
            if not first:
                self._context.disable_direct(_LOGIC_OP)
                self._context.enable(moderngl.BLEND)
                self._context.blend_func = moderngl.ONE, moderngl.ONE
            self._surface.use(0)
            if self._normal_depth:
                self._normal_depth.use(1)
            # Once each: without half-spaces, the quiet cells' program is that of the empty ones.
            for program in dict.fromkeys(self._programs[1:]):
                if program and not (cleared and program is self._programs.empty):
                    self._squares[program].draw()
            self._context.disable(moderngl.BLEND)
            self._context.disable_direct(_LOGIC_OP)
            self._context.finish()

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

    def read_sum(self, part: Rectangle) -> NDArray[np.float32]:
        """(H, W, 3): the sum of the samples in a part of the target, top row first."""
        data = self._light.read(part, components=3, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(part[3], part[2], 3)[::-1]

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
        release(self._context, self._seen, self._light, *targets)
        for squares in self._squares.values():
            squares.release()
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
