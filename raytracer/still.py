"""What the window knows of a still picture's error, as samples are drawn: as sampler.py knows that of a tile."""

from __future__ import annotations

import math
from collections.abc import Callable

import moderngl

from raytracer.blocks import Blocks
from raytracer.estimate import Estimate, estimated
from raytracer.glsl_source import Source
from raytracer.movement import Movement
from raytracer.passes import Passes
from raytracer.sampler import _LESS_SURE, _SURE, _SURE_FROM
from raytracer.settings import Settings

# From the first look on there is something to compare with. After 1 sample a picture that moves is not still either.
_FIRST_LOOK = 2


class StillError:
    """Of one picture after another, in targets of one size. On the GPU until closed.

    All samples are in one sum of float32, other than render()'s. Of 4096 that is rounded by some 1e-5 of the radiance.
    """

    def __init__(
        self, context: moderngl.Context, program: Callable[[Source], moderngl.Program], size: tuple[int, int]
    ) -> None:
        """`program` compiles a fragment shader for blocks or cells."""
        self._movement = Movement(context, program, size)
        self._size = size
        self._tile = (0, 0, *size)
        self._blocks: Blocks | None = None
        self._at = self._looks = 0

    def forget(self) -> None:
        """A new picture begins."""
        self._blocks, self._looks = None, 0

    def look(self, n: int, passes: Passes, *, last: bool, sparse: bool) -> None:
        """The picture has n samples now. Only 2, 4, 8, ... are looked at, of which the `last` needs none after it.
        `sparse`: a large picture may be judged by a part of it.

        Raises ShaderError for a mistake in shaders/, when first asked for.
        """
        if n < _FIRST_LOOK or n & (n - 1):
            return
        if self._blocks is None or n != 2 * self._at:  # or it moved, or seemed to, half as many samples ago
            self._blocks, self._looks = Blocks(self._tile, passes), 0
            self._movement.begin(self._blocks, sparse=sparse)
        self._movement.look(n, n, passes.radiance, None, last=last)
        self._at, self._looks = n, self._looks + 1

    def rmse(self, n: int) -> float | None:
        """That of the picture, which has n samples now; None where it is not known (yet)."""
        if self._blocks is None or self._looks < 2:
            return None
        self._blocks.samples[:] = n
        return math.sqrt(self._movement.total(self._tile) / (3 * self._size[0] * self._size[1]))

    def estimate(self, n: int, seconds: float) -> Estimate | None:
        """That of the picture, whose n samples took so long; None where it is not known (yet)."""
        if self._blocks is None or self.rmse(n) is None:
            return None
        return estimated([self._movement.moved(self._tile)], self._size, n, seconds)

    def is_below(self, error: float, n: int) -> bool:
        """Whether that of the picture is surely below `error`, as render() has it: at 4, 6, 8, 12, 16 ... samples."""
        power = n // 3 if n % 3 == 0 else n
        if power & (power - 1) or (rmse := self.rmse(n)) is None:
            return False
        return (_SURE if n >= _SURE_FROM else _LESS_SURE) * rmse <= error

    def close(self) -> None:
        """Give back everything on the GPU but the programs."""
        self._movement.close()


def is_told(settings: Settings) -> bool:
    """Whether samples of such a picture tell its error."""
    return settings.sequence == "sobol" and settings.samples >= 2 * _FIRST_LOOK
