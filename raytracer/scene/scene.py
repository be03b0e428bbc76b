"""The scene: solids, materials, lights and a camera.

Pure data, no OpenGL. Every object is frozen, checked when made, and has a `repr` that can be
pasted back. Lengths are in one unit of the user's choice, angles in degrees, colours linear RGB.
Whatever is wrong with a value raises `InputError`, whose message begins with the value's name.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from raytracer.core.record import Record, public
from raytracer.core.shown import shown
from raytracer.core.validation import InputError, Vec3, check_text, color, items, set_fields
from raytracer.scene.camera import Camera
from raytracer.scene.instances import Instances
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.solids import MAX_SURFACES, Solid


@public
class Scene(Record, frozen=True):
    """Solids, lights and a camera.

    `objects` are separate solids, and Instances of solids; the first hit of any is seen. `ambient`
    is Ia of the lecture's formula, `background` the radiance of a ray that meets nothing.
    `materials` lists the scene's materials in the order that the `material` output counts them:
    those given, then any others in the order in which the objects name them.
    """

    objects: Sequence[Solid | Instances]
    lights: Sequence[PointLight]
    camera: Camera
    ambient: Vec3 = (1.0, 1.0, 1.0)
    background: Vec3 = (0.5, 0.7, 0.9)
    materials: Sequence[Material] = ()
    name: str = "scene"

    def __post_init__(self) -> None:
        objects = self.objects
        if not isinstance(objects, SceneObjects):
            objects = SceneObjects(_tuple_of(objects, (Solid, Instances), "objects", "solids and Instances"))
        if not isinstance(self.camera, Camera):
            raise InputError(f"expected a Camera, got {shown(self.camera)}", "camera")
        materials = _tuple_of(self.materials, (Material,), "materials", "Materials")
        set_fields(
            self,
            objects=objects,
            lights=_tuple_of(self.lights, (PointLight,), "lights", "PointLights"),
            ambient=color(self.ambient, "ambient"),
            background=color(self.background, "background"),
            materials=tuple(dict.fromkeys((*materials, *objects.materials))),
            name=check_text(self.name, "name"),
        )

    def solids(self) -> tuple[Solid, ...]:
        """All plain solids in order, Instances one by one. Surfaces are counted in this order everywhere."""
        return tuple(s for o in self.objects for s in (o.solids() if isinstance(o, Instances) else (o,)))


def checked_scene(value: Any) -> Scene:
    """`value`, if it is a Scene. Raises InputError."""
    if not isinstance(value, Scene):
        raise InputError(f"expected a Scene (raytracer.load() makes one of a file), got {shown(value)}", "scene")
    return value


def used_models(scene: Scene) -> list[str]:
    """The reflectance models of the materials that the primitives have, in the order of MODELS."""
    assert isinstance(scene.objects, SceneObjects)
    used = {material.model for material in scene.objects.materials}
    return [model for model in MODELS if model in used]


def _tuple_of(values: Any, kinds: tuple[type, ...], key: str, expected: str) -> tuple[Any, ...]:
    if isinstance(values, kinds):
        values = (values,)
    result = values if type(values) is tuple else items(values, MAX_SURFACES)
    if result is None:
        raise InputError(f"expected {expected}, got {shown(values)}", key)
    result = tuple(result)
    if len(result) > MAX_SURFACES:
        raise InputError(f"expected at most {MAX_SURFACES} {expected}", key)
    # Very many values have few types.
    if not all(issubclass(each, kinds) for each in {*map(type, result)}):
        wrong = next(value for value in result if not isinstance(value, kinds))
        raise InputError(f"expected {expected}, got {shown(wrong)}", key)
    return result
