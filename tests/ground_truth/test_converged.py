"""The converged reference, and what it says of its own error, against closed forms."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.formats.image import Image
from raytracer.ground_truth import ray_tracer, workers
from raytracer.ground_truth.converged import trace_converged
from raytracer.scene.settings import Settings
from tests import scenes

SHINING = rt.Material("lambert", rho=0, le=1)
WHITE = rt.Material(ka=(0, 0, 0), kd=(1, 1, 1), ks=(0, 0, 0))
SIZE = (48, 32)


def edge(angle: float = 0.3, offset: float = 0.2) -> rt.Scene:
    """The shining part cos(angle) x + sin(angle) y <= offset of the plane z = 0, before black, seen from (0, 0, 5)."""
    side = rt.Plane((math.cos(angle), math.sin(angle), 0), offset, SHINING)
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=40)
    return rt.Scene([rt.Plane((0, 0, 1), 0, SHINING) & side], [], camera, background=(0, 0, 0))


def coverage(size: tuple[int, int], angle: float = 0.3, offset: float = 0.2) -> np.ndarray:
    """How much of each pixel edge() covers, (H, W): the area of a square that a line cuts off."""
    width, height = size
    pixel = 2.0 * 5.0 * math.tan(math.radians(20)) / height  # on the plane z = 0
    x, y = np.meshgrid((np.arange(width) - width / 2) * pixel, (height / 2 - 1 - np.arange(height)) * pixel)
    a, b = math.cos(angle), math.sin(angle)
    c = (offset - a * x - b * y) / pixel  # from the pixel's corner at the lower left: a u + b v <= c
    squares = (sign * np.maximum(c - part, 0.0) ** 2 for part, sign in ((0, 1), (a, -1), (b, -1), (a + b, 1)))
    return np.round(np.sum([*squares], axis=0) / (2.0 * a * b), 9)  # 0 and 1 as they are: squares cancel


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def stated(image: Image) -> np.ndarray:
    assert image.error is not None
    return image.error


@pytest.mark.parametrize(("samples", "tolerance"), [(16, 0.0), (256, 0.0), (1024, 5e-3)])
def test_an_edge_is_where_it_should_be_to_the_error_that_is_stated(samples: int, tolerance: float) -> None:
    size = (80, 160)
    image = trace_converged(edge(), size, samples=samples, tolerance=tolerance, cache=False, workers=1)
    off = image.radiance[..., 0] - coverage(size)
    cut = (coverage(size) > 0) & (coverage(size) < 1)
    # Of so many pixels, each with 3 or more degrees of freedom, such a ratio is known to 10 %.
    assert cut.sum() > 150
    assert rms(off[cut]) == pytest.approx(rms(stated(image)[cut]), rel=0.25)
    assert not off[~cut].any() and not stated(image)[~cut].any()
    # One sample in each of n boxes would be off by sqrt(0.15) n^(-3/4); four sets, and rounds, cost a factor of 2.2.
    assert rms(off[cut]) < 1.2 * max(2.2 * math.sqrt(0.15) * samples**-0.75, tolerance)


def test_the_pictures_error_is_that_of_its_pixels_or_half_as_a_lower_bound_where_few_hold_it() -> None:
    for scene, few in ((edge(), False), (scenes.glint(), True)):
        image = trace_converged(scene, (40, 24), samples=64, cache=False, workers=1)
        found = image.estimate
        assert found and found.worst_at and found.uncertain == few and found.reached is None
        assert found.rmse == pytest.approx((0.5 if few else 1.0) * rms(stated(image)))
        x, y = found.worst_at
        assert found.worst == 3.0 * stated(image)[y, x] == 3.0 * stated(image).max()


def test_samples_go_where_the_error_is_above_the_tolerance_and_no_farther() -> None:
    image = trace_converged(edge(), (48, 32), samples=1000, tolerance=5e-3, cache=False)
    assert image.samples is not None and {*np.unique(image.samples)} <= {16, 32, 64, 128, 256, 512}
    far = np.abs(np.arange(48) - 24) > 12
    assert (image.samples[:, far] == 16).all() and image.samples.max() == 512
    assert rms(stated(image)) < 5e-3
    # Pixels that are not cut got more, too, and only beside those that are.
    cut = (coverage((48, 32)) > 0) & (coverage((48, 32)) < 1)
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(cut, 1), (3, 3)).any(axis=(2, 3))
    assert (image.samples[~cut] == 512).sum() > 30 and (image.samples[~beside] == 16).all()


def test_all_around_a_pixel_that_is_off_have_all_samples_also_if_they_had_ended_before() -> None:
    image = trace_converged(scenes.assignment(), (64, 36), samples=256, tolerance=2e-3, cache=False, workers=1)
    assert image.samples is not None
    off = np.lib.stride_tricks.sliding_window_view(np.pad(stated(image) > 2e-3, 1), (3, 3)).any(axis=(2, 3))
    assert off.sum() > 100 and (image.samples[off] == 256).all() and (image.samples == 16).sum() > 1000


FLOOR = rt.Plane((0, 1, 0), 0, WHITE)
LIGHT = rt.PointLight((-2, 4, 0), (0.7, 0.7, 0.7), radius=0.8)


def penumbra() -> rt.Scene:
    """A floor under a wall x >= 0, y >= 1, whose edge (0, 1, z) hides a part of a sphere light."""
    wall = rt.Plane((-1, 0, 0), 0) & rt.Plane((0, -1, 0), -1)
    return rt.Scene([FLOOR, wall], [LIGHT], rt.Camera((0.7, 0.8, 0.2), (0.7, 0, 0), vertical_fov=50))


def in_penumbra(P: np.ndarray) -> np.ndarray:
    """The radiance of penumbra()'s floor at points (..., 3): Lambert's integral over the border of what is seen.

    That is a part of the cone to the light, between an arc of its border and the plane of the point and the edge.
    """
    to_light = np.array(LIGHT.position) - P
    d = np.linalg.norm(to_light, axis=-1, keepdims=True)
    W, sine = to_light / d, LIGHT.radius / d[..., 0]
    cosine = np.sqrt(1.0 - sine**2)
    m = np.stack([np.ones(P.shape[:-1]), P[..., 0], np.zeros(P.shape[:-1])], axis=-1)
    m /= np.linalg.norm(m, axis=-1, keepdims=True)  # what is seen has a negative scalar product with it
    s = np.sum(W * m, axis=-1)
    U = (m - s[..., None] * W) / np.sqrt(1.0 - s**2)[..., None]
    V = np.cross(W, U)
    begin = np.arccos(np.clip(-s * cosine / (np.sqrt(1.0 - s**2) * sine), -1.0, 1.0))
    end = 2.0 * np.pi - begin

    def border(angle: np.ndarray) -> np.ndarray:
        across = np.cos(angle)[..., None] * U + np.sin(angle)[..., None] * V
        return cosine[..., None] * W + sine[..., None] * across

    along = (np.sin(end) - np.sin(begin))[..., None] * U - (np.cos(end) - np.cos(begin))[..., None] * V
    flux = (sine**2 * (end - begin))[..., None] * W - (cosine * sine)[..., None] * along
    normal = np.cross(border(end), border(begin))
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    between = 2.0 * np.arcsin(np.linalg.norm(border(end) - border(begin), axis=-1, keepdims=True) / 2.0)
    flux += between * normal / np.maximum(length, 1e-300)
    return LIGHT.color[0] / (np.pi * sine**2) * flux[..., 1] / 2.0


def test_a_penumbra_is_as_dark_as_it_should_be_to_the_error_that_is_stated() -> None:
    size, parts = (24, 16), 6
    image = trace_converged(penumbra(), size, Settings(shadows="soft"), samples=64, tolerance=0.0, cache=False)
    rd = ray_tracer.camera_rays(penumbra().camera, (parts * size[0], parts * size[1]))
    eye = np.array(penumbra().camera.position)
    points = in_penumbra(eye - eye[1] / rd[..., 1:2] * rd)
    expected = points.reshape(size[1], parts, size[0], parts).mean(axis=(1, 3))
    assert expected.max() - expected.min() > 0.4, "light and shadow"
    off = image.radiance[..., 0] - expected
    assert rms(off) == pytest.approx(rms(stated(image)), rel=0.2)
    # Of a light half of which is hidden, stratified rays show 0.36 n^(-3/4) too much or little; of each sample 4.
    assert rms(off) < 2.2 * 0.36 * LIGHT.color[0] * (4 * 64) ** -0.75


def test_depth_normal_and_material_are_those_of_the_centre_rays() -> None:
    found, expected = (
        trace_converged(scenes.assignment(), (32, 18), samples=16, cache=False),
        ray_tracer.trace(scenes.assignment(), (32, 18)),
    )
    for name in ("depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_the_result_does_not_depend_on_how_many_processes_work_on_it(monkeypatch: pytest.MonkeyPatch) -> None:
    pools = []

    class Pool(workers.ProcessPoolExecutor):
        def __init__(self, *arguments: Any) -> None:
            pools.append(arguments[0])
            super().__init__(*arguments)

    monkeypatch.setattr(workers, "ProcessPoolExecutor", Pool)
    seen: list[tuple[int, int]] = []
    one = trace_converged(penumbra(), (96, 64), Settings(shadows="soft"), samples=32, workers=1, cache=False)
    three = trace_converged(
        penumbra(),
        (96, 64),
        Settings(shadows="soft"),
        samples=32,
        workers=3,
        cache=False,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert pools == [3]
    for name in ("radiance", "error", "samples", "depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))
    assert three.samples is not None and seen[-1] == (three.samples.sum(), three.samples.sum())
    assert len(seen) > 10 and all(done < total for done, total in seen[:-1])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"samples": 15}, "samples: expected a whole number in [16, 65536], got 15"),
        ({"samples": 2**17}, "samples"),
        ({"samples": 16.0}, "samples"),
        ({"tolerance": -1.0}, "tolerance: expected a finite number of at least 0"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"size": (0, 1)}, "size"),
    ],
)
def test_what_cannot_be_asked_for_is_refused(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(rt.InputError, match=re.escape(says)):
        trace_converged(edge(), **{"size": SIZE, **arguments})
