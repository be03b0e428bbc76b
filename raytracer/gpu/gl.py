"""OpenGL calls that several modules share, and calls that moderngl lacks: buffer textures, float depth.

Each `context` comes from raytracer.gpu.context, and must be current. Other packages import the types of OpenGL's
objects from here, because only this package imports moderngl.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.glsl.preprocessor import ShaderError
from raytracer.gpu.turns import ContextError

Context = moderngl.Context
Framebuffer = moderngl.Framebuffer
Program = moderngl.Program
Texture = moderngl.Texture
VertexArray = moderngl.VertexArray

_ALIASED_POINT_SIZE_RANGE = 0x846D
_TEXTURE0, _TEXTURE_BUFFER, _MAX_TEXTURE_BUFFER_SIZE = 0x84C0, 0x8C2A, 0x8C2B
# The internal format of a buffer texture, by the type and number of its components.
_FORMATS = {("f", 4): 0x8814, ("i", 4): 0x8D82, ("i", 2): 0x823B, ("i", 1): 0x8235}
_COLOR = 0x1800
_INVERTING, _PACK_INVERT = "GL_MESA_pack_invert", 0x8758
_MAX_VARYING_COMPONENTS, _MAX_VERTEX_OUTPUT_COMPONENTS = 0x8B4B, 0x9122
_RENDERBUFFER, _DEPTH_COMPONENT32F = 0x8D41, 0x8CAC
# On Windows, OpenGL has Windows's own calling convention.
_FUNCTION: Any = getattr(ctypes, "WINFUNCTYPE", ctypes.CFUNCTYPE)
_Uint, _Int = ctypes.c_uint, ctypes.c_int


def release(context: moderngl.Context, *objects: Any) -> None:
    """Release OpenGL objects, which may be framebuffers.

    When moderngl creates a framebuffer, it then binds the framebuffer that was in use before. That one must still
    exist, so the default framebuffer is bound first.
    """
    context.detect_framebuffer(0).use()
    for item in objects:
        item.release()


def set_uniforms(program: moderngl.Program, **values: object) -> None:
    """Set the uniforms that the program has. Others are ignored, because compilers remove unused uniforms.

    Raises ShaderError for a value that does not fit the type in the shader.
    """
    for name, value in values.items():
        uniform: Any = program.get(name, None)
        if uniform is not None:
            try:
                uniform.value = value
            except (struct.error, TypeError, ValueError, moderngl.Error) as error:
                raise ShaderError(f"uniform {name}: expected a type that takes {value!r}: {error}") from None


def set_constants(program: moderngl.Program, constants: Mapping[str, object]) -> None:
    """Set uniforms that many draws share, unless the program has the same object `constants` already.

    Raises ShaderError as set_uniforms() does.
    """
    if program.extra is not constants:
        program.extra = None  # until all uniforms are set: an interrupt or an error may come first
        set_uniforms(program, **constants)
        program.extra = constants


def depth_buffer(context: moderngl.Context, size: tuple[int, int]) -> moderngl.Renderbuffer:
    """Create a depth buffer of 32-bit floats, of `size` (width, height). moderngl's own have 24 bits."""
    buffer = context.depth_renderbuffer(size)
    bind = _function(context, "glBindRenderbuffer", _Uint, _Uint)
    bind(_RENDERBUFFER, buffer.glo)
    _function(context, "glRenderbufferStorage", _Uint, _Uint, _Int, _Int)(_RENDERBUFFER, _DEPTH_COMPONENT32F, *size)
    bind(_RENDERBUFFER, 0)
    return buffer


def clear_integers(context: moderngl.Context, framebuffer: moderngl.Framebuffer) -> None:
    """Set all pixels of a framebuffer's first target, a texture of integers, to 0. The framebuffer stays in use."""
    framebuffer.scissor = (0, 0, *framebuffer.size)
    framebuffer.use()
    _function(context, "glClearBufferiv", _Uint, _Int, ctypes.POINTER(_Int))(_COLOR, 0, (_Int * 4)())


def read_top_first(
    context: moderngl.Context,
    framebuffer: moderngl.Framebuffer,
    area: tuple[int, int, int, int],
    out: NDArray[np.float32],
) -> None:
    """Read an area of a framebuffer into `out` (H, W, components), C-contiguous, the top row first."""
    components = out.shape[2]
    if _INVERTING in context.extensions:
        # Mesa reverses the rows while it reads, which saves a copy.
        store = _function(context, "glPixelStorei", _Uint, _Int)
        try:
            store(_PACK_INVERT, 1)
            framebuffer.read_into(out, area, components=components, dtype="f4")
        finally:
            store(_PACK_INVERT, 0)
    else:
        data = framebuffer.read(area, components=components, dtype="f4")
        out[:] = np.frombuffer(data, np.float32).reshape(out.shape)[::-1]


