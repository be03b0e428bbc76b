"""The stopping rule of blocks, on arrays without OpenGL."""

from __future__ import annotations

import numpy as np

from raytracer.rendering.pixel_blocks import Blocks, surrounding_area
from raytracer.rendering.stopping_rule import (
    FIRST,
    NEXT,
    choose_blocks,
    chooses_blocks,
    is_choice_due,
    is_surely_below,
)
from raytracer.scene.options import SamplingOptions

ALL = np.ones((2, 3), bool)


def test_is_surely_below_has_a_larger_margin_with_fewer_samples() -> None:
    assert is_surely_below(1.0, 0.9, 8) and not is_surely_below(1.0, 0.9, 4)
    assert is_surely_below(1.0, 0.7, 4) and not is_surely_below(1.0, 0.1, 2)
    assert not is_surely_below(1.0, 0.1, 7) and is_surely_below(1.0, 0.1, 12)


def test_choices_are_due_after_the_first_samples_and_at_powers_of_two() -> None:
    threshold, error = SamplingOptions(samples=64, adaptive=0.1), SamplingOptions(samples=64, max_error=0.1)
    assert [n for n in range(1, 65) if is_choice_due(threshold, n)] == [FIRST, 8, 16, 32, 64]
    assert [n for n in range(1, 65) if is_choice_due(error, n)] == [4, 8, 16, 32, 64]
    for options in (SamplingOptions(samples=64), SamplingOptions(samples=64, time=1.0, sequence="r2")):
        assert not chooses_blocks(options) and not any(is_choice_due(options, n) for n in range(1, 65))


def test_active_blocks_above_the_threshold_continue() -> None:
    active = np.array([[True, True, False], [True, True, True]])
    errors = np.array([[0.2, 0.1, 0.9], [0.0, 0.11, 0.3]])
    options = SamplingOptions(samples=64, adaptive=0.1)
    choice = choose_blocks(options, active, errors, None, spare=None, pixels=96, growth=8.0)
    np.testing.assert_array_equal(choice.active, [[True, False, False], [False, True, True]])


def test_blocks_stop_after_they_held_a_negligible_error_twice() -> None:
    options = SamplingOptions(
        samples=64, max_error=0.1
    )  # with 96 pixels the squared error may be 2.88, of which 5 % may remain in stopped blocks
    squared_errors = np.array([[1.0, 0.07, 0.07], [0.07, 0.0, 0.5]])
    errors = np.sqrt(squared_errors)
    first = choose_blocks(options, ALL, errors, squared_errors, spare=None, pixels=96, growth=8.0)
    spare = np.array([[False, True, True], [False, True, False]])
    np.testing.assert_array_equal(first.active, ALL)
    assert first.spare is not None
    np.testing.assert_array_equal(first.spare, spare)
    then = choose_blocks(options, ALL, errors, squared_errors, spare=first.spare, pixels=96, growth=4.0)
    np.testing.assert_array_equal(then.active, ~spare)
    # The stopped blocks already hold as much error as is allowed.
    last = choose_blocks(options, then.active, errors, squared_errors, spare=then.spare, pixels=96, growth=2.0)
    np.testing.assert_array_equal(last.active, then.active)


def test_no_block_stops_if_the_candidates_hold_too_much_error_together() -> None:
    options = SamplingOptions(samples=64, max_error=0.1)
    squared_errors = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.3]])
    errors = np.sqrt(squared_errors)
    choice = choose_blocks(options, ALL, errors, squared_errors, spare=ALL, pixels=96, growth=4.0)
    np.testing.assert_array_equal(choice.active, ALL)


def test_with_a_time_limit_the_error_reachable_in_that_time_counts() -> None:
    options = SamplingOptions(samples=NEXT**3, time=1.0)
    squared_errors = np.array([[1.0, 0.01, 0.0], [0.0, 0.0, 1.0]])
    spare = squared_errors < 0.1
    for growth, stop in ((1.0, True), (6.0, False)):
        choice = choose_blocks(options, ALL, squared_errors, squared_errors, spare=spare, pixels=96, growth=growth)
        assert choice.active[0, 1] != stop and not choice.active[1, 0]


def test_blocks_are_immutable_values() -> None:
    blocks = Blocks.make_all((16, 32, 20, 16), np.array([[True, True]]))
    some = blocks.active.copy()
    some[:, :4] = False
    narrowed = blocks.add_samples(1).narrow(some).add_samples(1)
    assert blocks.is_whole and not narrowed.is_whole and blocks.active.all() and not blocks.samples.any()
    assert narrowed.cells.tolist() == [[False, True]] and np.unique(narrowed.samples).tolist() == [1, 2]
    samples = narrowed.samples_in((30, 40, 6, 2))
    assert samples.tolist() == [[1, 1, 2, 2, 2, 2]] * 2
    np.testing.assert_array_equal(narrowed.divisors_in((30, 40, 6, 2)), samples[..., None].repeat(3, axis=2))
    assert narrowed.part((30, 40, 6, 2)) == (slice(2, 3), slice(3, 5))


def test_blocks_around_a_tile_are_active_until_some_blocks_stop() -> None:
    size = 70, 40
    blocks = Blocks.make_all((0, 0, *size), np.arange(15).reshape(3, 5) != 8).add_samples(2)
    tile = 32, 16, 16, 16
    around = blocks.surround(tile, surrounding_area(tile, (0, 0, *size)))
    assert around.area == (16, 0, 48, 40) and around.is_whole and around.active.all() and (around.samples == 2).all()
    assert around.cells.tolist() == [[True] * 3, [True, True, False], [True] * 3]
    active = blocks.active.copy()
    active[4, 8] = active[0, 0] = False
    around = blocks.narrow(active).surround(tile, surrounding_area(tile, (0, 0, *size)))
    assert not around.is_whole and around.cells.tolist() == [[False] * 3, [False, True, False], [False] * 3]
    np.testing.assert_array_equal(around.active[around.block_slices(tile)], active[blocks.block_slices(tile)])
    assert around.active.sum() == 15


def test_an_empty_cell_is_not_measured_once_some_blocks_have_stopped() -> None:
    blocks = Blocks.make_all((0, 0, 32, 32), np.array([[True, False], [True, True]]))
    active = blocks.active.copy()
    active[0, 0] = False
    assert blocks.narrow(active).cells.tolist() == [[True, False], [True, True]]


def test_a_tile_is_surrounded_by_whole_cells_within_the_picture() -> None:
    whole = (0, 0, 100, 50)
    assert surrounding_area((32, 16, 16, 16), whole) == (16, 0, 48, 48)
    assert surrounding_area(whole, whole) == whole
    assert surrounding_area((33, 17, 2, 2), whole) == (16, 0, 32, 32)
    assert surrounding_area((32, 16, 16, 16), (32, 16, 60, 20)) == (32, 16, 32, 20), "nothing beyond the bounds"
