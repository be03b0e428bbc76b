"""Picture strips: a magnified crop of the picture with the largest errors, rendered by several techniques."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from raytracer.analysis.difference_figure import difference_colors
from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs, time_picture
from raytracer.formats.srgb import encode_srgb8
from raytracer.rendering.renderer import Renderer

# The size of the crop in pixels, and its magnification: 240 pixels, the width of a picture on the page.
_CROP, _TIMES = (40, 30), 6
# Strips compare techniques at the time, and at the error, of this number of Sobol' samples.
_SAMPLES = 16
# Times and errors up to this factor count as equal: repeated times differ by 10 to 20 %.
_TOLERANCE = 1.2


class Tile(NamedTuple):
    """One picture in a strip (a row of crops): its heading, the text below, and PNG files.

    `png` is the crop, `difference` its differences from the reference; None without a picture or a reference.
    """

    heading: str
    text: str
    png: bytes | None = None
    difference: bytes | None = None


def make_strips(trade: Tradeoffs, renderer: Renderer) -> dict[str, list[Tile]]:
    """Return the strips by title. There are none if the trade lacks the measurements that they compare."""
    results = trade.results_for(MAIN)
    common = next((r for r in results if r.configuration.label == f"{_SAMPLES} sobol"), None)
    if common is None:
        sobol = [r for r in trade.results_for_knob("samples") if r.samples > 1]
        common = max(sobol, key=lambda result: result.samples, default=None)
    if common is None or common.error is None:
        return {}
    crops = _Crops(trade, renderer, common)
    seconds, error = _TOLERANCE * common.median, _TOLERANCE * common.error.rmse
    families = _families(trade, results)
    return {
        f"Equal time: the most accurate picture of each technique within {1e3 * seconds:.0f} ms": [
            crops.reference(),
            *_choose_tiles(
                families,
                lambda r: r.median <= seconds,
                lambda r: _rmse(r),
                crops,
                f"none within {1e3 * seconds:.0f} ms",
            ),
        ],
        f"Equal error: the fastest picture of each technique with an RMSE of at most {error:.2g}": [
            crops.reference(),
            *_choose_tiles(families, lambda r: _rmse(r) <= error, lambda r: r.median, crops, "none is as accurate"),
        ],
    }


def _rmse(result: Result) -> float:
    return result.error.rmse if result.error else np.inf


def _families(trade: Tradeoffs, results: Sequence[Result]) -> dict[str, list[Result]]:
    """Return the configurations of each technique."""
    plain = [r for r in results if r.configuration.scale == 1.0 and not r.configuration.settings.sampling.is_adaptive]
    families = {f"sequence {name}": [] for name in dict.fromkeys(r.configuration.settings.sequence for r in plain)}
    for result in plain:
        families[f"sequence {result.configuration.settings.sequence}"].append(result)
    families["adaptive samples"] = [r for r in results if r.configuration.settings.adaptive is not None]
    families["error limit"] = [r for r in results if r.configuration.settings.max_error is not None]
    for scale in dict.fromkeys(r.configuration.scale for r in trade.results_for_knob("resolution", MAIN)):
        if scale != 1.0:
            families[f"{scale:g} x the resolution"] = [r for r in results if r.configuration.scale == scale]
    return {name: own for name, own in families.items() if own}


def _choose_tiles(
    families: dict[str, list[Result]],
    fits: Callable[[Result], bool],
    cost: Callable[[Result], float],
    crops: _Crops,
    missing: str,
) -> list[Tile]:
    tiles = []
    for name, results in families.items():
        best = min(filter(fits, results), key=cost, default=None)
        tiles.append(crops.tile(name, best) if best else Tile(name, missing))
    return tiles


class _Crops:
    """The crops of pictures, at the place where the picture of `common` has the largest error."""

    def __init__(self, trade: Tradeoffs, renderer: Renderer, common: Result) -> None:
        self._trade, self._renderer = trade, renderer
        self._reference = trade.references[MAIN].radiance
        off = ((self._picture(common) - self._reference) ** 2).sum(axis=2)
        height, width = off.shape
        self._side = min(_CROP[0], width), min(_CROP[1], height)
        sums = np.pad(off.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        w, h = self._side
        boxes = sums[h:, w:] - sums[:-h, w:] - sums[h:, :-w] + sums[:-h, :-w]
        self._y, self._x = (int(k) for k in np.unravel_index(boxes.argmax(), boxes.shape))

    def _picture(self, result: Result) -> NDArray[np.float64]:
        target = self._trade.plan.targets[MAIN]
        return time_picture(result.configuration, target, self._renderer, self._trade.size)[0].radiance.astype(
            np.float64
        )

    def _crop(self, radiance: NDArray[np.float64]) -> NDArray[np.float64]:
        return radiance[self._y : self._y + self._side[1], self._x : self._x + self._side[0]]

    def reference(self) -> Tile:
        """Return the tile of the reference."""
        crop = self._crop(self._reference)
        place = f"{self._side[0]}x{self._side[1]} pixels from ({self._x}, {self._y}), magnified {_TIMES} times"
        return Tile("reference", place, _png(encode_srgb8(crop)), _png(_differences(crop, crop)))

    def tile(self, name: str, result: Result) -> Tile:
        """Return the tile of a configuration's picture."""
        crop = self._crop(self._picture(result))
        text = f"{result.configuration.label}: {1e3 * result.median:.1f} ms, RMSE {_rmse(result):.2g}"
        return Tile(name, text, _png(encode_srgb8(crop)), _png(_differences(crop, self._crop(self._reference))))


def _differences(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.uint8]:
    return difference_colors(np.abs(a - b).max(axis=2))


def _png(colors: NDArray[np.uint8]) -> bytes:
    """Return a PNG file of sRGB colours (H, W, 3), magnified by _TIMES."""
    large = np.ascontiguousarray(colors.repeat(_TIMES, axis=0).repeat(_TIMES, axis=1))
    file = io.BytesIO()
    Picture.fromarray(large).save(file, "png", optimize=True)
    return file.getvalue()
