"""A scene's objects are compiled once, and the compiled data live as long as the objects."""

from __future__ import annotations

import copy
import pickle

import raytracer as rt
from raytracer.compiler.compiled_scene import compile as compile_scene
from raytracer.scene.options import CompileOptions
from raytracer.scene.scene_objects import SceneObjects
from tests import scenes


def test_scenes_of_the_same_objects_share_their_compiled_data() -> None:
    scene, other = rt.load(scenes.ASSIGNMENT), rt.load(scenes.ASSIGNMENT)
    first = compile_scene(scene, CompileOptions())
    between = compile_scene(other, CompileOptions())
    moved = scene.replace(lights=[rt.PointLight((1, 2, 3))], camera=rt.Camera((0, 2, 9), (0, 0, 0)))
    second = compile_scene(moved, CompileOptions(shadows="off", shading="ggx"))
    assert first.surfaces is second.surfaces and first.batches is second.batches
    assert between.surfaces is not first.surfaces, "compiled data belong to the objects that they were made from"


def test_an_additional_material_renumbers_the_materials_of_the_surfaces() -> None:
    scene = rt.load(scenes.ASSIGNMENT)
    before = compile_scene(scene, CompileOptions()).surfaces
    more = scene.replace(materials=(rt.Material(kd=0.123), *scene.materials))
    after = compile_scene(more, CompileOptions()).surfaces
    assert (after.material == before.material + 1).all()
    assert (compile_scene(scene, CompileOptions()).surfaces.material == before.material).all()


def test_a_copy_of_a_scene_does_not_copy_its_compiled_data() -> None:
    scene = rt.load(scenes.ASSIGNMENT)
    compile_scene(scene, CompileOptions())
    for other in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        assert other == scene and isinstance(other.objects, SceneObjects) and not other.objects.derived