def largest_point(context: moderngl.Context) -> int:
    """Return the side of the largest point, in pixels."""
    sizes = (ctypes.c_float * 2)()
    _function(context, "glGetFloatv", _Uint, ctypes.POINTER(ctypes.c_float))(_ALIASED_POINT_SIZE_RANGE, sizes)
    return int(sizes[1])


def varying_components(context: moderngl.Context) -> int:
    """Return the number of varying components of a vertex shader, besides gl_Position and gl_PointSize."""
    get = _function(context, "glGetIntegerv", _Uint, ctypes.POINTER(_Int))
    varyings, outputs = _Int(), _Int()
    get(_MAX_VARYING_COMPONENTS, ctypes.byref(varyings))
    get(_MAX_VERTEX_OUTPUT_COMPONENTS, ctypes.byref(outputs))
    # OpenGL 3.3 promises 60 and 64. A driver may count gl_Position (4 components) and gl_PointSize as outputs.
    return min(varyings.value, outputs.value - 5)


def volume_texture(context: moderngl.Context, values: NDArray[np.float32]) -> moderngl.Texture3D:
    """Create a texture for a sampler3D from values (D, H, W, 3)."""
    depth, height, width, components = values.shape
    return context.texture3d((width, height, depth), components, np.ascontiguousarray(values), dtype="f4")


class BufferTexture:
    """A row of texels for a samplerBuffer. llvmpipe fetches a texel in a third of the time that a 2D texture takes."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._buffer: moderngl.Buffer | None = None
        self._parts: dict[int, NDArray[Any]] = {}  # the parts in the buffer, by the byte at which each begins
        self._name = _Uint()
        self._active = _function(context, "glActiveTexture", _Uint)
        self._bind = _function(context, "glBindTexture", _Uint, _Uint)
        _function(context, "glGenTextures", _Int, ctypes.POINTER(_Uint))(1, ctypes.byref(self._name))

    @staticmethod
    def most(context: moderngl.Context) -> int:
        """Return the limit of texels in one buffer texture."""
        texels = _Int()
        get = _function(context, "glGetIntegerv", _Uint, ctypes.POINTER(_Int))
        get(_MAX_TEXTURE_BUFFER_SIZE, ctypes.byref(texels))
        return texels.value

    def write(self, parts: Sequence[NDArray[Any]]) -> None:
        """Write parts one after the other: each (N, 4) float32 or int32, or (N, 2) or (N,) int32.

        All writes must have one type and number of components. A part that is the same object at the same place as
        before is not written again.
        """
        size = sum(part.nbytes for part in parts)
        before, self._parts = self._parts, {}  # empty until all parts are written: an interrupt may come first
        if self._buffer is None or not size <= self._buffer.size <= 4 * max(size, 1024):
            if self._buffer:
                self._buffer.release()
            # A quarter more than needed, because lists change their length with every move of the camera.
            self._buffer = self._context.buffer(reserve=max(1024, size + size // 4), dynamic=True)
            form = _FORMATS[parts[0].dtype.kind, parts[0].shape[1] if parts[0].ndim > 1 else 1]
            self._bind(_TEXTURE_BUFFER, self._name.value)
            _function(self._context, "glTexBuffer", _Uint, _Uint, _Uint)(_TEXTURE_BUFFER, form, self._buffer.glo)
            before = {}
        now: dict[int, NDArray[Any]] = {}
        begin = 0
        for part in parts:
            if not part.nbytes:
                continue
            if before.get(begin) is not part:
                self._buffer.write(np.ascontiguousarray(part), offset=begin)
            now[begin] = part
            begin += part.nbytes
        self._parts = now

    def use(self, unit: int) -> None:
        """Bind the texture to a texture unit."""
        self._active(_TEXTURE0 + unit)
        self._bind(_TEXTURE_BUFFER, self._name.value)

    def release(self) -> None:
        """Release the texture and its buffer."""
        delete = _function(self._context, "glDeleteTextures", _Int, ctypes.POINTER(_Uint))
        delete(1, ctypes.byref(self._name))
        if self._buffer:
            self._buffer.release()


def set_sampler(context: moderngl.Context, program: moderngl.Program, name: str, unit: int) -> None:
    """Set the texture unit of a sampler of `program`. moderngl cannot do so for a samplerBuffer."""
    _function(context, "glUseProgram", _Uint)(program.glo)
    location = program[name].location  # pyright: ignore[reportAttributeAccessIssue]
    _function(context, "glUniform1i", _Int, _Int)(location, unit)


def _function(context: moderngl.Context, name: str, *types: Any) -> Any:
    """Load an OpenGL function that returns nothing. `types` are the types of its arguments."""
    address = context.extra.load_opengl_function(name)
    if not address:
        raise ContextError(f"this driver has no {name}, a function of OpenGL 3.3")
    return _FUNCTION(None, *types)(address)
