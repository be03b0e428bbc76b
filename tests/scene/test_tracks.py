"""Tracks and turns of the camera: closed forms."""

import math

import pytest

from raytracer.scene.camera import Camera
from raytracer.scene.tracks import Animation, Interpolation, Track, go_round


@pytest.mark.parametrize(
    ("interpolation", "expected"),
    [
        ("linear", [1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0]),
        # 3 t^2 - 2 t^3 at t = 1/4, 1/2, 3/4 is 5/32, 1/2, 27/32.
        ("smooth", [1.0, 1.0, 1.0, 1.625, 3.0, 4.375, 5.0, 5.0, 5.0]),
        ("step", [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 5.0, 5.0, 5.0]),
    ],
)
def test_a_track_goes_through_its_keys_as_its_interpolation_says(
    interpolation: Interpolation, expected: list[float]
) -> None:
    track = Track("a", ((2, 1.0), (6, 5.0)), interpolation)
    assert [track.value(k) for k in range(9)] == expected


def test_each_number_of_a_vector_has_its_own_way() -> None:
    track = Track("a", ((0, (0.0, 0.1, 4.0)), (4, (4.0, 0.1, 0.0)), (5, (0.0, 0.0, 0.0))))
    assert track.value(1) == (1.0, 0.1, 3.0) and track.value(4) == (4.0, 0.1, 0.0) and track.value(9) == (0, 0, 0)


def test_a_turntable_closes_after_its_last_frame() -> None:
    animation = Animation(frames=8, turntable=360.0)
    assert [animation.degrees(k) for k in (0, 2, 8)] == [0.0, 90.0, 360.0]


def test_the_camera_goes_round_its_point_counterclockwise_about_up() -> None:
    camera = Camera((1.0, 2.0, 5.0), (1.0, 0.0, 1.0))
    assert go_round(camera, 0.0) is camera
    assert go_round(camera, 90.0).position == (5.0, 2.0, 1.0)
    assert go_round(camera, -180.0).position == (1.0, 2.0, -3.0)
    eighth = go_round(camera, 45.0)
    assert eighth.position == pytest.approx((1 + math.sqrt(8), 2, 1 + math.sqrt(8)), rel=1e-15)
    assert (eighth.look_at, eighth.up, eighth.vertical_fov) == (camera.look_at, camera.up, camera.vertical_fov)


def test_a_tilted_axis_keeps_the_distance_and_the_height_along_it() -> None:
    camera = Camera((3.0, -2.0, 7.0), (1.0, 1.0, 0.0), up=(2.0, 5.0, -1.0))
    for degrees in (17.0, 123.0, 301.0, 3599.0):
        turned = go_round(camera, degrees)
        assert math.dist(turned.position, camera.look_at) == pytest.approx(math.dist(camera.position, camera.look_at))
        heights = [
            sum(u * (a - b) for u, a, b in zip(c.up, c.position, c.look_at, strict=True)) for c in (camera, turned)
        ]
        assert heights[0] == pytest.approx(heights[1])
