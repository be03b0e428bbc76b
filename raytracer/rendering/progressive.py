"""Progressive picture of the window: drawn sample by sample, and kept on the GPU until the caller reads it."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator, Mapping

import msgspec
import numpy as np

from raytracer.compiler.bright_features import bright_features
from raytracer.compiler.compiled_scene import CompiledScene, compile
from raytracer.compiler.draws import SAMPLES_PER_SUM
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.glsl.preprocessor import ShaderError
from raytracer.compiler.glsl.shaders import Show
from raytracer.compiler.meshes import Rectangle
from raytracer.core.validation import InputError
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Program, Texture
from raytracer.rendering.accumulation import Accumulation, is_measured
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.picture_arrays import PictureArrays
from raytracer.rendering.programs import are_compiled, find_programs
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# The largest side of an enlarged pixel, in pixels of the window. Larger ones would hide the scene.
_MOST_ENLARGED = 16


class Pace:
    """The measured time per sample, which decides the size of the pixels of a moving picture."""

    def __init__(self, budget: float) -> None:
        self._budget = budget  # seconds for one sample
        self._recent: deque[float] = deque(maxlen=5)

    def add(self, seconds: float) -> None:
        """Record a sample, in seconds per pixel."""
        self._recent.append(seconds)

    def enlarged(self, pixels: int) -> int:
        """Return the side of the smallest enlarged pixels that keep a sample within the budget, in window pixels.

        The fastest of the last samples counts, because slow samples had to wait for a compiler or another process.
        """
        if not self._recent:
            return 1
        seconds = min(self._recent) * pixels
        return min(_MOST_ENLARGED, max(1, int(np.ceil(np.sqrt(seconds / self._budget)))))


class ProgressivePicture:
    """A picture that `start` begins, and that gains one sample with every `step`.

    The device's context must be current in all calls.
    """

    def __init__(self, device: Device, budget: float) -> None:
        """Prepare without drawing. `budget`: time limit for a sample of a moving picture, in seconds."""
        self._device = device
        self._budget = budget
        self._pace = Pace(budget)
        self._tiles: TileRenderer | None = None
        self._measurements: BlockMeasurements | None = None
        self._accumulation: Accumulation | None = None
        self._structure: tuple[object, ...] = ()
        self._compiled: CompiledScene | None = None
        self._frame: Frame | None = None
        self._programs: Mapping[str, Program] = {}
        self._rereads = False
        self._is_mistaken = False  # whether the shaders of measurements have a mistake
        self._settings = Settings()
        self._seconds = 0.0  # duration of the samples
        self._arrays: PictureArrays | None = None  # the arrays of the finished picture, while its error is measured
        self._measuring: Iterator[None] | None = None
        self._estimate: Estimate | None = None  # the measured error of the finished picture
        self._stopped: object = None  # the active blocks when "blockSamples" was written to the GPU
        self.size = (0, 0)
        self.is_moving = False  # a moving picture gets no second sample; the caller starts a still picture instead
        self.enlarged = 1  # the side of a pixel in pixels of the window

    def reread(self) -> None:
        """Read the shader files again at the next `start`."""
        self._rereads = True

    def start(self, scene: Scene, settings: Settings, show: Show, size: tuple[int, int], *, moving: bool) -> None:
        """Begin a picture without any sample.

        Programs are compiled only if `scene` has other objects than the previous scene, or if settings differ.

        Args:
            scene, settings: the scene and the settings of the picture
            show: the picture, or normals, depth or materials
            size: width and height in pixels, both above 0
            moving: whether the picture moves. The pixels of a moving picture are enlarged to keep the budget.

        Raises InputError for a scene or size beyond the driver's limits, and ShaderError for a mistake in `shaders/`.
        After an error, the previous picture can be started again.
        """
        limit = self._device.limits.target
        if max(size) > limit:
            raise InputError(
                f"expected a window of at most {limit} pixels a side on this driver, got {size[0]}x{size[1]}", "size"
            )
        compiled = self._compile(scene, settings)
        structure = compiled.structure, show
        rereads, self._rereads = self._rereads, False
        is_known = not rereads and structure == self._structure
        if is_known:
            programs = self._programs
        else:
            self._device.limits.check(compiled)
            programs = find_programs(self._device, compiled, show)
        enlarged = self._pace.enlarged(size[0] * size[1]) if moving else 1
        drawn_size = _enlarged_size(size, enlarged)
        tiles = self._tiles_for(size, geometry=show != "picture")
        self._frame = make_frame(compiled, drawn_size, self._device.limits, self._frame)
        tiles.load(programs, self._frame)
        self._programs, self._structure = programs, structure
        if not is_known:
            self._pace = Pace(self._budget)
        if rereads:
            self._is_mistaken, self._measurements = False, None
            self._device.forget()  # the programs of previous file versions
        elif not is_known:
            self._device.trim()
        self.enlarged, self.is_moving = enlarged, moving and (enlarged > 1 or settings.samples > 1)
        self._settings, self._seconds, self._stopped = settings, 0.0, None
        self._arrays = self._measuring = self._estimate = None
        # A moving picture has one sample, at the pixel's centre unless samples are random.
        options = msgspec.structs.replace(settings.sampling, samples=1) if moving else settings.sampling
        measurements = None
        if show == "picture" and is_measured(options, estimates=True) and not self._is_mistaken:
            measurements = self._measurements = self._measurements or BlockMeasurements(
                self._device, tiles.player, size
            )
        features = bright_features(compiled, drawn_size) if measurements and options.max_error is not None else None
        whole = 0, 0, *drawn_size
        self._accumulation = Accumulation(
            tiles, measurements, options, whole, [whole], whole, features=features, always_estimates=True
        )

    def _tiles_for(self, size: tuple[int, int], *, geometry: bool) -> TileRenderer:
        """Return the renderer of a tile as large as the picture. Replaces the present one if it does not fit."""
        tiles = self._tiles
        if tiles is None or tiles.target != size or tiles.has_geometry != geometry:
            if tiles:
                tiles.close()
            self._measurements = self._accumulation = self._tiles = None
            self._tiles = tiles = TileRenderer(self._device, size, geometry=geometry)
            self.size = size
        return tiles

    def has_structure(self, scene: Scene, settings: Settings, show: Show) -> bool:
        """Whether the programs of the current picture can draw this one. Raises InputError as `start` does."""
        return self._structure == (self._compile(scene, settings).structure, show)

    def is_compiled(self, scene: Scene, settings: Settings, show: Show) -> bool:
        """Whether `start` would compile nothing for this picture. Raises InputError and ShaderError as `start` does."""
        compiled = self._compile(scene, settings)
        self._device.limits.check(compiled)
        return are_compiled(self._device, compiled, show)

    def _compile(self, scene: Scene, settings: Settings) -> CompiledScene:
        """Compile the scene. The result shares as much as possible with the last compiled scene."""
        self._compiled = compile(scene, settings.compile_options, self._compiled)
        return self._compiled

    def step(self) -> None:
        """Draw one more sample and wait for it, or continue to measure the error of a finished picture.

        Raises InputError if shaders do not terminate in the first sample. Raises ShaderError for a mistake in the
        shaders of measurements: once, as the picture continues without an error until the shaders are read again.
        """
        assert self._accumulation
        begin = time.perf_counter()
        if self._accumulation.is_done(self._seconds_left()):
            self._measure(self._accumulation)
            self._seconds += time.perf_counter() - begin
            return
        try:
            self._accumulation.step(self._seconds_left())
        except ShaderError:
            self._accumulation.stop_measuring()
            self._is_mistaken = True
            raise
        finally:
            self._seconds += time.perf_counter() - begin
        width, height = _enlarged_size(self.size, self.enlarged)
        self._pace.add(self._accumulation.drawing_seconds / (width * height))
        self._write_stopped(self._accumulation)

    def _measure(self, accumulation: Accumulation) -> None:
        """Measure the error of the finished picture within one budget. Resume sampling if the error is too large."""
        assert self._tiles and self._compiled
        end = time.perf_counter() + self._budget
        whole: Rectangle = (0, 0, self.size[0], self.size[1])
        if self._arrays is None or self._measuring is None:
            self._arrays = PictureArrays(whole, accumulation.options, bright_features(self._compiled, self.size))
            self._arrays.read(accumulation, whole)
            self._measuring = self._arrays.measure(self._tiles, [whole])
        for _ in self._measuring:
            if time.perf_counter() > end:
                return
        estimate = self._arrays.estimate(self._seconds)
        self._arrays = self._measuring = None
        if not accumulation.resume(estimate, self._seconds_left()):
            self._estimate = estimate

    @property
    def _can_measure(self) -> bool:
        """Whether the picture's error can be measured once it is finished."""
        accumulation = self._accumulation
        return accumulation is not None and accumulation.knows_error and self.enlarged == 1

    def _seconds_left(self) -> float:
        return math.inf if self._settings.time is None else self._settings.time - self._seconds

    def _write_stopped(self, accumulation: Accumulation) -> None:
        """Upload the numbers of samples of stopped blocks, if more blocks have stopped."""
        blocks = accumulation.blocks
        if blocks.is_whole or blocks.active is self._stopped:
            return
        assert self._tiles
        rows, columns = blocks.active.shape
        self._tiles.player.add_texture("blockSamples", (columns, rows), 1, "i4")
        self._tiles.player.write("blockSamples", np.where(blocks.active, 0, blocks.samples).astype(np.int32))
        self._stopped = blocks.active

    def textures(self) -> dict[str, Texture]:
        """Return the textures of the picture, by the names of their samplers in present.frag."""
        assert self._tiles
        player = self._tiles.player
        names = {"radianceSum": "radiance"}
        if self.samples > SAMPLES_PER_SUM:
            names["summedBefore"] = "summedBefore"
        if self._stopped is not None:
            names["blockSamples"] = "blockSamples"
        return {sampler: player.texture(name) for sampler, name in names.items()}

    @property
    def light_scale(self) -> float:
        """The power of two by which all light in the textures' sums is multiplied."""
        return self._accumulation.light_scale if self._accumulation else 1.0

    @property
    def samples(self) -> int:
        """The number of samples. Pixels in stopped blocks have fewer."""
        return self._accumulation.samples if self._accumulation else 0

    @property
    def is_done(self) -> bool:
        """Whether the picture has all samples that the settings require, and its error is measured."""
        accumulation = self._accumulation
        is_finished = accumulation is not None and accumulation.is_done(self._seconds_left())
        return is_finished and (self._estimate is not None or not self._can_measure)

    def estimate(self) -> Estimate | None:
        """Return the picture's estimate of its own error; None if there is no estimate (yet)."""
        if self._estimate or self._accumulation is None:
            return self._estimate
        return self._accumulation.estimate(self._seconds)

    def image(self, metadata: Mapping[str, str]) -> Image:
        """Read the picture so far, with enlarged pixels as single pixels."""
        assert self._accumulation
        width, height = _enlarged_size(self.size, self.enlarged)
        mean = np.empty((height, width, 3), np.float32)
        self._accumulation.read(mean)
        return Image(mean, metadata=metadata)

    def close(self) -> None:
        """Release all GPU resources except the device's programs."""
        if self._tiles:
            self._tiles.close()
        self._tiles = self._measurements = self._accumulation = None


def _enlarged_size(size: tuple[int, int], by: int) -> tuple[int, int]:
    """Return the numbers of pixels, enlarged by a factor, that cover a window of `size`."""
    return -(-size[0] // by), -(-size[1] // by)
