"""Replacement of an attribute of a Scene object by its path, such as "lights.0.position" or "objects.1.material.kd"."""

from __future__ import annotations

from typing import Any

from raytracer.core.record import Record
from raytracer.core.suggest import did_you_mean, known_names
from raytracer.core.validation import KeyNameError, Keys, items, within
from raytracer.scene.materials.material import Material
from raytracer.scene.scene import Scene

# The attributes of a scene that paths may begin with. `materials` only orders the materials that the objects have.
_ROOTS = ("camera", "lights", "ambient", "background", "objects")


def replace_attribute(scene: Scene, path: Keys, value: Any) -> Scene:
    """Return a scene with another value for one attribute.

    Args:
        scene: the scene.
        path: names of attributes, and indices of lights, objects and components of vectors, from
            scene_paths.parse_path(). Solids of a tree are its attributes `a` and `b`.
        value: a number, a vector or a text.

    Raises:
        InputError: no such attribute (a KeyNameError), or a value that it cannot have.
    """
    if path[0] not in _ROOTS:
        first = str(path[0])
        raise KeyNameError(
            f"expected a path that begins with one of {', '.join(_ROOTS)}, got {first}{did_you_mean(first, _ROOTS)}",
            path,
        )
    return _replace(scene, path, value)


def _replace(owner: Any, path: Keys, value: Any) -> Any:
    """Return the value `owner` with another value at a path in it."""
    if not path:
        if isinstance(owner, Record | Material) or (isinstance(owner, tuple) and isinstance(owner[0], Record)):
            raise KeyNameError(f"expected the path of a number, a vector or a text ({known_names(_names(owner))})", ())
        return value
    key, rest = path[0], path[1:]
    if isinstance(owner, Record | Material):
        name = str(key)
        known = _names(owner)
        if name not in known and not isinstance(owner, Material):  # a material may have a parameter of another model
            hint = f"({known_names(known)}){did_you_mean(name, known)}"
            raise KeyNameError(f"unknown attribute `{name}` of {type(owner).__name__} {hint}", name)
        old = getattr(owner, name, None)
        with within(name):
            new = _replace(old, rest, value)
        return owner.replace(**{name: new})
    values = items(owner, 2**20)
    if values is None:
        raise KeyNameError("expected the end of the path, as the value has no parts", ())
    if not isinstance(key, int) or key >= len(values):
        raise KeyNameError(f"expected an index in [0, {len(values) - 1}], got {key}", key)
    with within(key):
        return (*values[:key], _replace(values[key], rest, value), *values[key + 1 :])


def _names(owner: Any) -> tuple[str, ...]:
    """Return the names of the attributes of a part of a scene, or the indices of a list."""
    if isinstance(owner, Material):
        return ("model", *owner.parameters)
    return owner.__struct_fields__ if isinstance(owner, Record) else tuple(map(str, range(len(owner))))
