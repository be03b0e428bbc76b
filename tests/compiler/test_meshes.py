"""The rectangles of objects of common shapes: the squares of the picture that each rectangle touches."""

import math

import numpy as np

import raytracer as rt
from raytracer.compiler.meshes import cells_under, touches_area, touches_squares
from tests.compiled import frame

ROWS, COLUMNS, SIDE = 9, 13, 4


def random_rectangles(count: int) -> np.ndarray:
    """Return rectangles in a picture of ROWS x COLUMNS squares: first column and row, end column and row [N, 4]."""
    rng = np.random.default_rng(4)
    ends = rng.integers(0, (SIDE * COLUMNS, SIDE * ROWS), (2, count, 2))
    return np.column_stack([ends.min(axis=0), ends.max(axis=0) + 1]).astype(np.int32)


def pixel_mask(rectangle: np.ndarray) -> np.ndarray:
    """Return a mask of the picture's pixels inside the rectangle [rows, columns]."""
    x0, y0, x1, y1 = rectangle
    y, x = np.mgrid[: SIDE * ROWS, : SIDE * COLUMNS]
    return (x0 <= x) & (x < x1) & (y0 <= y) & (y < y1)


def test_the_cells_under_rectangles_are_the_cells_with_a_pixel_of_a_rectangle() -> None:
    for count in (0, 1, 3, 8):
        rectangles = random_rectangles(count)
        covered = cells_under(rectangles, (0, 0, COLUMNS, ROWS), SIDE)
        pixels = np.zeros((SIDE * ROWS, SIDE * COLUMNS), bool)
        for rectangle in rectangles:
            pixels |= pixel_mask(rectangle)
        np.testing.assert_array_equal(covered, pixels.reshape(ROWS, SIDE, COLUMNS, SIDE).any(axis=(1, 3)))
        some = cells_under(rectangles, (2, 3, COLUMNS - 4, ROWS - 5), SIDE)
        np.testing.assert_array_equal(some, covered[3 : ROWS - 2, 2 : COLUMNS - 2], "only the cells of a part")


def test_a_rectangle_touches_squares_that_share_a_pixel_with_it() -> None:
    rng = np.random.default_rng(6)
    rectangles = random_rectangles(60)
    for corner in ((0, 0), (8, 16)):
        rows, columns = ROWS - corner[1] // SIDE - 1, COLUMNS - corner[0] // SIDE - 2
        squares = rng.random((rows, columns)) < 0.1
        whole = np.zeros((SIDE * ROWS, SIDE * COLUMNS), bool)
        drawn = squares.repeat(SIDE, axis=0).repeat(SIDE, axis=1)
        whole[corner[1] : corner[1] + drawn.shape[0], corner[0] : corner[0] + drawn.shape[1]] = drawn
        expected = [bool((pixel_mask(rectangle) & whole).any()) for rectangle in rectangles]
        assert touches_squares(rectangles, squares, corner, SIDE).tolist() == expected and 0 < sum(expected) < 60


def test_a_rectangle_touches_an_area_if_they_share_a_pixel() -> None:
    rectangles = random_rectangles(60)
    for x, y, width, height in ((0, 0, 20, 10), (17, 9, 3, 30), (30, 18, 1, 1)):
        expected = [bool(pixel_mask(rectangle)[y : y + height, x : x + width].any()) for rectangle in rectangles]
        assert touches_area(rectangles, (x, y, width, height)).tolist() == expected and 0 < sum(expected) < 60


def test_the_rectangle_of_a_lens_encloses_only_the_intersection_of_its_spheres() -> None:
    # The camera is so far away that the tangents are almost parallel to its axis. The lens is 0.2 wide and
    # 2 sqrt(1 - 0.9^2) high.
    lens = rt.Sphere((-0.9, 0, 0), 1) & rt.Sphere((0.9, 0, 0), 1)
    scene = rt.Scene([lens] * 8, [], rt.Camera((0, 0, 1e4), (0, 0, 0), vertical_fov=math.degrees(2e-4)))
    rectangles = frame(scene, (1000, 1000)).rectangles  # 500 pixels per unit of length
    assert rectangles.shape == (8, 8)
    half = np.array([0.1, math.sqrt(1 - 0.9**2)])
    np.testing.assert_allclose(rectangles[:, :4], np.tile(500 + 500 * np.concatenate([-half, half]), (8, 1)), atol=1.1)
