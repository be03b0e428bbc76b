"""The squares of a picture that a program draws by cells.vert: whole cells, or blocks of them."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import CELL
from raytracer.gpu.gl import largest_point, release, set_uniforms

Rectangle = tuple[int, int, int, int]  # x, y, width, height; x, y the lower left pixel of the picture
Mask = NDArray[np.bool_]

# Of a viewport around its tile, in pixels: points with a centre beyond it are not drawn.
MARGIN = 128


def runs(cells: Mask) -> NDArray[np.int32]:
    """(N, 3): column, row and length of each run of cells that are True along a row."""
    edges = np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edges == 1)
    _, end = np.nonzero(edges == -1)
    return np.column_stack([first, row, end - first]).astype(np.int32)


def squares(cells: Mask) -> NDArray[np.int32]:
    """(N, 3): column and row of each cell that is True, and 1."""
    row, column = np.nonzero(cells)
    return np.column_stack([column, row, np.ones_like(row)]).astype(np.int32)


class Squares:
    """What one program draws with cells.vert."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program) -> None:
        self._context = context
        self.program = program
        self._buffer: moderngl.Buffer | None = None
        self._arrays: tuple[moderngl.VertexArray, ...] = ()  # that draw rectangles, and points
        self.count, self._points = 0, False
        self._has_points = largest_point(context) >= CELL

    def set(self, squares: NDArray[np.integer[Any]], *, points: bool = False) -> None:
        """Draw all rows of `squares`: a run's column, row, length, and the ends of its list if the program has lists.

        As `points`: all runs being of one square.
        """
        data = np.ascontiguousarray(squares, np.int32)
        if self._buffer is None or self._buffer.size < data.nbytes:
            self.release()
            self._buffer = self._context.buffer(reserve=max(1024, 2 * data.nbytes), dynamic=True)
            form, names = ("3i 2i", ("run", "list")) if data.shape[1] > 3 else ("3i", ("run",))
            self._arrays = tuple(
                self._context.vertex_array(self.program, [(self._buffer, form + each, *names)]) for each in ("/i", "")
            )
        self._buffer.write(data)
        self.count, self._points = len(data), points and self._has_points

    def draw(self) -> None:
        """Draw them into the framebuffer in use."""
        if not self.count:
            return
        set_uniforms(self.program, points=self._points)
        rectangles, points = self._arrays
        if self._points:
            self._context.enable(moderngl.PROGRAM_POINT_SIZE)
            points.render(moderngl.POINTS, self.count)
        else:
            rectangles.render(moderngl.TRIANGLE_STRIP, 4, instances=self.count)

    def release(self) -> None:
        """Give back everything on the GPU but the program."""
        if self._buffer:
            release(self._context, *self._arrays, self._buffer)


def viewport(area: Rectangle) -> tuple[Rectangle, Rectangle]:
    """The viewport for an area of the picture in the lower left of a target, and what of the picture it shows: with
    a margin, as points with a centre beyond it are not drawn."""
    x, y, width, height = area
    size = width + 2 * MARGIN, height + 2 * MARGIN
    return (-MARGIN, -MARGIN, *size), (x - MARGIN, y - MARGIN, *size)
