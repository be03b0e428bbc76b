"""Scenes as plain lists, numbers and strings, from which the keys of stored pictures are hashed."""

from __future__ import annotations

import hashlib
from typing import Any

import msgspec
import numpy as np

from raytracer.scene.materials.material import Material
from raytracer.scene.materials.merl import Measured
from raytracer.scene.scene import Scene
from raytracer.scene.solids.solid import Primitive, Solid, postfix


def canonical(scene: Scene) -> Any:
    """Return a scene as lists, numbers and strings, for the keys of stored pictures.

    The results of two scenes are equal if and only if both scenes have the same picture: names of the scene
    and of materials are left out. An array is replaced by its hash. Other numbers keep all their bits in JSON.
    """
    number = {material: i for i, material in enumerate(scene.materials)}

    def plain(value: Any) -> Any:
        match value:
            case Material():  # the material of a leaf, by its index in the list of materials
                return number[value]
            case Measured():
                return plain(value.values)
            case np.ndarray():
                return [list(value.shape), value.dtype.str, hashlib.sha256(value.tobytes()).hexdigest()]
            case tuple() | list():
                return [plain(part) for part in value]
            case Solid() if not isinstance(value, Primitive):
                nodes = postfix(value)
                return [plain(node) if isinstance(node, Primitive) else type(node).__name__ for node in nodes]
            case msgspec.Struct():
                return [type(value).__name__, *(plain(getattr(value, name)) for name in value.__struct_fields__)]
        return value

    materials = [[m.model, {key: plain(value) for key, value in m.parameters.items()}] for m in scene.materials]
    others = {
        name: plain(getattr(scene, name)) for name in scene.__struct_fields__ if name not in ("materials", "name")
    }
    return {"materials": materials, **others}
