"""The error estimate by a replicate: the choice of blocks, sums over blocks, and errors of closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raytracer.rendering.renderer import Renderer
from raytracer.rendering.replicate import block_sums, choose_blocks, squared_error
from raytracer.scene.sequences import light_index, replicate_place, sample_place
from raytracer.scene.settings import Settings
from tests import scenes
from tests.edges import SIZE, random_strips

DIGITS = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])[::-1]), axis=-1).reshape(-1, 2).astype(np.uint32)


def scrambled_places(places: list[tuple[int, int]]) -> np.ndarray:
    """Scramble sample places for each pixel, as camera.glsl does: offsets from the centres [samples, pixels, 2]."""
    at = DIGITS[:, 0] * np.uint32(3242174889) + DIGITS[:, 1] * np.uint32(2447445413)
    flipped = np.stack([at, at * np.uint32(1010068087)], axis=-1) >> np.uint32(8)
    return (np.array(places, np.uint32)[:, None] ^ flipped) * 2.0**-24 - 0.5


@pytest.mark.parametrize("thickness", [0.02, 0.1, 0.3, 2.0])
def test_two_scramblings_estimate_the_error_of_edges_and_lines_within_10_percent(
    thickness: float,
) -> None:
    inside, exact = random_strips(np.random.default_rng(3), thickness)
    samples, replicate = (scrambled_places([place(k) for k in range(64)]) for place in (sample_place, replicate_place))
    for n in (2, 3, 4, 8, 16, 24, 32, 64):
        mean, other = (inside(points[:n]).mean(axis=0) for points in (samples, replicate))
        error = math.sqrt(np.mean((mean - exact) ** 2))
        assert math.sqrt(np.mean((mean - other) ** 2) / 2.0) == pytest.approx(error, rel=0.1), n


def test_blocks_are_chosen_in_proportion_to_their_weights() -> None:
    rng = np.random.default_rng(4)
    weights = rng.uniform(0.0, 1.0, (40, 60)) ** 8
    weights[3, 5], weights[7, 9], weights[:, 20:] = 1e3, 2e3, 0.0
    rows, columns, probabilities = choose_blocks(weights, 64)
    assert abs(len(rows) - 64) <= 1 and (weights[rows, columns] > 0.0).all()
    # The two largest blocks are chosen with certainty. All other chosen blocks represent equal weights.
    assert sorted(weights[rows, columns][probabilities == 1.0])[-2:] == [1e3, 2e3]
    assert (weights[rows, columns] / probabilities).sum() == pytest.approx(weights.sum(), rel=1e-2)
    least = (weights[rows, columns] / probabilities)[probabilities < 1.0]
    np.testing.assert_allclose(least, least[0])
    few = choose_blocks(np.eye(5), 64)
    assert len(few[0]) == 5 and (few[2] == 1.0).all()


def test_an_error_in_few_blocks_is_uncertain_and_the_other_blocks_are_a_lower_bound() -> None:
    even = np.full(100, 2.0)
    total, least, is_uncertain = squared_error(even, np.full(100, 0.5))
    assert total == pytest.approx(400.0) and not is_uncertain
    assert 300.0 < least < total
    total, least, is_uncertain = squared_error(np.append(even, 2e4), np.append(np.full(100, 0.5), 1.0))
    assert is_uncertain and 300.0 < least < 400.0 < total


def test_block_sums_count_rows_from_the_bottom_and_include_all_pixels() -> None:
    values = np.arange(6 * 9, dtype=np.float32).reshape(6, 9)
    sums = block_sums(values)
    assert sums.shape == (2, 3) and sums.sum() == values.sum()
    assert sums[0, 0] == values[2:, :4].sum() and sums[1, 2] == values[:2, 8:].sum()


def test_light_indices_stay_below_those_of_replicates() -> None:
    assert max(light_index(k) for k in range(65536)) < 1 << 24


@pytest.mark.gl
def test_the_estimate_is_correct_for_any_number_of_samples_and_any_tiles(renderer: Renderer) -> None:
    scene = scenes.with_light_radii(scenes.assignment(), 0.5)
    truth = renderer.render(scene, (160, 90), Settings(samples=4096, shadows="soft"), estimates=False).radiance
    for samples in (3, 16, 24, 300):
        settings = Settings(samples=samples, shadows="soft")
        whole, parts = (renderer.render(scene, (160, 90), settings, tile=tile) for tile in (2048, 64))
        assert whole.estimate and parts.estimate and whole.estimate.rmse
        assert parts.estimate.rmse == pytest.approx(whole.estimate.rmse, rel=1e-6)
        assert not whole.estimate.uncertain
        error = math.sqrt(np.mean((whole.radiance - truth) ** 2, dtype=float))
        assert whole.estimate.rmse == pytest.approx(error, rel=0.25), samples


@pytest.mark.gl
def test_the_error_of_a_glint_is_a_lower_bound(renderer: Renderer) -> None:
    for samples in (4, 16, 64):
        estimate = renderer.render(scenes.glint(), (160, 90), Settings(samples=samples)).estimate
        assert estimate and estimate.uncertain and estimate.rmse is not None and math.isfinite(estimate.rmse)
