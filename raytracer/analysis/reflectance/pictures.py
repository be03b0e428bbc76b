"""The scene that shows a material: a ball with a bite taken out of it and a small ball on a grey floor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.formats.srgb import encode_srgb8
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.convert import WITHOUT_PI
from raytracer.scene.materials.material import Material
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.sphere import Sphere

_KEY, _FILL = (-3.2, 5.5, 5.0), (6.0, 2.5, 2.0)
_FILL_SHARE = 0.35
_GREY = 0.42


def white_light(material: Material) -> float:
    """Return the light's colour that makes a white diffuse material white: pi, or 1 for models without 1/pi."""
    return 1.0 if material.model in WITHOUT_PI else math.pi


def make_scene(material: Material) -> Scene:
    """Return the scene with this material. Without ambient light, it shows the reflectance alone."""
    light = white_light(material)
    ball = Sphere((0.0, 1.0, 0.0), 1.0, material) - Sphere((0.62, 1.72, 0.72), 0.62, material)
    small = Sphere((1.02, 0.3, 0.86), 0.3, material)
    grey = Material("phong", kd=_GREY, ks=0.0) if light == 1.0 else Material("lambert", rho=_GREY)
    return Scene(
        [ball, small, Plane((0.0, 1.0, 0.0), 0.0, grey)],
        [PointLight(_KEY, _grey(light)), PointLight(_FILL, _grey(_FILL_SHARE * light))],
        Camera((0.35, 3.0, 5.0), (0.2, 0.82, 0.0), vertical_fov=28.0),
        background=(0.3, 0.38, 0.5),
        ambient=_grey(0.0),
    )


def _grey(value: float) -> Vec3:
    return (value, value, value)


def draw_material(material: Material, side: int, samples: int, renderer: Renderer) -> NDArray[np.uint8]:
    """Render the material's scene as a square sRGB picture (side, side, 3)."""
    image = renderer.render(make_scene(material), (side, side), Settings(samples=samples))
    return encode_srgb8(image.radiance)
