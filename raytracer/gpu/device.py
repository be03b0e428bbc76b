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
from raytracer.core.interrupts import deferred
from raytracer.gpu.adapters import Adapter, leave
from raytracer.gpu.context import chosen, open_context
from raytracer.gpu.gl import BufferTexture, Context, Program, varying_components
from raytracer.gpu.turns import alone, check_process, turn

# Characters of the texts of all programs that are kept, without the characters that every text has: llvmpipe takes some
# 4 MB for the program of a tree of 8 spheres, 200 MB for one of 300, in all 0.8 to 2.3 kB a character. So many are up
# to 1 GB, most often half of it. A page of all knobs (analysis/tradeoffs) times 58 programs of 275,000 characters.
KEPT_TEXT = 400_000
_COMMON_TEXT = 24_000

# One context serves all pictures of a process: opening a context takes longer than many a picture, and no program is
# compiled twice. `rt.render` gets no device from its caller, so the process has to remember the open ones. The registry
# only grows, by at most one device for each backend and adapter.
_shared: dict[tuple[str, Adapter | None], Device] = {}


def shared_device(backend: str | None = None, adapter: Adapter | None = None) -> Device:
    """This process's one device of a backend and an adapter, opened at the first call.

    Raises InputError for a backend or an adapter that is not there, ContextError if no context opens or in a process
    that was forked from one that had begun with OpenGL (turns.py), RuntimeError within a progress callback.
    """
    key = chosen(backend, adapter)
    check_process()
    if key not in _shared:
        with alone():
            if key not in _shared:  # another thread may have been before
                context = open_context(backend, adapter)
                try:
                    _shared[key] = Device(context, *key)
                finally:
                    leave(context)  # also where the constructor failed before its own end
    return _shared[key]


class Blending(NamedTuple):
    """Factors of the new color and of the color that is there, as moderngl's constants."""

    new: int
    old: int


ADD = Blending(moderngl.ONE, moderngl.ONE)
OVER = Blending(moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA)


class Device:
    """One OpenGL context with its driver's limits and the programs that were used last, by their texts."""

    def __init__(self, context: Context, backend: str | None = None, adapter: Adapter | None = None) -> None:
        """Ask `context` for its limits, after which no context is current.

        `backend` and `adapter` are how shared_device() finds such a device in another process.
        """
        self.context, self.backend, self.adapter = context, backend, adapter
        self._programs: dict[tuple[str, str], Program] = {}  # the least recently used first
        self._held: WeakKeyDictionary[object, set[Program]] = WeakKeyDictionary()
        with context:
            self.limits = _limits(context)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Have the context current for a block, in which no program is released. Errors are those of turns.turn()."""
        with turn(self.context):
            self._set_state()  # an interrupt may have come while a block put the defaults back
            self.trim()
            yield

    @contextmanager
    def state(self, *, blending: Blending | None = None, depth_test: bool = False) -> Iterator[None]:
        """Have OpenGL draw in these ways for a block, and in none of them after it. The context must be current.

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
        """The program with this fragment shader, and screen.vert or another; the context must be current.

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

    def has_program(self, source: Source, vertex: Source) -> bool:
        """Whether `program` compiles nothing."""
        return (vertex.text, source.text) in self._programs

    def hold(self, owner: object, programs: Iterable[Program]) -> None:
        """Keep `programs` as long as `owner` lives, in place of the programs held for it before.

        A window holds the programs that it draws with, while other pictures are made by the same device.
        """
        self._held[owner] = set(programs)

    def forget(self) -> None:
        """Release all programs that nobody holds. The context must be current."""
        for key in self._not_held():
            self._programs.pop(key).release()

    def trim(self) -> None:
        """Release the least recently used programs that nobody holds, if there are more than KEPT_TEXT.

        The context must be current, and no program in use but those that are held.
        """
        lengths = {key: max(len(key[0]) + len(key[1]) - _COMMON_TEXT, 0) for key in self._programs}
        total = sum(lengths.values())
        for key in self._not_held():
            if total <= KEPT_TEXT:
                break
            total -= lengths[key]
            self._programs.pop(key).release()

    def _not_held(self) -> list[tuple[str, str]]:
        """The texts of the programs that nobody holds, the least recently used first."""
        held = set().union(*self._held.values())
        return [key for key, program in self._programs.items() if program not in held]


def _limits(context: Context) -> DriverLimits:
    """The limits of the driver of `context`, which must be current."""
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
