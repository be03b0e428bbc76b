"""Rows of the ledger on curved walls: the roots of single rays, and walls that do not shade themselves."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np

from raytracer.analysis.cone_bounds import cone_ends
from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.wall_rays import VIEW, Aim, Kind, WallRays, place, points_on, random_walls, rays_at
from raytracer.analysis.numerics.wall_truth import exact_intervals
from raytracer.analysis.rounding_bounds import FEW_ROUNDINGS, UNIT, Array, Rays
from raytracer.analysis.torus_bounds import torus_ends
from raytracer.analysis.wall_bounds import Ends, Forms, forms_along, round_ends
from raytracer.gpu import glsl_call
from raytracer.rendering.renderer import Renderer

KINDS: tuple[Kind, ...] = ("cylinder", "ellipsoid", "cone", "torus")
AIMS: tuple[Aim, ...] = ("at", "inside", "tangent", "axis", "generator")
_U = UNIT[32]
# The largest error of an exit from a known start, in units of 2^-24 of the distance: FEW_ROUNDINGS of each of the four
# forms, and as many of the normal and of the direction.
_EXIT = 8.0 * FEW_ROUNDINGS


def wall_roots(renderer: Renderer, kind: Kind, aim: Aim, count: int) -> Iterator[Finding]:
    """Compare the roots of `count` rays in each case with long double: camera rays and others, aspects 1 and 100."""
    rng = np.random.default_rng(11)
    for camera, aspect in itertools.product((True, False), (1.0, 100.0)):
        at = f"{kind}, {aim}, {'camera' if camera else 'other'} rays, aspect {aspect:g}"
        some = rays_at(kind, aim, camera, count, aspect, rng)
        wrong, doubtful, shares, errors = 0, 0, [np.zeros(1)], [np.zeros(1)]
        parts = zip(
            _spans(renderer, kind, some), exact_intervals(kind, some.rays, some.forms), _bounds(kind, some), strict=True
        )
        for got, exact, ends in parts:
            surely_hit, surely_missed = ends.high[0] < ends.low[1], ~(ends.low[0] < ends.high[1])
            hit = got[0] < got[1]
            wrong += int(np.sum((surely_hit & ~hit) | (surely_missed & hit)))
            doubtful += int(np.sum(~surely_hit & ~surely_missed))
            with np.errstate(invalid="ignore"):
                known = surely_hit & hit & np.isfinite(got) & np.isfinite(exact.astype(float))
                off = np.abs(got - exact).astype(float)
                bound = np.where(got < exact, exact.astype(float) - ends.low, ends.high - exact.astype(float))
                # Bounds that a root of infinity meets are infinite.
                shares.append(np.where(off == 0.0, 0.0, off / bound)[known])
                errors.append((off / np.maximum(np.abs(exact.astype(float)), some.scale) / _U)[known])
        off = np.concatenate(errors)
        note = f"median {np.median(off):.2g} u, 99.9 % {np.quantile(off, 0.999):.3g} u, largest {off.max():.3g} u"
        yield Finding("curved walls", at, 32, "wrong hits", wrong, 0, f"{count} rays, {doubtful} doubtful")
        yield Finding("curved walls", at, 32, "root error, share of its bound", np.concatenate(shares).max(), 1, note)


def _spans(renderer: Renderer, kind: Kind, some: WallRays) -> list[Array]:
    """Compute the intervals on the GPU, (2, N) each."""
    if kind == "torus":
        parts = _torus_spans(renderer, some.p, some.d)
    else:
        name = "coneSpan" if kind == "cone" else "roundSpan"
        parts = [glsl_call.call(name, some.p, some.d, some.power, device=renderer.device)]
    spans = [part.astype(float).T for part in parts]
    return [np.where(np.abs(t) >= 0.99e30, np.copysign(np.inf, t), t) for t in spans]


def _torus_spans(renderer: Renderer, p: Any, d: Any) -> list[Any]:
    """Compute both intervals of a torus on the GPU, (N, 2) each, one by one as for a ray with no known end."""
    return [
        glsl_call.call("torusRoots", p, d, first, first + 2, device=renderer.device)[:, first : first + 2]
        for first in (0, 2)
    ]


def _bounds(kind: Kind, some: WallRays) -> list[Ends]:
    along = forms_along(VIEW, some.forms, some.rays)
    if kind == "torus":
        return list(torus_ends(along, _U))
    return [(cone_ends if kind == "cone" else round_ends)(along, _U)]


def self_shadows(renderer: Renderer, kind: Kind, count: int) -> Iterator[Finding]:
    """Rays from random points of walls, rounded to float32, to the outer side and to the inner side.

    No ray to the outer side may meet a convex wall again. A torus may shade itself, and then the answer must be right
    in all but a few cases, but no point that the light reaches may be dark. A ray that passes another part of the torus
    within the rounding of its start is in doubt.
    """
    rng = np.random.default_rng(13)
    for aspect in (1.0, 100.0):
        at = f"{kind}, aspect {aspect:g}"
        walls = random_walls(kind, count, aspect, rng)
        on, gradient = points_on(kind, walls, rng)
        distance = walls.size * 10.0 ** rng.uniform(0.3, 3.0, count)
        c = rng.normal(size=(count, 3))
        c *= (distance / np.linalg.norm(c, axis=1))[:, None]
        exact_start = c + (walls.M @ on[:, :, None])[..., 0]
        normal = (np.swapaxes(np.linalg.inv(walls.M), 1, 2) @ gradient[:, :, None])[..., 0]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        rays = np.zeros(count, glsl_call.dtype("Ray"))
        rays["ro"], rays["start"]["n"], rays["start"]["surface"] = exact_start, normal, 1
        rays["distance"] = 1e30
        rd = rng.normal(size=(count, 3))
        rays["rd"] = rd / np.linalg.norm(rd, axis=1)[:, None]
        slope = (rays["rd"] * rays["start"]["n"]).sum(axis=1)
        rays["rd"] *= np.sign(slope)[:, None]
        forms = place(walls, c)
        spans = _known_spans(renderer, kind, rays, forms)
        blocked = _blocked(spans)
        if kind != "torus":
            yield Finding(
                "self-shadow of curved walls", at, 32, "wrong shadows", int(blocked.sum()), 0, f"{count} rays"
            )
            yield from _inner_roots(renderer, kind, at, rays, forms, exact_start)
            continue
        start = Rays(exact_start, rays["rd"].astype(float), np.zeros(count), np.zeros(count), False)
        exact = [np.asarray(t, float) for t in exact_intervals(kind, start, forms)]
        # The root at the start itself is 0 up to the rounding of float64.
        truly = _blocked([np.where(np.abs(t) <= 1e-8 * walls.size, 0.0, t) for t in exact])
        grazes = _grazes_elsewhere(forms, start, spans, np.abs(slope))
        dark, lit = int(np.sum(blocked & ~truly & ~grazes)), int(np.sum(~blocked & truly))
        note = (
            f"{count} rays, {truly.mean():.2%} truly in shadow, {np.sum(blocked & ~truly & grazes)} graze another part"
        )
        yield Finding("self-shadow of curved walls", at, 32, "falsely dark", dark, 0, note)
        # A chord that is too short to be seen takes another interval's place: 1e-3 of the rays in shadow.
        yield Finding("self-shadow of curved walls", at, 32, "falsely lit", lit, 1e-3 * count, note)


def _grazes_elsewhere(forms: Forms, start: Rays, spans: list[Array], slope: Array) -> Any:
    """Return whether a ray passes a torus within the rounding of its start, beyond the errors of its first root."""
    ahead = [np.where((t[0] < t[1]) & (t[1] > 0.0), 0.5 * (np.maximum(t[0], 0.0) + t[1]), np.inf) for t in spans]
    middle = np.min(ahead, axis=0)
    middle = np.where(np.isfinite(middle), middle, 0.0)
    along = forms_along(VIEW, forms, start._replace(ro_error=_U * np.linalg.norm(start.ro, axis=1)))
    slack = np.linalg.norm(along.p_error, axis=1) + middle * np.linalg.norm(along.d_error, axis=1)
    x = along.p + middle[:, None] * along.d
    gap = np.hypot(np.hypot(x[:, 1], x[:, 2]) - 1.0, x[:, 3]) - x[:, 0]
    own = np.minimum(slack / np.maximum(slope, _U), np.sqrt(2.0 * x[:, 0] * slack))
    return (gap <= slack) & (middle * np.linalg.norm(along.d, axis=1) > 4.0 * own)


def _blocked(spans: list[Array]) -> Any:
    """Return whether an interval reaches beyond 0 (N,)."""
    return np.any([(t[0] < t[1]) & (t[1] > 0.0) for t in spans], axis=0)


def _known_spans(renderer: Renderer, kind: Kind, rays: Any, forms: Forms) -> list[Array]:
    """Compute the intervals of rays that start on walls."""
    w, c, ro, rd = (np.asarray(x, np.float32) for x in (forms.w, forms.c, rays["ro"][:, None], rays["rd"][:, None]))
    p, d = (w * ro).sum(axis=2) + c, (w * rd).sum(axis=2)
    power = p[:, 0] ** 2 - (p[:, 1:] ** 2).sum(axis=1)
    device = renderer.device
    if kind == "torus":
        parts = _torus_spans(renderer, p, d)
        pairs = zip((0, 1), parts, parts[::-1], strict=True)
        slope = (rays["start"]["n"] * rays["rd"]).sum(axis=1)
        spans = [
            glsl_call.call("torusEnds", rays, i, True, False, slope, one, other, device=device)
            for i, one, other in pairs
        ]
    elif kind == "cone":
        span = glsl_call.call("coneSpan", p, d, power, device=device)
        spans = [glsl_call.call("coneEnds", rays, p, d, *(w[:, i] for i in range(4)), 1, span, device=device)]
    else:
        span = glsl_call.call("roundSpan", p, d, power, device=device)
        spans = [glsl_call.call("roundEnds", rays, p, d, *(w[:, i] for i in range(1, 4)), 1, span, device=device)]
    return [span.astype(float).T for span in spans]


def _inner_roots(
    renderer: Renderer, kind: Kind, at: str, rays: Any, forms: Forms, exact_start: Array
) -> Iterator[Finding]:
    """Compare the exits of rays that enter the walls at their starts."""
    entering = rays.copy()
    entering["rd"] *= -1.0
    (span,) = _known_spans(renderer, kind, entering, forms)
    none = np.zeros(len(span[0]))
    start = Rays(exact_start, entering["rd"].astype(float), none, none, False)
    (exact,) = exact_intervals(kind, start, forms)
    wrong = int(np.sum((span[0] != 0.0) | ~(span[1] > 0.0)))
    yield Finding("self-shadow of curved walls", at, 32, "roots that are not 0 at the start", wrong, 0)
    # The distance of the exit from the wall, in the space of the forms. Its errors are those of the start, of the slope
    # along the rounded normal, and of the forms: a few roundings of each number.
    length = np.linalg.norm(forms.w, axis=2)
    end = np.minimum(span[1], 1e29)
    known = (span[1] < 1e29) & (exact[1] < 1e29)
    x = exact_start + end[:, None] * start.rd
    l = np.asarray((forms.w @ x[:, :, None])[..., 0] + forms.c)
    off = np.abs(l[:, 0] - np.linalg.norm(l[:, 1:], axis=1))
    reach = (np.linalg.norm(exact_start, axis=1) + end) * length.max(axis=1)
    share = (off / reach / _U)[known]
    yield Finding(
        "self-shadow of curved walls", at, 32, "exit off the wall, units of its distance", float(share.max()), _EXIT
    )
