"""Draws the rectangles of a picture in which objects of common shapes may be seen, with shapes.vert."""

from __future__ import annotations

import moderngl
import numpy as np

from raytracer.compiler.draws import MARGIN
from raytracer.compiler.meshes import Rectangles
from raytracer.gpu.gl import largest_point, release, set_uniforms

# The pixels in the rectangles of one draw: they take some 20 ms on two cores.
_DRAW = 2**20
# The corners, of four, of a rectangle's two triangles.
_CORNERS = np.array([0, 1, 2, 2, 1, 3], np.int32)


class RectangleDraw:
    """A mesh of rectangles for one program. It stays on the GPU until released."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program) -> None:
        self._context = context
        self.program = program
        self._mesh: Rectangles | None = None  # the mesh in the buffer
        self._buffer = context.buffer(reserve=24)
        self._array = context.vertex_array(program, [], index_buffer=self._buffer)
        self._points = False
        self._largest_point = min(2 * MARGIN, largest_point(context))

    def upload(self, mesh: Rectangles) -> None:
        """Upload a mesh for the next draws, unless the GPU has it already."""
        if mesh is self._mesh:
            return
        self._mesh = None
        # Small rectangles are drawn as points: llvmpipe shades the pixels along a rectangle's diagonal twice.
        self._points = mesh.largest <= self._largest_point
        indices = mesh.numbers if self._points else (4 * mesh.numbers[:, None] + _CORNERS).astype(np.int32)
        self._buffer.orphan(max(24, indices.nbytes))
        self._buffer.write(np.ascontiguousarray(indices))
        self._mesh = mesh

    def draw(self) -> None:
        """Draw the mesh into the framebuffer in use. A large mesh takes several draws; wait for each to finish."""
        assert self._mesh
        set_uniforms(self.program, points=self._points)
        self._context.enable(moderngl.PROGRAM_POINT_SIZE)
        mode, vertices = (moderngl.POINTS, 1) if self._points else (moderngl.TRIANGLES, 6)
        ends = np.cumsum(self._mesh.costs)
        first = 0
        while first < len(ends):
            before = int(ends[first - 1]) if first else 0
            last = max(int(np.searchsorted(ends, before + _DRAW)), first + 1)
            self._array.render(mode, vertices * (last - first), first=vertices * first)
            self._context.finish()
            first = last

    def release(self) -> None:
        """Release everything on the GPU but the program."""
        release(self._context, self._array, self._buffer)
