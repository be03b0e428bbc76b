"""The figure of where two pictures differ, with its colour scale: `raytracer compare -o`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.figures import new_figure, save_figure, set_text
from raytracer.analysis.image_difference import Comparison, size_text
from raytracer.core.output import Writer, write_atomically
from raytracer.formats.radiance import PictureRows, row_blocks

# The ends of the colour scale, in linear radiance: far less than 8 bits can show, and white. The ends are fixed, so
# that figures can be compared with each other.
DARKEST, BRIGHTEST = 1e-4, 1.0
# Perceptually uniform, and black where pictures agree.
COLOR_MAP = "magma"
QUANTITY = "largest difference of the three channels\n(linear radiance)"
# Inches: the largest area of the picture, its margins (left, right, bottom, top), and the least size of a figure, in
# which its title and its colour bar have room.
_AREA = (9.0, 6.75)
_MARGINS = (0.75, 1.45, 0.65, 0.85)
_LEAST_SIZE = (7.0, 4.0)
# Pixels along the longer side of the picture in a .png. Smaller pictures are magnified, larger ones are reduced: the
# text of the figure is legible at these sizes.
_COARSEST, _FINEST = 1350, 2400
# Letters of a file name in the title, of which two fit into the narrowest figure.
_LONGEST_NAME = 28


def difference_colors(difference: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the colours of differences (H, W) as sRGB (H, W, 3)."""
    from matplotlib import colormaps

    return colormaps[COLOR_MAP](_scale()(difference), bytes=True)[..., :3]


def color_bar() -> Any:
    """Return a figure of the colour scale alone."""
    from matplotlib.cm import ScalarMappable

    figure = new_figure(5.0, 0.8)
    bar = figure.colorbar(
        ScalarMappable(_scale(), COLOR_MAP), cax=figure.add_subplot(), extend="both", format="{x:g}", location="bottom"
    )
    bar.set_label(QUANTITY.replace("\n", " "), fontsize=8)
    bar.ax.tick_params(labelsize=8)
    return figure


def write_difference(
    path: Path,
    pictures: tuple[PictureRows, PictureRows],
    names: tuple[str, str],
    comparison: Comparison,
    note: str = "",
    write: Writer = write_atomically,
) -> None:
    """Write a figure of where a picture differs from a reference.

    Args:
        path: A file that ends in one of figures.SUFFIXES.
        pictures: The picture and the reference, of one size.
        names: The files of both, for the title.
        comparison: The measured differences, for the title.
        note: More text for the title.
        write: Opens the file.
    """
    from matplotlib.cm import ScalarMappable

    height, width, _ = pictures[0].shape
    difference = _largest_of_blocks(*pictures, math.ceil(max(width, height) / _FINEST))
    rows, columns = difference.shape
    inches = min(_AREA[0] / width, _AREA[1] / height)
    wide, high = max(inches * width, 0.1), max(inches * height, 0.1)
    times = math.ceil(_COARSEST / max(rows, columns))
    dots = max(times * columns / wide, times * rows / high)
    left, right, below, above = _MARGINS
    total = max(left + wide + right, _LEAST_SIZE[0]), max(below + high + above, _LEAST_SIZE[1])
    figure = new_figure(*total, layout=None)
    figure.set_dpi(dots)
    # At whole dots, so that all pixels of the picture get the same number of dots.
    left = round((total[0] - wide - right + left) / 2.0 * dots) / dots
    below = round((total[1] - high - above + below) / 2.0 * dots) / dots
    axes = figure.add_axes((left / total[0], below / total[1], wide / total[0], high / total[1]))
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    axes.imshow(difference_colors(difference), extent=extent, interpolation="nearest", aspect="auto")
    axes.set_xlabel("x (pixels from the left)", fontsize=9)
    axes.set_ylabel("y (pixels from the top)", fontsize=9)
    axes.tick_params(labelsize=8)
    for axis, length in ((axes.xaxis, wide), (axes.yaxis, high)):
        axis.get_major_locator().set_params(integer=True, min_n_ticks=1, nbins=6 if length > 2.0 else 1)
        if length < 0.3:  # labels would overlap
            axis.set_ticks([])
    tall = total[1] - _MARGINS[2] - above
    bar = figure.colorbar(
        ScalarMappable(_scale(), COLOR_MAP),
        cax=figure.add_axes(((left + wide + 0.2) / total[0], _MARGINS[2] / total[1], 0.2 / total[0], tall / total[1])),
        extend="both",
        format="{x:g}",
    )
    bar.set_label(QUANTITY, fontsize=8)
    bar.ax.tick_params(labelsize=8)
    _write_title(figure, names, comparison, f"{size_text(pictures[0])} pixels{note}")
    save_figure(figure, path, f"difference between {names[0]} and reference {names[1]}", write)


def _write_title(figure: Any, names: tuple[str, str], comparison: Comparison, note: str) -> None:
    height = figure.get_size_inches()[1]
    x, y = comparison.pixel
    place = f" at ({x}, {y})" if comparison.largest else ""
    a, b = (name if len(name) <= _LONGEST_NAME else f"...{name[3 - _LONGEST_NAME :]}" for name in names)
    for inches, size, text in (
        (0.22, 10, f"Difference between {a} and reference {b}"),
        (0.46, 9, f"RMSE {comparison.rmse:.3g}; largest difference {comparison.largest:.3g}{place}"),
        (0.68, 8, note),
    ):
        set_text(figure.text(0.5, 1.0 - inches / height, "", fontsize=size, ha="center", va="center"), text)


def _scale() -> Any:
    from matplotlib.colors import LogNorm

    return LogNorm(DARKEST, BRIGHTEST, clip=True)


def _largest_of_blocks(a: PictureRows, b: PictureRows, side: int) -> NDArray[np.float32]:
    """Return the largest channel difference in each square of `side` pixels. An average would hide single pixels."""
    height, width, _ = a.shape
    result = np.zeros((-(-height // side), -(-width // side)), np.float32)
    for rows in row_blocks(a.shape):
        off = np.abs(np.asarray(a[rows], np.float64) - b[rows]).max(axis=2)
        off = np.maximum.reduceat(np.minimum(off, BRIGHTEST), np.arange(0, width, side), axis=1)
        np.maximum.at(result, np.arange(rows.start, rows.start + len(off)) // side, off.astype(np.float32))
    return result
