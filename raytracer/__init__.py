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

    from raytracer.analysis.image_difference import Comparison, compare
    from raytracer.compiler.glsl.preprocessor import ShaderError
    from raytracer.core.validation import InputError
    from raytracer.formats.image import Image
    from raytracer.formats.material_library import published
    from raytracer.formats.scene_file import SceneFile, load, load_all, load_settings
    from raytracer.gpu import glsl_call as glsl  # noqa: F401  (not in __all__)
    from raytracer.gpu.turns import ContextError
    from raytracer.ground_truth.picture import reference
    from raytracer.rendering import brdf
    from raytracer.rendering.picture import render
    from raytracer.scene.camera import Camera
    from raytracer.scene.instances import Instances
    from raytracer.scene.lights import PointLight
    from raytracer.scene.materials.lobe import Lobe
    from raytracer.scene.materials.material import Material
    from raytracer.scene.scene import Scene
    from raytracer.scene.settings import Settings
    from raytracer.scene.settings_patch import quality
    from raytracer.scene.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, Union
    from raytracer.version import __version__ as __version__

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
# The names that need neither NumPy nor OpenGL come all together, and with every other one: so
# `eval(repr(x), vars(raytracer))` finds them.
_SCENES = {
    "Camera": "scene.camera",
    "Complement": "scene.solids",
    "Difference": "scene.solids",
    "InputError": "core.validation",
    "Instances": "scene.instances",
    "Intersection": "scene.solids",
    "Lobe": "scene.materials.lobe",
    "Material": "scene.materials.material",
    "Plane": "scene.solids",
    "PointLight": "scene.lights",
    "Scene": "scene.scene",
    "SceneFile": "formats.scene_file",
    "Settings": "scene.settings",
    "Solid": "scene.solids",
    "Sphere": "scene.solids",
    "Union": "scene.solids",
    "load": "formats.scene_file",
    "load_all": "formats.scene_file",
    "load_settings": "formats.scene_file",
    "quality": "scene.settings_patch",
}
_PICTURES = {
    "Comparison": "analysis.image_difference",
    "ContextError": "gpu.turns",
    "Image": "formats.image",
    "ShaderError": "compiler.glsl.preprocessor",
    "compare": "analysis.image_difference",
    "published": "formats.material_library",
    "reference": "ground_truth.picture",
    "render": "rendering.picture",
}

# `glsl` is for who looks into the shaders: not in `__all__`.
_MODULES = {"brdf": "rendering.brdf", "glsl": "gpu.glsl_call"}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name == "__version__":
        return import_module("raytracer.version").__version__
    if name in _MODULES:
        return import_module(f"raytracer.{_MODULES[name]}")
    module = _SCENES.get(name) or _PICTURES.get(name)
    if module is None:
        # With both, Python asks whether a near name of dir() was meant.
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
    # A function comes with the class of its result.
    names = _SCENES | {each: place for each, place in _PICTURES.items() if place == module}
    for each, place in names.items():
        globals()[each] = getattr(import_module(f"raytracer.{place}"), each)
    return globals()[name]


def __dir__() -> list[str]:
    # Public names, imported yet or not, without the modules that are imported by now, such as __main__.
    attributes = ("__all__", "__doc__", "__file__", "__loader__", "__name__", "__package__", "__path__", "__spec__")
    return sorted([*__all__, *attributes, "__version__"])
