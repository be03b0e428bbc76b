"""Intersection of rays with CSG trees in float64 NumPy, written from the definitions.

Whether a point is inside a CSG tree follows by Boolean logic from the primitives that contain it. A ray hits the
surface of the tree at a root of a primitive if just one of the points right before and right after the root is inside
the tree. The code tests every root of every primitive: it sorts and skips nothing, and shares nothing with the shaders.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.ground_truth.light_rays import is_light_surface
from raytracer.ground_truth.microfacets import dot
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.solids import Complement, Intersection, Primitive, Solid, Sphere, Union, postfix

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def _inside(solid: list[Solid], leaf_inside: list[Mask]) -> list[Mask]:
    """Return for each node of a postfix tree whether points are inside, from the masks of the leaves in order."""
    results: list[Mask] = []
    stack: list[Mask] = []
    leaf = iter(leaf_inside)
    for node in solid:
        if isinstance(node, Primitive):
            value = next(leaf)
        elif isinstance(node, Complement):
            value = ~stack.pop()
        else:
            b, a = stack.pop(), stack.pop()
            value = a | b if isinstance(node, Union) else a & b if isinstance(node, Intersection) else a & ~b
        stack.append(value)
        results.append(value)
    return results


class Tracer:
    """Intersects rays with the primitives (leaves) of a scene.

    Rays have origins `ro` and directions `rd` [R, 3]. Points are relative to the camera. A surface is the index of a
    leaf, -1 for none. coincide[a, b]: whether the surfaces of leaves a and b are identical.
    """

    def __init__(self, scene: Scene) -> None:
        self._eye = scene.camera.position
        self._trees = [postfix(solid) for solid in scene.solids()]
        self.leaves = [node for tree in self._trees for node in tree if isinstance(node, Primitive)]
        order = {material: i for i, material in enumerate(scene.materials)}
        self.material_index = np.array([*(order[leaf.material] for leaf in self.leaves), -1], np.int32)
        numbers: dict[object, int] = {}
        surface = np.array([numbers.setdefault(_geometry(leaf), len(numbers)) for leaf in self.leaves])
        self.coincide = surface[:, None] == surface

    def spans(
        self,
        ro: Array,
        rd: Array,
        start: NDArray[np.int32] | None = None,
        n: Array | None = None,
        light: PointLight | None = None,
        distance: Array | None = None,
    ) -> list[tuple[Array, Array]]:
        """Return for every leaf the distances (entry, exit) along the whole line; (inf, -inf) if the line misses it.

        Args:
            ro: the rays' origins [R, 3].
            rd: the rays' directions, unit vectors [R, 3].
            start: the surfaces on which the rays start [R]. The root there is exactly 0 by definition, not computed.
                None: the rays start at the camera.
            n: the outward normals of these surfaces at the rays' origins [R, 3].
            light: the light to which the rays go. None: no shadow rays.
            distance: the distance of the light [R]. It is the exact root for surfaces on which the light lies, and for
                the light's own sphere, because the rays end there.
        """
        result = []
        for k, leaf in enumerate(self.leaves):
            on = self.coincide[k][start] if start is not None else np.zeros(len(rd), bool)
            lit = distance if light and is_light_surface(leaf, light) else None
            if isinstance(leaf, Sphere):
                to_center = np.subtract(leaf.center, self._eye) - ro
                along = dot(to_center, rd)
                perp = to_center - along[:, None] * rd
                # The product of the two roots is the power of the ray's origin. Next to a huge sphere, computing it
                # from a distance loses too many bits, even in float64. For the camera it is known exactly.
                to_distance = np.linalg.norm(to_center, axis=1)
                power: Any = (to_distance - leaf.radius) * (to_distance + leaf.radius)
                if start is None:
                    power = leaf.power(self._eye)
                square = np.where(np.abs(along) < leaf.radius, along**2 - power, leaf.radius**2 - dot(perp, perp))
                outer = along + np.copysign(np.sqrt(np.maximum(square, 0.0)), along)
                with np.errstate(divide="ignore", invalid="ignore"):
                    inner = power / outer
                entry = np.where(square > 0, np.minimum(inner, outer), np.inf)
                exit = np.where(square > 0, np.maximum(inner, outer), -np.inf)
                if light and lit is not None:
                    outward: Any = np.subtract(light.position, leaf.center)
                    if light.radius:
                        outward = ro + lit[:, None] * rd - np.subtract(leaf.center, self._eye)
                    chord = -2.0 * dot(rd, outward)
                    entry, exit = lit + np.minimum(chord, 0.0), lit + np.maximum(chord, 0.0)
                    entry, exit = np.where(on, 0.0, entry), np.where(on, lit, exit)
                elif n is not None:
                    chord = -2.0 * leaf.radius * dot(n, rd)
                    entry = np.where(on, np.minimum(chord, 0.0), entry)
                    exit = np.where(on, np.maximum(chord, 0.0), exit)
            else:
                normal = np.array(leaf.unit()[0])
                slope = rd @ normal
                depth = np.where(on, 0.0, leaf.depth(self._eye) - ro @ normal)
                with np.errstate(divide="ignore", invalid="ignore"):
                    t = depth / slope
                if lit is not None:
                    t = lit
                parallel = np.where(depth >= 0.0, np.inf, -np.inf)
                entry = np.where(slope == 0, -parallel, np.where(slope < 0, t, -np.inf))
                exit = np.where(slope == 0, parallel, np.where(slope > 0, t, np.inf))
            result.append((entry, exit))
        return result

    def first(self, ro: Array, rd: Array, *ends: Any) -> tuple[Array, NDArray[np.int32]]:
        """Return (t, surface) of the first surface with t > 0; (inf, -1) if there is none.

        `ends` are the optional arguments of spans() about the rays' ends.
        """
        nearest, surface = np.full(len(rd), np.inf), np.full(len(rd), -1, np.int32)
        spans = self.spans(ro, rd, *ends)
        first_leaf = 0
        for tree in self._trees:
            count = sum(isinstance(node, Primitive) for node in tree)
            own = spans[first_leaf : first_leaf + count]
            t = np.full(len(rd), np.inf)
            for root in (root for span in own for root in span):
                before, after = (
                    _inside(tree, _is_inside_before(own, root))[-1],
                    _inside(tree, _is_inside_after(own, root))[-1],
                )
                t = np.where((before != after) & (root > 0.0) & (root < t), root, t)
            closer = t < nearest
            owner = first_leaf + _owner(
                tree, _inside(tree, _is_inside_before(own, t)), _inside(tree, _is_inside_after(own, t))
            )
            nearest, surface = np.where(closer, t, nearest), np.where(closer, owner, surface).astype(np.int32)
            first_leaf += count
        return nearest, surface

    def normals(self, P: Array, surface: NDArray[np.int32]) -> Array:
        """Return the outward unit normals of the primitives at points on their surfaces [R, 3]; 0 for surface -1."""
        result = np.zeros(P.shape)
        for k, leaf in enumerate(self.leaves):
            on = surface == k
            if isinstance(leaf, Sphere):
                outward = P[on] - np.subtract(leaf.center, self._eye)
                result[on] = outward / np.linalg.norm(outward, axis=1, keepdims=True)
            else:
                result[on] = leaf.unit()[0]
        return result


def _is_inside_before(spans: list[tuple[Array, Array]], t: Array) -> list[Mask]:
    return [(entry < t) & (t <= exit) for entry, exit in spans]


def _is_inside_after(spans: list[tuple[Array, Array]], t: Array) -> list[Mask]:
    return [(entry <= t) & (t < exit) for entry, exit in spans]


def _owner(tree: list[Solid], before: list[Mask], after: list[Mask]) -> NDArray[np.int32]:
    """Return the leaf that a hit surface belongs to, as its index in the tree.

    At each operator, it is in the first operand whose state (inside or not) changes at the root.
    """
    stack: list[tuple[Mask, Any]] = []  # for each node: whether its state changes, and the leaf
    leaf = 0
    for node, b, a in zip(tree, before, after, strict=True):
        if isinstance(node, Primitive):
            owner: Any = np.full(a.shape, leaf, np.int32)
            leaf += 1
        elif isinstance(node, Complement):
            owner = stack.pop()[1]
        else:
            _, second = stack.pop()
            changes, first = stack.pop()
            owner = np.where(changes, first, second)
        stack.append((a != b, owner))
    return stack[0][1]


def _geometry(leaf: Primitive) -> object:
    """Return a key that is equal for leaves with coincident surfaces, regardless of their materials and sides."""
    if isinstance(leaf, Sphere):
        return leaf.center, leaf.radius
    (x, y, z), offset = leaf.unit()
    return max((x, y, z, offset), (-x, -y, -z, -offset))
