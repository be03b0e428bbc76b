"""The rectangles of a picture in which objects of kinds may be seen (candidate_lists.py), drawn by kinds.vert."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.gpu.cell_draw import MARGIN, Mask, Rectangle
from raytracer.gpu.gl import depth_buffer, largest_point, release, set_uniforms

# Pixels in the rectangles of one draw: some 20 ms on two cores.
_DRAW = 2**20
# What a rectangle costs besides, in pixels.
_EACH = 64
# Vertices of its two triangles, of four corners.
_CORNERS = np.array([0, 1, 2, 2, 1, 3], np.int32)

Ints = NDArray[np.int32]


def which_touch(rectangles: Ints, squares: Mask, corner: tuple[int, int], side: int) -> Mask:
    """(N,): which rectangles touch a square of `side` pixels that is True. The first begins at the pixel `corner`."""
    sums = np.pad(squares.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    most = squares.shape[1], squares.shape[0]
    low = np.clip((rectangles[:, :2] - corner) // side, 0, most)
    high = np.clip((rectangles[:, 2:4] - corner - 1) // side + 1, 0, most)
    (x0, y0), (x1, y1) = low.T, np.maximum(high, low).T
    return sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0] > 0


def touching(rectangles: Ints, area: Rectangle) -> Mask:
    """(N,): which rectangles share a pixel with an area."""
    x, y, width, height = area
    x0, y0, x1, y1 = rectangles[:, :4].T
    return (x0 < x + width) & (x < x1) & (y0 < y + height) & (y < y1)


class Rectangles:
    """What one program draws of a scene's rectangles."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program) -> None:
        self._context = context
        self.program = program
        self._all: Ints | None = None  # what is drawn, if it is all
        self._buffer = context.buffer(reserve=24)
        self._array = context.vertex_array(program, [], index_buffer=self._buffer)
        self._largest_point = min(2 * MARGIN, largest_point(context))
        self._points = False
        self._ends = np.zeros(0, np.int64)  # sums of their costs

    def set(self, rectangles: Ints, kept: Mask | None = None) -> None:
        """Draw those of `rectangles` that are `kept`, by default all."""
        if kept is None and rectangles is self._all:
            return
        self._all = rectangles if kept is None else None
        numbers = np.arange(len(rectangles)) if kept is None else np.flatnonzero(kept)
        size = rectangles[numbers, 2:4] - rectangles[numbers, :2]
        self._ends = np.cumsum(size[:, 0].astype(np.int64) * size[:, 1] + _EACH)
        # Points if they are small: llvmpipe shades what lies along the diagonal of a rectangle twice.
        self._points = bool(size.max(initial=0) <= self._largest_point)
        indices = (numbers if self._points else 4 * numbers[:, None] + _CORNERS).astype(np.int32)
        self._buffer.orphan(max(24, indices.nbytes))
        self._buffer.write(indices)

    def draw(self) -> Iterator[None]:
        """Draw them, in several draws if they are large, and yield after each."""
        set_uniforms(self.program, points=self._points)
        self._context.enable(moderngl.PROGRAM_POINT_SIZE)
        mode, each = (moderngl.POINTS, 1) if self._points else (moderngl.TRIANGLES, 6)
        at = 0
        while at < len(self._ends):
            done = int(self._ends[at - 1]) if at else 0
            after = max(int(np.searchsorted(self._ends, done + _DRAW)), at + 1)
            self._array.render(mode, each * (after - at), first=each * at)
            yield
            at = after

    def release(self) -> None:
        """Give back everything on the GPU but the program."""
        release(self._context, self._array, self._buffer)


class Over:
    """The targets with which rectangles are drawn over what all other objects are seen to be, until closed.

    First those others are drawn into `under`; `colors` are the targets for what is seen. With `others` there is one
    more in `under`, the second, for their distances and the numbers of their objects (visibility.frag).
    """

    def __init__(
        self,
        context: moderngl.Context,
        size: tuple[int, int],
        colors: Sequence[moderngl.Texture],
        *,
        others: bool,
    ) -> None:
        self._context = context
        self.others = context.texture(size, 2, dtype="f4") if others else None
        self._depth = depth_buffer(context, size)
        self._only_depth = context.framebuffer([], self._depth)
        self._both = context.framebuffer(colors, self._depth)
        under = [colors[0], *([self.others] if self.others else []), *colors[1:]]
        self.under = context.framebuffer(under)

    def draw(self, rectangles: Rectangles, viewport: tuple[int, int, int, int], size: tuple[int, int]) -> None:
        """Draw and wait for it, in the lower left part of that size."""
        self._both.viewport = viewport
        self._only_depth.scissor = self._both.scissor = (0, 0, *size)
        self._only_depth.clear(depth=1.0)
        self._both.use()
        if self.others:
            self.others.use(0)
        self._context.enable(moderngl.DEPTH_TEST)
        self._context.depth_func = "<"
        for _ in rectangles.draw():
            self._context.finish()
        self._context.disable(moderngl.DEPTH_TEST)

    def release(self) -> None:
        """Give back everything on the GPU but `colors`."""
        targets = (self._only_depth, self._both, self.under, self._depth, *([self.others] if self.others else []))
        release(self._context, *targets)
