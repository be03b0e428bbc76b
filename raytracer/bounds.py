"""Balls around solids."""

from __future__ import annotations

import math

from raytracer.checks import Vec3
from raytracer.solids import Complement, Difference, Intersection, Plane, Solid, Sphere, postfix
from raytracer.vectors import add, scaled, sub

Ball = tuple[Vec3, float]


def ball(solid: Solid) -> Ball | None:
    """(center, radius) of a ball that holds `solid`, close to the smallest; None if the solid may be unbounded.

    Which of the two depends on the tree and its kinds of primitive only, not on their numbers.
    """
    stack: list[Ball | None] = []
    for node in postfix(solid):
        match node:
            case Sphere():
                stack.append((node.center, node.radius))
            case Plane():
                stack.append(None)
            case Complement():
                stack[-1] = None
            case Difference():
                stack.pop()
            case _:
                b, a = stack.pop(), stack.pop()
                if isinstance(node, Intersection):
                    stack.append(_common(a, b) if a and b else a or b)
                else:
                    stack.append(_around(a, b) if a and b else None)
    return stack[0]


def _common(a: Ball, b: Ball) -> Ball:
    """Around what two balls have in common: a lens, or else all of the smaller one."""
    distance = math.dist(a[0], b[0])
    if distance > 0.0:
        along = (distance + (a[1] - b[1]) * (a[1] + b[1]) / distance) / 2.0  # from a to the lens's edge
        square = (a[1] - along) * (a[1] + along)
        if 0.0 < along < distance and square > 0.0:
            return add(a[0], scaled(sub(b[0], a[0]), along / distance)), math.sqrt(square)
    return min(a, b, key=lambda ball: ball[1])


def _around(a: Ball, b: Ball) -> Ball:
    """The smallest ball around two."""
    if a[1] < b[1]:
        a, b = b, a
    distance = math.dist(a[0], b[0])
    if distance + b[1] <= a[1]:
        return a
    radius = (distance + a[1] + b[1]) / 2.0
    return add(a[0], scaled(sub(b[0], a[0]), (radius - a[1]) / distance)), radius
