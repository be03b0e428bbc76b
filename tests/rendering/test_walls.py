"""Slabs and curved walls: the roots of single rays are within their bounds, and no wall shades itself."""

from collections.abc import Iterator

import numpy as np
import pytest

from raytracer import glsl
from raytracer.analysis.numerics import walls
from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.wall_rays import Aim, Kind, place, points_on, random_walls, rays_at
from raytracer.rendering.renderer import Renderer

pytestmark = pytest.mark.gl

U = 2.0**-24
# The rays of a case: enough for a share of 1e-3 with a wrong root to show. The slow test takes 1e5.
COUNT = 5_000
# Directions along a generator are a case of their own only for walls that have straight ones.
CASES = [
    (kind, aim)
    for kind in walls.KINDS
    for aim in walls.AIMS
    if aim != "generator" or kind in ("cylinder", "cone")
]  # fmt: skip


def _check(findings: Iterator[Finding]) -> None:
    assert not [finding for finding in findings if not finding.is_within_bound]


@pytest.mark.parametrize(("kind", "aim"), CASES)
def test_roots_of_walls_are_within_their_bounds(renderer: Renderer, kind: Kind, aim: Aim) -> None:
    _check(walls.wall_roots(renderer, kind, aim, COUNT))


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "aim"), CASES)
def test_roots_of_walls_are_within_their_bounds_for_many_rays(renderer: Renderer, kind: Kind, aim: Aim) -> None:
    _check(walls.wall_roots(renderer, kind, aim, 100_000))


@pytest.mark.parametrize("kind", walls.KINDS)
def test_no_wall_shades_itself(renderer: Renderer, kind: Kind) -> None:
    _check(walls.self_shadows(renderer, kind, 100_000 if kind != "torus" else 20_000))


@pytest.mark.parametrize("kind", walls.KINDS[:3])
def test_scaled_walls_have_scaled_roots_from_1e_minus_12_to_1e12(renderer: Renderer, kind: Kind) -> None:
    some = rays_at(kind, "at", True, 2_000, 1.0, np.random.default_rng(9))
    # Powers of two change no bits. All walls and distances get the sizes 1 and 1 to 1e4 first.
    p = (some.p / some.size[:, None]).astype(np.float32)
    power = (some.power / some.size**2).astype(np.float32)
    name = "coneSpan" if kind == "cone" else "roundSpan"
    once = glsl.call(name, p, some.d, power, device=renderer.device)
    known = (np.abs(once) < 1e8) & (np.abs(once) > 0.0)
    assert known.mean() > 0.5
    for scale in (2.0**-39, 2.0**39):
        again = glsl.call(name, p * scale, some.d, power * scale**2, device=renderer.device)
        np.testing.assert_array_equal(again[known], once[known] * np.float32(scale))


def test_rays_along_axes_and_generators_are_inside_for_ever_or_never(renderer: Renderer) -> None:
    def span(name: str, p: object, d: object, power: float) -> list[float]:
        return glsl.call(name, p, d, power, device=renderer.device)[0].tolist()  # pyright: ignore[reportArgumentType]

    huge, none = [-1e30, 1e30], [1e30, -1e30]
    # A cylinder of radius 1, along its axis: inside, outside, on the wall.
    for x, expected in ((0.5, huge), (1.5, none), (1.0, none)):
        np.testing.assert_allclose(span("roundSpan", (1, x, 0, 0), (0, 0, 0, 0), 1 - x * x), expected)
    # The cone x^2 + y^2 <= z^2, z >= 0: along its axis, up and down; along a generator, from inside, outside and on it.
    np.testing.assert_allclose(span("coneSpan", (-2, 0, 0, 0), (1, 0, 0, 0), 4), (2, 1e30))
    np.testing.assert_allclose(span("coneSpan", (2, 0, 0, 0), (-1, 0, 0, 0), 4), (-1e30, 2))
    np.testing.assert_allclose(span("coneSpan", (2, 1, 0, 0), (1, 1, 0, 0), 3), (-1.5, 1e30))
    np.testing.assert_allclose(span("coneSpan", (2, 1, 0, 0), (-1, -1, 0, 0), 3), (-1e30, 1.5))
    for p in ((1, 2, 0, 0), (1, 1, 0, 0)):
        entry, exit = span("coneSpan", p, (1, 1, 0, 0), p[0] ** 2 - p[1] ** 2)
        assert entry >= exit
    # Across the second nappe, where l0 < 0.
    np.testing.assert_allclose(span("coneSpan", (-1, -5, 0, 0), (0, 1, 0, 0), -24), none)


