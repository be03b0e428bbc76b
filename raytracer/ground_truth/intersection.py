"""Intersection of rays with CSG trees in float64 NumPy, written from the definitions.

Whether a point is inside a CSG tree follows by Boolean logic from the primitives that contain it. A ray hits the
surface of the tree at a root of a primitive if just one of the points right before and right after the root is inside
the tree. The code tests every root of every primitive: it sorts and skips nothing, and shares nothing with the shaders.
A primitive is the common part of the insides of its faces, and coincident faces are one surface (scene_surfaces.py).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.ground_truth.scene_surfaces import Ends, HalfSpace, SceneSurfaces, Surface
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.solids.solid import Complement, Intersection, Primitive, Solid, Union, postfix

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Span = tuple[Array, Array]


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
    """Intersects rays with the faces of a scene's primitives (leaves).

    Rays have origins `ro` and directions `rd` [R, 3]. Points are relative to the camera. Faces are numbered over all
    leaves in order, and -1 is none. A sphere or a half-space has one face.
    """

    def __init__(self, scene: Scene) -> None:
        self._trees = [postfix(solid) for solid in scene.solids()]
        self.leaves = [node for tree in self._trees for node in tree if isinstance(node, Primitive)]
        scene_surfaces = SceneSurfaces(self.leaves, scene.camera.position)
        self._has_one_origin = scene.camera.projection == "perspective"
        self.surfaces, self.faces = scene_surfaces.surfaces, scene_surfaces.faces
        # The leaf of each face, and the number of its surface: coincident faces have one number.
        self.leaf = np.array([*(face.leaf for face in self.faces), -1], np.int32)
        self.surface = np.array([*(face.surface for face in self.faces), -1], np.int32)
        self._first_face = np.searchsorted(self.leaf[:-1], np.arange(len(self.leaves) + 1))
        order = {material: i for i, material in enumerate(scene.materials)}
        material = np.array([*(order[leaf.material] for leaf in self.leaves), -1], np.int32)
        self.material_index = material[self.leaf]

    def is_bulb(self, light: PointLight, face: NDArray[np.int32]) -> Mask:
        """Return whether each of the faces is on the own sphere of a light with a radius."""
        return self._on(face, lambda surface: bool(light.radius) and surface.is_at(light))

    def is_in_plane(self, light: PointLight, face: NDArray[np.int32]) -> Mask:
        """Return whether a light lies in the plane of each of the faces; False for curved faces."""
        return self._on(face, lambda surface: isinstance(surface, HalfSpace) and surface.is_at(light))

    def _on(self, face: NDArray[np.int32], test: Callable[[Surface], bool]) -> Mask:
        return np.array([*map(test, self.surfaces), False])[self.surface[face]]

    def _surface_spans(
        self,
        ro: Array,
        rd: Array,
        start: NDArray[np.int32] | None = None,
        n: Array | None = None,
        light: PointLight | None = None,
        distance: Array | None = None,
    ) -> list[list[Span]]:
        result: list[list[Span]] = []
        is_camera = start is None and self._has_one_origin
        for k, surface in enumerate(self.surfaces):
            on = np.zeros(len(rd), bool) if start is None else self.surface[start] == k
            is_lit = light is not None and surface.is_at(light)
            ends = Ends(is_camera, on, n, light if is_lit else None, distance if is_lit else None)
            result.append(surface.spans(ro, rd, ends))
        return result

    def spans(self, ro: Array, rd: Array, *ends: Any) -> tuple[list[Span], list[Span]]:
        """Return the distances (entry, exit) along the whole line for every leaf, and for every face.

        The span of a leaf is the common part of the spans of its faces; (inf, -inf) if the line misses it. `ends` are
        the optional arguments of first().
        """
        surface_spans = self._surface_spans(ro, rd, *ends)
        face_spans = [surface_spans[face.surface][face.part] for face in self.faces]
        leaf_spans: list[Span] = []
        for first, last in itertools.pairwise(self._first_face):
            entry, exit = face_spans[first]
            if last - first > 1:
                entry, exit = (
                    choose.reduce([span[i] for span in face_spans[first:last]])
                    for i, choose in enumerate((np.maximum, np.minimum))
                )
                is_hit = entry < exit
                entry, exit = np.where(is_hit, entry, np.inf), np.where(is_hit, exit, -np.inf)
            leaf_spans.append((entry, exit))
        return leaf_spans, face_spans

    def first(self, ro: Array, rd: Array, *ends: Any) -> tuple[Array, NDArray[np.int32]]:
        """Return (t, face) of the first surface with t > 0; (inf, -1) if there is none.

        Args:
            ro: the rays' origins [R, 3].
            rd: the rays' directions, unit vectors [R, 3].
            ends: further arguments about the rays' ends, all or none, or only the first two:
                start: the faces on which the rays start [R]. The root of their surfaces there is exactly 0 by
                    definition, not computed. Without it, they are the rays of the camera.
                n: the outward normals of these faces at the rays' origins [R, 3].
                light: the light to which the rays go.
                distance: the distance of the light [R]. It is the exact root for surfaces on which the light lies, and
                    for the light's own sphere, because the rays end there.
        """
        nearest, hit_face = np.full(len(rd), np.inf), np.full(len(rd), -1, np.int32)
        spans, face_spans = self.spans(ro, rd, *ends)
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
            face = self._faces_at(owner, t, face_spans)
            nearest, hit_face = np.where(closer, t, nearest), np.where(closer, face, hit_face).astype(np.int32)
            first_leaf += count
        return nearest, hit_face

    def _faces_at(self, leaf: NDArray[np.int32], t: Array, face_spans: list[Span]) -> NDArray[np.int32]:
        """Return the first face of each leaf whose root is at t."""
        result = self._first_face[leaf].astype(np.int32)
        for k in np.unique(leaf):
            first, last = self._first_face[k : k + 2]
            for face in reversed(range(first, last)) if last - first > 1 else ():
                entry, exit = face_spans[face]
                result[(leaf == k) & ((entry == t) | (exit == t))] = face
        return result

    def normals(self, P: Array, face: NDArray[np.int32]) -> Array:
        """Return the outward unit normals of the primitives at points on their faces [R, 3]; 0 for face -1."""
        result = np.zeros(P.shape)
        for k in np.unique(face[face >= 0]):
            on = face == k
            surface = self.surfaces[self.faces[k].surface]
            normals = surface.normals(P[on])
            is_flipped = isinstance(surface, HalfSpace) and self.faces[k].part == 1
            result[on] = -normals if is_flipped else normals
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
