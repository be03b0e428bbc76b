"""Contact sheets: small pictures are means of the radiance, and labels stay within their columns."""

import io

import numpy as np
import pytest
from PIL import Image, ImageFont

from raytracer.formats.contact_sheet import (
    Cell,
    choose_cells,
    count_columns,
    fit_text,
    reduce_picture,
    small_side,
    write_sheet,
)

LINES = ("0003.png", "radius = 0.5", "shapes.ball.sphere.radius = 12345.6789", "materials.gold.model = cook_torrance")


def sheet(count: int, shape: tuple[int, int], lines: tuple[str, ...] = LINES) -> np.ndarray:
    columns = count_columns(count)
    picture = reduce_picture(np.full((*shape, 3), 0.5), small_side(columns))
    file = io.BytesIO()
    write_sheet(file, [Cell(picture, lines)] * count, columns)
    return np.asarray(Image.open(file))


def test_a_small_picture_has_the_mean_radiance_of_the_large_one() -> None:
    checks = np.indices((64, 96)).sum(0)[..., None] % 2 * np.ones(3)  # black and white pixels
    small = reduce_picture(checks, 48)
    assert small.shape == (32, 48, 3) and (small == 188).all()  # sRGB of 0.5


def test_a_picture_that_is_small_already_stays_as_it_is() -> None:
    assert reduce_picture(np.zeros((40, 64, 3)), 320).shape == (40, 64, 3)


@pytest.mark.parametrize(("count", "shape"), [(1, (40, 64)), (1, (720, 1280)), (400, (90, 160)), (5, (300, 10))])
def test_labels_are_apart_from_pictures_and_from_each_other(count: int, shape: tuple[int, int]) -> None:
    pixels = sheet(count, shape)
    columns = count_columns(count)
    step = (pixels.shape[1] - 12) // columns
    assert pixels.shape[1] <= 4096 and pixels.shape[0] <= 8192
    gaps = [slice(i * step, i * step + 12) for i in range(columns + 1)]  # no label or picture is in the gaps
    assert all((pixels[:, gap] == 255).all() for gap in gaps)
    inked = (pixels != 255).any(axis=(1, 2))
    blocks = np.flatnonzero(np.diff(inked.astype(int)) == 1)
    rows = -(-count // columns)
    assert len(blocks) == rows * (1 + len(LINES))  # a white row of pixels between any two lines


@pytest.mark.parametrize("text", ["x" * 10**6, "shapes.ball.sphere.radius = 0.5", "\x1b[31m", "W" * 40, ""])
def test_a_line_fits_into_its_width_and_keeps_its_ends(text: str) -> None:
    font = ImageFont.load_default(13)
    line = fit_text(text, 160, font)
    assert font.getlength(line) <= 160
    assert line == text or ("..." in line and text.endswith(line[-3:])) or line == "\\x1b[31m"


def test_a_long_label_counts_the_lines_that_it_leaves_out() -> None:
    assert np.array_equal(sheet(1, (9, 9), ("a",) * 60), sheet(1, (9, 9), (*["a"] * 5, "and 55 more")))


def test_a_picture_that_is_missing_leaves_an_empty_frame() -> None:
    file = io.BytesIO()
    write_sheet(file, [Cell(None, ("refused",))], 1)
    assert len(np.unique(np.asarray(Image.open(file))[:80])) == 2


def test_a_sheet_shows_all_pictures_or_400_at_equal_distances() -> None:
    assert choose_cells(400) == [*range(400)]
    chosen = choose_cells(1000)
    assert len(chosen) == 400 and chosen[0] == 0 and chosen[-1] == 997 and max(np.diff(chosen)) == 3


@pytest.mark.parametrize(
    ("count", "across", "columns"), [(6, None, 3), (6, 2, 2), (6, 3, 3), (60, 2, 8), (60, 30, 8), (1, None, 1)]
)
def test_the_columns_are_the_requested_ones_if_a_screen_shows_them(
    count: int, across: int | None, columns: int
) -> None:
    assert count_columns(count, across) == columns
