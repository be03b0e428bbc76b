"""Picture files: valid files are read to the last bit, and invalid files are refused in one line."""

from __future__ import annotations

import io
import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest
from numpy.lib import format as npy
from PIL import Image as Pillow

import raytracer as rt
from raytracer.app.cli import main
from raytracer.formats.image import Image
from raytracer.formats.image_files import FORMATS, load_picture, read_metadata, read_size
from raytracer.formats.png_chunks import PngWriter, check_whole
from raytracer.formats.radiance import StoredPicture
from tests.picture_files import chunk, grey, png, png16, save


def test_a_png_is_read_back_within_half_a_level(tmp_path: Path) -> None:
    radiance = np.random.default_rng(3).uniform(0, 1, (9, 11, 3))
    read = load_picture(save(tmp_path / "a.PNG", radiance)).radiance[:]
    encoded = [np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055) for v in (radiance, read)]
    assert (
        np.abs(encoded[0] - encoded[1]).max() <= 0.5 / 255 + 1e-5
    )  # the two pieces of the sRGB curve do not quite meet
    np.testing.assert_array_equal(Image(read).srgb8(), Image(radiance).srgb8())


KINDS = [(bits, 0, 1) for bits in (1, 2, 4, 8, 16)] + [(8, 2, 3), (16, 2, 3), (8, 6, 4), (16, 6, 4), (8, 4, 2)]
KINDS += [(bits, 3, 1) for bits in (1, 2, 4, 8)]


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize(("bits", "colour", "samples"), KINDS)
def test_a_whole_png_of_any_kind_is_read_and_an_incomplete_one_is_refused(
    tmp_path: Path, bits: int, colour: int, samples: int, interlaced: bool
) -> None:
    rng = np.random.default_rng(bits)
    path = tmp_path / "a.png"
    for size in ((5, 7), (1, 1), (9, 2), (2, 9)):
        pixels = rng.integers(0, 1 << bits, (*size, samples))
        if colour in (4, 6):
            pixels[..., -1] = (1 << bits) - 1
        palette = rng.integers(0, 256, (1 << min(bits, 8), 3), np.uint8)
        more = chunk(b"PLTE", palette.tobytes()) if colour == 3 else chunk(b"tEXt", b"Title\0a")
        parts = png(pixels, bits, colour, interlaced, more)
        path.write_bytes(b"".join(parts))
        shown = palette[pixels[..., 0]] / 255 if colour == 3 else pixels[..., : 3 if colour in (2, 6) else 1]
        shown = np.broadcast_to(shown if colour == 3 else shown / ((1 << bits) - 1), (*size, 3))
        expected = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(load_picture(path).radiance[:], expected, rtol=1e-12)
        whole = path.read_bytes()
        _, head, _, first, second, end = parts
        taller, lower = (bytearray(head) for _ in range(2))
        taller[15], lower[15] = size[0] + 1, size[0] - 1
        wrong = [whole[: k * len(whole) // 40] for k in range(40)] + [whole[:-1], whole[: -len(end)], whole + b"\0"]
        wrong += [whole.replace(second, b""), whole.replace(first, b""), whole.replace(first, first + more)]
        wrong += [whole.replace(head, chunk(b"IHDR", bytes(other[8:-4]))) for other in (taller, lower)]
        wrong += [whole.replace(head, head + head), whole.replace(end, first + end), whole.replace(b"IDAT", b"IDAU")]
        for k in range(8, len(whole), 5):
            broken = bytearray(whole)
            broken[k] ^= 4
            wrong.append(bytes(broken))
        for data in wrong:
            path.write_bytes(data)
            with pytest.raises(rt.InputError, match=r"a.png: expected (a PNG file|at most 33554432 pixels)"):
                load_picture(path)


def test_a_truncated_png_whose_chunks_are_all_valid_is_refused(tmp_path: Path) -> None:
    # The file has the data of one row out of four, deflated and with valid checksums. Decoders fill up with black.
    path = tmp_path / "a.png"
    pixels = np.full((4, 4, 3), 200)
    whole, short = (png(pixels[:rows], 8, 2, False) for rows in (4, 1))
    path.write_bytes(b"".join([*whole[:3], *short[3:]]))
    with pytest.raises(rt.InputError, match=r"a.png: expected a PNG file: pixels are missing"):
        load_picture(path)
    path.write_bytes(b"".join([*short[:3], *whole[3:]]))
    with pytest.raises(rt.InputError, match=r"a.png: expected a PNG file: it has more pixels than"):
        load_picture(path)


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_all_bits_of_a_png_of_16_bits_are_read(tmp_path: Path, channels: int) -> None:
    pixels = np.random.default_rng(channels).integers(0, 65536, (5, 7, channels))
    if channels == 4:
        pixels[..., 3] = 65535
    path = tmp_path / "a.png"
    path.write_bytes(png16(pixels))
    encoded = np.broadcast_to(pixels[..., :3], (5, 7, 3)) / 65535
    expected = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(load_picture(path).radiance[:], expected, rtol=1e-12)


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGBA"])
def test_a_white_png_of_any_mode_is_read_as_white(tmp_path: Path, mode: str) -> None:
    with Pillow.new("RGB", (4, 3), (255, 255, 255)) as picture:
        picture.convert(mode).save(tmp_path / "a.png")
    np.testing.assert_array_equal(load_picture(tmp_path / "a.png").radiance[:], np.ones((3, 4, 3)))


def a_transparent_png(path: Path) -> None:
    Pillow.new("RGBA", (4, 4), (1, 2, 3, 254)).save(path)


def a_transparent_palette(path: Path) -> None:
    Pillow.new("P", (4, 4)).save(path, transparency=0)


@pytest.mark.parametrize("write", [a_transparent_png, a_transparent_palette])
def test_a_png_with_transparent_pixels_has_an_alpha(tmp_path: Path, write: Callable[[Path], None]) -> None:
    write(tmp_path / "a.png")
    assert load_picture(tmp_path / "a.png").alpha is not None


def transparent_image(rng: np.random.Generator) -> Image:
    """Return a picture with pixels of all kinds: empty, covered, partly covered, and brighter than white."""
    alpha = rng.choice([0.0, 1.0, 0.25, 0.7], (9, 11)).astype(np.float32)
    straight = rng.uniform(0, 1.2, (9, 11, 3)).astype(np.float32)
    return Image(straight * alpha[..., None], alpha=alpha, metadata={"Title": "a", "Error": "b"})


@pytest.mark.parametrize("bits", [8, 16])
def test_a_png_has_straight_alpha_and_is_read_premultiplied(tmp_path: Path, bits: int) -> None:
    image = transparent_image(np.random.default_rng(bits))
    path = tmp_path / "a.png"
    image.save(path, bits)
    assert image.alpha is not None
    picture, top_level = load_picture(path), (1 << bits) - 1
    assert picture.alpha is not None and read_metadata(path) == image.metadata
    np.testing.assert_allclose(picture.alpha, image.alpha, atol=0.51 / top_level)
    clipped = np.minimum(image.radiance, image.alpha[..., None])
    np.testing.assert_allclose(
        picture.radiance[:], clipped, atol=2.6 / top_level
    )  # the sRGB curve's slope is below 2.3
    with Pillow.open(path) as other:
        assert other.mode == "RGBA"
        np.testing.assert_array_equal(np.asarray(other)[..., 3] == 0, image.alpha == 0)


def test_16_bits_are_read_back_within_half_a_level(tmp_path: Path) -> None:
    radiance = np.random.default_rng(3).uniform(0, 1, (9, 11, 3))
    Image(radiance).save(tmp_path / "a.png", bits=16)
    read = load_picture(tmp_path / "a.png").radiance[:]
    encoded = [np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055) for v in (radiance, read)]
    assert np.abs(encoded[0] - encoded[1]).max() <= 0.5 / 65535 + 1e-7


def test_a_png_of_rows_is_the_png_of_the_picture() -> None:
    levels = np.random.default_rng(1).integers(0, 65536, (7, 5, 4)).astype(np.uint16)
    files = io.BytesIO(), io.BytesIO()
    for file, steps in zip(files, (7, 1), strict=True):
        writer = PngWriter(file, 5, 7, 4, {"Title": "a"}, 16)
        for row in range(0, 7, steps):
            writer.write_rows(levels[row : row + steps])
        writer.close()
        assert check_whole(io.BytesIO(file.getvalue()), 100)[:4] == (5, 7, 16, 6)
    with Pillow.open(files[0]) as a, Pillow.open(files[1]) as b:
        assert a.tobytes() == b.tobytes()


def test_an_npz_holds_alpha(tmp_path: Path) -> None:
    image = transparent_image(np.random.default_rng(1))
    shape = image.radiance.shape[:2]
    path = tmp_path / "a.npz"
    zeros = np.zeros(shape, np.float32)
    image.replace(depth=zeros, normal=image.radiance, material=zeros.astype(np.int32)).save(path)
    picture = load_picture(path)
    np.testing.assert_array_equal(picture.radiance[:], image.radiance)
    np.testing.assert_array_equal(picture.alpha, image.alpha)
    for wrong, message in (
        (np.full(shape, 1.5), "alpha: expected numbers in"),
        (np.zeros((2, 2)), "alpha: expected an array"),
        (np.zeros(shape, int), "alpha: expected an array"),
    ):
        np.savez(path, radiance=image.radiance, alpha=wrong)
        with pytest.raises(rt.InputError, match=message):
            load_picture(path)
    np.savez(path, radiance=image.radiance, alpha=np.ones(shape))
    assert load_picture(path).alpha is None  # opaque


@pytest.mark.parametrize("suffix", [".npz", ".exr"])
def test_bits_of_a_format_without_a_choice_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    with pytest.raises(rt.InputError, match=r"bits: expected no bits for .*; only .png has a choice"):
        Image(grey(0.5)).save(path, bits=16)
    assert main(["render", "assignment", "-o", str(path), "--bits", "16"]) == 2
    assert not path.exists()


def a_png_of_colours(count: float, *, late: bool = False) -> Callable[[Path], object]:
    """Return a writer of a PNG of 2 bits with the pixels 0 to 3.

    The palette has `count` colours, and comes after the pixels if it is `late`.
    """
    palette = chunk(b"PLTE", bytes(round(3 * count)))
    begin, head, _, first, second, end = png(np.arange(4).reshape(2, 2, 1), 2, 3, False, palette)
    parts = (begin, head, first, second, palette, end) if late else (begin, head, palette, first, second, end)
    return lambda path: path.write_bytes(b"".join(parts))


def a_png_cut_off(path: Path) -> None:
    Image(np.random.default_rng(1).uniform(0, 1, (64, 64, 3))).save(path)
    path.write_bytes(path.read_bytes()[:2000])


def a_huge_png(path: Path) -> None:
    path.write_bytes(
        png16(np.zeros((1, 1, 3), int)).replace(struct.pack(">2I", 1, 1), struct.pack(">2I", 2**30, 2**30))
    )


def a_png_of_two_headers(path: Path) -> None:
    data = png16(np.zeros((1, 1, 3), int))
    kind = b"IHDR" + struct.pack(">2I5B", 10_000, 10_000, 8, 2, 0, 0, 0)
    path.write_bytes(data[:33] + data[8:12] + kind + struct.pack(">I", zlib.crc32(kind)) + data[33:])


def a_file_of(size: int) -> Callable[[Path], None]:
    """Return a writer of a sparse file, which takes no space on the disk."""

    def write(path: Path) -> None:
        path.touch()
        os.truncate(path, size)

    return write


def a_huge_npz(path: Path) -> None:
    header = io.BytesIO()
    npy.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (1, 2**25 + 1, 3)})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("radiance.npy", header.getvalue())


