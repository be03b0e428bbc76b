"""How far pictures are apart, against what is known by construction; files that are pictures, and others."""

from __future__ import annotations

import io
import json
import math
import os
import re
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.lib import format as npy
from PIL import Image as Pillow

import raytracer as rt
from raytracer.analysis.image_difference import DARKEST, METRICS, compare, difference
from raytracer.app.cli import main
from raytracer.formats.image import Image
from raytracer.formats.image_files import load_radiance


def grey(value: float, size: tuple[int, int] = (8, 6)) -> np.ndarray:
    return np.full((size[1], size[0], 3), value)


def save(path: Path, radiance: np.ndarray) -> str:
    if path.suffix == ".npz":
        np.savez(path, radiance=radiance)
    else:
        Image(radiance).save(path)
    return str(path)


def test_a_known_difference_has_the_numbers_that_follow_from_it() -> None:
    a, b = grey(0.5), grey(0.5)
    a[4, 7] += 0.3, -0.4, 0.0
    a[0, 1, 2] += 0.005
    found = compare(a, b)
    rmse = math.sqrt((0.3**2 + 0.4**2 + 0.005**2) / (8 * 6 * 3))
    assert found.rmse == pytest.approx(rmse, rel=1e-12)
    assert found.relative == pytest.approx(rmse / 0.5, rel=1e-12)
    assert found.psnr == pytest.approx(10 * math.log10(1 / rmse**2), rel=1e-12)
    assert found.largest == pytest.approx(0.4, rel=1e-12) and found.pixel == (7, 4)
    assert found.over == 1 / 48 and compare(a, b, threshold=0.001).over == 2 / 48
    assert compare(a, b, threshold=0.5).over == 0 and found.flip is None


def test_pictures_of_many_blocks_of_rows_have_the_numbers_of_the_plain_formulas() -> None:
    rng = np.random.default_rng(8)
    a, b = (rng.uniform(0, 9, (701, 130, 3)).astype(kind) for kind in (np.float32, np.uint16))
    a[600, 7, 1] = a[650, 3, 0] = 5000.0  # equal differences, of which the first one counts
    b[600, 7, 1] = b[650, 3, 0] = 0
    off = np.abs(a.astype(float) - b)
    got = compare(a, b, threshold=8.0)
    assert got.rmse == pytest.approx(math.sqrt(np.mean(off**2)), rel=1e-12)
    assert got.relative == pytest.approx(math.sqrt(np.mean(off**2) / np.mean(b.astype(float) ** 2)), rel=1e-12)
    assert (got.largest, got.pixel) == (5000.0, (7, 600))
    assert 0 < got.over == pytest.approx(np.mean(off.max(axis=2) > 8.0), rel=1e-12)


def test_pictures_may_be_lists_and_numbers_of_any_type() -> None:
    rows = [[[0.5, 0.25, 1], [0, 1, 2]], [[1, 1, 1], [3, 2, 1]]]
    a = np.array(rows, np.float64)
    for same in (rows, [*a], a.astype(np.float16), a.astype(np.longdouble), a.astype(object), np.ma.array(a), Image(a)):
        assert compare(same, a).largest == 0.0
    assert compare(a, np.asfortranarray(a)[::-1]).largest == 3.0


def test_the_second_picture_is_the_reference() -> None:
    assert compare(grey(0.1), grey(0.4)).relative == pytest.approx(0.75)
    assert compare(grey(0.4), grey(0.1)).relative == pytest.approx(3.0)
    assert compare(grey(0.1), grey(0.0)).relative is None
    assert compare(grey(0.0), grey(0.0)).psnr == math.inf


@pytest.mark.parametrize("wrong", [np.zeros((2, 2)), np.zeros((0, 2, 3)), grey(math.nan), grey(math.inf), grey(1e39)])
def test_what_is_no_picture_is_refused(wrong: np.ndarray) -> None:
    for pair in ((wrong, grey(0.5)), (grey(0.5), wrong)):
        with pytest.raises(rt.InputError, match=r"^[ab]: expected"):
            compare(*pair)
    with pytest.raises(rt.InputError, match="one size, got 8x6 and 6x8"):
        compare(grey(0.5), grey(0.5, (6, 8)))
    with pytest.raises(rt.InputError, match="threshold"):
        compare(grey(0.5), grey(0.5), threshold=-1.0)


def test_a_png_is_read_as_what_was_written_within_half_a_level(tmp_path: Path) -> None:
    radiance = np.random.default_rng(3).uniform(0, 1, (9, 11, 3))
    read = load_radiance(save(tmp_path / "a.PNG", radiance))[:]
    encoded = [np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055) for v in (radiance, read)]
    assert np.abs(encoded[0] - encoded[1]).max() <= 0.5 / 255 + 1e-5  # the standard's two pieces meet but nearly
    np.testing.assert_array_equal(Image(read).srgb8(), Image(radiance).srgb8())


