"""The compiled scene: everything derived from a scene and its compile options, for any camera and any picture size."""

from __future__ import annotations

import msgspec

from raytracer.compiler.batches import FEW, Batches, is_bounded, make_batches
from raytracer.compiler.material_layout import Layout, make_layout
from raytracer.compiler.surfaces import Surfaces, make_surfaces
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.options import CompileOptions
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids.plane import Plane


class CompiledScene(msgspec.Struct, frozen=True, eq=False):
    """A scene in the form that the shaders need. compile() makes it; compiled scenes may share parts.

    has_lists: There are many primitives, so rays test the candidate lists of cells (candidate_lists.py).
    is_one_pass: There are few primitives, so one program finds the surface of a pixel and computes its light.
    has_mirrors: Some material mirrors the light of other surfaces.
    is_over_planes: All objects are objects of common shapes or single half-spaces, and the second pass finds the
        half-spaces itself.
    has_plane_only_cells: Some cells of a picture may show nothing but half-spaces (grounds.py).
    """

    scene: Scene
    options: CompileOptions
    surfaces: Surfaces
    batches: Batches
    materials: dict[int, Material]  # the materials in use, with the shading option applied, by their index in the scene
    layout: Layout  # of these materials
    lights: tuple[PointLight, ...]  # without radii, unless shadows are soft
    has_lists: bool
    is_one_pass: bool
    has_mirrors: bool
    is_over_planes: bool
    has_plane_only_cells: bool

    @property
    def has_area_lights(self) -> bool:
        """Whether any light has a radius."""
        return any(light.radius for light in self.lights)

    @property
    def has_falloff(self) -> bool:
        """Whether any light is attenuated."""
        return any(light.falloff != "none" for light in self.lights)

    @property
    def shadowing_lights(self) -> tuple[PointLight, ...]:
        """The lights that cast shadows."""
        return () if self.options.shadows == "off" else self.lights

    @property
    def structure(self) -> tuple[object, ...]:
        """All values that decide the text of the shaders: compiled scenes of equal structures share their programs."""
        lights = len(self.lights), self.has_area_lights, self.has_falloff
        return self.scene.objects, self.scene.materials, self.options, lights, self.scene.camera.projection


def compile(scene: Scene, options: CompileOptions, previous: CompiledScene | None = None) -> CompiledScene:
    """Compile `scene`. The result shares the unchanged parts with `previous`, or is `previous` if nothing has changed.

    Raises InputError for a material that the model `options.shading` cannot express.
    """
    if previous and previous.scene is scene and previous.options == options:
        return previous
    known = previous.scene.objects if previous else ()
    if previous and scene.objects is not known and scene.objects == known:
        # Equal objects become the same objects, with all that is derived from them, because each job of a farm has a
        # copy of its scene. To compare takes less than half of the time to compile.
        scene = scene.replace(objects=known)
    surfaces, batches = _surfaces(scene, previous), _batches(scene, previous)
    materials, layout = _materials(scene, options, surfaces, previous)
    has_lists = options.evaluator == "cells" and options.precision == 32 and surfaces.size > FEW
    has_mirrors = options.bounces > 0 and any(MODELS[model].mirrors for model in layout.models)
    return CompiledScene(
        scene=scene,
        options=options,
        surfaces=surfaces,
        batches=batches,
        materials=materials,
        layout=layout,
        lights=tuple(map(options.effective_light, scene.lights)),
        has_lists=has_lists,
        # llvmpipe needs minutes to compile Roth's filters twice in a row, and seconds for large trees.
        is_one_pass=options.evaluator != "roth" and surfaces.size <= FEW,
        has_mirrors=has_mirrors,
        is_over_planes=has_lists and bool(batches.shapes) and not batches.programs and not has_mirrors,
        has_plane_only_cells=options.evaluator == "cells"
        and not (has_mirrors and _has_mirror_planes(surfaces, batches, materials))
        and (has_lists or _is_bounded(scene, batches)),
    )


def _surfaces(scene: Scene, previous: CompiledScene | None) -> Surfaces:
    """Return the surfaces of the scene, shared with `previous` if they are unchanged."""
    if previous and scene.objects is previous.scene.objects and scene.materials == previous.scene.materials:
        return previous.surfaces
    # Scenes that differ only in camera, size or lights share their objects, such as successive pictures or frames.
    assert isinstance(scene.objects, SceneObjects)
    return scene.objects.derive("surfaces", scene.materials, lambda: make_surfaces(scene))


def _batches(scene: Scene, previous: CompiledScene | None) -> Batches:
    """Return the batches of the scene, shared with `previous` if they are unchanged."""
    if previous and scene.objects is previous.scene.objects:
        return previous.batches
    objects = scene.objects
    assert isinstance(objects, SceneObjects)
    return objects.derive("batches", None, lambda: make_batches(objects))


def _materials(
    scene: Scene, options: CompileOptions, surfaces: Surfaces, previous: CompiledScene | None
) -> tuple[dict[int, Material], Layout]:
    """Return the materials in use and their layout, shared with `previous` if they are unchanged."""
    if previous and previous.surfaces is surfaces and previous.options.shading == options.shading:
        return previous.materials, previous.layout
    materials = {i: options.shaded(scene.materials[i]) for i in surfaces.used}
    return materials, make_layout([*materials.values()])


def _has_mirror_planes(surfaces: Surfaces, batches: Batches, materials: dict[int, Material]) -> bool:
    """Return whether a single half-space is a mirror, in which any object may be visible."""
    return any(MODELS[materials[surfaces.material[plane]].model].mirrors for plane in batches.planes)


def _is_bounded(scene: Scene, batches: Batches) -> bool:
    """Return whether a ray that misses all spheres can meet only single half-spaces that the code names."""
    assert isinstance(scene.objects, SceneObjects)
    planes = 0
    for i, count in enumerate(scene.objects.counts()):
        shape = tuple(map(type, scene.objects.tree(i)))
        if shape == (Plane,):
            planes += count
        elif not is_bounded(shape):
            return False
    return planes <= len(batches.planes)
