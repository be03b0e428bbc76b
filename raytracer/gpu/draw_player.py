"""The OpenGL player of lists of draws (compiler/draws.py): it binds textures, sets uniforms and draws meshes."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.draws import Clear, Draw, Screen, Step
from raytracer.compiler.meshes import Cells, Rectangle, Rectangles
from raytracer.core.validation import InputError
from raytracer.gpu.cell_draw import CellDraw
from raytracer.gpu.device import ADD, OVER, Device
from raytracer.gpu.gl import (
    Context,
    Framebuffer,
    Program,
    Texture,
    clear_integers,
    depth_buffer,
    read_top_first,
    release,
    set_constants,
    set_sampler,
    set_uniforms,
)
from raytracer.gpu.rectangle_draw import RectangleDraw
from raytracer.gpu.texture_units import UNITS

# The target duration of one draw, in seconds: short enough that the desktop does not stall.
_SHORT_DRAW = 0.05
# The pixels of the first draw of a program, and of the smallest draw.
_FIRST_DRAW, _LEAST_DRAW = 2**16, 2**12
_BLENDING = {"replace": None, "add": ADD, "over": OVER}


class ScreenDraw:
    """A triangle that covers the viewport, for one program. It stays on the GPU until released."""

    def __init__(self, context: Context, program: Program) -> None:
        self._array = context.vertex_array(program, [])

    def upload(self, mesh: Screen) -> None:
        """Do nothing: screen.vert makes the triangle itself."""

    def draw(self) -> None:
        """Draw the triangle into the framebuffer in use."""
        self._array.render(vertices=3)

    def release(self) -> None:
        """Release everything on the GPU but the program."""
        self._array.release()


_MESHES: dict[type, type[CellDraw | RectangleDraw | ScreenDraw]] = {
    Cells: CellDraw,
    Rectangles: RectangleDraw,
    Screen: ScreenDraw,
}


class DrawPlayer:
    """Programs and textures by name, with the framebuffers and meshes that their draws need.

    They stay on the GPU until closed. The device's context must be current in all calls.
    """

    def __init__(self, device: Device) -> None:
        self._device, self._context = device, device.context
        self._programs: dict[str, Program] = {}
        self._meshes: dict[str, CellDraw | RectangleDraw | ScreenDraw] = {}  # by program
        self._textures: dict[str, Any] = {}
        self._names: Mapping[str, str] = {}  # a texture's own name, by the name that draws use (rename())
        self._framebuffers: dict[tuple[str, ...], Framebuffer] = {}  # by the textures' names, the depth texture last
        self._long_draws: dict[str, int] = {}  # by program: the number of pixels that take _SHORT_DRAW

    def use(self, programs: Mapping[str, Program], replaced: Collection[str] = ()) -> None:
        """Add programs by name. Drop the programs with the names `replaced` unless a new program has the name."""
        for name in {*programs, *replaced} & self._programs.keys():
            if self._programs[name] is not programs.get(name):
                if mesh := self._meshes.pop(name, None):
                    release(self._context, mesh)
                del self._programs[name]
                self._long_draws.pop(name, None)
        for name, program in programs.items():
            for sampler, unit in UNITS.items():
                if sampler in program:
                    set_sampler(self._context, program, sampler, unit)
            self._programs[name] = program
        self._device.hold(self, self._programs.values())

    def has_program(self, name: str) -> bool:
        """Return whether there is a program of that name."""
        return name in self._programs

    def rename(self, names: Mapping[str, str]) -> None:
        """Let each key of `names` stand for the texture whose name is its value. It replaces earlier renames."""
        self._names = names

    def add_texture(self, name: str, size: tuple[int, int], components: int, dtype: str = "f4") -> None:
        """Create a texture of `size` (width, height). It replaces a texture of the same name.

        Raises InputError if the GPU has not enough memory.
        """
        self.remove_texture(name)
        self._textures[self._own_name(name)] = self._context.texture(size, components, dtype=dtype)
        if self._context.error == "GL_OUT_OF_MEMORY":
            raise InputError(
                f"expected memory on the GPU for a texture of {size[0]}x{size[1]} pixels, got too little; "
                "a remedy is a smaller picture",
                "size",
            )

    def add_depth(self, name: str, size: tuple[int, int]) -> None:
        """Create a depth texture of `size` (width, height)."""
        self._textures[name] = depth_buffer(self._context, size)

    def texture(self, name: str) -> Texture:
        """Return the texture of that name, for another player's draws."""
        return self._textures[self._own_name(name)]

    def has_texture(self, name: str) -> bool:
        """Return whether there is a texture of that name."""
        return self._own_name(name) in self._textures

    def write(self, name: str, values: NDArray[Any]) -> None:
        """Write values (H, W, ...), the lowest row first, into the lower left of a texture."""
        height, width = values.shape[:2]
        self.texture(name).write(np.ascontiguousarray(values), viewport=(0, 0, width, height))

    def read(self, name: str, area: Rectangle, components: int) -> NDArray[Any]:
        """Read an area of a texture (H, W, components), the lowest row first."""
        dtype: str = self.texture(name).dtype
        data = self._framebuffer((name,)).read(area, components=components, dtype=dtype)
        return np.frombuffer(data, {"f4": np.float32, "i4": np.int32}[dtype]).reshape(area[3], area[2], components)

    def read_top_first(self, name: str, area: Rectangle, out: NDArray[np.float32]) -> None:
        """Read an area of a texture into `out` (H, W, components), C-contiguous, the top row first."""
        read_top_first(self._context, self._framebuffer((name,)), area, out)

    def play(
        self,
        steps: Iterable[Step],
        *,
        screen: Framebuffer | None = None,
        textures: Mapping[str, Texture] | None = None,
    ) -> None:
        """Play a list of draws. `screen` is the target "screen"; `textures` are textures of another player."""
        renamed = {
            name: self._textures[own_name] for name, own_name in self._names.items() if own_name in self._textures
        }
        known = self._textures | renamed | dict(textures or {})
        for part, group in groupby(steps, _part):
            if part is None:
                for step in group:
                    if isinstance(step, Clear):
                        self._clear(step)
                    else:
                        self._draw(step, step.area, known, screen)
                continue
            draws = [step for step in group if isinstance(step, Draw)]
            for band in self._bands(part[1], draws[0].program):
                for draw in draws:
                    self._draw(draw, band, known, screen)
                self._context.finish()

    def _clear(self, step: Clear) -> None:
        texture = self.texture(step.texture)
        if texture.depth:
            framebuffer = self._framebuffer((), step.texture)
            framebuffer.scissor = step.area or (0, 0, *framebuffer.size)
            framebuffer.clear(depth=step.value[0])
            return
        framebuffer = self._framebuffer((step.texture,))
        if texture.dtype == "i4":
            clear_integers(self._context, framebuffer)
            return
        framebuffer.scissor = step.area or (0, 0, *framebuffer.size)
        framebuffer.use()
        framebuffer.clear(color=step.value)

    def _draw(self, draw: Draw, area: Rectangle, textures: Mapping[str, Any], screen: Framebuffer | None) -> None:
        program = self._programs[draw.program]
        framebuffer = screen if draw.target == ("screen",) else self._framebuffer(draw.target, draw.depth)
        assert framebuffer
        mesh = self._mesh(draw, program)
        framebuffer.use()
        framebuffer.viewport, framebuffer.scissor = draw.viewport, area
        set_constants(program, draw.constants)
        set_uniforms(program, **draw.uniforms)
        for sampler, name in draw.inputs.items():
            textures[name].use(UNITS[sampler])
        with self._device.state(blending=_BLENDING[draw.blending], depth_test=draw.depth is not None):
            mesh.draw()

    def _mesh(self, draw: Draw, program: Program) -> CellDraw | RectangleDraw | ScreenDraw:
        """Upload the mesh of a draw, and return it."""
        mesh = self._meshes.get(draw.program)
        if mesh is None:
            mesh = self._meshes[draw.program] = _MESHES[type(draw.mesh)](self._context, program)
        mesh.upload(draw.mesh)  # pyright: ignore[reportArgumentType]
        return mesh

    def _bands(self, area: Rectangle, program: str) -> Iterator[Rectangle]:
        """Yield the area in bands of rows, each of which takes `program` about _SHORT_DRAW seconds."""
        x, y, width, height = area
        top = y + height
        while y < top:
            rows = min(top - y, -(-self._long_draws.get(program, _FIRST_DRAW) // width))
            begin = time.perf_counter()
            yield x, y, width, rows
            change = _SHORT_DRAW / max(time.perf_counter() - begin, 1e-9)
            self._long_draws[program] = max(_LEAST_DRAW, int(rows * width * min(max(change, 0.25), 8.0)))
            y += rows

    def forget_times(self) -> None:
        """Forget the durations of draws: draws of few pixels do not predict draws of many."""
        self._long_draws.clear()

    def _framebuffer(self, target: tuple[str, ...], depth: str | None = None) -> Framebuffer:
        key = (*map(self._own_name, target), depth or "")
        if key not in self._framebuffers:
            colors = [self.texture(name) for name in target]
            self._framebuffers[key] = self._context.framebuffer(colors, self._textures[depth] if depth else None)
        return self._framebuffers[key]

    def remove_texture(self, name: str) -> None:
        """Release the texture of that name, if there is one."""
        own_name = self._own_name(name)
        if own_name in self._textures:
            for key in [key for key in self._framebuffers if own_name in key]:
                release(self._context, self._framebuffers.pop(key))
            release(self._context, self._textures.pop(own_name))

    def _own_name(self, name: str) -> str:
        """Return a texture's own name."""
        return self._names.get(name, name)

    def close(self) -> None:
        """Release everything on the GPU but the programs."""
        release(self._context, *self._framebuffers.values(), *self._meshes.values(), *self._textures.values())
        for kept in (self._framebuffers, self._meshes, self._textures, self._programs):
            kept.clear()
        self._device.hold(self, ())


def _part(step: Step) -> tuple[tuple[str, ...], Rectangle] | None:
    """Return the target and area of a long draw, which is drawn band by band; None for any other step."""
    return (step.target, step.area) if isinstance(step, Draw) and step.is_long else None
