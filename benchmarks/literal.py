"""The assignment's shader written down literally (`literal.frag`), as a peer of our own draws."""

from pathlib import Path
from typing import Self

import moderngl
import numpy as np

import raytracer as rt
from benchmarks.bench import Picture, Size
from raytracer.compiler.glsl.preprocessor import assemble
from raytracer.formats.srgb import encode_srgb8
from raytracer.gpu.device import Device
from raytracer.gpu.gl import release, set_uniforms


class Literal:
    """Draws of the assignment by the literal shader, with one sample a pixel, into the float format of our pictures."""

    def __init__(self, device: Device, scene: rt.Scene, size: Size) -> None:
        self._device, self._context, self._size = device, device.context, size
        with device.turn():
            self._make(scene)

    def _make(self, scene: rt.Scene) -> None:
        context, size = self._context, self._size
        text = Path(__file__).with_name("literal.frag").read_text()
        self._program = context.program(vertex_shader=assemble("passes/screen.vert").text, fragment_shader=text)
        light = scene.lights[0]
        set_uniforms(
            self._program,
            resolution=size,
            lightPosition=light.position,
            lightColor=light.color,
            ambient=scene.ambient,
            background=scene.background,
            blinn=False,
            shadows=True,
            grid=1,
            **{
                f"materials[{i}].{name}": getattr(material, name)
                for i, material in enumerate(scene.materials)
                for name in ("ka", "kd", "ks", "h")
            },
        )
        self._array = context.vertex_array(self._program, [])
        self._texture = context.texture(size, 4, dtype="f4")
        self._target = context.framebuffer([self._texture])

    def draw(self) -> None:
        """Draw the picture, and wait until the GPU has finished."""
        with self._device.turn():
            self._target.use()
            self._array.render(moderngl.TRIANGLES, 3)
            self._context.finish()

    def picture(self) -> Picture:
        """Read the picture back, and convert it to sRGB (H, W, 3)."""
        with self._device.turn():
            data = np.frombuffer(self._target.read(components=3, dtype="f4"), np.float32)
        return encode_srgb8(data.reshape(self._size[1], self._size[0], 3)[::-1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._device.turn():
            release(self._context, self._array, self._target, self._texture, self._program)
