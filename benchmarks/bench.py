"""The bench: times of frames and pictures, ours and others' in turns, and whether pictures agree."""

import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from statistics import median

import moderngl
import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from benchmarks import povray
from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.frame import make_frame
from raytracer.formats.image import Image
from raytracer.formats.srgb import encode_srgb8
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.accumulation import Accumulation, is_measured
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.programs import find_programs
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.solids import leaves

Size = tuple[int, int]
Picture = NDArray[np.uint8]

# Of 255: by how much a value may differ. Rounding to 8 bits alone makes 1.
TOLERANCE = 3
# The share of pixels that may differ by more where the same rays are shot: rounding decides on which side of an
# outline some of them fall.
SAME_RAYS = 1e-4
# POV-Ray's rays through a pixel are not ours where there are several, so all outlines differ somewhat.
OTHER_RAYS = 0.01
# Frames of ours a turn, so that one slow moment does not decide.
FRAMES = 3
# The reference tests every ray against every leaf, in NumPy: some seconds for a few of them, and for
# 3,000 still where the picture is small. It is no help beyond.
_FEW, _MANY, _SMALL = 16, 4000, (64, 36)


class Agreement:
    """Agreement of pictures, in words; whether they are right."""

    def __init__(self) -> None:
        self.findings: list[str] = []
        self.right = True

    def compare(self, picture: Picture, truth: Picture, against: str, share: float = SAME_RAYS) -> None:
        """At most that `share` of the pixels may differ by more than the tolerance."""
        share_off = float(np.mean(np.abs(picture.astype(int) - truth).max(axis=2) > TOLERANCE))
        self.right &= share_off <= share
        self.findings.append(f"{100.0 * share_off:.2g} % off {against} (at most {100.0 * share:g} %)")


def in_turns(
    rounds: int, ours: Callable[[], float], theirs: Callable[[], float], each: int = FRAMES
) -> tuple[float, float]:
    """The medians of the seconds that two things return, measured in turns: the machine is not ours alone.

    `each`: of theirs, a turn.
    """
    ours()  # compiles
    times: tuple[list[float], list[float]] = [], []
    for _ in range(rounds):
        times[0].extend(ours() for _ in range(FRAMES))
        times[1].extend(theirs() for _ in range(each))
    return median(times[0]), median(times[1])


class Bench:
    """One renderer, one size of the pictures, and how often to measure."""

    def __init__(self, renderer: Renderer, size: Size, rounds: int) -> None:
        self.context: moderngl.Context = renderer.device.context
        self.software = any(name in self.context.info["GL_RENDERER"] for name in ("llvmpipe", "softpipe"))
        self.size, self.rounds = size, rounds
        self._renderer = renderer
        self._picture = ProgressivePicture(renderer.device, budget=1.0)
        self._traced: dict[tuple[str, int], tuple[Picture, float]] = {}

    def frame(self, scene: rt.Scene, settings: rt.Settings, size: Size | None = None) -> float:
        """The seconds that all samples of a frame take, with everything about its scene on the GPU already."""
        self.start(scene, settings, size)
        begin = time.perf_counter()
        while not self._picture.is_done:
            self._picture.step()
        return time.perf_counter() - begin

    def first_frame(self, scene: Callable[[], rt.Scene], settings: rt.Settings) -> float:
        """The seconds from making a scene to the end of its frame."""
        begin = time.perf_counter()
        self.start(scene(), settings)
        while not self._picture.is_done:
            self._picture.step()
        return time.perf_counter() - begin

    def start(self, scene: rt.Scene, settings: rt.Settings, size: Size | None = None) -> None:
        """Bring everything about a scene to the GPU. Raises InputError for one that it cannot take."""
        self._picture.start(scene, settings, "picture", size or self.size, moving=False)

    def radiance(self, scene: rt.Scene, settings: rt.Settings, size: Size | None = None) -> NDArray[np.float32]:
        """(H, W, 3): what a frame leaves on the GPU."""
        self.frame(scene, settings, size)
        return self._picture.image({}).radiance

    def summed(self, scene: rt.Scene, settings: rt.Settings) -> float:
        """The seconds in which render() draws all samples and reads their sum."""
        device, options, area = self._renderer.device, settings.sampling, (0, 0, *self.size)
        with closing(TileRenderer(device, self.size)) as tiles:
            compiled = compile(scene, settings.compile_options)
            tiles.load(find_programs(device, compiled), make_frame(compiled, self.size, device.limits))
            is_needed = is_measured(options, estimates=True)
            measurements = BlockMeasurements(device, tiles.player, self.size) if is_needed else None

            def draw() -> None:
                accumulation = Accumulation(tiles, measurements, options, area, self.size)
                while not accumulation.is_done():
                    accumulation.step()
                accumulation.result(errors=False)

            draw()  # memory is new the first time
            begin = time.perf_counter()
            draw()
            return time.perf_counter() - begin

    def rendered(self, scene: rt.Scene, settings: rt.Settings) -> Image:
        """The picture that render() draws."""
        image = self._renderer.render(scene, self.size, settings, geometry=False)
        self.context.__enter__()  # render() leaves no context current; here one is throughout
        return image

    def saved(self, scene: rt.Scene, path: Path, *, geometry: bool) -> float:
        """The seconds in which a picture of 1 sample is rendered and saved."""
        begin = time.perf_counter()
        self._renderer.render(scene, self.size, rt.Settings(), geometry=geometry).save(path)
        seconds = time.perf_counter() - begin
        self.context.__enter__()  # as in rendered()
        return seconds

    def traced(self, scene: rt.Scene, samples: int = 1, *, again: bool = False) -> tuple[Picture, float]:
        """POV-Ray's picture and seconds; of a run before, if there was one and it is not to run `again`."""
        text = povray.source(scene, self.size, rt.Settings())
        if again or (text, samples) not in self._traced:
            self._traced[text, samples] = povray.run(text, self.size, samples)
        return self._traced[text, samples]

    def agreement(self, scene: rt.Scene, samples: int = 1) -> Agreement:
        """How our picture compares with POV-Ray's where that is installed, and the reference's where that is quick."""
        agreement, settings = Agreement(), rt.Settings(samples=samples)
        picture = encode_srgb8(self.radiance(scene, settings))
        if povray.version():
            share = SAME_RAYS if samples == 1 else OTHER_RAYS
            agreement.compare(picture, self.traced(scene, samples)[0], "POV-Ray's", share)
        count = sum(len(leaves(solid)) for solid in scene.solids())
        if count <= _FEW or (not povray.version() and count <= _MANY):
            width, height = self.size
            size = _SMALL if count > _FEW else self.size if samples == 1 else (width // 4, height // 4)
            truth = ray_tracer.trace(scene, size, settings).srgb8()
            agreement.compare(
                encode_srgb8(self.radiance(scene, settings, size)), truth, f"float64's, {size[0]}x{size[1]}"
            )
        if not agreement.findings:
            agreement.findings.append("not compared: that takes povray")
        return agreement
