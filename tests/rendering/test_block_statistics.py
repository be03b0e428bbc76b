"""The error statistics of blocks while samples are added, and the variance of a pixel's samples."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raytracer.gpu.draw_player import DrawPlayer
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import FACTOR, empty_statistics, update_statistics
from raytracer.rendering.renderer import Renderer

ALL = np.ones((4, 4), bool)
WHOLE = slice(0, 4), slice(0, 4)


def movement_and_most(moved: float, most: float) -> np.ndarray:
    return np.full((4, 4, 2), (moved, most), np.float32)


def test_the_error_follows_the_last_movement_and_falls_like_independent_samples() -> None:
    statistics = update_statistics(empty_statistics((4, 4)), 8, movement_and_most(48.0, 1.0), ALL)
    for n in (8, 16):
        samples = np.full((4, 4), n, np.int32)
        np.testing.assert_allclose(statistics.squared_errors(samples), FACTOR * 48.0 * 8 / n)
        rmse = math.sqrt(16 * FACTOR * 48.0 * 8 / n / (3 * 256))
        assert statistics.rmse(samples, WHOLE, 256) == pytest.approx(rmse)


def test_a_look_keeps_earlier_statistics_and_inactive_blocks() -> None:
    first = update_statistics(empty_statistics((4, 4)), 4, movement_and_most(1.0, 3.0), ALL)
    active = ALL.copy()
    active[0] = False
    second = update_statistics(first, 8, movement_and_most(5.0, 7.0), active)
    assert np.unique(first.at).tolist() == [4] and np.unique(first.moved).tolist() == [1.0]
    for field, old, new in (("at", 4, 8), ("moved", 1, 5), ("most", 3, 7)):
        values = getattr(second, field)
        assert np.unique(values[0]).tolist() == [old] and np.unique(values[1:]).tolist() == [new]


def test_the_estimate_of_a_part_has_its_worst_place() -> None:
    measurements = movement_and_most(1.0, 1.0)
    measurements[3, 1] = 4.0, 4.0
    statistics = update_statistics(empty_statistics((4, 4)), 8, measurements, ALL)
    estimate = statistics.estimate(np.full((4, 4), 8, np.int32), WHOLE, (16, 16), 8.0, 1.5, None)
    assert estimate.rmse == pytest.approx(math.sqrt(19.0 * FACTOR / (3 * 256))) and not estimate.uncertain
    assert estimate.worst_at == (4 + 2, 15 - (12 + 2)) and estimate.worst == pytest.approx(
        3.0 * math.sqrt(4.0 * FACTOR / 3.0)
    )
    measurements[3, 1] = 400.0, 4.0
    few = update_statistics(empty_statistics((4, 4)), 8, measurements, ALL)
    estimate = few.estimate(np.full((4, 4), 8, np.int32), WHOLE, (16, 16), 8.0, 1.5, 1e9)
    assert estimate.uncertain and estimate.reached is False
    assert estimate.rmse == pytest.approx(math.sqrt(415.0 * FACTOR / (3 * 256)) / 2.0)


@pytest.mark.gl
def test_the_variance_of_a_pixels_samples_equals_the_variance_of_its_values(renderer: Renderer) -> None:
    # Blocks of 4 x 4 pixels with 5 samples each, except one with 3, and an empty cell on the right.
    counts = np.full((4, 8), 5, np.int32)
    counts[1, 2] = 3
    values = np.random.default_rng(1).uniform(0, 2, (5, 16, 32, 3)).astype(np.float32)
    values[3:, 4:8, 8:12] = 0.0
    sums = np.concatenate([values.sum(axis=0), (values**2).sum(axis=(0, 3))[..., None]], axis=2)
    truth = values.var(axis=0, ddof=1).sum(axis=2)
    truth[4:8, 8:12] = values[:3, 4:8, 8:12].var(axis=0, ddof=1).sum(axis=2)
    truth[:, 16:] = 0.0
    area, cells = (16, 0, 32, 16), np.array([[True, False]])
    with renderer.device.turn():
        player = DrawPlayer(renderer.device)
        player.add_texture("radiance", (32, 16), 4)
        player.write("radiance", sums)
        measurements = BlockMeasurements(renderer.device, player, (32, 16))
        chosen, uniform = (measurements.variance(area, cells, samples) for samples in (counts, 5))
        player.close()
    np.testing.assert_allclose(chosen, truth, rtol=1e-4)
    same = counts.repeat(4, axis=0).repeat(4, axis=1) == 5
    np.testing.assert_allclose(uniform[same], truth[same], rtol=1e-4)
