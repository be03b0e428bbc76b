"""The passes that draw one tile: what each pixel sees, then its light, summed over samples."""

from __future__ import annotations

import math
import struct
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer import view_space
from raytracer.film import Image
from raytracer.glsl_source import ShaderError
from raytracer.sampling import sample_point
from raytracer.scene import Scene
from raytracer.settings import Settings

Rectangle = tuple[int, int, int, int]  # x, y, width, height; x, y the lower left pixel of the picture
# Uniform blocks' binding points.
_BLOCKS = {"Surfaces": 0, "CameraTerms": 1, "Materials": 2, "Lights": 3}


class Passes:
    """Targets of `target` (width, height) pixels, and a scene's numbers, on the GPU until closed."""

    def __init__(self, context: moderngl.Context, target: tuple[int, int]) -> None:
        self._context = context
        self._programs: tuple[moderngl.Program, ...] = ()
        self._arrays: list[moderngl.VertexArray] = []
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._numbers: object = None  # of which scene the buffers are, but for its lights
        self._normal_depth = context.texture(target, 4, dtype="f4")
        self._surface = context.texture(target, 1, dtype="i4")
        self.radiance = context.texture(target, 4, dtype="f4")  # the sum of the samples
        self._seen = context.framebuffer([self._normal_depth, self._surface])
        self._light = context.framebuffer([self.radiance])

    def load(
        self,
        programs: tuple[moderngl.Program, moderngl.Program],
        scene: Scene,
        settings: Settings,
        size: tuple[int, int],
    ) -> None:
        """Take the numbers of `scene` for a picture of `size`. `programs` draw the two passes of its structure.

        Raises ShaderError if a program has a uniform of another type than it should have.
        """
        self._to_world = view_space.rotation(scene.camera).astype(np.float32)
        precision = settings.precision
        self._write("Lights", view_space.lights_block(scene, precision))
        # Lights move, and then all else is as it was. Equal tuples of the same things are quickly compared.
        numbers = programs, scene.objects, scene.camera, scene.materials, settings, size
        if numbers != self._numbers:
            blocks = {
                "Surfaces": view_space.surfaces_block(scene, precision),
                "CameraTerms": view_space.camera_terms_block(scene, size, precision),
                "Materials": view_space.materials_block(scene, settings),
            }
            for name, block in blocks.items():
                self._write(name, block)
            self._material_index = view_space.material_index(scene)
            self._numbers = numbers
        if programs != self._programs:
            release(self._context, *self._arrays)
            self._arrays = [self._context.vertex_array(program, []) for program in programs]
            self._programs = programs
        for program in programs:
            set_uniforms(
                program,
                resolution=size,
                pixelScale=view_space.pixel_scale(scene.camera, size[1]),
                ambient=scene.ambient,
                background=scene.background,
                toWorld=tuple(self._to_world.ravel().tolist()),  # rows of the way there are columns of the way back
                focus=math.dist(scene.camera.position, scene.camera.look_at),
                normalDepth=0,
                surface=1,
                tileOrigin=(0, 0),
                samplePoint=(0.0, 0.0),
            )
            for name in self._buffers:
                if name in program:
                    program[name].binding = _BLOCKS[name]  # pyright: ignore[reportAttributeAccessIssue]

    def _write(self, name: str, data: bytes) -> None:
        """Bring a uniform block to the GPU, into the buffer that is there if that has the size."""
        buffer = self._buffers.get(name)
        if buffer and buffer.size == len(data):
            buffer.write(data)
            return
        if buffer:
            self._buffers.pop(name).release()
        if data:
            self._buffers[name] = self._context.buffer(data, dynamic=True)

    def draw(self, tile: Rectangle, k: int, *, anew: bool) -> None:
        """Draw sample k = 0, 1, ... of a tile and wait for it; add it to the sum, or begin one `anew`."""
        sx, sy = sample_point(k)
        for program in self._programs:
            set_uniforms(program, tileOrigin=tile[:2], samplePoint=(2.0 * sx - 1.0, 1.0 - 2.0 * sy))
        for name, buffer in self._buffers.items():
            buffer.bind_to_uniform_block(_BLOCKS[name])
        viewport = (0, 0, *tile[2:])

        self._context.disable(moderngl.BLEND)
        self._seen.use()
        self._seen.viewport = viewport
        self._arrays[0].render(moderngl.TRIANGLES, 3)

        self._light.use()
        self._light.viewport = viewport
        if anew:
            self._light.clear()
        # Always blending: llvmpipe would compile the shader a second time to draw without.
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        self._normal_depth.use(0)
        self._surface.use(1)
        self._arrays[1].render(moderngl.TRIANGLES, 3)
        self._context.disable(moderngl.BLEND)
        self._context.finish()

    def read_sum(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """(H, W, 3): the sum of the samples, top row first."""
        width, height = size
        data = self._light.read((0, 0, width, height), components=3, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(height, width, 3)[::-1]

    def read_geometry(self, image: Image, where: tuple[slice, slice]) -> None:
        """Put what the sample just drawn sees into the other arrays of `image`."""
        assert image.depth is not None and image.normal is not None and image.material is not None
        height, width = image.depth[where].shape
        area = (0, 0, width, height)
        data = np.frombuffer(self._seen.read(area, components=4, dtype="f4"), np.float32)
        seen = data.reshape(height, width, 4)[::-1]
        data = np.frombuffer(self._seen.read(area, components=1, attachment=1, dtype="i4"), np.int32)
        surface = data.reshape(height, width)[::-1]
        image.normal[where] = seen[..., :3] @ self._to_world
        image.depth[where] = np.where(surface == 0, np.float32(np.inf), seen[..., 3])
        image.material[where] = self._material_index[np.abs(surface) - 1]

    def close(self) -> None:
        """Give back everything on the GPU."""
        targets = (self._normal_depth, self._surface, self.radiance)
        release(self._context, *self._arrays, self._seen, self._light, *targets, *self._buffers.values())


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
