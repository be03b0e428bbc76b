"""The scale of a picture's light on the GPU: squares of light are then float32 numbers, however bright or dark it is.

Lights are in [0, 1e12], and what surfaces send back in [0, 1e24] or more. Its square overflows above 1.8e19, and is 0
below 1e-23. So all light of a frame is multiplied by a power of two where its picture needs it, and results are divided
by it. That changes no bit, but for light below 1e-46 of the brightest. Pictures of usual brightness have the scale 1.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np

from raytracer.compiler.frame import Frame
from raytracer.compiler.packing import LIGHT
from raytracer.core.validation import MAX_COLOR

# Light between 2^-NEAR and 2^NEAR, a billion, stays as it is. Squares of 2^-24 of the darkest, what float32 rounds to,
# are then normal numbers of float32. Sums of squares of 2^25 times the brightest do not overflow (sums.glsl).
_NEAR = 30
# Light of a dark picture is multiplied by at most 2^MOST: times that, lights of 1e12 are below 2^120.
_MOST = 80


def light_scale(brightest: float) -> float:
    """The power of two to multiply light by in a picture with so bright samples: 1 if squares are exact without it."""
    exponent = math.frexp(brightest)[1] if math.isfinite(brightest) else 0
    if exponent > _NEAR:
        return 2.0 ** (_NEAR - exponent)
    return 2.0 ** min(-_NEAR - exponent, _MOST) if exponent < -_NEAR else 1.0


def in_light(frame: Frame, scale: float) -> Frame:
    """`frame` with all light times `scale`: of lights, ambient, background and surfaces."""
    compiled, factor = frame.compiled, np.float32(scale)
    lights = np.frombuffer(frame.lights.block, LIGHT[compiled.options.precision]).copy()
    lights["color"] *= factor
    texels, layout = frame.materials.texels, compiled.layout
    if "le" in layout.colors:
        texels = texels.copy()
        # Where materials are large, each surface has a texel before them (packing.material_texels()).
        rows = texels if layout.is_small else texels[len(compiled.surfaces.material) :]
        rows.reshape(-1, layout.texels, 4)[:, layout.colors.index("le"), :3] *= factor
    scene = compiled.scene
    ambient, background = (tuple(scale * c for c in color) for color in (scene.ambient, scene.background))
    uniforms = {"draw.ambient": ambient, "draw.background": background, "mostLight": scale * MAX_COLOR}
    return msgspec.structs.replace(
        frame,
        materials=msgspec.structs.replace(frame.materials, texels=texels),
        lights=msgspec.structs.replace(frame.lights, block=lights.tobytes()),
        uniforms=frame.uniforms | uniforms,
    )
