"""Bounds of the crossings of rays with faces hold the roots of the whole body, and are narrow."""

import math

import numpy as np

import raytracer as rt
from raytracer.analysis.face_bounds import crossings_of_ends, half_space_ends, meet
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.analysis.rounding_bounds import UNIT, Rays, RoundedView
from raytracer.analysis.surface_bounds import SurfaceBounds
from raytracer.ground_truth.ray_tracer import Tracer, trace

EYE = (0.3, -0.2, 4.0)
VIEW = RoundedView(np.eye(3), EYE, 3000, UNIT[32])


def rays_around(target: tuple[float, float, float], count: int) -> Rays:
    rng = np.random.default_rng(2)
    rd = np.subtract(target, EYE) + rng.normal(size=(count, 3))
    rd /= np.linalg.norm(rd, axis=1)[:, None]
    none = np.zeros(count)
    return Rays(np.zeros((count, 3)), rd, none, none, True)


def test_crossings_of_a_turned_box_hold_the_roots_of_the_box_for_turned_rays() -> None:
    c, s = math.cos(0.7), math.sin(0.7)
    matrix = (c, -s, 0.0, 0.5), (s, c, 0.0, -0.25), (0.0, 0.0, 1.0, 0.125)
    solid = rt.Box((-1, -2, -0.5), (1, 0.5, 0.75)).transform(matrix)
    rays = rays_around((0.4, -0.2, 0.0), 5000)
    tracer = Tracer(rt.Scene([solid], [], rt.Camera(EYE, (0, 0, 0))))
    crossings = SurfaceBounds(tracer, VIEW).crossings(rays)
    # In the space of the box, by the formula for a box with sides along the axes (Kay and Kajiya 1986).
    turn = np.array(matrix)[:, :3]
    ro, rd = (np.array(EYE) - np.array(matrix)[:, 3]) @ turn, rays.rd @ turn
    a, b = (np.array([-1, -2, -0.5]) - ro) / rd, (np.array([1, 0.5, 0.75]) - ro) / rd
    first, last = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    hit = first < last
    assert 0.3 < hit.mean() < 0.9
    low, high = (np.concatenate([each[i] for each in crossings]) for i in range(2))
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(low), high - low, 0.0)
    for root in (first, last):
        holds = (low <= root) & (root <= high)
        assert np.all(holds.any(axis=0)[hit])
    unsure = np.any([each.unsure for each in crossings], axis=0)
    assert unsure.mean() < 1e-3
    # Rays that miss cross nothing, and those that hit have two crossings. Three hold a root at an edge.
    count = np.isfinite(low).sum(axis=0)
    assert not count[~hit & ~unsure].any() and np.all(count[hit & ~unsure] >= 2) and np.mean(count[hit] > 2) < 1e-3
    assert UNIT[32] < np.median(width.max(axis=0)[hit]) < 1e-5


def test_a_ray_through_an_edge_within_its_error_is_unsure() -> None:
    rays = rays_around((0.0, 0.0, 0.0), 1)
    hits = np.array(EYE) + 3.0 * rays.rd[0]
    for shift, unsure in ((0.0, True), (1e-7, True), (1e-3, False), (-1e-3, False)):
        # Two faces whose edge is `shift` off the ray's point: their common part begins and ends there.
        faces = []
        for normal in (np.array([0.6, 0.0, 0.8]), np.array([0.6, 0.0, -0.8])):
            depth = float(normal @ hits + shift - normal @ EYE)
            faces.append(half_space_ends(VIEW, normal, depth, rays))
        assert bool(crossings_of_ends(meet(faces)).unsure[0]) == unsure


def test_a_camera_within_rounding_of_the_apex_of_a_cone_makes_all_that_the_cone_may_cover_doubtful() -> None:
    cone = rt.Cone((0, -1, 0), (0, 1, 0), 1, 0).rotate((1, 2, 3), 40, about=(0, 1, 0))
    scene = rt.Scene([cone], [], rt.Camera((0, 1, 0), (0.5, 1, 0.2), vertical_fov=120))
    resolved = find_pixel_doubt(scene, (32, 20))
    truth = trace(scene, (32, 20), rt.Settings())
    assert truth.material is not None
    assert (truth.material >= 0).any()
    assert resolved.doubtful[truth.material >= 0].all()