def _rays(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return rays in all directions, some along the axes, from points in and beside the unit ball."""
    rays = np.zeros(count, glsl.dtype("Ray"))
    rd = rng.normal(size=(count, 3))
    rd[: count // 4] = np.round(rd[: count // 4] + 0.01)
    rd[: count // 8, :2] = 0.0
    rd[np.all(rd == 0.0, axis=1)] = (0.0, 1.0, 0.0)
    rays["rd"] = rd / np.linalg.norm(rd, axis=1)[:, None]
    rays["ro"] = rng.normal(size=(count, 3))
    rays["distance"] = rng.uniform(1.0, 3.0, count)
    rays["start"]["surface"], rays["end"]["surface"] = rng.integers(0, 3, (2, count))
    rays["ofCamera"] = rng.integers(0, 2, count)
    return rays


def test_a_slab_has_the_bits_of_its_two_planes(renderer: Renderer) -> None:
    rng = np.random.default_rng(5)
    count = 100_000
    rays = _rays(count, rng)
    normal = rng.normal(size=(count, 3))
    normal[::4] = np.eye(3)[rng.integers(0, 3, len(normal[::4]))]  # so that some slopes are exactly 0
    normal = (normal / np.linalg.norm(normal, axis=1)[:, None]).astype(np.float32)
    high, low = rng.uniform(-1, 2, (2, count)).astype(np.float32)
    slope = glsl.call("planeSlopeOf", normal, rays["rd"], generated=DOT, file="dot.glsl", device=renderer.device)
    depths, spans = [], []
    for side, offset, number in ((normal, high, 1), (-normal, low, 2)):
        plane = np.concatenate([side, offset[:, None]], axis=1)
        slant = slope if number == 1 else -slope
        depths.append(glsl.call("depthOf", plane, rays["ro"], generated=DOT, file="dot.glsl", device=renderer.device))
        span = glsl.call("planeSpan", rays, plane, slant, device=renderer.device)
        spans.append(glsl.call("planeEnds", rays, slant, number, span, device=renderer.device))
    both = np.stack([np.maximum(spans[0][:, 0], spans[1][:, 0]), np.minimum(spans[0][:, 1], spans[1][:, 1])], axis=1)
    slab = glsl.call("slabSpan", rays, *depths, slope, (1, 2), device=renderer.device)
    known = both[:, 0] < both[:, 1]
    assert 0.2 < known.mean() < 0.9 and np.sum(slope == 0.0) > 100
    np.testing.assert_array_equal(slab[known].view(np.int32), both[known].view(np.int32))
    assert not np.any(slab[~known, 0] < slab[~known, 1])
    # With one face, it is the plane.
    one = glsl.call("slabSpan", rays, depths[0], 1e30, slope, (1, 0), device=renderer.device)
    np.testing.assert_array_equal(one, spans[0])
    other = glsl.call("slabSpan", rays, 1e30, depths[1], slope, (0, 2), device=renderer.device)
    np.testing.assert_array_equal(other, spans[1])


DOT = {
    "dot.glsl": """#include "geometry/ray.glsl"
real planeSlopeOf(real3 n, real3 rd) { return dot(n, rd); }
real depthOf(real4 plane, real3 ro) { return plane.w - dot(plane.xyz, ro); }
"""
}


@pytest.mark.parametrize("kind", walls.KINDS)
def test_normals_at_roots_are_those_of_the_walls(renderer: Renderer, kind: Kind) -> None:
    rng = np.random.default_rng(3)
    count = 20_000
    shapes = random_walls(kind, count, 3.0, rng)
    on, gradient = points_on(kind, shapes, rng)
    on_wall = (shapes.M @ on[:, :, None])[..., 0]
    normal = (np.swapaxes(np.linalg.inv(shapes.M), 1, 2) @ gradient[:, :, None])[..., 0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    # Camera rays towards points of the walls, that meet them at more than 17 degrees, from 1 to 1e3 sizes away.
    rd = rng.normal(size=(count, 3))
    rd /= np.linalg.norm(rd, axis=1)[:, None]
    away = shapes.size * 10.0 ** rng.uniform(0.0, 3.0, count)
    forms = place(shapes, away[:, None] * rd - on_wall)
    p, d = forms.c, (forms.w @ rd[:, :, None])[..., 0]
    power = p[:, 0] ** 2 - np.sum(p[:, 1:] ** 2, axis=1)
    cosine = np.sum(normal * rd, axis=1)
    enters = cosine < 0.0
    w = [forms.w[:, i] for i in range(4)]
    if kind == "cone":
        got = glsl.call("coneNormal", p, d, power, *w, enters, device=renderer.device)
    elif kind == "torus":
        got = glsl.call("torusNormal", p, d, away * (1.0 + U), *w[1:], device=renderer.device)
    else:
        got = glsl.call("roundNormal", p, d, power, *w[1:], enters, device=renderer.device)
    # The position on the wall is off by some u of the distance. The curvature turns that into an angle: the least
    # radius of curvature of an ellipsoid of aspect 3 is a ninth of its size, and that of a torus is that of its tube.
    # Cones are left out near their apexes, where the radius is that of their circles.
    least = shapes.size / 9.0
    if kind == "torus":
        least = least * shapes.own[:, 0, 3]
    elif kind == "cone":
        least = least * (1.0 + shapes.own[:, 0, 2] * on[:, 2])
    sure = np.abs(cosine) > 0.3
    bound = 16.0 * U * (1.0 + away / least) / 0.3
    sure &= bound < 0.1
    off = np.linalg.norm(got - normal, axis=1)
    assert sure.mean() > 0.3
    assert (off[sure] / bound[sure]).max() < 1.0
