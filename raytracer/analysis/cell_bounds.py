"""Rounding error bounds of the roots of rays with cells: the leaves that consist of slabs and at most one wall."""

from __future__ import annotations

from typing import Any

import numpy as np

from raytracer.analysis.rounding_bounds import FEW_ROUNDINGS, Array, Rays, Roots, RoundedView
from raytracer.analysis.torus_bounds import torus_ends
from raytracer.analysis.wall_bounds import Ends, Forms, cone_ends, forms_along, round_ends
from raytracer.scene.solids import affine
from raytracer.scene.solids.body import Placed


def placed_roots(view: RoundedView, leaf: Placed, rays: Rays) -> Roots:
    """Compute the roots of a leaf, the last entry and the first exit of its faces, and their error bounds."""
    faces: list[Ends] = []
    for slab in leaf.shape.slabs():
        faces.append(_placed_slab(view, leaf, slab.normal, slab.low, slab.high, rays))
    wall = leaf.shape.wall()
    if wall is not None:
        along = forms_along(view, view_forms(view, leaf.matrix, wall.forms), rays)
        if wall.kind == "torus":
            faces.append(torus_ends(along, view.u)[leaf.part])
        else:
            faces.append((round_ends if wall.kind == "round" else cone_ends)(along, view.u))
    return _roots(meet(faces))


def view_forms(view: RoundedView, matrix: affine.Map, forms: tuple[affine.Row, ...]) -> Forms:
    """Return the forms in view space of a wall that is moved by a map."""
    back = np.array(affine.inverse(matrix))
    rows = np.array(forms)
    w = rows[:, :3] @ back[:, :3]
    return Forms(w @ view.R.T, w @ np.array(view.eye) + rows[:, :3] @ back[:, 3] + rows[:, 3])


def _placed_slab(view: RoundedView, leaf: Placed, normal: Any, low: float, high: float, rays: Rays) -> Ends:
    """Return the intervals of rays in a slab that is moved by the map of its leaf."""
    sides: list[Ends] = []
    # The image of the complement has the negated normal, so one normal serves both sides.
    for sign, offset in ((1.0, high), (-1.0, -low)):
        if np.isfinite(offset):
            unit, place = affine.unit_plane(*affine.map_plane(leaf.matrix, tuple(sign * c for c in normal), offset))
            sides.append(slab_ends(view, view.R @ np.array(unit), -np.inf, place - float(np.dot(unit, view.eye)), rays))
    return meet(sides)


def _roots(ends: Ends) -> Roots:
    """Return the ends of one interval of each ray as roots; inf for an interval that is surely empty."""
    with np.errstate(invalid="ignore"):
        empty = ~(ends.low[0] <= ends.high[1])
        doubt = ~empty & ~(ends.high[0] < ends.low[1])
        known = ~empty & (ends.t[0] < ends.t[1]) & np.isfinite(ends.t)
        error = np.maximum(ends.t - ends.low, ends.high - ends.t)
        first, last = np.maximum(ends.low[0], -1e30), np.minimum(ends.high[1], 1e30)
    return Roots(
        np.where(known, ends.t, np.inf),
        np.where(known, np.nan_to_num(error, nan=np.inf), np.inf),
        doubt,
        np.where(doubt, 0.5 * (first + last), 0.0),
        np.where(doubt, 0.5 * (last - first), 0.0),
        np.where(known.all(axis=0), 0.5 * np.nan_to_num(error, nan=np.inf).sum(axis=0), 0.0),
    )


def slab_ends(view: RoundedView, normal: Array, low: float, high: float, rays: Rays) -> Ends:
    """Return the interval of each ray with low <= normal.x <= high, for a unit normal in view space; inf: no face."""
    u = view.u
    slope, place = rays.rd @ normal, rays.ro @ normal
    if rays.camera:
        slope_error: Any = FEW_ROUNDINGS * u * np.abs(slope) + view.linear(1.0)
    else:
        slope_error = rays.rd_error + 4.0 * u
    count = len(slope)
    ends = Ends(*(np.repeat([[-np.inf], [np.inf]], count, axis=1) for _ in range(3)))
    for offset, sign in ((high, 1.0), (-low, -1.0)):
        if not np.isfinite(offset):
            continue
        depth, slant = offset - sign * place, sign * slope
        depth_error = u * np.abs(depth)
        if not rays.camera:
            depth_error += u * abs(offset) + rays.ro_error + 4.0 * u * np.linalg.norm(rays.ro, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = depth / slant
            error = (depth_error + np.abs(t) * slope_error) / np.maximum(np.abs(slant) - slope_error, 0.0)
            error += 2.0 * u * np.abs(t)
        # A ray that may be parallel to the face has its root far out on either side, or none. Only the side ahead of
        # the ray counts.
        parallel = ~(np.abs(slant) > slope_error)
        far = (np.abs(depth) - depth_error) / np.maximum(np.abs(slant) + slope_error, np.finfo(float).tiny)
        inside, outside = depth > depth_error, depth < -depth_error
        leaves = slant > 0.0
        beginning = [np.where(leaves, -np.inf, root) for root in (t, t - error, t + error)]
        ending = [np.where(leaves, root, np.inf) for root in (t, t - error, t + error)]
        unsure = Ends(
            np.array([np.where(slant == 0.0, np.where(depth < 0.0, np.inf, -np.inf), beginning[0]), ending[0]]),
            np.array([np.where(outside, far, -np.inf), np.where(inside, far, -np.inf)]),
            np.array([np.where(inside, -far, np.inf), np.full(count, np.inf)]),
        )
        face = Ends(*map(np.array, zip(beginning, ending, strict=True)))
        ends = meet([ends, Ends(*(np.where(parallel, a, b) for a, b in zip(unsure, face, strict=True)))])
    return ends


def meet(faces: list[Ends]) -> Ends:
    """Return the common part of the intervals of faces: the last beginning and the first end."""
    return Ends(*(
        np.array([np.max([t[0] for t in each], axis=0), np.min([t[1] for t in each], axis=0)])
        for each in zip(*faces, strict=True)
    ))  # fmt: skip
