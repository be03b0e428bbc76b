"""Text for the window: the table of controls, notices and errors, drawn by Pillow."""

from __future__ import annotations

import textwrap

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from raytracer.interaction import CONTROLS, State

# Of a letter, in pixels at display scale 1.
_FONT_SIZE = 16.0
_SMALLEST = 6.0
# Letters are about half as wide as high; lines shorter than some words help nobody; more lines hide the picture.
_LETTER_WIDTH, _FEWEST_LETTERS, _MOST_LINES = 0.55, 20, 20
_INK, _GROUND, _WRONG = (255, 255, 255, 255), (16, 16, 24, 208), (140, 16, 16, 232)


def panels(state: State, size: tuple[int, int], scale: float) -> list[tuple[NDArray[np.uint8], tuple[int, int]]]:
    """What is to be drawn over a window of `size` pixels: (h, w, 4) uint8 arrays and their lower left pixels.

    `scale` is the display's: at 2 a letter has twice as many pixels. Text that does not fit is drawn smaller.
    """
    found: list[tuple[NDArray[np.uint8], tuple[int, int]]] = []
    if state.help:
        columns = ["\n".join(c.key for c in CONTROLS), "\n".join(c.does for c in CONTROLS)]
        table = _fitted(columns, size, scale, _GROUND)
        found.append((table, (0, size[1] - table.shape[0])))
    width = max(_FEWEST_LETTERS, int(size[0] / (_LETTER_WIDTH * _FONT_SIZE * scale)))
    bottom = 0
    for text, ground in ((state.error, _WRONG), (state.notice, _GROUND)):
        lines = [wrapped for line in text.splitlines() for wrapped in textwrap.wrap(line, width)]
        if len(lines) > _MOST_LINES:
            lines[_MOST_LINES - 1 :] = ["... (the whole is on the terminal)"]
        if lines and bottom < size[1]:
            box = _fitted(["\n".join(lines)], (size[0], size[1] - bottom), scale, ground)
            found.append((box, (0, bottom)))
            bottom += box.shape[0]
    return found


def _fitted(columns: list[str], size: tuple[int, int], scale: float, ground: tuple[int, ...]) -> NDArray[np.uint8]:
    letter = _FONT_SIZE * scale
    while True:
        box = _box(columns, letter, ground)
        excess = max(box.shape[1] / size[0], box.shape[0] / size[1])
        if excess <= 1.0 or letter <= _SMALLEST:
            return box[: size[1], : size[0]]
        letter = max(_SMALLEST, min(letter - 0.5, letter / excess))


def _box(columns: list[str], letter: float, ground: tuple[int, ...]) -> NDArray[np.uint8]:
    """Columns of text side by side on a coloured ground."""
    font = ImageFont.load_default(letter)
    pad, spacing = round(0.6 * letter), round(0.3 * letter)
    draw = ImageDraw.Draw(Image.new("RGBA", (1, 1)))
    boxes = [draw.multiline_textbbox((0, 0), column, font, spacing=spacing) for column in columns]
    width = sum(int(box[2]) + 2 * pad for box in boxes)
    image = Image.new("RGBA", (width, max(int(box[3]) for box in boxes) + 2 * pad), ground)
    draw = ImageDraw.Draw(image)
    x = pad
    for column, box in zip(columns, boxes, strict=True):
        draw.multiline_text((x, pad), column, _INK, font, spacing=spacing)
        x += int(box[2]) + 2 * pad
    return np.asarray(image)
