"""A GLSL ray tracer for constructive solid geometry (CSG) that estimates the error of its own pictures.

A scene of two spheres, merged, from which a third one is cut:

    import raytracer as rt

    solid = (rt.Sphere((0, 0, 0), 1) | rt.Sphere((1, 0, 0), 1)) - rt.Sphere((0.5, 0.5, 0.5), 0.8)
    scene = rt.Scene([solid], [rt.PointLight((4, 7, 4))], rt.Camera((0, 1, 5), (0, 0, 0)))
    rt.render(scene, size=(640, 360), samples=16).save("solid.png")

`load` reads a scene from a TOML file. `raytracer --help` describes the command line.

Overview:
    scene description: Scene, Union, Intersection, Difference, Complement, Instances, Material, Lobe, PointLight,
        Camera, and the kinds of primitive solids, such as Sphere and Box: raytracer.scene.solids.primitives lists them
    files: load, load_all, load_settings, SceneFile, published (measured materials from the literature)
    movies: animation, AnimatedScene
    sweeps: sweep (pictures of a scene with many values)
    pictures: render, Settings, quality (presets of settings), Image
    accuracy: reference (float64 ground truth), compare, Comparison
    reflectance models: brdf
    errors: InputError (a wrong value), ShaderError (a shader does not compile), ContextError (no OpenGL)

Points and vectors are three numbers in a right-handed coordinate system, lengths are in the units of the scene, and
colours are linear RGB.
"""

from __future__ import annotations

import sys

# Replaces typing.TYPE_CHECKING: importing typing takes longer than executing this whole module.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from raytracer.analysis.image_difference import Comparison as Comparison
    from raytracer.analysis.image_difference import compare as compare
    from raytracer.compiler.glsl.preprocessor import ShaderError as ShaderError
    from raytracer.core.validation import InputError as InputError
    from raytracer.farm.sweep_pictures import sweep as sweep
    from raytracer.formats.animated_scene import AnimatedScene as AnimatedScene
    from raytracer.formats.animated_scene import animation as animation
    from raytracer.formats.image import Image as Image
    from raytracer.formats.material_library import published as published
    from raytracer.formats.scene_file import SceneFile as SceneFile
    from raytracer.formats.scene_file import load as load
    from raytracer.formats.scene_file import load_all as load_all
    from raytracer.formats.scene_file import load_settings as load_settings
    from raytracer.gpu import glsl_call as glsl  # noqa: F401  (not in __all__)
    from raytracer.gpu.turns import ContextError as ContextError
    from raytracer.ground_truth.picture import reference as reference
    from raytracer.rendering import brdf as brdf
    from raytracer.rendering.picture import render as render
    from raytracer.scene.camera import Camera as Camera
    from raytracer.scene.instances import Instances as Instances
    from raytracer.scene.lights import PointLight as PointLight
    from raytracer.scene.materials.lobe import Lobe as Lobe
    from raytracer.scene.materials.material import Material as Material
    from raytracer.scene.scene import Scene as Scene
    from raytracer.scene.settings import Settings as Settings
    from raytracer.scene.settings_patch import quality as quality
    from raytracer.scene.solids.primitives import *  # noqa: F403
    from raytracer.scene.solids.solid import Complement as Complement
    from raytracer.scene.solids.solid import Difference as Difference
    from raytracer.scene.solids.solid import Intersection as Intersection
    from raytracer.scene.solids.solid import Solid as Solid
    from raytracer.scene.solids.solid import Union as Union
    from raytracer.version import __version__ as __version__

# Submodules are imported at the first use of a name, so that the command line handles Ctrl-C before any slow import.
# _SCENE_NAMES need neither NumPy nor OpenGL. The first use of any public name imports all of them, so that
# `eval(repr(x), vars(raytracer))` finds the class of x. The kinds of primitives are the
# classes that raytracer.scene.solids.primitives imports.
_SCENE_NAMES = {
    "AnimatedScene": "formats.animated_scene",
    "Camera": "scene.camera",
    "Complement": "scene.solids.solid",
    "Difference": "scene.solids.solid",
    "InputError": "core.validation",
    "Instances": "scene.instances",
    "Intersection": "scene.solids.solid",
    "Lobe": "scene.materials.lobe",
    "Material": "scene.materials.material",
    "PointLight": "scene.lights",
    "Scene": "scene.scene",
    "SceneFile": "formats.scene_file",
    "Settings": "scene.settings",
    "Solid": "scene.solids.solid",
    "Union": "scene.solids.solid",
    "animation": "formats.animated_scene",
    "load": "formats.scene_file",
    "load_all": "formats.scene_file",
    "load_settings": "formats.scene_file",
    "quality": "scene.settings_patch",
}
_PICTURE_NAMES = {
    "Comparison": "analysis.image_difference",
    "ContextError": "gpu.turns",
    "Image": "formats.image",
    "ShaderError": "compiler.glsl.preprocessor",
    "compare": "analysis.image_difference",
    "published": "formats.material_library",
    "reference": "ground_truth.picture",
    "render": "rendering.picture",
    "sweep": "farm.sweep_pictures",
}

# `glsl` calls single shader functions, for readers and tests of the shaders. It is not in `__all__`.
_MODULES = {"brdf": "rendering.brdf", "glsl": "gpu.glsl_call"}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name == "__version__":
        return import_module("raytracer.version").__version__
    if name == "__all__":
        return sorted([*_SCENE_NAMES, *_PICTURE_NAMES, "brdf", *_primitives()])
    if name in _MODULES:
        return import_module(f"raytracer.{_MODULES[name]}")
    module = _SCENE_NAMES.get(name) or _PICTURE_NAMES.get(name)
    if module is None and not (name[:1].isupper() and name in _primitives()):
        # With `name` and `obj`, Python suggests a similar name from dir().
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
    # A function is imported together with the class of its result, which is in the same submodule.
    imports = _SCENE_NAMES | {public: source for public, source in _PICTURE_NAMES.items() if source == module}
    globals().update(_primitives())
    for public, source in imports.items():
        globals()[public] = getattr(import_module(f"raytracer.{source}"), public)
    return globals()[name]


def __dir__() -> list[str]:
    # All public names, whether imported yet or not, but no submodules such as __main__.
    attributes = ("__all__", "__doc__", "__file__", "__loader__", "__name__", "__package__", "__path__", "__spec__")
    return sorted([*__getattr__("__all__"), *attributes, "__version__"])


def _primitives() -> dict[str, type]:
    """Return the classes of primitives, by their names."""
    from importlib import import_module

    names = vars(import_module("raytracer.scene.solids.primitives"))
    return {name: kind for name, kind in names.items() if isinstance(kind, type)}
