"""The passes that draw one tile: what each pixel sees, then its light, summed over samples."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.culling import Mask
from raytracer.compiler.direction_cells import BLOCK, CELL
from raytracer.compiler.frame import Frame
from raytracer.compiler.rounds import MAX_ROUNDS
from raytracer.core.validation import InputError
from raytracer.formats.image import Image
from raytracer.gpu.cell_draw import Rectangle, Squares, runs, squares, viewport
from raytracer.gpu.gl import clear_integers, release, set_uniforms
from raytracer.gpu.rectangle_draw import Over, Rectangles, touching, which_touch
from raytracer.gpu.scene_buffers import SceneBuffers
from raytracer.scene.options import SamplingOptions
from raytracer.scene.sequences import sample_place, scatters

# Seconds that a draw should take: well below what stalls a desktop.
_SHORT_DRAW = 0.05
_FIRST_DRAW, _LEAST_DRAW = 2**16, 2**12  # pixels
# GL_COLOR_LOGIC_OP, by default a copy: it changes nothing of such targets, though softpipe draws nothing then. But
# llvmpipe, which compiles a program's fragment shader twice, for blocks of pixels that are covered wholly and for
# others, does it once where it may need what was there: quicker for one picture, some percent slower for each of many.
_LOGIC_OP = 0x0BF2


# The constant CUT_SHORT of cut_short.glsl.
_CUT_SHORT = -(2**31)
# Less than INF of real.glsl, more than any light.
_INFINITE = 1e29


class Programs(NamedTuple):
    """What draws a scene: two passes and, if there may be plane-only cells (culling.py), the one pass for these."""

    see: moderngl.Program | None  # visibility.frag, unless `shade` finds all that is under objects that share code
    shade: moderngl.Program | None = None  # shade.frag, or show_*.frag
    plane_only: moderngl.Program | None = None  # picture.frag
    empty: moderngl.Program | None = None  # empty.frag
    shapes: moderngl.Program | None = None  # visibility.frag for kinds.vert


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
        self._software = "llvmpipe" in context.info["GL_RENDERER"]
        self._programs: Programs | None = None
        self._drawn: dict[moderngl.Program, Mask] = {}  # which cells each program draws
        self._squares: dict[moderngl.Program, Squares] = {}  # the same on the GPU, or blocks of them
        self._side = CELL  # of those squares, in pixels
        self._buffers = SceneBuffers(context)
        self._draw_size: dict[moderngl.Program, int] = {}  # pixels, as found last time
        self._target = target
        self._rectangles: Rectangles | None = None
        self._over: Over | None = None
        self._surface = context.texture(target, 1, dtype="i4")
        self._normal_depth = context.texture(target, 4, dtype="f4") if geometry else None
        self.radiance = context.texture(target, 4, dtype="f4")  # the sums of the samples, and in a of their squares
        self._colors = [self._surface, *([self._normal_depth] if self._normal_depth else [])]
        self._seen = context.framebuffer(self._colors)
        self._light = context.framebuffer([self.radiance])

    def load(self, programs: Programs, frame: Frame, sampling: SamplingOptions) -> None:
        """Take the numbers of `frame`. `programs` draw its structure.

        Raises ShaderError if a program has a uniform of another type than it should have.
        """
        scene = frame.compiled.scene
        self._to_world = frame.view.rotation.astype(np.float32)
        self._buffers.upload(frame)
        self._material_index = np.append(frame.compiled.surfaces.material, np.int32(-1))  # so also at index -1
        r, g, b = scene.background
        self._background = r, g, b, r * r + g * g + b * b  # as empty.frag has it
        self._programs, self._frame, self._sampling = programs, frame, sampling
        self._find_cells(programs, frame)
        self._find_rectangles(programs)
        self.draw_all()
        for program in filter(None, programs):
            set_uniforms(program, **frame.uniforms, two=2, surface=0, normalDepth=1, others=0)
            self._buffers.attach(program)

    def _find_cells(self, programs: Programs, frame: Frame) -> None:
        """Say which program draws which cells."""
        cells = frame.cells
        others = cells.others if programs.empty else np.ones_like(cells.others)
        drawn = {program: others for program in programs[:2] if program}
        if programs.empty:
            drawn[programs.empty] = cells.empty
        if programs.plane_only:
            drawn[programs.plane_only] = cells.plane_only
        for program in self._squares.keys() - drawn.keys():
            self._squares.pop(program).release()
        for program in drawn.keys() - self._squares.keys():
            self._squares[program] = Squares(self._context, program)
        self._drawn = drawn

    def _find_rectangles(self, programs: Programs) -> None:
        """Have what draws objects that share code, if there are any."""
        if self._rectangles and self._rectangles.program is not programs.shapes:
            self._rectangles.release()
            self._rectangles = None
        if programs.shapes:
            self._rectangles = self._rectangles or Rectangles(self._context, programs.shapes)
            others = "others" in programs.shapes
            if self._over and bool(self._over.others) != others:
                self._over.release()
                self._over = None
            self._over = self._over or Over(self._context, self._target, self._colors, others=others)
        elif self._over:
            self._over.release()
            self._over = None

    def draw_all(self) -> None:
        """Let the next draws be of all pixels."""
        self._side = CELL
        if self._rectangles:
            self._rectangles.set(self._frame.rectangles)
        for program, cells in self._drawn.items():
            self._set_squares(program, cells, (0, 0))

    def draw_only(self, blocks: Mask, corner: tuple[int, int]) -> None:
        """Let the next draws be only of those blocks that are True: (rows, columns) of them, whole cells, the
        lowest row first, from the pixel `corner` (x, y) of the picture on, which is a cell's.
        """
        self._side = BLOCK
        per = CELL // BLOCK
        x, y = corner[0] // CELL, corner[1] // CELL
        part = slice(y, y + blocks.shape[0] // per), slice(x, x + blocks.shape[1] // per)
        if self._rectangles:
            rectangles = self._frame.rectangles
            self._rectangles.set(rectangles, which_touch(rectangles, blocks, corner, BLOCK))
        for program, cells in self._drawn.items():
            self._set_squares(program, cells[part].repeat(per, axis=0).repeat(per, axis=1) & blocks, (x, y))

    def warm(self, area: Rectangle) -> None:
        """Have the driver compile what draws of cells and of blocks need, by draws that are clipped to an area."""
        assert self._programs and self._programs.shade
        for k in range(2):
            self.draw(area, k, anew=k == 0)
        some = np.zeros_like(self._drawn[self._programs.shade])  # a cell of each program
        for cells in self._drawn.values():
            some.flat[cells.argmax()] = True
        per = CELL // BLOCK
        self.draw_only(some.repeat(per, axis=0).repeat(per, axis=1), (0, 0))
        self.draw(area, 1, anew=False)
        self._draw_size.clear()  # of so few pixels it tells nothing

    def cells(self, area: Rectangle) -> Mask:
        """(rows, columns): in which cells of an area, whole ones, something may be seen."""
        assert self._programs and self._programs.shade
        x, y, width, height = area
        part = slice(y // CELL, -(-(y + height) // CELL)), slice(x // CELL, -(-(x + width) // CELL))
        if self._programs.empty:
            return ~self._drawn[self._programs.empty][part]
        return self._drawn[self._programs.shade][part]  # all of them

    def _set_squares(self, program: moderngl.Program, mask: Mask, corner: tuple[int, int]) -> None:
        """Have the program draw what is True of cells, or of their blocks, from the cell `corner` on."""
        per = CELL // self._side
        has_lists = "list" in program
        points = has_lists or per > 1
        found = squares(mask) if points else runs(mask)
        found[:, :2] += np.multiply(corner, per).astype(np.int32)
        if has_lists:
            assert self._frame.camera_lists is not None
            column, row = found[:, :2].T // per
            lists = self._frame.camera_lists[row * self._drawn[program].shape[1] + column]
            found = np.column_stack([found, lists])
        self._squares[program].set(found, points=points)

    def draw(self, tile: Rectangle, k: int, *, anew: bool) -> None:
        """Draw sample k = 0, 1, ... of a tile and wait for it; add it to the sum, or begin one `anew`."""
        assert self._programs
        place = sample_place(k, self._sampling.sequence, self._sampling.samples)
        if anew and self._side == CELL and self._rectangles and self._programs.shapes:
            found = self._frame.rectangles
            whole = tile == (0, 0, *self._frame.size)
            self._rectangles.set(found, None if whole else touching(found, tile))
        port, shown = viewport(tile)
        drawn = [program for program, squares in self._squares.items() if squares.count]
        if self._programs.shapes:
            drawn.append(self._programs.shapes)
        for program in drawn:
            set_uniforms(
                program,
                side=self._side,
                **{
                    "draw.tileOrigin": tile[:2],
                    "draw.viewport": shown,
                    "draw.samplePlace": place,
                    "draw.scatter": -1 if scatters(self._sampling.sequence, self._sampling.samples) else 0,
                    "draw.sampleIndex": k,
                },
            )
        self._buffers.bind()
        self._light.viewport = port
        # All pixels are drawn, so a first sample need neither find 0 there nor be added to it.
        first = anew and self._side == CELL
        cleared = first and self._once  # to what is in empty cells
        if anew and (cleared or not first):
            # All of it: a part llvmpipe clears by drawing, with a program to be compiled.
            self._light.scissor = (0, 0, *self._light.size)
            self._light.use()
            self._light.clear(color=self._background if cleared else (0.0, 0.0, 0.0, 0.0))
        # Also of what a draw that was broken off left.
        self._context.disable(moderngl.BLEND | moderngl.DEPTH_TEST)
        if self._once and self._software:
            self._context.enable_direct(_LOGIC_OP)
        self._see(tile)
        if not self._programs.shade:
            self._context.disable_direct(_LOGIC_OP)
            return
        if not first:
            self._context.disable_direct(_LOGIC_OP)
            self._context.enable(moderngl.BLEND)
            self._context.blend_func = moderngl.ONE, moderngl.ONE
        for band in self._bands(tile, self._programs.shade):
            self._light.use()
            self._light.scissor = band
            self._surface.use(0)
            if self._normal_depth:
                self._normal_depth.use(1)
            for program in (self._programs.shade, self._programs.plane_only, self._programs.empty):
                if program and not (cleared and program is self._programs.empty):
                    self._squares[program].draw()
            self._context.finish()
        self._context.disable(moderngl.BLEND)
        self._context.disable_direct(_LOGIC_OP)
        if anew and self._software and self._frame.rounds > MAX_ROUNDS:
            self.read_sum((0, 0, *tile[2:]))

    def try_out(self) -> None:
        """Raise InputError if shaders do not come to an end in the picture's first sample; in a target of its size."""
        if self._software and self._frame.rounds > MAX_ROUNDS:
            self.draw((0, 0, *self._frame.size), 0, anew=True)
            if self.geometry:  # no light is computed, which would tell it
                self._read_surface(self._frame.size)

    def _see(self, tile: Rectangle) -> None:
        """Find what the pixels of a tile see."""
        assert self._programs
        port, _ = viewport(tile)
        seen = self._over.under if self._over else self._seen
        seen.use()
        seen.viewport = port
        if see := self._programs.see:
            for band in self._bands(tile, see):
                seen.scissor = band
                self._squares[see].draw()
                self._context.finish()
        else:  # nothing, all over: see draw()
            clear_integers(self._context, seen)
        if self._rectangles and self._over:
            self._over.draw(self._rectangles, port, tile[2:])

    def _bands(self, tile: Rectangle, program: moderngl.Program) -> Iterator[Rectangle]:
        """The tile in rows of pixels that take `program` long enough to be worth a draw, and no longer."""
        width, height = tile[2:]
        y = 0
        while y < height:
            rows = min(height - y, -(-self._draw_size.get(program, _FIRST_DRAW) // width))
            begin = time.perf_counter()
            yield 0, y, width, rows
            change = _SHORT_DRAW / max(time.perf_counter() - begin, 1e-9)
            self._draw_size[program] = max(_LEAST_DRAW, int(rows * width * min(max(change, 0.25), 8.0)))
            y += rows

    def read_sum(self, part: Rectangle) -> NDArray[np.float32]:
        """(H, W, 3): the sum of the samples in a part of the target, top row first.

        Raises InputError if shaders did not come to an end in some pixels.
        """
        data = np.frombuffer(self._light.read(part, components=3, dtype="f4"), np.float32)
        _check_rounds(data.min(initial=0.0) < -_INFINITE)
        return data.reshape(part[3], part[2], 3)[::-1]

    def read_variance(self, part: Rectangle, samples: NDArray[np.int32]) -> NDArray[np.float32]:
        """(H, W), top row first: the variance of each pixel's samples (H, W), all in the sum, summed over channels."""
        data = self._light.read(part, components=4, dtype="f4")
        sums = np.frombuffer(data, np.float32).reshape(part[3], part[2], 4)[::-1]
        squares = np.einsum("ijk,ijk->ij", sums[..., :3], sums[..., :3])
        return np.maximum(sums[..., 3] - squares / samples, 0.0) / np.maximum(samples - 1, 1).astype(np.float32)

    def read_geometry(self, image: Image, where: tuple[slice, slice]) -> None:
        """Put what the sample just drawn sees into the other arrays of `image`."""
        assert image.depth is not None and image.normal is not None and image.material is not None
        height, width = image.depth[where].shape
        area = (0, 0, width, height)
        data = np.frombuffer(self._seen.read(area, components=4, attachment=1, dtype="f4"), np.float32)
        seen = data.reshape(height, width, 4)[::-1]
        surface = self._read_surface((width, height))
        image.normal[where] = seen[..., :3] @ self._to_world
        image.depth[where] = np.where(surface == 0, np.float32(np.inf), seen[..., 3])
        image.material[where] = self._material_index[np.abs(surface) - 1]

    def _read_surface(self, size: tuple[int, int]) -> NDArray[np.int32]:
        """(H, W), top row first: what the lower left part of that size sees. Raises InputError as read_sum()."""
        data = np.frombuffer(self._seen.read((0, 0, *size), components=1, dtype="i4"), np.int32)
        _check_rounds(data.min() == _CUT_SHORT)
        return data.reshape(size[1], size[0])[::-1]

    def close(self) -> None:
        """Give back everything on the GPU."""
        release(self._context, self._seen, self._light, *self._colors, self.radiance)
        for thing in (self._over, self._rectangles, *self._squares.values()):
            if thing:
                thing.release()
        self._buffers.close()


def _check_rounds(cut_short: bool) -> None:
    """Raise InputError if shaders were cut short (cut_short.glsl)."""
    if cut_short:
        raise InputError(
            f"expected pixels whose rays take at most {MAX_ROUNDS} steps from primitive to primitive and in sums of "
            "reflectance models, all lights together (llvmpipe computes no more), got one whose rays take more; "
            "remedies are fewer primitives in one object, fewer lights, fewer nodes of diffuse_microfacet, fewer terms "
            "of he, or a graphics card",
            "objects",
        )
