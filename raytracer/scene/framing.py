"""The bounding ball of objects, around which a camera is placed so that the ball just fits into the picture."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from raytracer.core.validation import Vec3
from raytracer.scene.instances import Instances
from raytracer.scene.solids.affine import similarity
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.bounds import Bounds
from raytracer.scene.solids.solid import Complement, Difference, Intersection, Primitive, Solid, postfix
from raytracer.scene.solids.sphere import Sphere

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class Ball(NamedTuple):
    """A ball."""

    center: Vec3
    radius: float


class _Copies(NamedTuple):
    """The balls of many copies of a solid."""

    centers: Array  # (N, 3)
    radii: Array  # (N,)


class _Part(NamedTuple):
    """An object with bounds: its box, and its solid or its copies."""

    box: Bounds
    solid: Solid | _Copies


def bounding_ball(objects: Iterable[Solid | Instances]) -> Ball | None:
    """Return a ball around all objects with bounds. Objects without bounds and empty ones do not count.

    The centre is the middle of the box around the objects. The radius is the smallest one that holds the primitives of
    each object, or the corners of its box if that is less. So the ball of one sphere is the sphere.

    Returns:
        The ball; None if no object has bounds.
    """
    parts = [part for part in map(_part, objects) if part]
    if not parts:
        return None
    box = parts[0].box
    for part in parts[1:]:
        box = box.union(part.box)
    center = _middle(box)
    return Ball(center, max(min(_reach(part.solid, center), _corner(part.box, center)) for part in parts))


def _part(item: Solid | Instances) -> _Part | None:
    """Return an object as a part; None if it is empty or has no bounds."""
    solid = item.solid if isinstance(item, Instances) else item
    box = solid.bounds()
    if not all(low <= high and math.isfinite(high - low) for low, high in zip(*box, strict=True)):
        return None
    if not isinstance(item, Instances):
        return _Part(box, solid)
    middle = _middle(box)
    radii = min(_reach(solid, middle), _corner(box, middle)) * item.scales
    maps = item.maps()
    centers = (maps[:, :, :3] * middle).sum(axis=2) + maps[:, :, 3]
    low, high = (centers - radii[:, None]).min(axis=0).tolist(), (centers + radii[:, None]).max(axis=0).tolist()
    return _Part(Bounds((low[0], low[1], low[2]), (high[0], high[1], high[2])), _Copies(centers, radii))


def _middle(box: Bounds) -> Vec3:
    x, y, z = ((low + high) / 2.0 for low, high in zip(*box, strict=True))
    return x, y, z


def _corner(box: Bounds, center: Vec3) -> float:
    """Return the distance of the farthest corner of a box."""
    return math.hypot(*(max(high - c, c - low) for low, high, c in zip(*box, center, strict=True)))


def _reach(solid: Solid | _Copies, center: Vec3) -> float:
    """Return a radius with which a ball around `center` holds a solid or its copies."""
    if isinstance(solid, _Copies):
        away = solid.centers - center
        return float(((away * away).sum(axis=1) ** 0.5 + solid.radii).max())
    stack: list[float] = []
    for node in postfix(solid):
        match node:
            case Primitive():
                stack.append(_primitive_reach(node, center))
            case Complement():
                stack[-1] = math.inf
            case Difference():
                stack.pop()
            case _:
                b, a = stack.pop(), stack.pop()
                stack.append(min(a, b) if isinstance(node, Intersection) else max(a, b))
    return stack[0]


def _primitive_reach(leaf: Primitive, center: Vec3) -> float:
    if isinstance(leaf, Sphere):
        return math.dist(leaf.center, center) + leaf.radius
    if not isinstance(leaf, Placed):
        return math.inf
    corners = leaf.corners()
    by_corners = max(math.dist(corner, center) for corner in corners)
    scale = similarity(leaf.matrix)
    if scale is None:
        return by_corners
    x, y, z = (sum(coordinates) / len(corners) for coordinates in zip(*corners, strict=True))
    return min(by_corners, math.dist((x, y, z), center) + scale * leaf.shape.reach())
