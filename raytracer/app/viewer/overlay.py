"""Overlay of the window: the table of controls, notices, hints and errors, drawn by Pillow."""

from __future__ import annotations

import math
import re
import textwrap
from typing import cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from raytracer.app.viewer.events import CONTROLS, State

# Height of a letter in pixels at display scale 1: normal, and smallest.
_FONT_SIZE = 16.0
_SMALLEST = 6.0
# A letter's width by its height, the fewest letters of a line (about two words), and the most lines of a text, which
# would otherwise hide the picture.
_LETTER_WIDTH, _FEWEST_LETTERS, _MOST_LINES = 0.55, 20, 20
# The widths of the descriptions in the table of controls, in letters: the narrowest that fits into the window. With 28
# the table takes 31 % of the width of a window of 1280x720; with 80 each description has one line.
_TABLE_LETTERS = (28, 36, 48, 80)
_INK, _GROUND, _WRONG = (255, 255, 255, 255), (16, 16, 24, 208), (140, 16, 16, 232)


def draw_panels(state: State, size: tuple[int, int], scale: float) -> list[tuple[NDArray[np.uint8], tuple[int, int]]]:
    """Draw the panels over a window of `size` pixels, and return each with the position of its lower left pixel.

    `scale` is the display's scale, by which letters are enlarged. Text that does not fit is drawn smaller.
    Panels are (h, w, 4) uint8 arrays.
    """
    boxes: list[tuple[NDArray[np.uint8], tuple[int, int]]] = []
    if state.help:
        table = _controls(size, scale)
        boxes.append((table, (0, size[1] - table.shape[0])))
    width = max(_FEWEST_LETTERS, int(size[0] / (_LETTER_WIDTH * _FONT_SIZE * scale)))
    bottom = 0
    for text, ground in ((state.error, _WRONG), (state.notice, _GROUND), (state.hint, _GROUND)):
        lines = [wrapped for line in text.splitlines() for wrapped in textwrap.wrap(line, width)]
        if len(lines) > _MOST_LINES:
            lines[_MOST_LINES - 1 :] = ["... (the terminal has the full message)"]
        if lines and bottom < size[1]:
            box = _fit_box(["\n".join(lines)], (size[0], size[1] - bottom), scale, ground)
            boxes.append((box, (0, bottom)))
            bottom += box.shape[0]
    return boxes


def _controls(size: tuple[int, int], scale: float) -> NDArray[np.uint8]:
    """Draw the table of controls as narrow as the window's height allows, so that it hides little of the picture."""
    columns: list[str] = []
    for letters in _TABLE_LETTERS:
        rows = [(control.key, textwrap.wrap(control.effect, letters)) for control in CONTROLS]
        columns = ["\n".join(key + "\n" * (len(lines) - 1) for key, lines in rows)]
        columns += ["\n".join(line for _, lines in rows for line in lines)]
        if _draw_box(columns, _FONT_SIZE * scale, _GROUND).shape[0] <= size[1]:
            break
    return _fit_box(columns, size, scale, _GROUND)


def _fit_box(columns: list[str], size: tuple[int, int], scale: float, ground: tuple[int, ...]) -> NDArray[np.uint8]:
    letter = _FONT_SIZE * scale
    while True:
        box = _draw_box(columns, letter, ground)
        excess = max(box.shape[1] / size[0], box.shape[0] / size[1])
        if excess <= 1.0 or letter <= _SMALLEST:
            return box[: size[1], : size[0]]
        letter = max(_SMALLEST, min(letter - 0.5, letter / excess))


def draw_label(state: State, scale: float) -> NDArray[np.uint8]:
    """Draw the text beside the selected light's marker: an (h, w, 4) uint8 array."""
    return _draw_box(
        [f"light {state.light + 1}" if len(state.scene.lights) > 1 else "light"], _FONT_SIZE * scale, _GROUND
    )


def _draw_box(columns: list[str], letter: float, ground: tuple[int, ...]) -> NDArray[np.uint8]:
    """Draw columns of text side by side on a coloured ground."""
    font = cast("ImageFont.FreeTypeFont", ImageFont.load_default(letter))  # with a size, it is a FreeType font
    pad, line = round(0.6 * letter), math.ceil(font.getbbox("A")[3]) + round(0.3 * letter)
    gap = math.ceil(letter / 8.0)
    texts = [[_place_pieces(text, font, gap) for text in column.split("\n")] for column in columns]
    widths = [max(width for _, width in rows) + 2 * pad for rows in texts]
    ascent, descent = font.getmetrics()
    height = line * (max(map(len, texts)) - 1) + ascent + descent + 2 * pad
    image = Image.new("RGBA", (sum(widths), height), ground)
    draw = ImageDraw.Draw(image)
    left = pad
    for rows, width in zip(texts, widths, strict=True):
        for k, (pieces, _) in enumerate(rows):
            for x, piece in pieces:
                draw.text((left + x, pad + k * line), piece, _INK, font)
        left += width
    return np.asarray(image)


def _place_pieces(text: str, font: ImageFont.FreeTypeFont, gap: int) -> tuple[list[tuple[int, str]], int]:
    """Split a line of text into pieces, and return each with its x position, and the line's width.

    Two dashes get a gap between them, because this font draws them as one.
    """
    pieces: list[tuple[int, str]] = []
    x = 0
    for piece in re.split(r"(?<=-)(?=-)", text):
        pieces.append((x, piece))
        x += math.ceil(font.getlength(piece)) + gap
    return pieces, x - gap
