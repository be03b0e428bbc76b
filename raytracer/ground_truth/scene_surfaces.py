"""Surfaces of a scene, each of them once: half-spaces, spheres and walls, and the leaves that have them as faces."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import Vec3
from raytracer.ground_truth import quadrics, tori
from raytracer.ground_truth.microfacets import dot
from raytracer.ground_truth.solid_faces.definition import WallDefinition
from raytracer.ground_truth.solid_faces.registry import find_faces
from raytracer.scene.lights import PointLight
from raytracer.scene.solids import affine
from raytracer.scene.solids.affine import Map
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.limits import ROUNDING
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Primitive
from raytracer.scene.solids.sphere import Sphere

Array = NDArray[np.float64]
Span = tuple[Array, Array]


class Ends(NamedTuple):
    """The known ends of rays on one surface. The roots there are exact by definition, not computed.

    Of a ray from one point of a plane to another one, every point is a root: the plane's only one is at the light.
    """

    is_camera: bool  # the rays start at the camera's position
    on: NDArray[np.bool_]  # (R,): the ray starts on the surface
    normals: Array | None  # (R, 3): outward, where the ray starts on the surface
    light: PointLight | None  # the light that lies on the surface, if any
    distance: Array | None  # (R,): its distance along the ray


class HalfSpace:
    """The half-space dot(normal, x) <= offset, for a unit normal. Its parts are the half-space and the other side."""

    def __init__(self, normal: Vec3, offset: float, eye: Vec3) -> None:
        self.normal, self._offset, self._eye = np.array(normal), offset, eye

    def depth(self, point: Vec3) -> float:
        """Return the depth of a point below the face, negative outside, rounded once."""
        return math.fsum((self._offset, *(-n * p for n, p in zip(map(float, self.normal), point, strict=True))))

    def is_at(self, light: PointLight) -> bool:
        """Whether shadow rays to a light end on the surface, up to rounding."""
        largest = max(map(abs, (*light.position, self._offset)))
        return not light.radius and abs(self.depth(light.position)) <= ROUNDING * largest

    def spans(self, ro: Array, rd: Array, ends: Ends) -> list[Span]:
        """Return the distances (entry, exit) of each part along the rays' lines; (inf, -inf) for a miss."""
        slope = rd @ self.normal
        depth = np.where(ends.on, 0.0, self.depth(self._eye) - ro @ self.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = depth / slope if ends.distance is None else ends.distance
        return [_half_line(t, slope, depth), _half_line(t, -slope, -depth)]

    def normals(self, P: Array) -> Array:
        """Return the outward unit normals of part 0 at points of the surface [R, 3]."""
        return np.broadcast_to(self.normal, P.shape)


def _half_line(t: Array, slope: Array, depth: Array) -> Span:
    parallel = np.where(depth >= 0.0, np.inf, -np.inf)
    entry = np.where(slope == 0, -parallel, np.where(slope < 0, t, -np.inf))
    exit = np.where(slope == 0, parallel, np.where(slope > 0, t, np.inf))
    return entry, exit


class Ball:
    """A ball, with one part. Methods as of HalfSpace."""

    def __init__(self, sphere: Sphere, eye: Vec3) -> None:
        self._sphere, self._eye = sphere, eye

    def is_at(self, light: PointLight) -> bool:
        return light.is_bulb(self._sphere) if light.radius else self._sphere.touches(light.position)

    def spans(self, ro: Array, rd: Array, ends: Ends) -> list[Span]:
        center, radius = self._sphere.center, self._sphere.radius
        to_center = np.subtract(center, self._eye) - ro
        along = dot(to_center, rd)
        perp = to_center - along[:, None] * rd
        # The product of the two roots is the power of the ray's origin. Next to a huge sphere, computing it
        # from a distance loses too many bits, even in float64. For the camera it is known exactly.
        to_distance = np.linalg.norm(to_center, axis=1)
        power: Any = (to_distance - radius) * (to_distance + radius)
        if ends.is_camera:
            power = self._sphere.power(self._eye)
        square = np.where(np.abs(along) < radius, along**2 - power, radius**2 - dot(perp, perp))
        outer = along + np.copysign(np.sqrt(np.maximum(square, 0.0)), along)
        with np.errstate(divide="ignore", invalid="ignore"):
            inner = power / outer
        entry = np.where(square > 0, np.minimum(inner, outer), np.inf)
        exit = np.where(square > 0, np.maximum(inner, outer), -np.inf)
        if ends.light and ends.distance is not None:
            outward: Any = np.subtract(ends.light.position, center)
            if ends.light.radius:
                outward = ro + ends.distance[:, None] * rd - np.subtract(center, self._eye)
            chord = -2.0 * dot(rd, outward)
            entry, exit = ends.distance + np.minimum(chord, 0.0), ends.distance + np.maximum(chord, 0.0)
            entry, exit = np.where(ends.on, 0.0, entry), np.where(ends.on, ends.distance, exit)
        elif ends.normals is not None:
            chord = -2.0 * radius * dot(ends.normals, rd)
            entry = np.where(ends.on, np.minimum(chord, 0.0), entry)
            exit = np.where(ends.on, np.maximum(chord, 0.0), exit)
        return [(entry, exit)]

    def normals(self, P: Array) -> Array:
        outward = P - np.subtract(self._sphere.center, self._eye)
        return outward / np.linalg.norm(outward, axis=1, keepdims=True)


class Wall:
    """The inside of a wall under an affine map. A torus has two parts, the first and the second span of a ray.

    Methods as of HalfSpace.
    """

    def __init__(self, wall: WallDefinition, matrix: Map, eye: Vec3) -> None:
        linear = np.array(wall.rows @ np.linalg.inv(np.array(matrix)[:, :3]))
        # The camera relative to the anchor's image, rounded once: both may be far from the origin.
        exact = [
            Fraction(e) - sum(Fraction(m) * Fraction(x) for m, x in zip(row, (*wall.anchor, 1.0), strict=True))
            for e, row in zip(eye, matrix, strict=True)
        ]
        self._is_torus, self._ratio = wall.kind == "torus", wall.constant
        # The forms and gradients of points relative to the camera.
        self._linear, self._at_camera = linear, linear @ np.array(list(map(float, exact)))
        self._at_camera[0] += wall.constant
        self._eye = eye
        # The largest number of the sums that make the forms, so that the rounding error is a share of it.
        reach = np.abs(linear) @ np.abs(np.array(matrix)[:, :3] @ wall.anchor + np.array(matrix)[:, 3])
        self._size = float(reach.max()) + 1.0
        self.has_camera = self._is_at(eye)  # whether the camera lies on the surface, up to rounding

    def _forms(self, P: Array) -> Array:
        return P @ self._linear.T + self._at_camera

    def is_at(self, light: PointLight) -> bool:
        return not light.radius and self._is_at(light.position)

    def _is_at(self, point: Vec3) -> bool:
        forms = self._forms(np.subtract(point, self._eye)[None])[0]
        if self._is_torus:
            off = math.hypot(math.hypot(forms[1], forms[2]) - 1.0, forms[3]) - self._ratio
        else:
            off = math.hypot(*forms[1:]) - float(forms[0])
        reach = np.abs(self._linear) @ np.maximum(np.abs(point), np.abs(self._eye))
        return abs(off) <= ROUNDING * max(self._size, float(reach.max()))

    def spans(self, ro: Array, rd: Array, ends: Ends) -> list[Span]:
        p, d = self._forms(ro), rd @ self._linear.T
        if ends.is_camera and self.has_camera:
            return self._spans_from_surface(p, d)
        result = self._spans(p, d)
        light = ends.light if ends.distance is not None else None
        if light is not None and ends.distance is not None:
            at_light = np.broadcast_to(self._forms(np.subtract(light.position, self._eye)[None]), p.shape)
            result = [(a + ends.distance, b + ends.distance) for a, b in self._spans_from_surface(at_light, d)]
        if ends.on.any():
            known = self._spans_from_surface(p[ends.on], d[ends.on])
            for (entry, exit), (first, second) in zip(result, known, strict=True):
                entry[ends.on], exit[ends.on] = first, second
                if light is not None and ends.distance is not None:  # a chord: both ends are known
                    for root in (entry, exit):
                        distance = ends.distance[ends.on]
                        near = np.abs(root[ends.on] - distance) <= _SAME * distance
                        root[ends.on] = np.where(near, distance, root[ends.on])
        return result

    def _spans(self, p: Array, d: Array) -> list[Span]:
        if self._is_torus:
            return tori.spans(p[:, 1:], d[:, 1:], self._ratio)
        return [quadrics.span(p, d)]

    def _spans_from_surface(self, p: Array, d: Array) -> list[Span]:
        if self._is_torus:
            return tori.spans_from_surface(p[:, 1:], d[:, 1:], self._ratio)
        return [quadrics.span_from_surface(p, d)]

    def normals(self, P: Array) -> Array:
        forms = self._forms(P)
        if self._is_torus:
            gradients = tori.outward(forms[:, 1:]) @ self._linear[1:]
        else:
            gradients = quadrics.outward(forms) @ self._linear
        length = np.linalg.norm(gradients, axis=1, keepdims=True)
        return gradients / np.where(length == 0.0, 1.0, length)


# The largest relative difference of the computed root and the light's distance on a ray that starts and ends on one
# wall. It is far above rounding, and the light is farther from any other root, but for rays along the wall.
_SAME = 1e-9

Surface = HalfSpace | Ball | Wall


class Face(NamedTuple):
    """A face of a leaf: part `part` of a surface of the scene, by its number."""

    leaf: int
    surface: int
    part: int


class SceneSurfaces:
    """The distinct surfaces of a scene, and the faces of its leaves: all faces of leaf 0, of leaf 1, and so on.

    A Sphere or a Plane has one face. Faces are on one surface if their definitions and maps are equal.
    """

    def __init__(self, leaves: list[Primitive], eye: Vec3) -> None:
        self._numbers: dict[object, int] = {}
        self._eye = eye
        self.surfaces: list[Surface] = []
        self.faces: list[Face] = []
        for k, leaf in enumerate(leaves):
            self.faces += [Face(k, surface, part) for surface, part in self._parts(leaf)]

    def _parts(self, leaf: Primitive) -> list[tuple[int, int]]:
        """Return the surfaces and their parts whose intersection is a leaf."""
        if isinstance(leaf, Sphere):
            return [(self._number((leaf.center, leaf.radius), lambda: Ball(leaf, self._eye)), 0)]
        if isinstance(leaf, Plane):
            return [self._half_space(*leaf.unit())]
        assert isinstance(leaf, Placed)
        half_spaces, wall = find_faces(leaf.shape)
        parts = [
            self._half_space(*affine.unit_plane(*affine.map_plane(leaf.matrix, *half_space)))
            for half_space in half_spaces
        ]
        if wall is not None:
            number = self._number((wall.key, leaf.matrix), lambda: Wall(wall, leaf.matrix, self._eye))
            parts.append((number, leaf.part))
        return parts

    def _half_space(self, normal: Vec3, offset: float) -> tuple[int, int]:
        x, y, z = normal
        key = max((x, y, z, offset), (-x, -y, -z, -offset))
        number = self._number(key, lambda: HalfSpace(normal, offset, self._eye))
        surface = self.surfaces[number]
        assert isinstance(surface, HalfSpace)
        return number, int(tuple(surface.normal) != normal)

    def _number(self, key: object, make: Any) -> int:
        number = self._numbers.setdefault(key, len(self.surfaces))
        if number == len(self.surfaces):
            self.surfaces.append(make())
        return number
