"""A GLSL ray tracer for constructive solid geometry that knows its own error.

    import raytracer as rt

    solid = (rt.Sphere((0, 0, 0), 1) | rt.Sphere((1, 0, 0), 1)) - rt.Sphere((0.5, 0.5, 0.5), 0.8)
    scene = rt.Scene([solid], [rt.PointLight((4, 7, 4))], rt.Camera((0, 1, 5), (0, 0, 0)))
    rt.render(scene, size=(640, 360), samples=16).save("solid.png")

A scene can also be loaded from a TOML file, by `load`; the command line is `raytracer --help`.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from raytracer.checks import InputError
from raytracer.instances import Instances
from raytracer.material import Material
from raytracer.models import Lobe
from raytracer.presets import quality
from raytracer.scene import Camera, PointLight, Scene
from raytracer.scene_file import SceneFile, load, load_all, load_settings
from raytracer.settings import Settings
from raytracer.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, Union

if TYPE_CHECKING:
    from raytracer import brdf
    from raytracer.comparison import Comparison, compare
    from raytracer.context import ContextError
    from raytracer.film import Image
    from raytracer.glsl_source import ShaderError
    from raytracer.library import published
    from raytracer.reference_picture import reference
    from raytracer.renderer import render

__version__ = "0.1.0"

__all__ = [
    "Camera",
    "Comparison",
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
    "SceneFile",
    "Settings",
    "ShaderError",
    "Solid",
    "Sphere",
    "Union",
    "brdf",
    "compare",
    "load",
    "load_all",
    "load_settings",
    "published",
    "quality",
    "reference",
    "render",
]

# What needs NumPy or OpenGL is imported when first asked for: a scene is made and checked without.
_LAZY = {
    "Comparison": "comparison",
    "ContextError": "context",
    "Image": "film",
    "ShaderError": "glsl_source",
    "compare": "comparison",
    "published": "library",
    "reference": "reference_picture",
    "render": "renderer",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name == "brdf":
        return import_module("raytracer.brdf")
    if name not in _LAZY:
        # With both, Python asks whether a near name of dir() was meant.
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
    value = getattr(import_module(f"raytracer.{_LAZY[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    # Public names, imported yet or not, without the modules that are imported by now, such as __main__.
    of_a_package = ("__all__", "__doc__", "__file__", "__loader__", "__name__", "__package__", "__path__", "__spec__")
    return sorted([*__all__, *of_a_package, "__version__"])
