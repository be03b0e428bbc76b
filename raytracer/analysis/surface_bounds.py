"""Rounding error bounds of the crossings of rays with all surfaces of a scene, and of the normals there."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.cone_bounds import cone_ends, cone_point_errors
from raytracer.analysis.face_bounds import (
    Crossings,
    crossings_of_ends,
    crossings_of_roots,
    crossings_within,
    half_space_ends,
    known_ends,
    meet,
    merged,
    turned,
)
from raytracer.analysis.known_bounds import Chord, chord_ends, with_known_root
from raytracer.analysis.rounding_bounds import (
    FEW_ROUNDINGS,
    Array,
    Mask,
    Rays,
    Roots,
    RoundedView,
    moment_error,
    sphere_roots,
)
from raytracer.analysis.torus_bounds import torus_ends, torus_point_errors
from raytracer.analysis.wall_bounds import Ends, Forms, FormsAlong, choose, forms_along, round_ends, round_point_errors
from raytracer.compiler.bodies import WALLS, PlacedShapes, make_bodies
from raytracer.ground_truth.intersection import Tracer
from raytracer.ground_truth.microfacets import dot
from raytracer.ground_truth.scene_surfaces import Ball, HalfSpace
from raytracer.ground_truth.scene_surfaces import Wall as WallSurface
from raytracer.scene.lights import PointLight
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.sphere import Sphere

# Half of the unit to which the compiler rounds the numbers of walls, as a share of the largest one of a wall.
_SNAP = 2.0**-45


class ShadowEnds(NamedTuple):
    """The known ends of R rays from surfaces to a light."""

    start: NDArray[np.int32]  # the surface on which each ray starts (R,)
    normal: Array  # its outward unit normal there in view space (R, 3)
    normal_error: Array  # (R,)
    light: PointLight
    lit: int | None  # the surface on which the light lies
    distance: Array  # of the light (R,)


class _Wall(NamedTuple):
    kind: str
    forms: Forms
    w_error: float  # the bounds of |error| of the forms' numbers before float32
    c_error: float


class SurfaceBounds:
    """The surfaces of a scene, by their numbers in `tracer`, and the bounds of rays with them."""

    def __init__(self, tracer: Tracer, view: RoundedView) -> None:
        self._tracer, self._view = tracer, view
        self._parts: list[list[int]] = [[] for _ in tracer.surfaces]
        self._spheres: dict[int, Sphere] = {}
        self._walls: dict[int, _Wall] = {}
        numbers = np.cumsum([isinstance(leaf, Placed) for leaf in tracer.leaves]) - 1
        placed = [leaf for leaf in tracer.leaves if isinstance(leaf, Placed)]
        maps, parts = np.array([leaf.matrix for leaf in placed]).reshape(-1, 3, 4), [leaf.part for leaf in placed]
        shapes = [leaf.shape for leaf in placed]
        bodies = make_bodies(PlacedShapes(shapes, np.arange(len(placed)), maps, np.array(parts, np.int64)))
        for k, surface, part in tracer.faces:
            if part not in self._parts[surface]:
                self._parts[surface].append(part)
            leaf = tracer.leaves[k]
            if isinstance(leaf, Sphere):
                self._spheres[surface] = leaf
            elif not isinstance(tracer.surfaces[surface], HalfSpace):
                body = numbers[k]
                forms = bodies.forms[bodies.walls[body]]
                self._walls[surface] = self._wall(WALLS[bodies.kinds[body]], forms)

    def _wall(self, kind: str, forms: Array) -> _Wall:
        w, c, eye = forms[:, :3], forms[:, 3], np.array(self._view.eye)
        by_w, by_c = (_SNAP * float(np.abs(x).max()) for x in (w, c))
        return _Wall(kind, Forms(w @ self._view.R.T, w @ eye + c), 2.0 * by_w, by_c + by_w * float(np.abs(eye).sum()))

    def surface_at_light(self, light: PointLight) -> int | None:
        """Return the surface on which the shaders know the light to lie: a sphere, a plane, a face, in this order."""

        def rank(surface: int) -> int:
            own = self._tracer.surfaces[surface]
            if isinstance(own, Ball):
                return 0
            if isinstance(own, HalfSpace):
                leaves = (self._tracer.leaves[f.leaf] for f in self._tracer.faces if f.surface == surface)
                return 1 if any(isinstance(leaf, Plane) for leaf in leaves) else 2
            return 3

        on = [k for k, surface in enumerate(self._tracer.surfaces) if surface.is_at(light)]
        return min(on, key=rank, default=None)

    def is_flat(self, surface: int) -> bool:
        """Whether a surface is a plane."""
        return isinstance(self._tracer.surfaces[surface], HalfSpace)

    def crossings(self, rays: Rays, known: ShadowEnds | None = None) -> list[Crossings]:
        """Return the crossings with each surface. Those that bound no leaf, by its other faces, are left out."""
        spheres = {k: crossings_of_roots(self._sphere(k, rays, known)) for k in self._spheres}
        ends = {k: self._ends(k, rays, known) for k in range(len(self._parts)) if k not in spheres}
        kept: dict[tuple[int, int], Crossings] = {}
        first_face = np.searchsorted(
            [face.leaf for face in self._tracer.faces], np.arange(len(self._tracer.leaves) + 1)
        )
        for i, j in itertools.pairwise(first_face):
            faces = [(f.surface, f.part) for f in self._tracer.faces[i:j] if f.surface not in spheres]
            if not faces:
                continue
            whole = meet([ends[surface][part] for surface, part in faces])
            for surface, part in faces:
                own = crossings_of_ends(ends[surface][part])
                own = crossings_within(own, whole.low[0], whole.high[1])
                other = kept.get((surface, part))
                kept[surface, part] = own if other is None else merged(own, other)
        result: list[Crossings] = []
        for k, parts in enumerate(self._parts):
            if k in spheres:
                result.append(spheres[k])
            elif self.is_flat(k) and len(parts) == 2:  # both sides of a plane have its one root
                result.append(merged(kept[k, 0], turned(kept[k, 1])))
            else:
                result += [kept[k, part] for part in parts]
        return result

    def _ends(self, k: int, rays: Rays, known: ShadowEnds | None) -> dict[int, Ends]:
        """Return the intervals of rays in each part of a half-space or a wall."""
        surface = self._tracer.surfaces[k]
        starts = np.zeros(len(rays.rd), bool) if known is None else known.start == k
        if not isinstance(surface, HalfSpace):
            return dict(enumerate(self._wall_ends(k, rays, known, starts)))
        result: dict[int, Ends] = {}
        for part, sign in enumerate((1.0, -1.0)):
            normal = sign * self._view.R @ surface.normal
            ends = half_space_ends(self._view, normal, sign * surface.depth(self._view.eye), rays)
            if known is not None:
                slope = rays.rd @ normal
                if known.lit == k:
                    ends = known_ends(known.distance, slope, rays.rd_error + 4.0 * self._view.u)
                at_start = known_ends(np.zeros(len(slope)), slope, np.zeros(len(slope)))
                ends = choose(starts, at_start, ends)
            result[part] = ends
        return result

    def _along(self, wall: _Wall, rays: Rays) -> FormsAlong:
        """Return the forms of a wall along rays, with the errors of the host as well."""
        along = forms_along(self._view, wall.forms, rays)
        p_error = along.p_error + wall.c_error + wall.w_error * np.linalg.norm(rays.ro, axis=1)[:, None]
        by_host = wall.c_error + wall.w_error * np.linalg.norm(rays.ro, axis=1)
        power_error = along.power_error + 2.0 * by_host * np.abs(along.p).sum(axis=1)
        return along._replace(p_error=p_error, d_error=along.d_error + wall.w_error, power_error=power_error)

    def _wall_ends(self, k: int, rays: Rays, known: ShadowEnds | None, starts: Mask) -> list[Ends]:
        wall, u = self._walls[k], self._view.u
        along = self._along(wall, rays)
        surface = self._tracer.surfaces[k]
        has_camera = rays.camera and isinstance(surface, WallSurface) and surface.has_camera
        if wall.kind == "torus":
            parts = list(torus_ends(along, u))
            if has_camera:
                zero = np.zeros(len(starts))
                slope = rays.rd @ (self._view.R @ surface.normals(np.zeros((1, 3)))[0])
                sure = np.abs(slope) > rays.rd_error + FEW_ROUNDINGS * u
                parts = with_known_root(parts, sure, zero, slope > 0.0)
        else:
            if has_camera:
                along = along._replace(power=np.zeros(len(starts)), power_error=np.zeros(len(starts)))
            parts = [(cone_ends if wall.kind == "cone" else round_ends)(along, u)]
        if known is None or not (starts.any() or known.lit == k):
            return parts
        zero = np.zeros(len(starts))
        slope = dot(known.normal, rays.rd)
        at_start = Chord(slope, known.normal_error + rays.rd_error + FEW_ROUNDINGS * u)
        own = chord_ends(wall.forms, along, at_start, zero, u)
        if wall.kind == "torus":
            parts = with_known_root(parts, starts, zero, slope > 0.0)
        if known.lit == k:
            place = np.subtract(known.light.position, self._view.eye)
            slope = rays.rd @ (self._view.R @ self._tracer.surfaces[k].normals(place[None])[0])
            if wall.kind == "torus":
                return with_known_root(parts, np.ones(len(starts), bool), known.distance, slope > 0.0)
            moved = np.full(len(zero), u * float(np.linalg.norm(place)))
            there = rays._replace(ro=np.broadcast_to(self._view.R @ place, rays.ro.shape), ro_error=moved)
            at_light = Chord(slope, rays.rd_error + FEW_ROUNDINGS * u)
            parts = [chord_ends(wall.forms, self._along(wall, there), at_light, known.distance, u)]
            own = Ends(*(np.broadcast_to([zero, known.distance], (2, len(zero))) for _ in range(3)))
        return parts if wall.kind == "torus" else [choose(starts, own, parts[0])]

    def _sphere(self, k: int, rays: Rays, known: ShadowEnds | None) -> Roots:
        sphere, u = self._spheres[k], self._view.u
        roots = sphere_roots(self._view, sphere, rays)
        if known is None:
            return roots
        # Two roots are exact, and so in no doubt: 0 at the start of a ray, and the distance of the light.
        starts, ends = known.start == k, np.full(len(rays.rd), known.lit == k)
        t = np.full((2, len(starts)), np.inf)
        error = t.copy()
        at_light = np.subtract(known.light.position, sphere.center) @ self._view.R.T / sphere.radius
        outward = np.where(starts[:, None], known.normal, at_light)
        chord = -2.0 * sphere.radius * dot(outward, rays.rd)
        other = np.where(starts, chord, known.distance + chord)
        t[0] = np.where((other > 0.0) & ~(starts & ends), other, np.inf)
        inexact = known.normal_error + rays.rd_error + FEW_ROUNDINGS * u
        error[0] = 2.0 * sphere.radius * inexact + np.where(starts, 0.0, FEW_ROUNDINGS * u * known.distance)
        is_known = starts | ends
        return roots._replace(
            t=np.where(is_known, t, roots.t),
            error=np.where(is_known, error, roots.error),
            tangent=roots.tangent & ~is_known,
        )

    def normal_errors(self, k: int, rays: Rays, t: Array, enters: Mask) -> Array:
        """Return the bounds of |error| (R,) of the normals where camera rays meet a surface at the distances t."""
        u = self._view.u
        if self.is_flat(k):
            return np.full(len(t), 2.0 * u)
        if k in self._spheres:
            sphere = self._spheres[k]
            c = self._view.R @ np.subtract(sphere.center, self._view.eye)
            # The normal is the sum of two legs, from the centre to the chord's middle, and along half the chord.
            to_center = c - rays.ro
            half = np.abs(t - dot(to_center, rays.rd))
            legs = moment_error(to_center, rays.rd, u) + sphere_roots(self._view, sphere, rays).half
            legs += FEW_ROUNDINGS * u * half + rays.ro_error
            if not rays.camera:
                legs += u * np.linalg.norm(c)
            return legs / sphere.radius + FEW_ROUNDINGS * u
        wall = self._walls[k]
        along = self._along(wall, rays)
        forms = along.p + t[:, None] * along.d
        w = wall.forms.w
        most = float(np.linalg.norm(w[1:], axis=1).max())
        if wall.kind == "torus":
            off = torus_point_errors(along, t, u)
            rho = np.linalg.norm(forms[:, 1:3], axis=1)
            to_tube = forms[:, 1:] * np.stack([1.0 - 1.0 / rho, 1.0 - 1.0 / rho, np.ones(len(rho))], axis=1)
            gradient = to_tube @ w[1:]
            off = off * (1.0 + 1.0 / rho)
        else:
            gradient = (forms * [-1.0, 1.0, 1.0, 1.0]) @ w
            if wall.kind == "cone":
                off = cone_point_errors(along, enters, u)
                most = float(np.linalg.norm(w, axis=1).max()) * 2.0
            else:
                off = round_point_errors(along, u)
        length = np.linalg.norm(gradient, axis=1)
        size = np.linalg.norm(forms, axis=1)
        moved = most * off + (wall.w_error + 4.0 * u * most) * size
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(moved / np.maximum(length - moved, 0.0), nan=np.inf) + FEW_ROUNDINGS * u
