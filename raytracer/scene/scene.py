"""The scene: objects, materials, lights and a camera.

Scenes are plain data without OpenGL. All objects are immutable and checked when they are created, and their `repr` is
valid Python. Lengths are in a unit of the user's choice, angles in degrees, colours in linear RGB. A wrong value raises
`InputError`, whose message begins with the name of the value.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, Vec3, check_text, color, items, set_fields
from raytracer.scene.camera import Camera
from raytracer.scene.instances import Instances
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.solid import Solid


@public
class Scene(Record, frozen=True):
    """A scene: objects, lights and a camera.

    Args:
        objects: solids, and Instances of solids, at least one. Objects may overlap: a ray sees the nearest surface.
        lights: the point lights. May be empty.
        camera: the camera. Default: Camera.framing() of the objects.
        ambient: the ambient light Ia, linear RGB, each at least 0. A surface reflects `ka` Ia of it, where `ka` is a
            parameter of its material. Default: (1, 1, 1).
        background: the radiance of a ray that hits nothing, linear RGB, each at least 0. Default: (0.5, 0.7, 0.9).
        materials: the order of the materials, which are the indices in `Image.material`. Materials of the objects
            that are missing here are appended, in the order of the objects. Default: none.
        name: a label. Default: "scene".

    Raises:
        InputError: a wrong value, more than 1048576 primitives in all objects together, or no camera and no object
            with bounds.
    """

    objects: Sequence[Solid | Instances]
    lights: Sequence[PointLight]
    camera: Camera = None  # pyright: ignore[reportAssignmentType]
    ambient: Vec3 = (1.0, 1.0, 1.0)
    background: Vec3 = (0.5, 0.7, 0.9)
    materials: Sequence[Material] = ()
    name: str = "scene"

    def __post_init__(self) -> None:
        objects = self.objects
        if not isinstance(objects, SceneObjects):
            objects = SceneObjects(_tuple_of(objects, (Solid, Instances), "objects", "solids and Instances"))
        camera = self.camera if self.camera is not None else _framing_camera(objects)
        if not isinstance(camera, Camera):
            raise InputError(f"expected a Camera, got {format_value(camera)}", "camera")
        materials = _tuple_of(self.materials, (Material,), "materials", "Materials")
        set_fields(
            self,
            objects=objects,
            camera=camera,
            lights=_tuple_of(self.lights, (PointLight,), "lights", "PointLights"),
            ambient=color(self.ambient, "ambient"),
            background=color(self.background, "background"),
            materials=tuple(dict.fromkeys((*materials, *objects.materials))),
            name=check_text(self.name, "name"),
        )

    def solids(self) -> tuple[Solid, ...]:
        """Return all solids in order, with Instances expanded. Surfaces are numbered in this order."""
        return tuple(s for o in self.objects for s in (o.solids() if isinstance(o, Instances) else (o,)))


def _framing_camera(objects: SceneObjects) -> Camera:
    """Return the camera that frames the objects, which Scenes of the same objects share."""
    try:
        return objects.derive("framing camera", None, lambda: Camera.framing(objects))
    except InputError as error:
        raise InputError(error.reason, "camera") from None


def check_scene(value: Any) -> Scene:
    """Return `value` if it is a Scene. Raises InputError otherwise."""
    if not isinstance(value, Scene):
        raise InputError(
            f"expected a Scene (raytracer.load() reads one from a file), got {format_value(value)}", "scene"
        )
    return value


def used_models(scene: Scene) -> list[str]:
    """Return the names of the reflectance models that occur in the scene, in the order of MODELS."""
    assert isinstance(scene.objects, SceneObjects)
    used = {material.model for material in scene.objects.materials}
    return [model for model in MODELS if model in used]


def _tuple_of(values: Any, kinds: tuple[type, ...], key: str, expected: str) -> tuple[Any, ...]:
    if isinstance(values, kinds):
        values = (values,)
    result = values if type(values) is tuple else items(values, MAX_SURFACES)
    if result is None:
        raise InputError(f"expected {expected}, got {format_value(values)}", key)
    result = tuple(result)
    if len(result) > MAX_SURFACES:
        raise InputError(f"expected at most {MAX_SURFACES} {expected}", key)
    # Check each distinct type once: a million values have few types.
    if not all(issubclass(kind, kinds) for kind in {*map(type, result)}):
        wrong = next(value for value in result if not isinstance(value, kinds))
        raise InputError(f"expected {expected}, got {format_value(wrong)}", key)
    return result
