"""The limits of an OpenGL driver, as a plain value, and the check of a scene against them and the evaluator's
limits."""

from __future__ import annotations

import msgspec

from raytracer.compiler.body_texels import count_texels
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.core.validation import InputError
from raytracer.scene.options import Precision

# llvmpipe's compile time grows by a factor of 2.5 with every two more successive loops: 4 s for 11, 10 s for 13, 16 s
# for 14, on 2 cores without Mesa's shader cache.
MAX_ROTH_LOOPS = 14
# The evaluators walk and roth, and 64 bits, write all trees out in one shader: llvmpipe compiles 100 primitives in
# about 2 s, 300 in about 10 s (walk: 1.7 s and 9 s, 64 bits: 2.7 s and 12 s).
MAX_PRIMITIVES = 512


class DriverLimits(msgspec.Struct, frozen=True):
    """The limits of one driver, which gpu.device queries."""

    driver: str  # GL_RENDERER
    version: int  # OpenGL version, such as 330
    target: int  # largest side of a target in pixels, with room for the viewport's margins
    varyings: int  # number of varying components of a vertex shader
    uniform_block: int  # bytes
    buffer_texels: int  # most texels of a buffer texture
    volume_layers: int  # most layers of a 3D texture

    @property
    def is_llvmpipe(self) -> bool:
        """Whether the driver is Mesa's llvmpipe, which leaves long loops early (cut_short.glsl)."""
        return "llvmpipe" in self.driver

    @property
    def precisions(self) -> tuple[Precision, ...]:
        """The supported precisions, in bits. Doubles need OpenGL 4.0."""
        return (32, 64) if self.version >= 400 else (32,)

    def check(self, compiled: CompiledScene) -> None:
        """Raise InputError if the scene exceeds a limit of this driver or of its evaluator."""
        options, primitives = compiled.options, compiled.surfaces.size
        if options.evaluator == "roth" and (loops := roth_loops(compiled.scene)) > MAX_ROTH_LOOPS:
            raise InputError(
                f"expected at most {MAX_ROTH_LOOPS} loops for roth (1 an object, |, & or ~, 2 a -), got "
                f"{loops}; the other evaluators have no such limit",
                "evaluator",
            )
        if options.precision not in self.precisions:
            raise InputError(
                f"64 needs OpenGL 4.0 or later, got {self.version // 100}.{self.version // 10 % 10} "
                f"({self.driver}); 32 needs no more than 3.3",
                "precision",
            )
        if not compiled.has_lists and primitives > MAX_PRIMITIVES:
            way = "64 bits" if options.precision == 64 else f"the evaluator {options.evaluator}"
            raise InputError(
                f"expected at most {MAX_PRIMITIVES} primitives for {way}, got {primitives}; "
                "the evaluator cells with 32 bits has no such limit"
            )
        for elements, count, size in (
            *([("primitives of 64 bits", primitives, 64)] if options.precision == 64 else []),
            *([("faces", count_texels(compiled.surfaces.bodies), 32)] if options.precision == 64 else []),
            ("lights", len(compiled.lights), 48 * options.precision // 32),
        ):
            if count * size > self.uniform_block:
                limit = self.uniform_block // size
                raise InputError(f"expected at most {limit} {elements} (this driver's uniform block), got {count}")
