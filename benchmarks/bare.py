"""Bare draws: the draws and read-backs of a picture or a frame, repeated without the preparation between them."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from raytracer.compiler.draws import Step
from raytracer.compiler.meshes import Rectangle
from raytracer.gpu.device import Device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.gpu.scene_buffers import SceneBuffers
from raytracer.rendering.renderer import Renderer


class Recorded(NamedTuple):
    """A recorded call that draws or reads. `again` repeats the call; `values` holds the result of a reading call."""

    again: Callable[[], Any]
    values: NDArray[Any] | None = None
    is_for_screen: bool = False


@contextmanager
def recorded() -> Iterator[list[Recorded]]:
    """Record the calls of the block that play lists of draws, bind the scene's buffers, and read textures."""
    calls: list[Recorded] = []
    play, read, bind = DrawPlayer.play, DrawPlayer.read, SceneBuffers.bind
    read_top_first = DrawPlayer.read_top_first

    def record_play(player: DrawPlayer, steps: Iterable[Step], **options: Any) -> None:
        kept = list(steps)
        calls.append(Recorded(partial(play, player, kept, **options), is_for_screen="screen" in options))
        play(player, kept, **options)

    def record_read(player: DrawPlayer, *arguments: Any) -> NDArray[Any]:
        values = read(player, *arguments)
        calls.append(Recorded(partial(read, player, *arguments), values))
        return values

    def record_top_first(player: DrawPlayer, name: str, area: Rectangle, out: NDArray[np.float32]) -> None:
        def read_again() -> NDArray[np.float32]:
            values = np.empty_like(out)
            read_top_first(player, name, area, values)
            return values

        read_top_first(player, name, area, out)
        # A copy, because the caller of the recorded call divides `out` afterwards.
        calls.append(Recorded(read_again, out.copy()))

    def record_bind(buffers: SceneBuffers) -> None:
        calls.append(Recorded(partial(bind, buffers)))
        bind(buffers)

    with (
        patch.object(DrawPlayer, "play", record_play),
        patch.object(DrawPlayer, "read", record_read),
        patch.object(DrawPlayer, "read_top_first", record_top_first),
        patch.object(SceneBuffers, "bind", record_bind),
    ):
        yield calls


class BareDraws:
    """The draws and read-backs of a picture. The scene stays on the GPU until close().

    The constructor renders the picture, which also compiles the programs. Repeated draws follow the decisions of that
    picture, for example its numbers of samples. Without `estimates` the picture has no draws and read-backs for the
    error estimate.
    """

    def __init__(
        self,
        device: Device,
        scene: rt.Scene,
        settings: rt.Settings,
        size: tuple[int, int],
        *,
        estimates: bool = True,
    ) -> None:
        self._device, self._renderer = device, Renderer(device)
        render = partial(self._renderer.render, scene, size, settings, geometry=estimates, estimates=estimates)
        render()
        with recorded() as self._calls:
            self.image = render()

    def draw(self) -> None:
        """Repeat the draws without the read-backs."""
        with self._device.turn():
            for call in self._calls:
                if call.values is None:
                    call.again()

    def draw_and_read(self) -> list[NDArray[Any]]:
        """Repeat the draws and the read-backs, and return the values of each read-back."""
        with self._device.turn():
            values = [call.again() for call in self._calls]
        return [array for array in values if array is not None]

    def is_same(self) -> bool:
        """Repeat the picture, and return whether all read-backs have the same values."""
        before = [call.values for call in self._calls if call.values is not None]
        return all(map(np.array_equal, self.draw_and_read(), before))

    def close(self) -> None:
        """Release everything on the GPU except the programs, which the device owns."""
        with self._device.turn():
            self._renderer.close()
