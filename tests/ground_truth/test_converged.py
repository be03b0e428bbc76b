"""The converged reference and its error estimate, compared with closed forms."""

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
    """Return an emitting half of the plane z = 0 before a black background, seen from (0, 0, 5).

    The emitting half is cos(angle) x + sin(angle) y <= offset.
    """
    side = rt.Plane((math.cos(angle), math.sin(angle), 0), offset, SHINING)
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=40)
    return rt.Scene([rt.Plane((0, 0, 1), 0, SHINING) & side], [], camera, background=(0, 0, 0))


def coverage(size: tuple[int, int], angle: float = 0.3, offset: float = 0.2) -> np.ndarray:
    """Return the share of each pixel that edge() covers [H, W]: the area of a square on one side of a line."""
    width, height = size
    pixel = 2.0 * 5.0 * math.tan(math.radians(20)) / height  # on the plane z = 0
    x, y = np.meshgrid((np.arange(width) - width / 2) * pixel, (height / 2 - 1 - np.arange(height)) * pixel)
    a, b = math.cos(angle), math.sin(angle)
    c = (offset - a * x - b * y) / pixel  # from the pixel's lower left corner: a u + b v <= c
    squares = (sign * np.maximum(c - part, 0.0) ** 2 for part, sign in ((0, 1), (a, -1), (b, -1), (a + b, 1)))
    # Rounded, because the squares cancel where the share is 0 or 1.
    return np.round(np.sum([*squares], axis=0) / (2.0 * a * b), 9)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def stated_error(image: Image) -> np.ndarray:
    assert image.error is not None
    return image.error


@pytest.mark.parametrize(("samples", "tolerance"), [(16, 0.0), (256, 0.0), (1024, 5e-3)])
def test_an_edge_is_correct_within_the_stated_error(samples: int, tolerance: float) -> None:
    size = (80, 160)
    image = trace_converged(edge(), size, samples=samples, tolerance=tolerance, cache=False, workers=1)
    difference = image.radiance[..., 0] - coverage(size)
    cut = (coverage(size) > 0) & (coverage(size) < 1)
    # With so many pixels, and at least 3 degrees of freedom in each, the ratio is known to 10 %.
    assert cut.sum() > 150
    assert rms(difference[cut]) == pytest.approx(rms(stated_error(image)[cut]), rel=0.25)
    assert not difference[~cut].any() and not stated_error(image)[~cut].any()
    # One sample in each of n boxes has an error of sqrt(0.15) n^(-3/4). Four sets and several rounds cost a factor of
    # 2.2.
    assert rms(difference[cut]) < 1.2 * max(2.2 * math.sqrt(0.15) * samples**-0.75, tolerance)


def test_the_stated_error_is_the_rms_of_the_pixels_or_half_of_it_if_few_pixels_hold_it() -> None:
    for scene, few in ((edge(), False), (scenes.glint(), True)):
        image = trace_converged(scene, (40, 24), samples=64, cache=False, workers=1)
        estimate = image.estimate
        assert estimate and estimate.worst_at and estimate.uncertain == few and estimate.reached is None
        assert estimate.rmse == pytest.approx((0.5 if few else 1.0) * rms(stated_error(image)))
        x, y = estimate.worst_at
        assert estimate.worst == 3.0 * stated_error(image)[y, x] == 3.0 * stated_error(image).max()


def test_only_pixels_above_the_tolerance_and_their_neighbours_get_more_samples() -> None:
    image = trace_converged(edge(), (48, 32), samples=1000, tolerance=5e-3, cache=False)
    assert image.samples is not None and {*np.unique(image.samples)} <= {16, 32, 64, 128, 256, 512}
    far = np.abs(np.arange(48) - 24) > 12
    assert (image.samples[:, far] == 16).all() and image.samples.max() == 512
    assert rms(stated_error(image)) < 5e-3
    # Pixels beside the edge get more samples as well, and other pixels do not.
    cut = (coverage((48, 32)) > 0) & (coverage((48, 32)) < 1)
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(cut, 1), (3, 3)).any(axis=(2, 3))
    assert (image.samples[~cut] == 512).sum() > 30 and (image.samples[~beside] == 16).all()


def test_the_neighbours_of_an_inaccurate_pixel_get_all_samples_also_after_they_stopped() -> None:
    image = trace_converged(scenes.assignment(), (64, 36), samples=256, tolerance=2e-3, cache=False, workers=1)
    assert image.samples is not None
    near = np.lib.stride_tricks.sliding_window_view(np.pad(stated_error(image) > 2e-3, 1), (3, 3)).any(axis=(2, 3))
    assert near.sum() > 100 and (image.samples[near] == 256).all() and (image.samples == 16).sum() > 1000


