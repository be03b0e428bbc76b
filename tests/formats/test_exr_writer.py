"""EXR files written row by row: OpenEXR reads every bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from raytracer.formats.exr_writer import ExrWriter
from raytracer.formats.image_exr import join_channels
from raytracer.formats.image_files import load_picture, read_metadata

OpenEXR = pytest.importorskip("OpenEXR")


def write(path: Path, pixels: np.ndarray, rows: list[int]) -> None:
    height, width, channels = pixels.shape
    with path.open("wb") as file:
        writer = ExrWriter(file, width, height, channels, {"Title": "Äpfel"})
        for first, last in zip([0, *rows], [*rows, height], strict=True):
            writer.write_rows(pixels[first:last])
        writer.close({"Error": "error about 0.1"})


@pytest.mark.parametrize(
    ("size", "rows"), [((1, 1), []), ((37, 50), [3, 20, 21]), ((16, 16), []), ((5, 33), [16, 32]), ((3, 17), [17])]
)
@pytest.mark.parametrize("channels", [3, 4])
def test_openexr_reads_every_bit(tmp_path: Path, size: tuple[int, int], rows: list[int], channels: int) -> None:
    path, rng = tmp_path / "a.exr", np.random.default_rng(4)
    # All bits of finite float32 numbers, which do not compress; then equal rows, which do.
    pixels = rng.integers(0, 0x7F7FFFFF, (size[1], size[0], channels)).astype(np.uint32).view(np.float32)
    pixels[size[1] // 2 :] = 0.25
    write(path, pixels, rows)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = dict(file.header())
        read = np.stack([file.channels()[name].pixels for name in "RGBA"[:channels]], axis=2)
    np.testing.assert_array_equal(read.view(np.uint32), pixels.view(np.uint32))
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    np.testing.assert_allclose(header["chromaticities"][:2], (0.64, 0.33), rtol=1e-6)


def test_the_file_is_read_back_with_the_texts_of_its_begin_and_its_end(tmp_path: Path) -> None:
    radiance, alpha = np.full((20, 9, 3), 0.5, np.float32), np.full((20, 9), 0.75, np.float32)
    write(tmp_path / "a.exr", join_channels(radiance, alpha), [7])
    picture = load_picture(tmp_path / "a.exr")
    np.testing.assert_array_equal(picture.radiance[:], radiance)
    np.testing.assert_array_equal(picture.alpha, alpha)
    assert read_metadata(tmp_path / "a.exr") == {"Title": "Äpfel", "Error": "error about 0.1"}


def test_a_file_without_all_rows_is_an_error(tmp_path: Path) -> None:
    with (tmp_path / "a.exr").open("wb") as file:
        writer = ExrWriter(file, 4, 40, 3, {})
        writer.write_rows(np.zeros((16, 4, 3), np.float32))
        with pytest.raises(ValueError, match="all rows"):
            writer.close()
