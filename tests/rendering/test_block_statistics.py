"""The statistics of blocks and tiles, and the variance of pixels that they scale."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raytracer.gpu.draw_player import DrawPlayer
from raytracer.rendering import estimator
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.estimator import (
    FACTOR,
    TileStatistics,
    after_look,
    before_any_look,
    estimate,
    is_look_due,
    pixel_errors,
    tile_statistics,
)
from raytracer.rendering.renderer import Renderer

ONE_CELL = np.ones((1, 1), bool)
ALL = np.ones((4, 4), bool)
WHOLE = slice(0, 4), slice(0, 4)


def measured(moved: float, variance: float, most: float) -> np.ndarray:
    return np.full((4, 4, 4), (moved, variance, most, 0.0), np.float32)


def test_the_error_is_that_of_the_last_movement_and_falls_as_that_of_independent_samples() -> None:
    statistics = after_look(before_any_look(ONE_CELL, is_sparse=False), 8, measured(48.0, 4.0, 1.0), ALL)
    for n in (8, 16):
        samples = np.full((4, 4), n, np.int32)
        np.testing.assert_allclose(statistics.squared_errors(samples), FACTOR * 48.0 * 8 / n)
        rmse = math.sqrt(16 * FACTOR * 48.0 * 8 / n / (3 * 256))
        assert statistics.rmse(samples, WHOLE, 256) == pytest.approx(rmse)


def test_a_look_leaves_the_statistics_before_and_those_of_blocks_that_are_not_active() -> None:
    first = after_look(before_any_look(ONE_CELL, is_sparse=False), 4, measured(1.0, 2.0, 3.0), ALL)
    active = ALL.copy()
    active[0] = False
    second = after_look(first, 8, measured(5.0, 6.0, 7.0), active)
    assert np.unique(first.at).tolist() == [4] and np.unique(first.moved).tolist() == [1.0]
    for field, old, new in (("at", 4, 8), ("moved", 1, 5), ("variance", 2, 6), ("most", 3, 7)):
        values = getattr(second, field)
        assert np.unique(values[0]).tolist() == [old] and np.unique(values[1:]).tolist() == [new]


def test_a_part_of_a_large_tile_stands_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(estimator, "_ENOUGH", 0)
    cells = np.ones((10, 10), bool)
    whole, part = (before_any_look(cells, is_sparse=sparse) for sparse in (False, True))
    assert whole.share == 1.0 and part.share == 0.2 and part.watched.mean() == 0.2
    moved = np.full((40, 40, 4), (1.0, 1.0, 1.0, 0.0), np.float32)
    samples, everywhere = np.full((40, 40), 8, np.int32), (slice(0, 40), slice(0, 40))
    a, b = (after_look(statistics, 8, moved, np.ones((40, 40), bool)) for statistics in (whole, part))
    assert a.rmse(samples, everywhere, 1600) == pytest.approx(b.rmse(samples, everywhere, 1600))
    assert (b.variance == 1.0).all(), "how far samples lie apart is known of all blocks"


def test_a_tile_says_its_worst_place_and_scales_by_the_number_of_samples() -> None:
    measurements = measured(0.0, 8.0, 1.0)
    measurements[3, 1] = 16.0, 8.0, 4.0, 0.0
    statistics = after_look(before_any_look(ONE_CELL, is_sparse=False), 8, measurements, ALL)
    samples = np.full((4, 4), 8, np.int32)
    tile = tile_statistics(statistics, samples, WHOLE, (32, 16))
    assert tile.total == pytest.approx(16.0 * FACTOR) and tile.fourth == pytest.approx((16.0 * FACTOR) ** 2)
    assert tile.at == (32 + 4 + 2, 16 + 12 + 2)
    assert tile.scales[8] == pytest.approx(16.0 * FACTOR / 16.0) and tile.worst == pytest.approx(tile.scales[8] * 4 / 8)


def test_tiles_add_up_to_the_picture() -> None:
    tiles = [TileStatistics(3.0, 9.0, 0.3, (5, 7), np.zeros(1)), TileStatistics(6.0, 36.0, 12.0, (90, 2), np.zeros(1))]
    whole = estimate(tiles, (100, 10), 8.0, 1.5)
    assert whole.rmse == pytest.approx(math.sqrt(9.0 / 3000.0))
    assert whole.worst == pytest.approx(6.0) and whole.worst_at == (90, 7)


def test_looks_are_at_powers_of_two_and_only_the_last_two_where_that_is_enough() -> None:
    assert [n for n in range(1, 41) if is_look_due(n, 40, has_all=True)] == [1, 2, 4, 8, 16, 32]
    assert [n for n in range(1, 41) if is_look_due(n, 40, has_all=False)] == [16, 32]


@pytest.mark.gl
def test_the_variance_of_a_pixels_samples_is_that_of_its_values(renderer: Renderer) -> None:
    # Blocks of 4 x 4 pixels with 5 samples each, but for one with 3, and a cell in which nothing is to be seen.
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
        chosen, alike = (measurements.variance(area, cells, samples) for samples in (counts, 5))
        player.close()
    np.testing.assert_allclose(chosen, truth, rtol=1e-4)
    same = counts.repeat(4, axis=0).repeat(4, axis=1) == 5
    np.testing.assert_allclose(alike[same], truth[same], rtol=1e-4)
    np.testing.assert_allclose(pixel_errors(chosen, 5, np.ones(6)), np.sqrt(truth / 15.0), rtol=1e-4)
