"""Comparison of GPU pictures with float64 pictures: wrong pixels, and the errors of all other pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.pixel_doubt import PixelDoubt, find_pixel_doubt
from raytracer.formats.image import Image
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.material import Material
from raytracer.scene.options import Evaluator
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Materials without ambient light and highlights: black where no light reaches, and only there.
MATTE = tuple(
    Material(ka=(0, 0, 0), kd=kd, ks=(0, 0, 0))
    for kd in ((0.8, 0.1, 0.1), (0.1, 0.2, 0.9), (0.1, 0.8, 0.2), (0.6, 0.6, 0.6))
)


@dataclass(frozen=True)
class PixelErrors:
    """The errors of a picture of one sample against float64. Sure pixels are pixels that are not doubtful.

    Errors of depth, normal and radiance are errors of sure pixels.
    """

    wrong: int  # number of sure pixels that show another material, or none
    doubtful: float  # number of doubtful pixels over the number of pixels that show something
    lit: int  # number of sure pixels with a wrong shadow, or without a shadow that should be there
    unlit: float  # share of sure hit pixels with a doubtful shadow
    wrong_or_doubtful: int  # number of pixels that are wrong in either way, doubtful or not
    shown: int  # number of pixels that show something
    dark: int  # number of sure pixels that are falsely dark
    dark_in_fact: int  # number of pixels that are falsely dark, doubtful or not
    bad: int  # number of values that are not finite (except the background's depth), and of negative radiances
    depth_share: float  # largest error of the depth over its bound
    depth_median: tuple[float, float]  # median error, and median bound, in units in the last place of the depth
    depth_largest: tuple[float, float]
    normal_share: float
    radiance_share: float


def measure_pixel_errors(renderer: Renderer, scene: Scene, size: tuple[int, int], settings: Settings) -> PixelErrors:
    """Compare a picture of `scene` with the picture of the float64 ray tracer.

    Shadows are compared by black pixels: the scene must have a single light and only MATTE materials.
    """
    image = renderer.render(scene, size, settings)
    exact = ray_tracer.trace(scene, size, settings)
    return compare_pictures(image, exact, find_pixel_doubt(scene, size, settings.precision))


def compare_pictures(image: Image, exact: Image, pixel_doubt: PixelDoubt) -> PixelErrors:
    """Compare a picture with the float64 ray tracer's picture, as measure_pixel_errors()."""
    assert image.depth is not None and image.normal is not None and image.material is not None
    assert exact.depth is not None and exact.normal is not None and exact.material is not None
    sure = ~pixel_doubt.doubtful
    shown = (exact.material >= 0) | (image.material >= 0)
    other = image.material != exact.material
    is_black, is_dark = ((picture.radiance == 0.0).all(axis=2) for picture in (image, exact))
    dark = is_black != is_dark
    hit = sure & shown & ~other
    depth = np.abs(image.depth[hit] - exact.depth[hit])
    ulp, bound = (error / np.spacing(exact.depth[hit].astype(np.float32)) for error in (depth, pixel_doubt.depth[hit]))
    normal = np.linalg.norm(image.normal[hit] - exact.normal[hit], axis=1)
    same_light = hit & ~pixel_doubt.unlit
    radiance = np.abs(image.radiance - exact.radiance).max(axis=2)[same_light]
    return PixelErrors(
        wrong=int(np.sum(sure & other)),
        doubtful=float(np.sum(~sure) / max(1, np.sum(shown))),
        lit=int(np.sum(dark & same_light)),
        unlit=float(np.sum(hit & pixel_doubt.unlit) / max(1, np.sum(hit))),
        wrong_or_doubtful=int(np.sum(other | (shown & dark))),
        shown=int(np.sum(shown)),
        dark=int(np.sum(is_black & ~is_dark & same_light)),
        dark_in_fact=int(np.sum(is_black & ~is_dark & ~other & (exact.material >= 0))),
        bad=count_invalid(image),
        depth_share=_largest(depth, pixel_doubt.depth[hit]),
        depth_median=(float(np.median(ulp)), float(np.median(bound))) if hit.any() else (0.0, 0.0),
        depth_largest=(float(ulp.max(initial=0.0)), float(bound.max(initial=0.0))),
        normal_share=_largest(normal, pixel_doubt.normal[hit]),
        radiance_share=_largest(radiance, pixel_doubt.radiance[same_light]),
    )


def count_invalid(image: Image) -> int:
    """Count the invalid values of an image: NaN, infinite or negative radiance, and depths that are not above 0."""
    assert image.depth is not None and image.normal is not None
    bad = np.sum(~(image.radiance >= 0.0) | np.isinf(image.radiance)) + np.sum(~np.isfinite(image.normal))
    return int(bad + np.sum(~(image.depth > 0.0)))


def normalize(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalize vectors (..., 3)."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _largest(error: NDArray[np.float64], bound: NDArray[np.float64]) -> float:
    """Return the largest error over its bound. An error above a bound of 0 is infinite."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nan_to_num(error / bound, nan=0.0, posinf=np.inf).max(initial=0.0))


def measure_scene(
    renderer: Renderer,
    row: str,
    at: str,
    scene: Scene,
    size: tuple[int, int],
    evaluator: Evaluator = "cells",
    doubt: float = 0.01,
    dark: float = 0.05,
    tangent: float = 0.0,
) -> Iterator[Finding]:
    """Measure a scene with all precisions.

    Args:
        renderer: the renderer
        row: name of the row
        at: place in the row's range
        scene, size, evaluator: the picture
        doubt: largest share of doubtful pixels with 32 bits; inf: 32 bits do not resolve the scene. Default: 0.01.
        dark: largest share of doubtful shadows with 32 bits; inf: 32 bits do not resolve them. Default: 0.05.
        tangent: share of pixels whose rays are exactly tangent, in doubt with any precision. Default: 0.

    With 64 bits the bounds are the defaults, and `tangent` more for pixels.
    """
    for bits in renderer.device.limits.precisions:
        errors = measure_pixel_errors(renderer, scene, size, Settings(precision=bits, evaluator=evaluator))
        yield Finding(row, at, bits, "wrong pixels", errors.wrong, 0)
        most = tangent + (doubt if bits == 32 else 0.01)
        yield Finding(row, at, bits, "doubtful pixels, of those hit", errors.doubtful, most)
        if scene.lights:
            yield Finding(row, at, bits, "wrong shadows", errors.lit, 0)
            yield Finding(row, at, bits, "doubtful shadows, of those hit", errors.unlit, dark if bits == 32 else 0.05)
            yield Finding(row, at, bits, "radiance error, share of its bound", errors.radiance_share, 1)
        yield Finding(row, at, bits, "wrong in fact, doubtful or not", errors.wrong_or_doubtful, math.inf)
        yield Finding(row, at, bits, "NaN, infinite or negative values", errors.bad, 0)
        yield Finding(row, at, bits, "depth error, ulp, median", *errors.depth_median)
        yield Finding(row, at, bits, "depth error, ulp, largest", *errors.depth_largest)
        yield Finding(row, at, bits, "depth error, share of its bound", errors.depth_share, 1)
        yield Finding(row, at, bits, "normal error, share of its bound", errors.normal_share, 1)