def a_pickle(path: Path) -> None:
    np.savez(path, radiance=np.full((2, 2, 3), None, object))


@pytest.mark.parametrize(
    ("name", "write", "message"),
    [
        ("a.png", None, "expected a picture that can be read: No such file"),
        ("a.jpg", None, "expected a file that ends in .png or .npz or .exr"),
        ("a.png", Path.mkdir, "it is a folder"),
        ("a.png", lambda path: path.write_bytes(b"not a png"), "expected a PNG file"),
        ("a.png", a_png_of_colours(3), "a pixel has none of the palette's 3 colours"),
        ("a.png", a_png_of_colours(0), "its palette has a wrong length"),
        ("a.png", a_png_of_colours(10 / 3), "its palette has a wrong length"),
        ("a.png", a_png_of_colours(5), "its palette has a wrong length"),
        ("a.png", a_png_of_colours(4, late=True), "its palette is missing"),
        ("a.png", a_png_cut_off, "expected a PNG file: "),
        ("a.png", a_huge_png, "expected at most 33554432 pixels"),
        ("a.png", a_png_of_two_headers, "expected at most 33554432 pixels, got 10000x10000"),
        ("a.png", a_file_of(2**29 + 1), "expected a file of at most 536870912 bytes, got 536870913"),
        ("a.png", lambda path: path.write_bytes(png16(np.zeros((2, 2, 2), int))), "got LA;16B"),
        ("a.npz", lambda path: path.write_bytes(b"not a zip"), "expected an .npz file"),
        ("a.npz", lambda path: np.savez(path, depth=np.zeros(3)), "expected an array radiance, got 'depth'"),
        ("a.npz", lambda path: np.savez(path, radiance=np.zeros((3, 4))), r"radiance: expected an array \(H, W, 3\)"),
        ("a.npz", lambda path: np.savez(path, radiance=np.zeros((3, 4, 3), int)), "floating-point"),
        ("a.npz", a_pickle, "floating-point"),
        ("a.npz", lambda path: np.savez(path, radiance=grey(math.nan)), "finite numbers within .*, got 144 others"),
        ("a.npz", a_file_of(2**31), "expected a file of at most 2147483647 bytes, got 2147483648"),
        ("a.npz", a_huge_npz, "expected at most 33554432 pixels, got 33554433x1"),
    ],
)
def test_a_file_that_is_not_a_picture_is_refused_in_one_line_with_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, write: Callable[[Path], Any] | None, message: str
) -> None:
    path = tmp_path / name
    if write:
        write(path)
    other = save(tmp_path / "other.npz", grey(0.5))
    assert main(["compare", other, str(path)]) == 2
    errors = capsys.readouterr().err
    assert errors.startswith(f"raytracer: {path}: ") and errors.count("\n") == 1 and re.search(message, errors)


def test_an_entry_in_the_table_adds_a_format_of_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write(file: IO[bytes], arrays: Mapping[str, Any], metadata: Mapping[str, str]) -> None:
        np.save(file, arrays["radiance"])

    def size_in(file: IO[bytes]) -> tuple[int, int]:
        height, width, _ = np.load(file).shape
        return width, height

    def picture_in(file: IO[bytes]) -> StoredPicture:
        return StoredPicture(np.load(file))

    raw = FORMATS[".png"]._replace(write=write, read_size=size_in, read_picture=picture_in, is_clipped=False)
    monkeypatch.setitem(FORMATS, ".raw", raw)
    path = tmp_path / "a.raw"
    radiance = np.random.default_rng(1).uniform(0, 9, (4, 5, 3)).astype(np.float32)
    Image(radiance).save(path)
    assert read_size(path) == (5, 4)
    np.testing.assert_array_equal(load_picture(path).radiance[:], radiance)
    for use in (Image(radiance).save, load_picture):
        with pytest.raises(rt.InputError, match=r"ends in .png or .npz or .exr or .raw$"):
            use(tmp_path / "a.jpg")
