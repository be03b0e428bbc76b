"""The picture in the window: drawn sample by sample on the GPU, and presented there, without read-back."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping, Sequence
from functools import partial

import moderngl
import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler import view_space
from raytracer.compiler.compiled_scene import CompiledScene, compile
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.glsl.preprocessor import ShaderError, Source, assemble
from raytracer.compiler.glsl.shaders import Show, plain_vertex_source
from raytracer.core.validation import InputError
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.gl import release, set_uniforms
from raytracer.rendering.error_estimate import is_surely_below
from raytracer.rendering.passes import Passes, Programs
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.still_error import StillError
from raytracer.scene.scene import Camera, PointLight, Scene
from raytracer.scene.settings import Settings

# Text or the like: (h, w, 4) uint8 with the top row first, and the window's pixel under its lower left one.
Panel = tuple[NDArray[np.uint8], tuple[int, int]]

# Fragment shaders of what `present` draws, and values of the types that their uniforms should have.
_ON_SCREEN: dict[str, dict[str, object]] = {
    "present": {"radianceSum": 0, "samples": 1.0, "enlarged": 1},
    "marker": {"center": (0.0, 0.0), "radius": 1.0, "fill": (0.0, 0.0, 0.0), "inView": True},
    "panel": {"panel": 0, "corner": (0, 0)},
}
# Larger pixels would show nothing any more.
_MOST_ENLARGED = 16
# In pixels, at display scale 1. A marker is as large as a cursor, which users find.
MARKER_RADIUS = 14.0
_LABEL_GAP = 4.0


class Pace:
    """How long samples take, and so how large the pixels of a moving picture must be."""

    def __init__(self, budget: float) -> None:
        self._budget = budget  # seconds for one sample
        self._recent: deque[float] = deque(maxlen=5)

    def add(self, seconds: float) -> None:
        """Take note of a sample by its seconds a pixel."""
        self._recent.append(seconds)

    def enlarged(self, pixels: int) -> int:
        """The side, in pixels of the window, of the smallest pixels that keep a sample within the budget.

        By the fastest of the last samples: the slow ones had to wait for a compiler, or another process.
        """
        if not self._recent:
            return 1
        seconds = min(self._recent) * pixels
        return min(_MOST_ENLARGED, max(1, int(np.ceil(np.sqrt(seconds / self._budget)))))


class Live:
    """A picture that begins anew with `start`, gains by every `sample`, and is shown by `present`.

    The renderer's context must be current in all that is called here.
    """

    def __init__(self, renderer: Renderer, budget: float) -> None:
        """`budget`: seconds that a sample of a moving picture may take."""
        self._renderer = renderer
        self._budget = budget
        self._pace = Pace(budget)
        self._device = renderer.device
        self._context = self._device.context
        self._passes: Passes | None = None
        self._structure: tuple[object, ...] = ()
        self._frame: Frame | None = None
        self._programs: tuple[Programs | None, dict[str, moderngl.Program]] = None, {}
        self._arrays: dict[str, moderngl.VertexArray] = {}
        self._held = self._device.held_by(self)  # all programs that are in use
        self._panels: list[tuple[moderngl.Texture, tuple[int, int]]] = []
        self._label: moderngl.Texture | None = None
        self._reread = False
        self._settings = Settings()
        self._error: StillError | None = None
        self._tells = True  # whether samples are looked at for the error
        self._mistaken = False  # the shaders that do that
        self._seconds = 0.0  # that the samples took
        self._enough = False
        self.size = (0, 0)
        self.samples = 0
        self.moving = False  # then it is not to get a second sample, but begun anew as a still one
        self.enlarged = 1  # the side of a pixel in pixels of the window

    def reread(self) -> None:
        """Read the shaders' files again at the next `start`."""
        self._reread = True

    def start(self, scene: Scene, settings: Settings, show: Show, size: tuple[int, int], *, moving: bool) -> None:
        """Begin a picture of `size` pixels, none of them 0, without any sample yet.

        The pixels of a `moving` one are enlarged as the budget wants. Programs are looked for only if
        `scene` has other objects than the one before, or other settings are used. Raises
        InputError for a scene or size beyond this driver's limits and ShaderError for a mistake in
        `shaders/`; the picture before can then be started again.
        """
        limit = self._device.limits.target
        if max(size) > limit:
            raise InputError(
                f"expected a window of at most {limit} pixels a side here, got {size[0]}x{size[1]}", "size"
            )
        compiled = self._compile(scene, settings)
        structure = compiled.structure, show
        reread, self._reread = self._reread, False
        known = not reread and structure == self._structure
        programs, on_screen = self._programs if known else self._find_programs(compiled, show)
        enlarged = self._pace.enlarged(size[0] * size[1]) if moving else 1
        geometry = show != "picture"
        if size != self.size or self._passes is None or self._passes.geometry != geometry:
            if self._passes:
                self._passes.close()
            self._drop_error()
            self._passes = Passes(self._context, size, geometry=geometry)
            self.size = size
        assert programs
        self._frame = make_frame(compiled, _enlarged(size, enlarged), self._device.limits, self._frame)
        # A moving picture's only sample is that of a picture of one: the pixel's centre, unless samples are random.
        drawn = msgspec.structs.replace(settings.sampling, samples=1) if moving else settings.sampling
        self._passes.load(programs, self._frame, drawn)
        self._passes.try_out()
        self.enlarged, self.samples, self.moving = enlarged, 0, moving and (enlarged > 1 or settings.samples > 1)
        self._settings, self._seconds, self._enough = settings, 0.0, False
        self._tells = not self.moving and not geometry and settings.tells
        if self._error:
            self._error.forget()
        if not known:
            self._pace = Pace(self._budget)
            release(self._context, *self._arrays.values())
            self._arrays = {name: self._context.vertex_array(program, []) for name, program in on_screen.items()}
            self._programs, self._structure = (programs, on_screen), structure
            self._drop_error()
            self._held.clear()
            self._held |= {*filter(None, programs), *on_screen.values()}
        if reread:  # programs of the files as they were are not needed any more
            self._mistaken = False
            self._device.forget()
        elif not known:
            self._device.trim()

    def has_structure(self, scene: Scene, settings: Settings, show: Show) -> bool:
        """Whether the programs of the picture before draw this one."""
        return self._structure == (self._compile(scene, settings).structure, show)

    def is_compiled(self, scene: Scene, settings: Settings, show: Show) -> bool:
        """Whether `start` compiles nothing for this picture. Raises InputError and ShaderError as `start`."""
        compiled = self._compile(scene, settings)
        self._device.limits.check(compiled)
        return self._renderer.has_programs(compiled, show)

    def _compile(self, scene: Scene, settings: Settings) -> CompiledScene:
        return compile(scene, settings.compile_options, self._frame.compiled if self._frame else None)

    def _find_programs(self, compiled: CompiledScene, show: Show) -> tuple[Programs, dict[str, moderngl.Program]]:
        self._device.limits.check(compiled)
        on_screen = {name: self._device.program(assemble(f"window/{name}.frag")) for name in _ON_SCREEN}
        programs = self._renderer.programs(compiled, show)
        for name, uniforms in _ON_SCREEN.items():
            set_uniforms(on_screen[name], **uniforms)
        return programs, on_screen

    def sample(self) -> None:
        """Draw one more sample and wait for it. That of a still picture may be looked at for the picture's error.

        Raises ShaderError for a mistake in the shaders that do that, once until they are read again.
        """
        assert self._passes
        begin = time.perf_counter()
        width, height = _enlarged(self.size, self.enlarged)
        self._passes.draw((0, 0, width, height), self.samples, anew=self.samples == 0)
        self.samples += 1
        drawn = time.perf_counter() - begin
        self._pace.add(drawn / (width * height))
        if self._tells and not self._mistaken:
            try:
                self._look(self._passes)
            except ShaderError:
                self._drop_error()  # what was not looked at has none, rather than 0
                self._mistaken = True
                raise
        self._seconds += time.perf_counter() - begin
        if self._settings.time is not None and self._seconds + drawn > self._settings.time:
            self._enough = True

    def _look(self, passes: Passes) -> None:
        if self._error is None:
            self._error = StillError(self._context, self._error_program, self.size)
        settings, n = self._settings, self.samples
        if not n & (n - 1):
            self._error.look(n, passes, last=2 * n > settings.samples)
        if settings.max_error is not None:
            self._enough |= is_surely_below(settings.max_error, partial(self._error.rmse, n), n)

    def _error_program(self, source: Source) -> moderngl.Program:
        program = self._device.program(source, plain_vertex_source())
        self._held.add(program)
        return program

    @property
    def done(self) -> bool:
        """Whether the picture has all samples that the settings want."""
        return self._enough or self.samples >= self._settings.samples

    def rmse(self) -> float | None:
        """The estimate of the picture's root mean square error, linear radiance; None where it is not known (yet)."""
        error = self._error
        return error.rmse(self.samples) if error and error.is_known(self.samples) else None

    def estimate(self) -> Estimate | None:
        """The estimate of its error; None where it is not known (yet)."""
        error = self._error
        return error.estimate(self.samples, self._seconds) if error and error.is_known(self.samples) else None

    def _drop_error(self) -> None:
        if self._error:
            self._error.close()
        self._error = None

    def set_panels(self, panels: Sequence[Panel]) -> None:
        """What `present` draws over the picture."""
        release(self._context, *(texture for texture, _ in self._panels))
        self._panels = [(self._texture(pixels), corner) for pixels, corner in panels]

    def set_label(self, label: NDArray[np.uint8] | None) -> None:
        """A panel that `present` draws beside the marker, if any."""
        release(self._context, *filter(None, [self._label]))
        self._label = None if label is None else self._texture(label)

    def _texture(self, pixels: NDArray[np.uint8]) -> moderngl.Texture:
        return self._context.texture((pixels.shape[1], pixels.shape[0]), 4, np.ascontiguousarray(pixels[::-1]))

    def present(self, screen: moderngl.Framebuffer, marked: PointLight | None, camera: Camera, scale: float) -> None:
        """Draw the picture into `screen`, with a marker and its label at the light `marked`, and the panels on top.

        `scale` is the display's: markers are that much larger.
        """
        assert self._passes
        labels: list[tuple[moderngl.Texture, tuple[int, int]]] = []
        screen.use()
        screen.viewport = (0, 0, self.size[0], self.size[1])
        self._passes.radiance.use(0)
        self._draw("present", samples=float(self.samples), enlarged=self.enlarged)
        if marked:
            radius = MARKER_RADIUS * scale
            x, y, in_view = view_space.in_picture(camera, marked.position, self.size, radius)
            fill = np.array(marked.color) / max(1.0, *marked.color)
            screen.viewport = (int(x - radius) - 1, int(y - radius) - 1, int(2 * radius) + 3, int(2 * radius) + 3)
            self._draw("marker", center=(x, y), radius=radius, fill=tuple(fill), inView=in_view)
            if self._label:
                labels = [(self._label, _beside((x, y), radius + _LABEL_GAP * scale, self._label.size, self.size))]
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        for texture, corner in (*labels, *self._panels):
            texture.use(0)
            screen.viewport = (*corner, texture.width, texture.height)
            self._draw("panel", corner=corner)
        self._context.disable(moderngl.BLEND)

    def _draw(self, name: str, **uniforms: object) -> None:
        set_uniforms(self._programs[1][name], **uniforms)
        self._arrays[name].render(moderngl.TRIANGLES, 3)

    def image(self, metadata: Mapping[str, str]) -> Image:
        """The picture so far, in the size in which it is drawn."""
        assert self._passes and self.samples
        size = _enlarged(self.size, self.enlarged)
        return Image(self._passes.read_sum((0, 0, *size)) / np.float32(self.samples), metadata=metadata)

    def close(self) -> None:
        """Give back everything on the GPU but the renderer's programs."""
        self.set_panels(())
        self.set_label(None)
        release(self._context, *self._arrays.values())
        self._drop_error()
        if self._passes:
            self._passes.close()
        self._held.clear()


def _beside(
    place: tuple[float, float], distance: float, panel: tuple[int, int], window: tuple[int, int]
) -> tuple[int, int]:
    """The lower left pixel of a panel at a distance to the right of a place, or to the left where the window ends."""
    x, y = place
    right = x + distance
    left = right if right + panel[0] <= window[0] else x - distance - panel[0]
    lower = min(max(0.0, y - panel[1] / 2.0), max(0.0, float(window[1] - panel[1])))
    return int(max(0.0, left)), int(lower)


def _enlarged(size: tuple[int, int], by: int) -> tuple[int, int]:
    """How many pixels, enlarged so much, cover a window of `size`."""
    return -(-size[0] // by), -(-size[1] // by)
