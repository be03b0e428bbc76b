"""Uploads a frame to the GPU: lights, and surfaces in double precision, to uniform blocks; the rest to textures."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from raytracer.compiler.frame import Frame
from raytracer.gpu.gl import BufferTexture, volume_texture
from raytracer.gpu.texture_units import SCENE_UNITS

# Binding points of uniform blocks.
_BLOCKS = {"Surfaces": 0, "CameraTerms": 1, "Lights": 2, "Bodies": 3}


class SceneBuffers:
    """The numbers of one frame on the GPU. They stay there until closed."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._blocks: dict[str, moderngl.Buffer] = {}
        self._textures: dict[str, BufferTexture] = {}
        self._measured: moderngl.Texture3D | None = None
        self._uploaded: dict[str, object] = {}  # the parts of frames on the GPU, by their names

    def upload(self, frame: Frame) -> None:
        """Upload the parts of `frame` that are not the same objects as the parts on the GPU."""
        textures = frame.textures
        parts: dict[str, Any] = {**frame.blocks, **textures, "measured": frame.measured}
        for name, part in parts.items():
            before = self._uploaded.get(name)
            if before is part or (name in textures and _are_same(before, part)):
                continue
            self._uploaded.pop(name, None)  # until the part is complete: an interrupt may come first
            if name in _BLOCKS:
                self._write_block(name, part)
            elif name == "measured":
                self._write_measured(part)
            else:
                if name not in self._textures:
                    self._textures[name] = BufferTexture(self._context)
                self._textures[name].write(part)
            self._uploaded[name] = part

    def _write_block(self, name: str, data: bytes) -> None:
        """Write a uniform block, into the existing buffer if the size is right."""
        buffer = self._blocks.get(name)
        if buffer and buffer.size == len(data):
            buffer.write(data)
            return
        if buffer:
            self._blocks.pop(name).release()
        if data:
            self._blocks[name] = self._context.buffer(data, dynamic=True)

    def _write_measured(self, tables: list[Any]) -> None:
        """Upload the tables of measured materials, stacked in one volume texture."""
        if self._measured:
            self._measured.release()
            self._measured = None
        if tables:
            self._measured = volume_texture(self._context, np.concatenate([table.values for table in tables]))

    def attach(self, program: moderngl.Program) -> None:
        """Set the binding points of the uniform blocks of `program`. DrawPlayer.use() sets the units of its
        samplers."""
        for name in self._blocks:
            if name in program:
                program[name].binding = _BLOCKS[name]  # pyright: ignore[reportAttributeAccessIssue]

    def bind(self) -> None:
        """Bind the blocks and textures for the next draws."""
        for name, buffer in self._blocks.items():
            buffer.bind_to_uniform_block(_BLOCKS[name])
        for name, texture in self._textures.items():
            texture.use(SCENE_UNITS[name])
        if self._measured:
            self._measured.use(SCENE_UNITS["measured"])

    def close(self) -> None:
        """Release everything on the GPU."""
        for part in (*self._blocks.values(), *self._textures.values(), self._measured):
            if part:
                part.release()


def _are_same(before: Any, parts: tuple[object, ...]) -> bool:
    """Return whether all parts of a texture are the same objects as before."""
    return before is not None and len(before) == len(parts) and all(a is b for a, b in zip(before, parts, strict=True))
