"""A device: one OpenGL context, its driver's limits, its programs, and the turns of the threads that draw."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NamedTuple
from weakref import WeakKeyDictionary

import moderngl

from raytracer.compiler.draws import MARGIN
from raytracer.compiler.glsl.preprocessor import ShaderError, Source, assemble
from raytracer.compiler.limits import DriverLimits
from raytracer.core.interrupts import defer_interrupts
from raytracer.gpu.adapters import Adapter, make_none_current
from raytracer.gpu.context import choose_backend, open_context
from raytracer.gpu.gl import BufferTexture, Context, Program, varying_components
from raytracer.gpu.turns import check_process, opengl_lock, turn

# The limit of the cache of compiled programs, in characters: the length of the shader texts of each program beyond
# _COMMON_TEXT, the length that all have in common, summed over programs. llvmpipe takes some 4 MB for the program of a
# tree of 8 spheres and 200 MB for one of 300, in all 0.8 to 2.3 kB a character. So the limit is up to 1 GB, most often
# half of it. The largest known need is 275,000 characters: a comparison of all settings (analysis/tradeoffs) draws with
# 58 programs.
KEPT_TEXT = 400_000
_COMMON_TEXT = 24_000

# One context serves all pictures of a process: opening a context takes longer than many a picture, and a shared context
# compiles no program twice. `rt.render` gets no device from its caller, so the process has to remember the open
# devices. The registry only grows, by at most one device for each backend and adapter.
_shared: dict[tuple[str, Adapter | None], Device] = {}


def shared_device(backend: str | None = None, adapter: Adapter | None = None) -> Device:
    """Return this process's one device of a backend and an adapter. The first call opens it.

    Raises InputError for a backend or an adapter that does not exist; ContextError if no context opens, or if this
    process was forked after its parent had used OpenGL (turns.py); RuntimeError within a progress callback.
    """
    key = choose_backend(backend, adapter)
    check_process()
    if key not in _shared:
        with opengl_lock():
            if key not in _shared:  # another thread may have opened it meanwhile
                context = open_context(backend, adapter)
                try:
                    _shared[key] = Device(context, *key)
                finally:
                    make_none_current(context)  # also if the constructor failed
    return _shared[key]


class Blending(NamedTuple):
    """The factors of the new colour and of the old colour of a pixel, as moderngl's constants."""

    new: int
    old: int


ADD = Blending(moderngl.ONE, moderngl.ONE)
OVER = Blending(moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA)


class Device:
    """One OpenGL context with its driver's limits, and a cache of programs by their texts."""

    def __init__(self, context: Context, backend: str | None = None, adapter: Adapter | None = None) -> None:
        """Query the limits of `context`. Afterwards no context is current.

        `backend` and `adapter` are the arguments by which shared_device() opens such a device in another process.
        """
        self.context, self.backend, self.adapter = context, backend, adapter
        self._programs: dict[tuple[str, str], Program] = {}  # the least recently used program first
        self._held: WeakKeyDictionary[object, set[Program]] = WeakKeyDictionary()
        with context:
            self.limits = _limits(context)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Make the context current for a block, in which no program is released. Raises the errors of turns.turn()."""
        with turn(self.context):
            self._set_state()  # an interrupt may have kept an earlier block from restoring the defaults
            self.trim()
            yield

    @contextmanager
    def state(self, *, blending: Blending | None = None, depth_test: bool = False) -> Iterator[None]:
        """Set the blending and the depth test for a block, and switch both off after it. The context must be current.

        `depth_test` keeps the nearest pixel. Blocks do not nest.
        """
        try:
            self._set_state(blending, depth_test)
            yield
        finally:
            self._set_state()

    def _set_state(self, blending: Blending | None = None, depth_test: bool = False) -> None:
        context = self.context
        if blending:
            context.blend_func = blending.new, blending.old
            context.enable(moderngl.BLEND)
        else:
            context.disable(moderngl.BLEND)
        if depth_test:
            context.depth_func = "<"
            context.enable(moderngl.DEPTH_TEST)
        else:
            context.disable(moderngl.DEPTH_TEST)

    def program(self, source: Source, vertex: Source | None = None) -> Program:
        """Return the program of a fragment shader and a vertex shader. Default vertex shader: screen.vert.

        It compiles the program unless the cache has it. The context must be current. Raises ShaderError with files and
        lines.
        """
        vertex = vertex or assemble("passes/screen.vert")
        key = vertex.text, source.text
        program = self._programs.pop(key, None)
        if program is None:
            try:
                with defer_interrupts():
                    program = self.context.program(vertex_shader=vertex.text, fragment_shader=source.text)
            except moderngl.Error as error:
                heading, _, log = str(error).rpartition("===\n")
                wrong = vertex if "vertex" in heading else source
                raise ShaderError(wrong.explain(log.strip())) from None
        self._programs[key] = program
        return program

    def has_program(self, source: Source, vertex: Source) -> bool:
        """Return whether program() with these arguments compiles nothing."""
        return (vertex.text, source.text) in self._programs

    def hold(self, owner: object, programs: Iterable[Program]) -> None:
        """Keep `programs` in the cache as long as `owner` lives, instead of the programs that it held before.

        A window holds the programs that it draws with, while the same device renders other pictures.
        """
        self._held[owner] = set(programs)

    def forget(self) -> None:
        """Release all programs without a holder. The context must be current."""
        for key in self._programs_without_holder():
            self._programs.pop(key).release()

    def trim(self) -> None:
        """Release the least recently used programs without a holder, until the cache's texts fit into KEPT_TEXT.

        The context must be current. Programs in use must have a holder.
        """
        lengths = {key: max(len(key[0]) + len(key[1]) - _COMMON_TEXT, 0) for key in self._programs}
        total = sum(lengths.values())
        for key in self._programs_without_holder():
            if total <= KEPT_TEXT:
                break
            total -= lengths[key]
            self._programs.pop(key).release()

    def _programs_without_holder(self) -> list[tuple[str, str]]:
        """Return the texts of the programs without a holder, the least recently used first."""
        held = set().union(*self._held.values())
        return [key for key, program in self._programs.items() if program not in held]


def _limits(context: Context) -> DriverLimits:
    """Query the limits of the driver of `context`, which must be current."""
    info = context.info
    return DriverLimits(
        driver=info["GL_RENDERER"],
        version=context.version_code,
        target=min(info["GL_MAX_TEXTURE_SIZE"], min(info["GL_MAX_VIEWPORT_DIMS"][:2]) - 2 * MARGIN),
        varyings=varying_components(context),
        uniform_block=info["GL_MAX_UNIFORM_BLOCK_SIZE"],
        buffer_texels=BufferTexture.most(context),
        volume_layers=info["GL_MAX_3D_TEXTURE_SIZE"],
    )