FLOOR = rt.Plane((0, 1, 0), 0, WHITE)
LIGHT = rt.PointLight((-2, 4, 0), (0.7, 0.7, 0.7), radius=0.8)


def penumbra() -> rt.Scene:
    """Return a floor under a wall x >= 0, y >= 1. The edge (0, 1, z) of the wall hides a part of a sphere light."""
    wall = rt.Plane((-1, 0, 0), 0) & rt.Plane((0, -1, 0), -1)
    return rt.Scene([FLOOR, wall], [LIGHT], rt.Camera((0.7, 0.8, 0.2), (0.7, 0, 0), vertical_fov=50))


def in_penumbra(P: np.ndarray) -> np.ndarray:
    """Return the radiance of penumbra()'s floor at points [..., 3], by Lambert's integral over the border of a region.

    The region is the visible part of the light's cone, between an arc of the cone's border and the plane through the
    point and the edge of the wall.
    """
    to_light = np.array(LIGHT.position) - P
    d = np.linalg.norm(to_light, axis=-1, keepdims=True)
    W, sine = to_light / d, LIGHT.radius / d[..., 0]
    cosine = np.sqrt(1.0 - sine**2)
    m = np.stack([np.ones(P.shape[:-1]), P[..., 0], np.zeros(P.shape[:-1])], axis=-1)
    m /= np.linalg.norm(m, axis=-1, keepdims=True)  # visible directions have a negative scalar product with m
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


def test_a_penumbra_is_correct_within_the_stated_error() -> None:
    size, parts = (24, 16), 6
    image = trace_converged(penumbra(), size, Settings(shadows="soft"), samples=64, tolerance=0.0, cache=False)
    rd = ray_tracer.camera_rays(penumbra().camera, (parts * size[0], parts * size[1]))
    eye = np.array(penumbra().camera.position)
    points = in_penumbra(eye - eye[1] / rd[..., 1:2] * rd)
    expected = points.reshape(size[1], parts, size[0], parts).mean(axis=(1, 3))
    assert expected.max() - expected.min() > 0.4, "light and shadow"
    difference = image.radiance[..., 0] - expected
    assert rms(difference) == pytest.approx(rms(stated_error(image)), rel=0.2)
    # Stratified rays to a half-hidden light have an error of 0.36 n^(-3/4); each sample shoots 4 rays.
    assert rms(difference) < 2.2 * 0.36 * LIGHT.color[0] * (4 * 64) ** -0.75


def test_depth_normal_and_material_come_from_the_centre_rays() -> None:
    image, expected = (
        trace_converged(scenes.assignment(), (32, 18), samples=16, cache=False),
        ray_tracer.trace(scenes.assignment(), (32, 18)),
    )
    for name in ("depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(image, name), getattr(expected, name))


def test_the_result_does_not_depend_on_the_number_of_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    worker_counts = []

    class Pool(workers.ProcessPoolExecutor):
        def __init__(self, *arguments: Any) -> None:
            worker_counts.append(arguments[0])
            super().__init__(*arguments)

    monkeypatch.setattr(workers, "ProcessPoolExecutor", Pool)
    calls: list[tuple[int, int]] = []
    one = trace_converged(penumbra(), (96, 64), Settings(shadows="soft"), samples=32, workers=1, cache=False)
    three = trace_converged(
        penumbra(),
        (96, 64),
        Settings(shadows="soft"),
        samples=32,
        workers=3,
        cache=False,
        progress=lambda done, total: calls.append((done, total)),
    )
    assert worker_counts == [3]
    for name in ("radiance", "error", "samples", "depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))
    assert three.samples is not None and calls[-1] == (three.samples.sum(), three.samples.sum())
    assert len(calls) > 10 and all(done < total for done, total in calls[:-1])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"samples": 15}, "samples: expected a whole number in [16, 65536], got 15"),
        ({"samples": 2**17}, "samples"),
        ({"samples": 16.0}, "samples"),
        ({"tolerance": -1.0}, "tolerance: expected a finite number of at least 0"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"size": (0, 1)}, "size"),
    ],
)
def test_invalid_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(rt.InputError, match=re.escape(message)):
        trace_converged(edge(), **{"size": SIZE, **arguments})
