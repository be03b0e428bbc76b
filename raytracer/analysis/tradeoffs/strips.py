"""Picture strips: the piece of the picture where errors are largest, by several techniques, magnified."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.image_difference import difference
from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs, time_picture
from raytracer.formats.image import Image
from raytracer.rendering.renderer import Renderer

# Pixels of the piece that is shown, and how many times larger.
_PIECE, _TIMES = (40, 30), 6
# Of what strips have in common: as much as Sobol' samples of this number.
_SAMPLES = 16
# By how much what is about the same may differ.
_ABOUT = 1.2


class Tile(NamedTuple):
    """A picture of a strip: its heading, what is said below it, and PNG files of the piece and of its differences."""

    heading: str
    text: str
    png: bytes | None = None
    difference: bytes | None = None


def strips(trade: Tradeoffs, renderer: Renderer) -> dict[str, list[Tile]]:
    """By their titles; none where what they are about was not measured."""
    results = trade.of(MAIN)
    common = next((r for r in results if r.configuration.label == f"{_SAMPLES} sobol"), None)
    if common is None:
        sobol = [r for r in trade.of_knob("samples") if r.samples > 1]
        common = max(sobol, key=lambda result: result.samples, default=None)
    if common is None or common.error is None:
        return {}
    show = _Shown(trade, renderer, common)
    seconds, error = _ABOUT * common.median, _ABOUT * common.error.rmse
    families = _families(trade, results)
    return {
        f"Equal time: the least wrong of each within {1e3 * seconds:.0f} ms": [
            show.reference(),
            *_chosen(
                families,
                lambda r: r.median <= seconds,
                lambda r: _rmse(r),
                show,
                f"none within {1e3 * seconds:.0f} ms",
            ),
        ],
        f"Equal error: the fastest of each with an error of {error:.2g} or less": [
            show.reference(),
            *_chosen(families, lambda r: _rmse(r) <= error, lambda r: r.median, show, "none as good"),
        ],
    }


def _rmse(result: Result) -> float:
    return result.error.rmse if result.error else np.inf


def _families(trade: Tradeoffs, results: Sequence[Result]) -> dict[str, list[Result]]:
    """The techniques that are compared, and their configurations."""
    plain = [r for r in results if r.configuration.scale == 1.0 and not r.configuration.settings.sampling.is_adaptive]
    families = {f"sequence {name}": [] for name in dict.fromkeys(r.configuration.settings.sequence for r in plain)}
    for result in plain:
        families[f"sequence {result.configuration.settings.sequence}"].append(result)
    families["adaptive"] = [r for r in results if r.configuration.settings.adaptive is not None]
    families["max error"] = [r for r in results if r.configuration.settings.max_error is not None]
    for scale in dict.fromkeys(r.configuration.scale for r in trade.of_knob("resolution", MAIN)):
        if scale != 1.0:
            families[f"resolution x {scale:g}"] = [r for r in results if r.configuration.scale == scale]
    return {name: own for name, own in families.items() if own}


def _chosen(
    families: dict[str, list[Result]],
    fits: Callable[[Result], bool],
    cost: Callable[[Result], float],
    show: _Shown,
    missing: str,
) -> list[Tile]:
    tiles = []
    for name, results in families.items():
        best = min(filter(fits, results), key=cost, default=None)
        tiles.append(show.tile(name, best) if best else Tile(name, missing))
    return tiles


class _Shown:
    """Cuts the piece out of pictures: that in which `common` is most wrong."""

    def __init__(self, trade: Tradeoffs, renderer: Renderer, common: Result) -> None:
        self._trade, self._renderer = trade, renderer
        self._reference = trade.references[MAIN].radiance
        off = ((self._picture(common) - self._reference) ** 2).sum(axis=2)
        height, width = off.shape
        self._side = min(_PIECE[0], width), min(_PIECE[1], height)
        sums = np.pad(off.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        w, h = self._side
        boxes = sums[h:, w:] - sums[:-h, w:] - sums[h:, :-w] + sums[:-h, :-w]
        self._y, self._x = (int(k) for k in np.unravel_index(boxes.argmax(), boxes.shape))

    def _picture(self, result: Result) -> NDArray[np.float64]:
        target = self._trade.plan.targets[MAIN]
        return time_picture(result.configuration, target, self._renderer, self._trade.size)[0].radiance.astype(
            np.float64
        )

    def _cut(self, radiance: NDArray[np.float64]) -> NDArray[np.float64]:
        return radiance[self._y : self._y + self._side[1], self._x : self._x + self._side[0]]

    def reference(self) -> Tile:
        """The tile of the reference."""
        piece = self._cut(self._reference)
        place = f"{self._side[0]}x{self._side[1]} pixels from ({self._x}, {self._y}), {_TIMES} times as large"
        return Tile("reference", place, _png(piece), _png(difference(piece, piece).radiance))

    def tile(self, name: str, result: Result) -> Tile:
        piece = self._cut(self._picture(result))
        text = f"{result.configuration.label}: {1e3 * result.median:.1f} ms, error {_rmse(result):.2g}"
        return Tile(name, text, _png(piece), _png(difference(piece, self._cut(self._reference)).radiance))


def _png(radiance: NDArray[np.float64]) -> bytes:
    """Each pixel as a square of pixels."""
    large = radiance.repeat(_TIMES, axis=0).repeat(_TIMES, axis=1)
    return Image(np.ascontiguousarray(large)).png()
