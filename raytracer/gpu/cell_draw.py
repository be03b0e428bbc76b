"""Draws squares of a picture with cells.vert: whole cells, or blocks of 4 x 4 pixels."""

from __future__ import annotations

import moderngl
import numpy as np

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.meshes import Cells
from raytracer.gpu.gl import largest_point, release, set_uniforms


class CellDraw:
    """A mesh of squares for one program, drawn with cells.vert. It stays on the GPU until released."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program) -> None:
        self._context = context
        self.program = program
        self._mesh: Cells | None = None  # the mesh in the buffer
        self._buffer: moderngl.Buffer | None = None
        self._arrays: tuple[moderngl.VertexArray, ...] = ()  # for rectangles and for points
        self._has_points = largest_point(context) >= CELL

    def upload(self, mesh: Cells) -> None:
        """Upload a mesh for the next draws, unless the GPU has it already. It may bind another framebuffer."""
        if mesh is self._mesh:
            return
        self._mesh = None
        data = np.ascontiguousarray(mesh.rows, np.int32)
        if self._buffer is None or self._buffer.size < data.nbytes:
            self.release()
            self._buffer = self._context.buffer(reserve=max(1024, 2 * data.nbytes), dynamic=True)
            layout, names = ("4i 2i", ("block", "list")) if data.shape[1] > 4 else ("4i", ("block",))
            self._arrays = tuple(
                self._context.vertex_array(self.program, [(self._buffer, layout + per, *names)]) for per in ("/i", "")
            )
        self._buffer.write(data)
        self._mesh = mesh

    def draw(self) -> None:
        """Draw the mesh into the framebuffer in use."""
        assert self._mesh
        points = self._mesh.as_points and self._has_points
        set_uniforms(self.program, points=points, side=self._mesh.side)
        rectangle_array, point_array = self._arrays
        if points:
            self._context.enable(moderngl.PROGRAM_POINT_SIZE)
            point_array.render(moderngl.POINTS, len(self._mesh.rows))
        else:
            rectangle_array.render(moderngl.TRIANGLE_STRIP, 4, instances=len(self._mesh.rows))

    def release(self) -> None:
        """Release everything on the GPU but the program."""
        if self._buffer:
            release(self._context, *self._arrays, self._buffer)
            self._buffer = None
