"""What several modules do with OpenGL and moderngl leaves to them."""

from __future__ import annotations

import ctypes
import struct
from typing import Any

import moderngl

from raytracer.glsl_source import ShaderError

_RENDERBUFFER, _DEPTH_COMPONENT32F = 0x8D41, 0x8CAC
# OpenGL's calling convention is Windows's own there.
_FUNCTION: Any = getattr(ctypes, "WINFUNCTYPE", ctypes.CFUNCTYPE)


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


def depth_buffer(context: moderngl.Context, size: tuple[int, int]) -> moderngl.Renderbuffer:
    """A depth buffer of 32-bit floats, of `size` (width, height): moderngl's own have 24 bits.

    `context` must be one that raytracer.context has opened, and current.
    """
    buffer = context.depth_renderbuffer(size)
    bind = _FUNCTION(None, ctypes.c_uint, ctypes.c_uint)(_address(context, "glBindRenderbuffer"))
    storage = _FUNCTION(None, ctypes.c_uint, ctypes.c_uint, ctypes.c_int, ctypes.c_int)(
        _address(context, "glRenderbufferStorage")
    )
    bind(_RENDERBUFFER, buffer.glo)
    storage(_RENDERBUFFER, _DEPTH_COMPONENT32F, *size)
    bind(_RENDERBUFFER, 0)
    return buffer


def _address(context: moderngl.Context, name: str) -> int:
    return context.extra.load_opengl_function(name)
