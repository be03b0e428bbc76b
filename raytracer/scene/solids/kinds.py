"""The kinds of primitives, by their keys in scene files: the names of their classes, in lower case."""

from __future__ import annotations

from raytracer.scene.solids import primitives
from raytracer.scene.solids.solid import Primitive

KINDS: dict[str, type[Primitive]] = {
    name.lower(): kind
    for name, kind in vars(primitives).items()
    if isinstance(kind, type) and issubclass(kind, Primitive)
}
