"""Bounds of the Roth filters of CSG trees: the hits of a diagram, and the number of successive loops."""

from __future__ import annotations

from raytracer.scene.instances import Instances
from raytracer.scene.scene import Scene
from raytracer.scene.solids.flattening import simplify
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Complement, Difference, Intersection, Solid, Union, postfix


def max_hits(solid: Solid) -> int:
    """Return the most hits of any Roth diagram of the tree and its subtrees.

    A line crosses a sphere or a body at most twice, and a plane at most once. A solid that may be unbounded can also
    have an end at each infinity. Hits come in pairs.
    """
    most = 0
    stack: list[tuple[int, bool]] = []  # the number of crossings, and whether the solid may be unbounded
    for node in postfix(solid):
        match node:
            case Complement():
                crossings, unbounded = stack.pop()
                stack.append((crossings, True))
            case Union():
                (m, u), (n, v) = stack.pop(), stack.pop()
                stack.append((m + n, u or v))
            case Intersection():
                (m, u), (n, v) = stack.pop(), stack.pop()
                stack.append((m + n, u and v))
            case Difference():
                (n, _), (m, u) = stack.pop(), stack.pop()
                most = max(most, n + 2)  # differenceCSG() takes the complement of its second operand
                stack.append((m + n, u))
            case _:
                stack.append((1, True) if isinstance(node, Plane) else (2, False))
        crossings, unbounded = stack[-1]
        most = max(most, crossings + 2 * unbounded)
    return most // 2 * 2


def roth_loops(scene: Scene) -> int:
    """Return the number of successive loops in the Roth filters of a scene, which decides the time to compile them."""
    cost = {Union: 1, Intersection: 1, Difference: 2, Complement: 1}
    loops = 0
    for item in scene.objects:
        tree = simplify(item.solid if isinstance(item, Instances) else item)
        count = len(item) if isinstance(item, Instances) else 1
        loops += count * (1 + sum(cost.get(type(node), 0) for node in tree))
    return loops
