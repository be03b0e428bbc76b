"""The bare draws of a picture or a frame: the same lists of draws, played again without all that prepares them."""

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from raytracer.compiler.compiled_scene import compile
from raytracer.compiler.draws import TOGETHER, Step
from raytracer.compiler.frame import make_frame
from raytracer.gpu.device import Device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.gpu.scene_buffers import SceneBuffers
from raytracer.rendering.accumulation import Accumulation, complete, is_measured, margin
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.programs import picture_programs
from raytracer.rendering.tile_renderer import TileRenderer


class Play(NamedTuple):
    """A call that draws, to be made again by `play`."""

    play: Callable[[], None]
    is_for_screen: bool


@contextmanager
def recorded() -> Iterator[list[Play]]:
    """Collect all calls in a block that play lists of draws, or bind a scene's numbers for them, in their order."""
    plays: list[Play] = []
    play, bind = DrawPlayer.play, SceneBuffers.bind

    def record_play(player: DrawPlayer, steps: Iterable[Step], **options: Any) -> None:
        kept = list(steps)
        plays.append(Play(partial(play, player, kept, **options), "screen" in options))
        play(player, kept, **options)

    def record_bind(buffers: SceneBuffers) -> None:
        plays.append(Play(partial(bind, buffers), is_for_screen=False))
        bind(buffers)

    with patch.object(DrawPlayer, "play", record_play), patch.object(SceneBuffers, "bind", record_bind):
        yield plays


class BareDraws:
    """A scene's numbers and programs on the GPU, and the draws of its picture as one tile, until closed.

    The constructor draws the picture once, and so compiles. Draws of measurements count, decisions by them do not.
    """

    def __init__(self, device: Device, scene: rt.Scene, settings: rt.Settings, size: tuple[int, int]) -> None:
        self._device = device
        options, around = settings.sampling, 2 * margin(settings.sampling)
        compiled = compile(scene, settings.compile_options)
        with device.turn():
            self._tiles = TileRenderer(device, (size[0] + around, size[1] + around))
            several = options.samples >= TOGETHER
            programs = picture_programs(device, compiled, plane_only=True, several=several)
            self._tiles.load(programs.by_name, make_frame(compiled, size, device.limits))
            is_needed = is_measured(options, estimates=True)
            measurements = BlockMeasurements(device, self._tiles.player, self._tiles.target) if is_needed else None
            self._accumulation = Accumulation(self._tiles, measurements, options, (0, 0, *size), size)
            with recorded() as self._plays:
                complete(self._accumulation, math.inf, lambda _: None)

    def draw(self) -> None:
        """Draw the picture again."""
        with self._device.turn():
            self._play()

    def picture(self) -> NDArray[np.float32]:
        """Draw the picture again and read it: (H, W, 3), the top row first."""
        with self._device.turn():
            self._play()
            return self._accumulation.result(errors=False).mean.astype(np.float32)

    def _play(self) -> None:
        for each in self._plays:
            each.play()

    def close(self) -> None:
        """Give back everything on the GPU but the device's programs."""
        with self._device.turn():
            self._tiles.close()
