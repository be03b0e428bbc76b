"""Contact sheets: many small pictures with labels below them, in one PNG picture."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from raytracer.core.shown import escape_unprintable
from raytracer.formats.srgb import encode_srgb8

# The most pictures of a sheet: a screen of 4096 pixels shows 20 x 20 of 192 pixels with legible labels.
MAX_CELLS = 400
# The most columns or rows of a layout that the caller requests.
_MOST_ACROSS = 20
# The width of a sheet that all columns share, and the largest side of a small picture, in pixels.
_WIDTH, _MAX_SIDE = 4096, 320
# The narrowest column: room for about 25 characters of a label. Smaller pictures stay as they are, centred.
_MIN_COLUMN = 160
_GAP, _FONT_SIZE, _LINE = 12, 13, 17  # pixels
# The most lines of a label. The last one then counts the others.
_MOST_LINES = 6
# The most characters of a line that are measured: no column shows more, and the time grows with their number.
_MOST_CHARACTERS = 200
_PAPER, _INK, _FAINT = (255, 255, 255), (30, 30, 30), (214, 214, 214)


class Cell(NamedTuple):
    """One picture of a sheet.

    Attributes:
        picture: small enough for the sheet, from reduce_picture(). None: there is no picture, and a frame is drawn.
        lines: the label. Too long lines lose their middle.
    """

    picture: NDArray[np.uint8] | None
    lines: Sequence[str]


def choose_cells(count: int) -> list[int]:
    """Return the indices of the pictures that a sheet of `count` pictures shows: all, or 400 at equal distances."""
    return [*range(count)] if count <= MAX_CELLS else [i * count // MAX_CELLS for i in range(MAX_CELLS)]


def count_columns(count: int, across: int | None = None) -> int:
    """Return the number of columns of a sheet.

    Args:
        count: the number of pictures on the sheet.
        across: the requested number, which is taken if there are at most 20 columns and 20 rows. Default: as many
            columns as rows.
    """
    if across and across <= _MOST_ACROSS and math.ceil(count / across) <= _MOST_ACROSS:
        return across
    return math.ceil(math.sqrt(count))


def small_side(columns: int) -> int:
    """Return the largest side of a small picture of a sheet with so many columns, in pixels."""
    return min(_MAX_SIDE, _WIDTH // columns - _GAP)


def reduce_picture(radiance: NDArray[Any], side: int) -> NDArray[np.uint8]:
    """Return a picture in sRGB that is at most `side` pixels wide and high, uint8 [h, w, 3].

    The pixels are means of the linear radiance, clipped to [0, 1]. A smaller picture stays as it is.

    Args:
        radiance: linear radiance [H, W, 3].
        side: pixels.
    """
    height, width = radiance.shape[:2]
    factor = min(1.0, side / max(height, width))
    size = max(1, round(width * factor)), max(1, round(height * factor))
    clipped = np.clip(radiance, 0.0, 1.0).astype(np.float32)
    channels = (Image.fromarray(np.ascontiguousarray(clipped[..., i])) for i in range(3))
    small = [np.asarray(channel.resize(size, Image.Resampling.BOX)) for channel in channels]
    return encode_srgb8(np.stack(small, axis=2))


def write_sheet(file: IO[bytes], cells: Sequence[Cell], columns: int) -> None:
    """Write a contact sheet as PNG.

    Args:
        file: an open binary file.
        cells: the pictures, row by row. At least one.
        columns: the number of columns, from count_columns(). Pictures are at most small_side(columns) wide and high.
    """
    font = ImageFont.load_default(_FONT_SIZE)
    shapes = [cell.picture.shape for cell in cells if cell.picture is not None]
    wide = max(_MIN_COLUMN, *(shape[1] for shape in shapes)) if shapes else _MIN_COLUMN
    high = max((shape[0] for shape in shapes), default=_MIN_COLUMN // 2)
    labels = [[fit_text(line, wide, font) for line in _first_lines(cell.lines)] for cell in cells]
    step = wide + _GAP, high + _LINE * max(map(len, labels)) + _GAP
    rows = math.ceil(len(cells) / columns)
    sheet = Image.new("RGB", (_GAP + columns * step[0], _GAP + rows * step[1]), _PAPER)
    draw = ImageDraw.Draw(sheet)
    for i, (cell, label) in enumerate(zip(cells, labels, strict=True)):
        x, y = (_GAP + place * distance for place, distance in zip((i % columns, i // columns), step, strict=True))
        if cell.picture is None:
            draw.rectangle((x, y, x + wide - 1, y + high - 1), outline=_FAINT)
        else:
            across = (wide - cell.picture.shape[1]) // 2
            sheet.paste(Image.fromarray(cell.picture), (x + across, y + high - cell.picture.shape[0]))
        for k, line in enumerate(label):
            draw.text((x + wide / 2, y + high + k * _LINE + 2), line, _INK, font, anchor="ma")
    sheet.save(file, "png")


def fit_text(text: str, width: float, font: Any) -> str:
    """Return a line of text that is at most `width` pixels wide: the text itself, or its ends with "..." between."""
    text = escape_unprintable(text)
    if len(text) <= _MOST_CHARACTERS and font.getlength(text) <= width:
        return text

    def shorten(kept: int) -> str:
        # The end, with the value of a path, is longer than the beginning.
        return f"{text[: kept // 3]}...{text[len(text) - (kept - kept // 3) :]}"

    counts = range(min(len(text), _MOST_CHARACTERS))
    return shorten(bisect_right(counts, width, key=lambda kept: font.getlength(shorten(kept))) - 1)


def _first_lines(lines: Sequence[str]) -> list[str]:
    """Return the lines of a label, or the first ones and a line that counts the others."""
    if len(lines) <= _MOST_LINES:
        return [*lines]
    return [*lines[: _MOST_LINES - 1], f"and {len(lines) - _MOST_LINES + 1} more"]
