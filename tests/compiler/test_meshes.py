"""The rectangles of objects of common shapes: on which squares of a picture they lie."""

import math

import numpy as np

import raytracer as rt
from raytracer.compiler.meshes import cells_under, touching, which_touch
from tests.compiled import frame

ROWS, COLUMNS, SIDE = 9, 13, 4


def random_rectangles(count: int) -> np.ndarray:
    """(N, 4): first column and row of pixels, and behind the last, in a picture of ROWS x COLUMNS squares."""
    rng = np.random.default_rng(4)
    ends = rng.integers(0, (SIDE * COLUMNS, SIDE * ROWS), (2, count, 2))
    return np.column_stack([ends.min(axis=0), ends.max(axis=0) + 1]).astype(np.int32)


def pixels_of(rectangle: np.ndarray) -> np.ndarray:
    """(rows, columns): which pixels of the picture are in it."""
    x0, y0, x1, y1 = rectangle
    y, x = np.mgrid[: SIDE * ROWS, : SIDE * COLUMNS]
    return (x0 <= x) & (x < x1) & (y0 <= y) & (y < y1)


def test_the_cells_under_rectangles_are_those_with_a_pixel_of_one() -> None:
    for count in (0, 1, 3, 8):
        rectangles = random_rectangles(count)
        found = cells_under(rectangles, (ROWS, COLUMNS), SIDE)
        pixels = np.zeros((SIDE * ROWS, SIDE * COLUMNS), bool)
        for rectangle in rectangles:
            pixels |= pixels_of(rectangle)
        np.testing.assert_array_equal(found, pixels.reshape(ROWS, SIDE, COLUMNS, SIDE).any(axis=(1, 3)))


def test_a_rectangle_touches_squares_that_share_a_pixel_with_it() -> None:
    rng = np.random.default_rng(6)
    rectangles = random_rectangles(60)
    for corner in ((0, 0), (8, 16)):
        rows, columns = ROWS - corner[1] // SIDE - 1, COLUMNS - corner[0] // SIDE - 2
        squares = rng.random((rows, columns)) < 0.1
        whole = np.zeros((SIDE * ROWS, SIDE * COLUMNS), bool)
        drawn = squares.repeat(SIDE, axis=0).repeat(SIDE, axis=1)
        whole[corner[1] : corner[1] + drawn.shape[0], corner[0] : corner[0] + drawn.shape[1]] = drawn
        expected = [bool((pixels_of(rectangle) & whole).any()) for rectangle in rectangles]
        assert which_touch(rectangles, squares, corner, SIDE).tolist() == expected and 0 < sum(expected) < 60


def test_a_rectangle_touches_an_area_if_they_share_a_pixel() -> None:
    rectangles = random_rectangles(60)
    for x, y, width, height in ((0, 0, 20, 10), (17, 9, 3, 30), (30, 18, 1, 1)):
        expected = [bool(pixels_of(rectangle)[y : y + height, x : x + width].any()) for rectangle in rectangles]
        assert touching(rectangles, (x, y, width, height)).tolist() == expected and 0 < sum(expected) < 60


def test_a_lens_has_the_rectangle_that_its_balls_share_of_that_around_it() -> None:
    # Far away, so that tangents are all but orthogonal: the lens is 0.2 wide and 2 sqrt(1 - 0.9^2) high.
    lens = rt.Sphere((-0.9, 0, 0), 1) & rt.Sphere((0.9, 0, 0), 1)
    scene = rt.Scene([lens] * 8, [], rt.Camera((0, 0, 1e4), (0, 0, 0), vertical_fov=math.degrees(2e-4)))
    found = frame(scene, (1000, 1000)).rectangles  # 500 pixels for 1
    assert found.shape == (8, 8)
    half = np.array([0.1, math.sqrt(1 - 0.9**2)])
    np.testing.assert_allclose(found[:, :4], np.tile(500 + 500 * np.concatenate([-half, half]), (8, 1)), atol=1.1)