def png16(pixels: np.ndarray) -> bytes:
    """A PNG file of 16 bits, by the standard (ISO/IEC 15948), each row as the difference to the left neighbour."""
    height, width, channels = pixels.shape
    rows = pixels.astype(">u2").view(np.uint8).reshape(height, -1)
    left = np.pad(rows, ((0, 0), (2 * channels, 0)))[:, : rows.shape[1]]
    data = np.pad(rows - left, ((0, 0), (1, 0)), constant_values=1).tobytes()
    kinds = {1: 0, 2: 4, 3: 2, 4: 6}
    head = struct.pack(">2I5B", width, height, 16, kinds[channels], 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(data)), (b"IEND", b""))
    parts = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def chunk(kind: bytes, data: bytes = b"") -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(pixels: np.ndarray, bits: int, colour: int, interlaced: bool, more: bytes = b"") -> list[bytes]:
    """A PNG file, by the standard, in parts: signature, IHDR, `more`, two IDAT, IEND. Pixels are (H, W, samples)."""
    height, width, _ = pixels.shape
    whole = [(0, 0, 1, 1)]
    passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
    data = b""
    for x, y, dx, dy in passes if interlaced else whole:
        part = pixels[y::dy, x::dx]
        for row in part if part.size else ():
            digits = "".join(f"{int(value):0{bits}b}" for value in row.ravel())
            digits += "0" * (-len(digits) % 8)
            data += b"\0" + int(digits, 2).to_bytes(len(digits) // 8)
    data = zlib.compress(data)
    head = struct.pack(">2I5B", width, height, bits, colour, 0, 0, int(interlaced))
    half = len(data) // 2
    idat = chunk(b"IDAT", data[:half]), chunk(b"IDAT", data[half:])
    return [b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", head), more, *idat, chunk(b"IEND")]


KINDS = [(bits, 0, 1) for bits in (1, 2, 4, 8, 16)] + [(8, 2, 3), (16, 2, 3), (8, 6, 4), (16, 6, 4), (8, 4, 2)]
KINDS += [(bits, 3, 1) for bits in (1, 2, 4, 8)]


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize(("bits", "colour", "samples"), KINDS)
def test_a_png_of_any_kind_is_read_if_it_is_whole_and_refused_if_anything_of_it_is_missing(
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
        np.testing.assert_allclose(load_radiance(path)[:], expected, rtol=1e-12)
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
                load_radiance(path)


def test_a_png_that_was_cut_off_with_all_its_chunks_right_is_refused(tmp_path: Path) -> None:
    # The data of one row of four, deflated and with all checksums right, which decoders fill up with black.
    path = tmp_path / "a.png"
    pixels = np.full((4, 4, 3), 200)
    whole, short = (png(pixels[:rows], 8, 2, False) for rows in (4, 1))
    path.write_bytes(b"".join([*whole[:3], *short[3:]]))
    with pytest.raises(rt.InputError, match=r"a.png: expected a PNG file: pixels are missing"):
        load_radiance(path)
    path.write_bytes(b"".join([*short[:3], *whole[3:]]))
    with pytest.raises(rt.InputError, match=r"a.png: expected a PNG file: it has more pixels than"):
        load_radiance(path)


BOUNDED = """
import resource, sys
from raytracer.app.cli import main
before = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (before + (int(sys.argv[1]) << 20),) * 2)
sys.exit(main(["compare", *sys.argv[2:]]))
"""


def bounded(mib: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    """`raytracer compare` with so much memory beyond that of the program itself."""
    command = [sys.executable, "-c", BOUNDED, str(mib), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def begin_of_8k(bits: int) -> bytes:
    head = struct.pack(">2I5B", 7680, 4320, bits, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)


def end_of_8k(bits: int) -> bytes:
    rows = zlib.compressobj(1)
    data = b"".join(rows.compress(bytes(1 + 3 * 7680 * bits // 8)) for _ in range(4320)) + rows.flush()
    return chunk(b"IDAT", data) + chunk(b"IEND")


@pytest.mark.parametrize("bits", [8, 16])
def test_two_pictures_of_8k_take_little_more_memory_than_their_pixels(tmp_path: Path, bits: int) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(begin_of_8k(bits) + end_of_8k(bits))
    ended = bounded(1200, path, path)
    assert ended.returncode == 0, ended.stderr
    assert "the reference is black" in ended.stdout


def test_sizes_are_compared_before_a_large_picture_takes_memory(tmp_path: Path) -> None:
    small = save(tmp_path / "small.png", grey(0.5, (300, 300)))
    large, filled = tmp_path / "large.png", tmp_path / "filled.png"
    begin, end = begin_of_8k(8), end_of_8k(8)
    large.write_bytes(begin + end)
    filled.write_bytes(begin + chunk(b"tEXt", b"a\0" + bytes(1 << 25)) + end)
    radiance = np.lib.format.open_memmap(tmp_path / "radiance.npy", "w+", np.float32, (4320, 7680, 3))
    del radiance
    archive = tmp_path / "large.npz"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        file.write(tmp_path / "radiance.npy", "radiance.npy")
    pairs = [(large, small), (small, large), (archive, small), (small, archive), (filled, filled)]
    for pair in pairs:
        ended = bounded(512, *pair)
        assert ended.returncode == 2, ended.stderr
        assert re.search(r"expected the size of|bytes beside its pixels", ended.stderr), ended.stderr


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_of_a_png_of_16_bits_all_bits_count(tmp_path: Path, channels: int) -> None:
    pixels = np.random.default_rng(channels).integers(0, 65536, (5, 7, channels))
    if channels == 4:
        pixels[..., 3] = 65535
    path = tmp_path / "a.png"
    path.write_bytes(png16(pixels))
    encoded = np.broadcast_to(pixels[..., :3], (5, 7, 3)) / 65535
    expected = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(load_radiance(path)[:], expected, rtol=1e-12)


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGBA"])
def test_pngs_of_other_kinds_are_what_they_look_like(tmp_path: Path, mode: str) -> None:
    with Pillow.new("RGB", (4, 3), (255, 255, 255)) as picture:
        picture.convert(mode).save(tmp_path / "a.png")
    np.testing.assert_array_equal(load_radiance(tmp_path / "a.png")[:], np.ones((3, 4, 3)))


def a_transparent_png(path: Path) -> None:
    Pillow.new("RGBA", (4, 4), (1, 2, 3, 254)).save(path)


def a_transparent_palette(path: Path) -> None:
    Pillow.new("P", (4, 4)).save(path, transparency=0)


def a_png_of_colours(count: float, *, late: bool = False) -> Callable[[Path], object]:
    """A PNG of 2 bits whose pixels are 0 to 3, with a palette of so many colours."""
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
    """It takes no place on the disk."""

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
    ("name", "write", "says"),
    [
        ("a.png", None, "expected a picture that can be read: No such file"),
        ("a.jpg", None, "expected a file that ends in .png or .npz"),
        ("a.png", Path.mkdir, "it is a folder"),
        ("a.png", lambda path: path.write_bytes(b"not a png"), "expected a PNG file"),
        ("a.png", a_transparent_png, "opaque"),
        ("a.png", a_transparent_palette, "opaque"),
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
def test_a_file_that_is_no_picture_is_one_line_that_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, write: Callable[[Path], Any] | None, says: str
) -> None:
    path = tmp_path / name
    if write:
        write(path)
    other = save(tmp_path / "other.npz", grey(0.5))
    assert main(["compare", other, str(path)]) == 2
    errors = capsys.readouterr().err
    assert errors.startswith(f"raytracer: {path}: ") and errors.count("\n") == 1 and re.search(says, errors)


def test_the_command_shows_a_table_or_json_and_its_status_is_1_above_the_tolerance(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a, b = save(tmp_path / "a.npz", grey(0.5)), save(tmp_path / "b.npz", grey(0.25))
    assert main(["compare", a, b]) == 0
    table = dict(re.split("  +", line, maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert table["RMSE"] == "0.25" and table["relative"] == "1" and table["over 0.01"] == "100 % of the pixels"
    assert main(["compare", a, b, "--tolerance", "0.25"]) == 0
    assert main(["compare", a, b, "--tolerance", "0.2499"]) == 1
    assert "the RMSE is above it" in capsys.readouterr().out
    assert main(["compare", a, b, "--tolerance", "0.2499", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["rmse"] == 0.25 and found["within_tolerance"] is False and found["pixel"] == [0, 0]
    assert found["psnr"] == pytest.approx(20 * math.log10(4))

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    assert main(["compare", a, a, "--json"]) == 0
    assert json.loads(capsys.readouterr().out, parse_constant=refuse)["psnr"] is None
    for wrong, says in (
        (["--tolerance", "-1"], "--tolerance"),
        (["--threshold", "nan"], "--threshold"),
        (["-o", str(tmp_path / "d.npz")], "ends in .png"),
    ):
        assert main(["compare", a, b, *wrong]) == 2
        assert says in capsys.readouterr().err


def test_pictures_of_two_sizes_are_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = save(tmp_path / "a.npz", grey(0.5)), save(tmp_path / "b.png", grey(0.5, (4, 3)))
    assert main(["compare", a, b]) == 2
    assert capsys.readouterr().err == f"raytracer: {a}: expected the size of {b}, 4x3, got 8x6\n"


def test_against_a_png_radiance_is_clipped_as_a_pngs_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    npz, png = save(tmp_path / "a.npz", grey(5.0)), save(tmp_path / "b.png", grey(5.0))
    for pair in ((npz, png), (png, npz)):
        assert main(["compare", *pair, "--tolerance", "0"]) == 0
        assert re.search(rf"clipped +{re.escape(npz)}, to \[0, 1\]", capsys.readouterr().out)
    assert main(["compare", npz, save(tmp_path / "c.npz", grey(1.0)), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["rmse"] == 4.0 and found["clipped"] is None


def test_the_difference_picture_has_a_level_for_each_step_of_its_logarithm(tmp_path: Path) -> None:
    a, b = grey(0.0, (6, 1)), grey(0.0, (6, 1))
    a[0, :, 1] = 0.0, DARKEST, 1e-3, 1e-2, 0.1, 1.0
    b[0, :, 0] = 2e-5  # less than the largest channel's
    a[0, 5, 2] = 70.0
    expected = [0, 0, 63.75, 127.5, 191.25, 255]
    levels = difference(a, b).srgb8()[0]
    assert (levels == levels[:, :1]).all() and np.abs(levels[:, 0] - expected).max() <= 0.5
    names = [save(tmp_path / f"{i}.npz", picture) for i, picture in enumerate((a, b))]
    assert main(["compare", *names, "-o", str(tmp_path / "d.png")]) == 0
    with Pillow.open(tmp_path / "d.png") as picture:
        np.testing.assert_array_equal(np.asarray(picture)[0], levels)
        assert "black 0.0001 or less" in str(picture.info["Description"])


def test_flip_is_0_for_equal_pictures_and_grows_with_what_is_seen(tmp_path: Path) -> None:
    pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(5)
    picture = rng.uniform(0.2, 0.8, (32, 48, 3))
    noise = rng.normal(size=picture.shape)
    for kind in ("ldr", "hdr"):
        found = [compare(picture + s * noise, picture, flip=kind).flip for s in (0.0, 0.01, 0.1)]
        assert found[0] == 0 and found[1] is not None and found[2] is not None and 0 < found[1] < found[2] < 1
        # FLIP would end the process for a reference that is all but black.
        for level in (1e-30, 1e-7, 1e-6, 1e-5, 1e-4):
            assert compare(grey(0.0), grey(level) * (0, 0, 1), flip=kind).flip is not None
        assert compare(grey(0.0), grey(0.0), flip=kind).flip == 0
        assert compare(grey(1.0), grey(0.0), flip=kind).flip == pytest.approx(0.97, abs=0.01)
    bright = [compare(picture + 5.0 + 0.1 * noise, picture + 5.0, flip=kind).flip for kind in ("ldr", "hdr")]
    assert bright[0] == 0 and bright[1] is not None and bright[1] > 0, "only HDR-FLIP sees what is above 1"


def test_flip_without_its_package_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    a = save(tmp_path / "a.npz", grey(0.5))
    assert main(["compare", a, a]) == 0
    assert main(["compare", a, a, "--flip"]) == 2
    assert "pip install 'roth-raytracer[flip]'" in capsys.readouterr().err


def test_a_metric_of_the_table_is_in_the_help_the_table_and_the_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("flip_evaluator")
    picture = str(tmp_path / "a.npz")
    black = np.zeros((8, 8, 3))
    np.savez(picture, radiance=black)
    with pytest.raises(SystemExit):
        main(["compare", "--help"])
    says = " ".join(capsys.readouterr().out.split())
    asked = [metric for metric in METRICS if metric.measure]
    assert asked and all(f"--{metric.field} {metric.help}" in says for metric in asked)
    options = [f"--{metric.field}" for metric in asked]
    assert main(["compare", picture, picture, *options]) == 0
    table = [line.partition("  ")[0] for line in capsys.readouterr().out.splitlines()]
    comparison = compare(black, black, flip="hdr")
    assert table == ["size", *(metric.row(comparison)[0] for metric in METRICS)]
    assert main(["compare", picture, picture, *options, "--json"]) == 0
    assert {metric.field for metric in METRICS} <= {*json.loads(capsys.readouterr().out)}
