"""A framing camera: the ball around all objects with bounds touches the frame of the picture."""

import math

import numpy as np
import pytest

import raytracer as rt
from raytracer.scene.framing import bounding_ball

BALL = rt.Sphere((3, -2, 1), 2)
GROUND = rt.Plane((0, 1, 0), 0)
POINT = rt.Box((0, 0, 0), (1, 1, 1)) & rt.Box((1, 1, 1), (2, 2, 2))


@pytest.mark.parametrize("aspect", [0.25, 1.0])
@pytest.mark.parametrize("fov", [5.0, 30.0, 120.0])
def test_a_framed_sphere_touches_the_planes_through_the_frame(aspect: float, fov: float) -> None:
    camera = rt.Camera.framing(BALL, (1, -2, 0.5), vertical_fov=fov, aspect=aspect)
    right, up, forward = np.array(camera.axes())
    tangent = math.tan(math.radians(fov) / 2.0)
    to_center = np.subtract(BALL.center, camera.position)
    gaps = []
    for side, slope in ((right, tangent * aspect), (-right, tangent * aspect), (up, tangent), (-up, tangent)):
        outward = (side - slope * forward) / math.hypot(1.0, slope)
        gaps.append(-to_center @ outward - BALL.radius)
    assert min(gaps) == pytest.approx(0.0, abs=1e-12), "it touches two sides"
    assert np.sort(gaps)[1] == pytest.approx(0.0, abs=1e-12)


def test_a_direction_of_any_length_frames_objects_far_from_the_origin() -> None:
    for center, length in ((1e6, 1e-11), (1e12 - 99, -1e12)):
        ball = rt.Sphere((center, 0, 0), 1)
        camera = rt.Camera.framing(ball, (length, 0, 0))
        assert camera == rt.Camera.framing(ball, (math.copysign(1.0, length), 0, 0)) and camera.look_at == ball.center


def test_an_orthographic_frame_is_as_high_as_the_ball() -> None:
    camera = rt.Camera.framing([BALL, GROUND], projection="orthographic")
    assert camera.height == pytest.approx(4.0) and camera.look_at == BALL.center
    assert math.dist(camera.position, BALL.center) > BALL.radius
    assert rt.Camera.framing(BALL, projection="orthographic", aspect=0.5).height == pytest.approx(8.0)


def test_the_ball_around_objects_holds_them_and_is_that_of_the_largest_where_it_is_known() -> None:
    box = rt.Box((0, 0, 0), (2, 2, 2))
    shell = rt.Sphere((0, 0, 0), 1) - rt.Sphere((5, 0, 0), 4.5)
    cut = rt.Sphere((0, 0, 0), 1) & rt.Box((-9, -9, -9), (9, 9, 9))
    cases = [
        ([box, GROUND, ~box], (1, 1, 1), math.sqrt(3)),
        ([shell], (0, 0, 0), 1.0),
        ([cut], (0, 0, 0), 1.0),
        ([rt.Sphere((-2, 0, 0), 1), rt.Sphere((4, 0, 0), 1)], (1, 0, 0), 4.0),
        ([rt.Ellipsoid((0, 0, 0), (2, 1, 1))], (0, 0, 0), 2.0),
        ([rt.Instances(rt.Sphere((1, 0, 0), 1), [(0, 0, 0), (3, 0, 0)], [1, 2])], (3.5, 0, 0), 3.5),
        ([rt.Instances(rt.Sphere((1, 0, 0), 1), [(0, 2, 0)], 2, [(1, 0, 0, 1)])], (0, 4, 0), 2.0),
        ([rt.Ellipsoid((0, 0, 0), (2, 1, 1)).rotate((1, 2, 3), 40).scale(3)], (0, 0, 0), 6.0),
        ([rt.Sphere((0, 0, 0), 1) & rt.Sphere((9, 0, 0), 1), BALL], BALL.center, 2.0),
    ]
    for objects, center, radius in cases:
        ball = bounding_ball(objects)
        assert ball is not None
        assert ball.center == pytest.approx(center) and ball.radius == pytest.approx(radius)


def test_a_scene_without_a_camera_frames_its_objects() -> None:
    scene = rt.Scene([BALL, GROUND], [])
    assert scene.camera == rt.Camera.framing(BALL)
    turned = scene.replace(camera=rt.Camera.framing(scene, (0, 0, -1)))
    assert turned.camera.axes()[2] == (0, 0, -1) and turned.replace(camera=None).camera == scene.camera


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rt.Scene([GROUND, ~BALL], []), "camera: expected an object with bounds, around which to place"),
        (lambda: rt.Camera.framing(GROUND), "scene: expected an object with bounds"),
        (lambda: rt.Camera.framing(BALL, (0, -1, 0)), "up: expected a direction not parallel to the view"),
        (lambda: rt.Camera.framing(BALL, aspect=0), "aspect: expected a number above 0, got 0"),
        (lambda: rt.Scene([rt.Sphere((0, 9, 0), 1e12)], []), r"camera: .* a ball of radius 1e\+12 .* state a position"),
        (lambda: rt.Camera.framing(BALL, projection="orthographic", aspect=1e-13), "scene: .* that a camera within"),
        (lambda: rt.Camera.framing(POINT), "scene: .* a ball of radius 0 around"),
        (lambda: rt.Camera.framing(POINT, projection="orthographic"), "scene: .* a ball of radius 0 around"),
        (lambda: rt.Camera((0, 0, 1), (0, 0, 0), height=2), "height: expected no height without projection"),
    ],
)
def test_an_error_about_a_frame_names_the_remedy(make, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        make()
