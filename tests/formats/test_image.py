"""Pictures with 8 bits and as PNG files, against the standards' formulas and Pillow's reading."""

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

import raytracer as rt
from raytracer.formats.image import Image
from raytracer.formats.srgb import encode_srgb8


def test_srgb_has_the_nearest_level_on_both_sides_of_every_threshold() -> None:
    half_way = (np.arange(1, 256) - 0.5) / 255
    at = np.where(half_way < 0.04045, half_way / 12.92, ((half_way + 0.055) / 1.055) ** 2.4).astype(np.float32)
    values = np.stack([np.nextafter(at, np.float32(0)), at, np.nextafter(at, np.float32(1))])
    linear = values.astype(float)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    nearest = np.rint(curve * 255)
    assert {tuple(levels) for levels in (nearest - np.arange(255)).T} <= {(0, 0, 1), (0, 1, 1)}
    np.testing.assert_array_equal(encode_srgb8(np.stack([values] * 3, -1))[..., 0], nearest)
    assert (np.diff(at.view(np.int32) >> 16) > 0).all()  # encode_srgb8() needs different upper halves


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nan_becomes_white_and_infinities_are_clipped(dtype: type) -> None:
    values = np.array([[[np.nan, -np.nan, np.inf], [-np.inf, -0.0, 0.0]]], dtype)
    assert encode_srgb8(values).tolist() == [[[255, 255, 255], [0, 0, 0]]]


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (7, 1), (640, 200), (50_000, 2)])
def test_a_png_holds_the_picture_and_its_metadata(size: tuple[int, int]) -> None:
    width, height = size
    radiance = np.random.default_rng(1).uniform(-0.1, 1.1, (height, width, 3)).astype(np.float32)
    radiance[: height // 2] = 0.25
    image = Image(radiance, metadata={"Title": "Würfel, \u65e5\u672c", "Software": "a test"})
    file = io.BytesIO()
    image.write_png(file)
    with Pillow.open(file) as picture:
        assert picture.size == size and picture.mode == "RGB"
        np.testing.assert_array_equal(np.asarray(picture), image.srgb8())
        assert picture.info == dict(image.metadata)


@pytest.mark.parametrize("metadata", [{"": "x"}, {"a" * 80: "x"}, {"\u0394": "x"}, {"a\0": "x"}, {"a": 1}, {"a": "\0"}])
def test_metadata_that_a_png_cannot_hold_is_refused_before_writing(metadata: Any) -> None:
    with pytest.raises(rt.InputError, match=r"^metadata"):
        rt.Image(np.zeros((1, 2, 3), np.float32), metadata=metadata)
