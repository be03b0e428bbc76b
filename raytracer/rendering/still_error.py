"""What the window knows of a still picture's error, as samples are drawn: as sampler.py knows that of a tile."""

from __future__ import annotations

from collections.abc import Callable

import moderngl

from raytracer.compiler.glsl.preprocessor import Source
from raytracer.formats.estimate import Estimate
from raytracer.rendering.convergence import Movement
from raytracer.rendering.error_estimate import estimated
from raytracer.rendering.passes import Passes
from raytracer.rendering.pixel_blocks import Blocks


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

    def forget(self) -> None:
        """A new picture begins."""
        self._blocks = None

    def look(self, n: int, passes: Passes, *, last: bool) -> None:
        """The picture has n samples now, a power of two. The `last` such look needs none after it.

        Raises ShaderError for a mistake in shaders/, when first asked for.
        """
        if self._blocks is None:
            self._blocks = Blocks(self._tile, passes)
            self._movement.begin(self._blocks, sparse=True)
        self._movement.look(n, n, passes.radiance, None, last=last)

    def is_known(self, n: int) -> bool:
        """Whether it is known of a picture with n samples."""
        return self._blocks is not None and n > 1

    def rmse(self, n: int) -> float:
        """That of the picture, which has n samples now. It must be known."""
        assert self._blocks
        self._blocks.samples[:] = n
        return self._movement.rmse(self._tile)

    def estimate(self, n: int, seconds: float) -> Estimate:
        """That of the picture, whose n samples took so long. It must be known."""
        assert self._blocks
        self._blocks.samples[:] = n
        return estimated([self._movement.moved(self._tile)], self._size, n, seconds)

    def close(self) -> None:
        """Give back everything on the GPU but the programs."""
        self._movement.close()
