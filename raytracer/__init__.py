"""A GLSL ray tracer for constructive solid geometry that knows its own error.

    import raytracer as rt

    solid = (rt.Sphere((0, 0, 0), 1) | rt.Sphere((1, 0, 0), 1)) - rt.Sphere((0.5, 0.5, 0.5), 0.8)
    scene = rt.Scene([solid], [rt.PointLight((4, 7, 4))], rt.Camera((0, 1, 5), (0, 0, 0)))
    rt.render(scene, size=(640, 360), samples=16).save("solid.png")

A scene can also be loaded from a TOML file, by `load`; the command line is `raytracer --help`.
"""

from __future__ import annotations

import sys

# As typing.TYPE_CHECKING, whose import takes longer than all of this module.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from raytracer import brdf
    from raytracer.checks import InputError
    from raytracer.comparison import Comparison, compare
    from raytracer.context import ContextError
    from raytracer.film import Image
    from raytracer.glsl_source import ShaderError
    from raytracer.instances import Instances
    from raytracer.library import published
    from raytracer.lobe import Lobe
    from raytracer.material import Material
    from raytracer.picture import render
    from raytracer.presets import quality
    from raytracer.reference_picture import reference
    from raytracer.scene import Camera, PointLight, Scene
    from raytracer.scene_file import SceneFile, load, load_all, load_settings
    from raytracer.settings import Settings
    from raytracer.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, Union

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

# Names are imported when they are first used, so that the command line sees to Ctrl-C before anything takes time.
# The names that need neither NumPy nor OpenGL come all together: `eval(repr(scene), vars(raytracer))` finds them.
_SCENES = {
    "Camera": "scene",
    "Complement": "solids",
    "Difference": "solids",
    "InputError": "checks",
    "Instances": "instances",
    "Intersection": "solids",
    "Lobe": "lobe",
    "Material": "material",
    "Plane": "solids",
    "PointLight": "scene",
    "Scene": "scene",
    "SceneFile": "scene_file",
    "Settings": "settings",
    "Solid": "solids",
    "Sphere": "solids",
    "Union": "solids",
    "load": "scene_file",
    "load_all": "scene_file",
    "load_settings": "scene_file",
    "quality": "presets",
}
_PICTURES = {
    "Comparison": "comparison",
    "ContextError": "context",
    "Image": "film",
    "ShaderError": "glsl_source",
    "compare": "comparison",
    "published": "library",
    "reference": "reference_picture",
    "render": "picture",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name == "brdf":
        return import_module("raytracer.brdf")
    if name not in _SCENES and name not in _PICTURES:
        # With both, Python asks whether a near name of dir() was meant.
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
    names = _SCENES if name in _SCENES else {name: _PICTURES[name]}
    for each, module in names.items():
        globals()[each] = getattr(import_module(f"raytracer.{module}"), each)
    return globals()[name]


def __dir__() -> list[str]:
    # Public names, imported yet or not, without the modules that are imported by now, such as __main__.
    attributes = ("__all__", "__doc__", "__file__", "__loader__", "__name__", "__package__", "__path__", "__spec__")
    return sorted([*__all__, *attributes, "__version__"])
