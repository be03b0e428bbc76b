"""The scale of a picture's light on the GPU. It keeps squares of light in float32's range, however bright the light is.

Lights are in [0, 1e12], and surfaces send back light in [0, 1e24] or more. The square of light overflows above 1.8e19,
and is 0 below 1e-23. So if a picture needs it, all light of a frame is multiplied by a power of two, and results are
divided by it. The scale changes no bit, except in light below 1e-46 of the brightest. Pictures of usual brightness have
the scale 1.
"""

from __future__ import annotations

import math
from typing import assert_never

import msgspec
import numpy as np

from raytracer.compiler.frame import Frame
from raytracer.compiler.packing import LIGHT
from raytracer.core.validation import MAX_COLOR, MIN_RADIUS
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.models import MODELS

# Light from 2^-_NEAR to 2^_NEAR, a billion, is not scaled. Float32 rounds the darkest by 2^-24 of itself, and the
# square of this rounding is still a normal float32 number. Sums of squares of 2^25 times the brightest do not overflow
# (sums.glsl).
_NEAR = 30
# The largest reflectance, 2^_PEAK or 1e12, as a multiple of the material's largest colour: a lobe's peak may be as
# high.
_PEAK = 40
# Sums of 256 samples of light below 2^_LARGEST do not overflow.
_LARGEST = 119


def light_scale(frame: Frame, brightest: float) -> float:
    """Return the power of two that scales all light of a picture. Usually 1.

    `brightest` is the brightest channel of its samples.
    """
    exponent = math.frexp(brightest)[1] if math.isfinite(brightest) else 0
    if exponent > _NEAR:
        return 2.0 ** (_NEAR - exponent)
    if exponent >= -_NEAR:
        return 1.0
    # Later samples of a dark picture may meet the brightest possible light.
    return 2.0 ** max(0, min(-_NEAR - exponent, _LARGEST - math.frexp(_most_light(frame))[1]))


def _most_light(frame: Frame) -> float:
    """Return an upper bound of all light of a picture."""
    scene, materials = frame.compiled.scene, frame.compiled.materials.values()
    lights = [_most_irradiance(light) for light in frame.compiled.lights]
    factors = [
        max(value)
        for material in materials
        for name, value in material.parameters.items()
        if MODELS[material.model].parameters[name].kind == "color" and name != "le"
    ]
    reflected = max(1.0, *factors) * (max(scene.ambient) + 2.0**_PEAK * sum(lights))
    return reflected + max(max(scene.background), *(max(material.get("le", (0.0,))) for material in materials))


def _most_irradiance(light: PointLight) -> float:
    """Return the largest irradiance of a light at any distance, as computed by irradiance.glsl."""
    match light.falloff:
        case "none":
            return max(light.color)
        case "inverse_square":
            return min(max(light.color) / max(light.radius, MIN_RADIUS) ** 2, MAX_COLOR)
    assert_never(light.falloff)


def scale_light(frame: Frame, scale: float) -> Frame:
    """Return `frame` with all light multiplied by `scale`: of lights, ambient, background and emission."""
    compiled, factor = frame.compiled, np.float32(scale)
    lights = np.frombuffer(frame.lights.block, LIGHT[compiled.options.precision]).copy()
    lights["color"] *= factor
    texels, layout = frame.materials.texels, compiled.layout
    if "le" in layout.colors:
        texels = texels.copy()
        # Large materials come after one texel for each surface (packing.material_texels()).
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
