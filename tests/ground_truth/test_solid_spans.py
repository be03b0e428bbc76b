"""The float64 reference of each kind of solid: spans, normals and shadows, against closed forms and the definitions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import raytracer as rt
from raytracer.ground_truth import ray_tracer
from raytracer.ground_truth.intersection import Tracer
from raytracer.ground_truth.microfacets import dot
from raytracer.scene.solids.box import Box
from raytracer.scene.solids.cone import Cone
from raytracer.scene.solids.cylinder import Cylinder
from raytracer.scene.solids.ellipsoid import Ellipsoid
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere
from raytracer.scene.solids.torus import Torus
from tests import scenes
from tests.solids import EXAMPLES, inside

Array = NDArray[np.float64]

RED = scenes.COLORS[0]
SOLIDS: dict[str, Solid] = {
    **{name: shape.paint(RED) for name, shape in EXAMPLES.items() if name != "sphere"},
    "moved cone": Cone((0.1, -0.8, 0.2), (-0.3, 0.9, 0.1), 0.9, 0, RED),
    "frustum": Cone((0.1, -0.8, 0.2), (-0.3, 0.9, 0.1), 0.4, 0.8, RED),
    "equal cone": Cone((0.1, -0.8, 0.2), (-0.3, 0.9, 0.1), 0.5, 0.5, RED),
    "thin torus": Torus((0.1, -0.2, 0.3), (0, 1, 0), 1, 0.01, RED),
    "fat torus": Torus((0.1, -0.2, 0.3), (-1, 2, 0.5), 0.6, 0.59, RED),
}


def random_matrix(rng: np.random.Generator, condition: float) -> Array:
    """Return the rows [A | t] of a map with this condition number, a mirror in half of the cases."""
    u, v = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    factors = condition ** np.array([0.0, rng.uniform(-1, 0), -1.0]) * 2.0
    return np.hstack((u * factors @ v, rng.normal(size=(3, 1))))


def points_near(shape: Any, rng: np.random.Generator, count: int) -> Array:
    """Return random points in and around a solid, in its own space: for a torus, around its circle."""
    if not isinstance(shape, Torus):
        return rng.normal(size=(count, 3)) * 0.6
    radial = np.cross(rng.normal(size=(count, 3)), shape.axis)
    radial *= shape.major_radius / np.linalg.norm(radial, axis=1, keepdims=True)
    return shape.center + radial + rng.normal(size=(count, 3)) * shape.minor_radius


def solid_spans(solid: Solid, eye: Any, rd: Array, ro: Array | None = None) -> list[tuple[Array, Array]]:
    """Return the spans of rays in each leaf of a solid."""
    tracer = Tracer(rt.Scene([solid], [], rt.Camera((float(eye[0]), float(eye[1]), float(eye[2])), (1e3, 1e3, 1e3))))
    return tracer.spans(np.zeros(rd.shape) if ro is None else ro, rd)[0]


def one_span(solid: Solid, eye: Any, rd: Any) -> list[tuple[float, float]]:
    """Return the spans of one ray that are no misses."""
    spans = solid_spans(solid, eye, np.array([rd], float) / np.linalg.norm(rd))
    return [(float(entry[0]), float(exit[0])) for entry, exit in spans if entry[0] < exit[0]]


def test_rays_along_axes_have_the_spans_of_closed_forms() -> None:
    can = Cylinder((0, 0, 0), (0, 2, 0), 1)
    cone = Cone((0, 0, 0), (0, 2, 0), 1, 0)
    frustum = Cone((0, 0, 0), (0, 2, 0), 1, 3)
    torus = Torus((0, 0, 0), (0, 1, 0), 3, 1)
    cases: list[tuple[Solid, Any, Any, list[tuple[float, float]]]] = [
        (Box((0, 0, 0), (1, 2, 3)), (-2, 1, 1), (1, 0, 0), [(2, 3)]),
        (Box((0, 0, 0), (1, 2, 3)), (-2, 2.5, 1), (1, 0, 0), []),
        (can, (0, -3, 0), (0, 1, 0), [(3, 5)]),
        (can, (0.5, 1, 0), (0, 1, 0), [(-1, 1)]),
        (can, (1.5, 1, 0), (0, 1, 0), []),
        (can, (-4, 1, 0.6), (1, 0, 0), [(3.2, 4.8)]),
        (can, (-4, 1, 1.1), (1, 0, 0), []),
        (cone, (-4, 1, 0), (1, 0, 0), [(3.5, 4.5)]),
        (cone, (0, 5, 0), (0, -1, 0), [(3, 5)]),  # through the apex
        (cone, (0.5, 5, 0), (0, -1, 0), [(4, 5)]),
        (cone, (-4, 2.5, 0), (1, 0, 0), []),  # the other half of the double cone
        (frustum, (-4, 1, 0), (1, 0, 0), [(2, 6)]),
        (frustum, (2, 5, 0), (0, -1, 0), [(3, 4)]),
        (Ellipsoid((1, 0, 0), (2, 1, 3)), (1, 0, 9), (0, 0, -1), [(6, 12)]),
        (Ellipsoid((1, 0, 0), (2, 1, 3)), (1, 0, 0), (1, 0, 0), [(-2, 2)]),
        (torus, (-9, 0, 0), (1, 0, 0), [(5, 7), (11, 13)]),
        (torus, (0, 0, 0), (0, 0, 1), [(-4, -2), (2, 4)]),
        (torus, (3, 9, 0), (0, -1, 0), [(8, 10)]),
        (torus, (0, 9, 0), (0, -1, 0), []),  # along the axis, through the hole
        (torus, (-9, 0, 2.5), (1, 0, 0), [(9 - math.sqrt(16 - 6.25), 9 + math.sqrt(16 - 6.25))]),
    ]
    for solid, eye, rd, expected in cases:
        np.testing.assert_allclose(one_span(solid, eye, rd), expected, rtol=1e-14, err_msg=f"{solid} {eye} {rd}")


def test_a_tangent_ray_has_no_span_or_one_as_short_as_rounding_allows() -> None:
    cases: list[tuple[Solid, Any, Any]] = [
        (Cylinder((0, 0, 0), (0, 2, 0), 1), (-4, 1, 1), (1, 0, 0)),
        (Ellipsoid((0, 0, 0), (2, 1, 3)), (-4, 1, 0), (1, 0, 0)),
        (Torus((0, 0, 0), (0, 1, 0), 3, 1), (-9, 0, 4), (1, 0, 0)),
        (Torus((0, 0, 0), (0, 1, 0), 3, 1), (-9, 1, 3), (1, 0, 0)),
    ]
    for solid, eye, rd in cases:
        assert sum(exit - entry for entry, exit in one_span(solid, eye, rd)) <= 1e-3
    # A little below the plane that touches the top of a torus along a circle.
    spans = one_span(Torus((0, 0, 0), (0, 1, 0), 3, 1), (-9, 1 - 1e-9, 0), (1, 0, 0))
    half = math.sqrt(2e-9)
    np.testing.assert_allclose(spans, [(6 - half, 6 + half), (12 - half, 12 + half)], rtol=0, atol=1e-10)


def test_a_ray_along_a_generator_of_a_cone_counts_from_where_it_enters() -> None:
    # Parallel to the generator from (1, 0, 0) to (0, 2, 0), inside it by 0.1: it leaves at the base alone.
    [(entry, exit)] = one_span(Cone((0, 0, 0), (0, 2, 0), 1, 0), (0.9 - 2, 4, 0), (1, -2, 0))
    assert exit == pytest.approx(2 * math.sqrt(5), rel=1e-14)
    x = -1.1 + entry / math.sqrt(5)
    assert -x == pytest.approx(1 - (4 - 2 * entry / math.sqrt(5)) / 2, rel=1e-13)


def test_a_camera_at_the_apex_of_a_cone_sees_its_base_from_within() -> None:
    cone = Cone((0, 0, 0), (0, 2, 0), 1, 0)
    assert one_span(cone, (0, 2, 0), (0, -1, 0)) == [(0, 2)]
    assert one_span(cone.rotate((0, 2, 1), 20, (0, 2, 0)), (0, 2, 0), (0, -1, 0)) == [pytest.approx((0, 2), abs=0.1)]
    assert one_span(cone, (0, 2, 0), (0, 1, 0)) == [(-2, 0)]
    assert one_span(cone, (0, 2, 0), (1, 0, 0)) == []


@pytest.mark.parametrize("distance", [0.0, 4.0, 1e4])
@pytest.mark.parametrize("name", [*SOLIDS, "sphere"])
def test_spans_of_a_moved_solid_agree_with_its_definition(name: str, distance: float) -> None:
    rng = np.random.default_rng(7)
    shape: Any = SOLIDS.get(name, Sphere((0.2, 0.1, -0.3), 0.8, RED))
    for condition in (1.5, 10.0, 100.0):
        matrix = random_matrix(rng, condition)
        linear, shift = matrix[:, :3], matrix[:, 3]
        away = rng.normal(size=3)
        eye = shift + distance * away / np.linalg.norm(away) + rng.normal(size=3) * 0.3
        target = points_near(shape, rng, 400) @ linear.T + shift
        rd = target - eye
        rd /= np.linalg.norm(rd, axis=1, keepdims=True)
        spans = solid_spans(shape.transform(matrix), eye, rd)
        # Points of each line around the target, in the solid's own space.
        own_rd = np.linalg.solve(linear, rd.T).T
        own_target = np.linalg.solve(linear, (target - shift).T).T
        length = np.linalg.norm(own_rd, axis=1)
        s = np.linspace(-6.0, 6.0, 1201) / length[:, None]
        t = np.linalg.norm(target - eye, axis=1)[:, None] + s
        values = inside(shape, own_target[:, None] + s[..., None] * own_rd[:, None])
        is_inside = np.any([(entry[:, None] < t) & (t < exit[:, None]) for entry, exit in spans], axis=0)
        sure = np.abs(values) > 1e-8
        assert ((values < 0.0) == is_inside)[sure].all() and sure.mean() > 0.99
        assert (is_inside.any(axis=1)).sum() > 20, "rays hit the solid"
        # The ends are on the surface, also of spans between two of the points.
        for root in (root for span in spans for root in span):
            hit = np.isfinite(root)
            moved = (root[hit] - np.linalg.norm(target - eye, axis=1)[hit])[:, None] * own_rd[hit]
            at_root = inside(shape, own_target[hit] + moved)
            assert np.abs(at_root).max(initial=0.0) < 1e-11 * max(1.0, distance) * condition


def lit(solids: list[Solid], eye: tuple[float, float, float] = (3.1, 2.3, 4.7)) -> rt.Scene:
    return rt.Scene(solids, [rt.PointLight((3, 6, 5))], rt.Camera(eye, (0, 0, 0), vertical_fov=40))


@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_less_itself_has_no_surface(name: str) -> None:
    solid = SOLIDS[name]
    maps: list[Callable[[Solid], Solid]] = [
        lambda solid: solid,
        lambda solid: solid.rotate((1, 2, 3), 33).scale((1, 2, 0.3)).mirror((1, 1, 0)),
    ]
    for move in maps:
        image = ray_tracer.trace(lit([move(solid) - move(solid)]), (48, 48))
        assert (image.material == -1).all()
        assert (ray_tracer.trace(lit([move(solid)]), (48, 48)).material != -1).any()


def test_a_box_less_its_six_half_spaces_has_no_surface() -> None:
    planes: list[Solid] = []
    for axis in np.eye(3):
        planes += [rt.Plane(tuple(axis), 0.7), rt.Plane(tuple(-axis), 0.4)]
    half_spaces = planes[0]
    for plane in planes[1:]:
        half_spaces &= plane
    box: Solid = Box((-0.4, -0.4, -0.4), (0.7, 0.7, 0.7))
    for a, b in ((box, half_spaces), (half_spaces, box)):
        moved = [solid.rotate((3, 1, 2), 40).scale((1, 3, 0.5)) for solid in (a, b)]
        assert (ray_tracer.trace(lit([moved[0] - moved[1]]), (64, 64)).material == -1).all()


def test_two_boxes_that_share_a_face_have_no_surface_between() -> None:
    left, right = Box((-1, -1, -1), (0.1, 1, 1), RED), Box((0.1, -1, -1), (1, 1, 1), RED)
    whole = Box((-1, -1, -1), (1, 1, 1), RED)
    inside_view = (0.02, 0.3, -0.2)
    for eye in ((3.1, 2.3, 4.7), inside_view):
        images = [
            ray_tracer.trace(lit([solid.rotate((1, 2, 3), 33)], eye), (64, 64)) for solid in (left | right, whole)
        ]
        for name in ("depth", "normal", "radiance"):
            np.testing.assert_allclose(getattr(images[0], name), getattr(images[1], name), rtol=1e-12, atol=1e-12)


def test_a_shorter_cylinder_cuts_no_skin_from_the_same_wall() -> None:
    axis = np.array((1.0, 2.0, -0.5)) / 3.0
    long = Cylinder((0.1, 0.2, 0.3), tuple(np.array((0.1, 0.2, 0.3)) + axis), 0.5)
    middle = [tuple(np.array((0.1, 0.2, 0.3)) + k * axis) for k in (0.7, 0.3)]
    outer = Cylinder(middle[0], middle[1], 0.7)
    cut = long & outer
    assert (ray_tracer.trace(lit([cut - Cylinder(middle[0], middle[1], 0.5)]), (64, 64)).material == -1).all()


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_are_the_gradients_of_the_definition_through_any_map(name: str) -> None:
    rng = np.random.default_rng(11)
    shape: Any = SOLIDS[name]
    for condition in (2.0, 20.0):
        matrix = random_matrix(rng, condition)
        linear, shift = matrix[:, :3], matrix[:, 3]
        eye = np.add(shift, (0.3, 7.0, 2.0))
        tracer = Tracer(rt.Scene([shape.transform(matrix)], [], rt.Camera(tuple(eye), (1e3, 1e3, 1e3))))
        rd = points_near(shape, rng, 300) @ linear.T + shift - eye
        rd /= np.linalg.norm(rd, axis=1, keepdims=True)
        t, face = tracer.first(np.zeros(rd.shape), rd)
        hit = face >= 0
        P = t[hit, None] * rd[hit]
        n = tracer.normals(P, face[hit])

        def level(x: Array, shape: Any = shape, linear: Array = linear, origin: Array = shift - eye) -> Array:
            return inside(shape, np.linalg.solve(linear, (x - origin).T).T.astype(float))

        step = 1e-6 / condition
        gradient = np.stack([level(P + step * e) - level(P - step * e) for e in np.eye(3)], axis=1)
        gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
        off = np.linalg.norm(gradient - n, axis=1)
        assert hit.sum() > 30
        assert np.median(off) < 1e-6 and (off < 1e-3).mean() > 0.97, "all but those at edges"
        assert (dot(n, rd[hit]) <= 1e-9).all(), "outward, towards the camera"


@pytest.mark.parametrize("name", SOLIDS)
def test_no_solid_shades_itself_where_its_definition_does_not(name: str) -> None:
    rng = np.random.default_rng(5)
    shape: Any = SOLIDS[name]
    matrix = random_matrix(rng, 3.0)
    linear, shift = matrix[:, :3], matrix[:, 3]
    solid = shape.transform(matrix)
    eye, light = np.add(shift, (0.3, 7.0, 2.0)), rt.PointLight(tuple(np.add(shift, (5.0, 6.0, 3.0))))
    tracer = Tracer(rt.Scene([solid], [light], rt.Camera(tuple(eye), (1e3, 1e3, 1e3))))
    rd = points_near(shape, rng, 2000) @ linear.T + shift - eye
    rd /= np.linalg.norm(rd, axis=1, keepdims=True)
    t, face = tracer.first(np.zeros(rd.shape), rd)
    hit = face >= 0
    P, face = t[hit, None] * rd[hit], face[hit]
    n = tracer.normals(P, face)
    L = np.subtract(light.position, eye) - P
    distance = np.linalg.norm(L, axis=1)
    L /= distance[:, None]
    blocked_at, _ = tracer.first(P, L, face, n, light, distance)
    faces_light = dot(n, L) > 0.0
    if not isinstance(shape, Torus):
        assert faces_light.sum() > 50 and not (blocked_at < distance)[faces_light].any()
    # By the definition, at points of the ray some way from its start.
    s = np.geomspace(1e-6, 1.0, 2000) * distance[:, None]
    own = np.linalg.solve(linear, (P[:, None] + s[..., None] * L[:, None] - (shift - eye)).reshape(-1, 3).T).T
    values = inside(shape, own).reshape(s.shape)
    assert ((values < -1e-9).any(axis=1) <= (blocked_at < distance)).all(), "no light through a solid"
    blocked = blocked_at < distance
    clear = faces_light & (values > 1e-9).all(axis=1)
    assert not blocked[clear].any() and clear.sum() > 20


def test_a_light_on_a_face_or_a_wall_is_not_shaded_by_it() -> None:
    floor = Box((-3, -1, -3), (3, 0, 3), RED)
    cases: list[tuple[Solid, tuple[float, float, float]]] = [
        (Box((-0.5, 1, -0.5), (0.5, 2, 0.5)), (0.1, 1.0, 0.2)),
        (Cylinder((-0.5, 2, 0), (0.5, 2, 0), 1), (0.2, 1.0, 0)),
        (Ellipsoid((0, 2, 0), (0.5, 1, 0.5)), (0, 1, 0)),
        (Torus((0, 2, 0), (0, 0, 1), 0.7, 0.3), (0, 1, 0)),
    ]
    for solid, place in cases:
        turned = [part.rotate((1, 2, 3), 30) for part in (floor, solid)]
        turn = np.array(turned[1].matrix)[:, :3]  # pyright: ignore[reportAttributeAccessIssue]
        light = rt.PointLight(tuple(turn @ place))
        camera = rt.Camera(tuple(turn @ (0.5, 0.6, 3.0)), tuple(turn @ (0.0, 0.0, 0.0)), vertical_fov=30)
        shaded = ray_tracer.trace(rt.Scene(turned, [light], camera), (16, 16))
        free = ray_tracer.trace(rt.Scene(turned, [light], camera), (16, 16), rt.Settings(shadows="off"))
        assert shaded.normal is not None
        on_floor = shaded.normal @ turn[:, 1] > 0.999
        assert on_floor.mean() > 0.3
        np.testing.assert_array_equal(shaded.radiance[on_floor], free.radiance[on_floor])


def test_a_camera_far_from_the_origin_sees_the_same_picture() -> None:
    for solid in (SOLIDS["torus"], SOLIDS["cylinder"], SOLIDS["cone"], SOLIDS["box"]):
        pictures = []
        for place in ((0.0, 0.0, 0.0), (2.0**30, -(2.0**31), 2.0**29)):
            eye = tuple(np.add(place, (3.0, 2.0, 4.0)))
            camera = rt.Camera(eye, place, vertical_fov=30)
            scene = rt.Scene([solid.translate(place)], [rt.PointLight(tuple(np.add(place, (3.0, 6.0, 5.0))))], camera)
            pictures.append(ray_tracer.trace(scene, (32, 32)))
        # Planes are rounded at the scale of their offsets, walls are not.
        atol = 1e-5 if solid is not SOLIDS["torus"] else 1e-12
        np.testing.assert_array_equal(pictures[0].material, pictures[1].material)
        seen = pictures[0].material >= 0
        np.testing.assert_allclose(pictures[0].depth[seen], pictures[1].depth[seen], rtol=0, atol=atol)
