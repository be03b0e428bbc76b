"""A GLSL ray tracer for constructive solid geometry that knows its own error.

    import raytracer as rt

    solid = (rt.Sphere((0, 0, 0), 1) | rt.Sphere((1, 0, 0), 1)) - rt.Sphere((0.5, 0.5, 0.5), 0.8)
    scene = rt.Scene([solid], [rt.PointLight((4, 7, 4))], rt.Camera((0, 1, 5), (0, 0, 0)))
    rt.render(scene, size=(640, 360), samples=16).save("solid.png")

A scene can also be loaded from a TOML file, by `load`; the command line is `raytracer --help`.
"""

from __future__ import annotations

# As typing.TYPE_CHECKING, whose import takes longer than all of this module.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from raytracer import brdf
    from raytracer.checks import InputError
    from raytracer.context import ContextError
    from raytracer.film import Image
    from raytracer.glsl_source import ShaderError
    from raytracer.instances import Instances
    from raytracer.library import published
    from raytracer.material import Material
    from raytracer.models import Lobe
    from raytracer.presets import quality
    from raytracer.renderer import render
    from raytracer.scene import Camera, PointLight, Scene
    from raytracer.scene_file import load, load_settings
    from raytracer.settings import Settings
    from raytracer.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, Union

__version__ = "0.1.0"

__all__ = [
    "Camera",
    "Complement",
    "ContextError",
    "Difference",
    "Image",
    "InputError",
    "Instances",
    "Intersection",
    "Lobe",
    "Material",
    "Plane",
    "PointLight",
    "Scene",
    "Settings",
    "ShaderError",
    "Solid",
    "Sphere",
    "Union",
    "brdf",
    "load",
    "load_settings",
    "published",
    "quality",
    "render",
]

# The module of each name, which is imported when the name is first used. So the command line sees to Ctrl-C before
# anything takes time, and a scene is made and checked without NumPy and OpenGL.
_LAZY = {
    "Camera": "scene",
    "Complement": "solids",
    "ContextError": "context",
    "Difference": "solids",
    "Image": "film",
    "InputError": "checks",
    "Instances": "instances",
    "Intersection": "solids",
    "Lobe": "models",
    "Material": "material",
    "Plane": "solids",
    "PointLight": "scene",
    "Scene": "scene",
    "Settings": "settings",
    "ShaderError": "glsl_source",
    "Solid": "solids",
    "Sphere": "solids",
    "Union": "solids",
    "load": "scene_file",
    "load_settings": "scene_file",
    "published": "library",
    "quality": "presets",
    "render": "renderer",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name == "brdf":
        return import_module("raytracer.brdf")
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"raytracer.{_LAZY[name]}"), name)
    globals()[name] = value
    return value
