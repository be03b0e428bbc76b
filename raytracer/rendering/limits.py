"""What cannot be rendered: by this driver, by an evaluator, or at all."""

from __future__ import annotations

import moderngl

from raytracer.compiler.glsl.shaders import is_listed, roth_loops
from raytracer.compiler.surfaces import table
from raytracer.core.validation import InputError
from raytracer.gpu.cell_draw import MARGIN
from raytracer.gpu.gl import varying_components
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Precision, Settings

# llvmpipe's compile time triples with every two loops in a row: 2 s for 11, 5 s for 13, 16 s for 15.
MAX_ROTH_LOOPS = 14
# The evaluators walk and roth write all trees out in one shader: llvmpipe compiles 100 primitives in 2 s, 300 in 13 s.
MAX_PRIMITIVES = 512


def host_memory(size: tuple[int, int], geometry: bool, refines: bool = False) -> int:
    """Bytes of host memory that rendering and saving a picture take at most, beside the program itself."""
    # radiance 12; depth 4, normal 12, material 4 and its index 4, error 4; the number of samples 4
    return size[0] * size[1] * (12 + 28 * geometry + 4 * refines)


class Limits:
    """Those of a driver."""

    def __init__(self, context: moderngl.Context) -> None:
        info = context.info
        self._version: int = context.version_code
        self._driver: str = info["GL_RENDERER"]
        self._block: int = info["GL_MAX_UNIFORM_BLOCK_SIZE"]
        # The largest side of a target in pixels; viewports have margins.
        self.target: int = min(info["GL_MAX_TEXTURE_SIZE"], min(info["GL_MAX_VIEWPORT_DIMS"][:2]) - 2 * MARGIN)
        self.varyings: int = varying_components(context)
        # Doubles came with OpenGL 4.0.
        self.precisions: tuple[Precision, ...] = (32, 64) if self._version >= 400 else (32,)

    def check(self, scene: Scene, settings: Settings) -> None:
        """Raise InputError if the scene needs more than this driver or the evaluator has."""
        if settings.evaluator == "roth" and (loops := roth_loops(scene)) > MAX_ROTH_LOOPS:
            raise InputError(
                f"expected at most {MAX_ROTH_LOOPS} loops for roth (1 an object, |, & or ~, 2 a -), got "
                f"{loops}; the others have no such limit",
                "evaluator",
            )
        if settings.precision not in self.precisions:
            version = self._version
            raise InputError(
                f"64 needs OpenGL 4.0 or later, got {version // 100}.{version // 10 % 10} "
                f"({self._driver}); 32 needs no more than 3.3",
                "precision",
            )
        primitives = table(scene).size
        listed = is_listed(scene, settings)
        if not listed and primitives > MAX_PRIMITIVES:
            way = "64 bits" if settings.precision == 64 else f"the evaluator {settings.evaluator}"
            raise InputError(
                f"expected at most {MAX_PRIMITIVES} primitives for {way}, got {primitives}; "
                "the evaluator cells with 32 bits has no such limit"
            )
        for what, count, size in (
            *([("primitives of 64 bits", primitives, 64)] if settings.precision == 64 else []),
            ("lights", len(scene.lights), 48 * settings.precision // 32),
        ):
            if count * size > self._block:
                limit = self._block // size
                raise InputError(f"expected at most {limit} {what} (this driver's uniform block), got {count}")
