"""The converged reference, and what it says of its own error, against closed forms; its cache; its command."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer import processes, reference, truth_cache
from raytracer import truth as module
from raytracer.cli import main
from raytracer.film import Image
from raytracer.settings import Settings
from raytracer.truth import truth

from . import scenes

SHINING = rt.Material("lambert", rho=0, le=1)
WHITE = rt.Material(ka=(0, 0, 0), kd=(1, 1, 1), ks=(0, 0, 0))
SIZE = (48, 32)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where truths are kept during a test."""
    monkeypatch.setenv("RAYTRACER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def edge(angle: float = 0.3, offset: float = 0.2) -> rt.Scene:
    """The shining part cos(angle) x + sin(angle) y <= offset of the plane z = 0, before black, seen from (0, 0, 5)."""
    side = rt.Plane((math.cos(angle), math.sin(angle), 0), offset, SHINING)
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=40)
    return rt.Scene([rt.Plane((0, 0, 1), 0, SHINING) & side], [], camera, background=(0, 0, 0))


def coverage(size: tuple[int, int], angle: float = 0.3, offset: float = 0.2) -> np.ndarray:
    """How much of each pixel edge() covers, (H, W): the area of a square that a line cuts off."""
    width, height = size
    pixel = 2.0 * 5.0 * math.tan(math.radians(20)) / height  # on the plane z = 0
    x, y = np.meshgrid((np.arange(width) - width / 2) * pixel, (height / 2 - 1 - np.arange(height)) * pixel)
    a, b = math.cos(angle), math.sin(angle)
    c = (offset - a * x - b * y) / pixel  # from the pixel's corner at the lower left: a u + b v <= c
    squares = (sign * np.maximum(c - part, 0.0) ** 2 for part, sign in ((0, 1), (a, -1), (b, -1), (a + b, 1)))
    return sum(squares) / (2.0 * a * b)  # pyright: ignore[reportReturnType]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def stated(image: Image) -> np.ndarray:
    assert image.error is not None
    return image.error


@pytest.mark.parametrize(("samples", "tolerance"), [(16, 0.0), (256, 0.0), (1024, 5e-3)])
def test_an_edges_pixels_are_covered_as_computed_and_off_by_what_is_stated(samples: int, tolerance: float) -> None:
    size = (240, 160)
    image = truth(edge(), size, samples=samples, tolerance=tolerance)
    assert image.radiance.dtype == np.float64 and image.samples is not None
    off = image.radiance[..., 0] - coverage(size)
    print(
        samples,
        tolerance,
        rms(off),
        rms(stated(image)),
        rms(off) / rms(stated(image)),
        image.samples.min(),
        image.samples.max(),
        image.samples.mean(),
        stated(image).max(),
    )
    # 190 pixels or so are cut, each with 3 or more degrees of freedom: such a ratio is known to 10 %.
    assert rms(off) == pytest.approx(rms(stated(image)), rel=0.25)
    assert rms(off) < 2.0 * samples**-0.75 * 0.1
