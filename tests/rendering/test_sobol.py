"""The points of soft shadows: a (0, 2)-sequence in each pixel, independent of other pixels and lights."""

from __future__ import annotations

import functools
import itertools
import operator

import numpy as np
import pytest
from numpy.typing import ArrayLike

from raytracer import glsl
from raytracer.rendering.renderer import Renderer
from raytracer.scene.sequences import light_index, sample_place

pytestmark = pytest.mark.gl


def points(renderer: Renderer, pixel: ArrayLike, light: ArrayLike, index: ArrayLike) -> np.ndarray:
    return glsl.call("sobolPoint", pixel, light, index, device=renderer.device).astype(float)


def test_pascal_returns_the_digits_of_sobols_second_dimension(renderer: Renderer) -> None:
    # By definition a point is the XOR of the direction numbers of the polynomial 1 + x at the set bits of the index.
    direction = [1 << 31]
    for _ in range(31):
        direction.append(direction[-1] ^ direction[-1] >> 1)
    rng = np.random.default_rng(0)
    index = np.concatenate([np.arange(64), rng.integers(0, 2**32, 1000)]).astype(np.uint32)
    expected = [
        functools.reduce(operator.xor, (d for k, d in enumerate(direction) if i >> k & 1), 0) for i in index.tolist()
    ]
    values = glsl.call("reversed", glsl.call("pascal", index, device=renderer.device), device=renderer.device)
    np.testing.assert_array_equal(values, np.array(expected, np.uint32))


def test_reversed_reverses_the_bits(renderer: Renderer) -> None:
    x = np.random.default_rng(1).integers(0, 2**32, 1000).astype(np.uint32)
    expected = [int(f"{value:032b}"[::-1], 2) for value in x.tolist()]
    np.testing.assert_array_equal(glsl.call("reversed", x, device=renderer.device), np.array(expected, np.uint32))


@pytest.mark.parametrize(("pixel", "light"), [((0, 0), 0), ((1, 0), 0), ((0, 0), 1), ((65535, 1234), 40)])
def test_each_of_2_to_the_n_equal_boxes_holds_one_of_the_first_2_to_the_n_points(
    renderer: Renderer, pixel: tuple[int, int], light: int
) -> None:
    places = points(renderer, pixel, light, np.arange(1024))
    assert places.min() >= 0.0 and places.max() < 1.0
    for n in range(11):
        for i in range(n + 1):
            box = np.floor(places[: 2**n] * (2**i, 2 ** (n - i))).astype(int)
            assert len(set(map(tuple, box.tolist()))) == 2**n, (n, i)


def test_sample_places_and_light_points_are_evenly_distributed_in_four_dimensions(renderer: Renderer) -> None:
    lights = points(renderer, (3, 5), 0, [light_index(k) for k in range(256)])
    together = np.column_stack([np.array([sample_place(k) for k in range(256)]) * 2.0**-24, lights])
    for m in range(5):
        for shape in itertools.product(range(m + 1), repeat=4):
            if sum(shape) == m:
                boxes = np.floor(together[: 4**m] * 4.0 ** np.array(shape)).astype(int)
                assert len(set(map(tuple, boxes.tolist()))) == 4**m, shape
    for n in range(9):
        for i in range(n + 1):
            boxes = np.floor(lights[: 2**n] * (2**i, 2 ** (n - i))).astype(int)
            assert len(set(map(tuple, boxes.tolist()))) == 2**n, (n, i)


def test_points_of_different_pixels_lights_and_samples_are_uncorrelated(renderer: Renderer) -> None:
    x, y = np.meshgrid(np.arange(64), np.arange(64))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    # The correlation of 4096 independent pairs of numbers exceeds 5 / sqrt(4096) once in a million times.
    most = 5.0 / 64.0
    for k in (0, 1, 5):
        grid = points(renderer, pixels, 0, k).reshape(64, 64, 2)
        assert np.histogramdd(grid.reshape(-1, 2), bins=4, range=[(0, 1)] * 2)[0].min() > 180, "256 on average"
        for other in (
            np.roll(grid, 1, axis=0),
            np.roll(grid, 1, axis=1),
            np.roll(grid, 8, axis=(0, 1)),
            points(renderer, pixels, 1, k).reshape(64, 64, 2),
        ):
            for i, j in np.ndindex(2, 2):
                assert abs(np.corrcoef(grid[..., i].ravel(), other[..., j].ravel())[0, 1]) < most
        assert abs(np.corrcoef(grid[..., 0].ravel(), grid[..., 1].ravel())[0, 1]) < most
    # The correlation of a pixel's 64 points with its 64 sample places, averaged over 400 pixels, is as small as for
    # independent numbers.
    places = np.array([sample_place(k) for k in range(64)]) * 2.0**-24 - 0.5
    pixel_of_point = np.repeat(pixels[:400], 64, axis=0)
    offsets = (
        points(renderer, pixel_of_point, 0, np.tile([light_index(k) for k in range(64)], 400)).reshape(400, 64, 2) - 0.5
    )
    correlation = np.einsum("pki,kj->pij", offsets, places) / 64.0 * 12.0
    assert np.abs(correlation.mean(axis=0)).max() < 5.0 / np.sqrt(400 * 64)
