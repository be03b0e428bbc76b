"""Differences of pictures, against values that are known by construction, and the figure of differences."""

from __future__ import annotations

import json
import math
import re
import struct
import subprocess
import sys
import zipfile
import zlib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import raytracer as rt
from raytracer.analysis.image_difference import METRICS, compare
from raytracer.app.cli import main
from raytracer.formats.image import Image
from tests.picture_files import chunk, grey, save


def test_a_known_difference_has_the_expected_metrics() -> None:
    a, b = grey(0.5), grey(0.5)
    a[4, 7] += 0.3, -0.4, 0.0
    a[0, 1, 2] += 0.005
    comparison = compare(a, b)
    rmse = math.sqrt((0.3**2 + 0.4**2 + 0.005**2) / (8 * 6 * 3))
    assert comparison.rmse == pytest.approx(rmse, rel=1e-12)
    assert comparison.relative == pytest.approx(rmse / 0.5, rel=1e-12)
    assert comparison.psnr == pytest.approx(10 * math.log10(1 / rmse**2), rel=1e-12)
    assert comparison.largest == pytest.approx(0.4, rel=1e-12) and comparison.pixel == (7, 4)
    assert comparison.over == 1 / 48 and compare(a, b, threshold=0.001).over == 2 / 48
    assert compare(a, b, threshold=0.5).over == 0 and comparison.flip is None


def test_metrics_of_many_blocks_of_rows_are_those_of_the_formulas() -> None:
    rng = np.random.default_rng(8)
    a, b = (rng.uniform(0, 9, (701, 130, 3)).astype(kind) for kind in (np.float32, np.uint16))
    a[600, 7, 1] = a[650, 3, 0] = 5000.0  # equal differences: the first one counts
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


def test_alpha_is_compared_by_itself_and_an_opaque_picture_has_an_alpha_of_1() -> None:
    shape = 6, 8
    half = Image(grey(0.25), alpha=np.full(shape, 0.5, np.float32))
    assert compare(half, half).alpha == 0 and compare(grey(0.5), grey(0.5)).alpha is None
    for pair in ((half, Image(grey(0.25))), (Image(grey(0.25)), half)):
        comparison = compare(*pair)
        assert comparison.alpha == 0.5 and comparison.rmse == 0


def test_files_are_compared_by_their_paths(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(2)
    radiance = rng.uniform(0, 2, (6, 8, 3)).astype(np.float32)
    image = Image(radiance, alpha=np.ones((6, 8), np.float32) / 4)
    exr, png = tmp_path / "a.exr", tmp_path / "a.png"
    image.save(exr)
    Image(radiance).save(png, bits=16)
    assert compare(exr, image) == compare(str(exr), image)
    assert compare(exr, image).rmse == 0 and compare(exr, image).alpha == 0
    assert compare(png, radiance).rmse < 1e-5  # clipped, as only one of the two is a .png
    assert compare(png, png).rmse == 0
    with pytest.raises(rt.InputError, match=r"nowhere.exr: expected a picture that can be read"):
        compare(tmp_path / "nowhere.exr", image)
    assert main(["compare", str(exr), str(exr), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["alpha"] == 0
    assert main(["compare", str(exr), str(exr)]) == 0
    assert "alpha      RMSE 0; the radiance is premultiplied" in capsys.readouterr().out


def test_the_second_picture_is_the_reference() -> None:
    assert compare(grey(0.1), grey(0.4)).relative == pytest.approx(0.75)
    assert compare(grey(0.4), grey(0.1)).relative == pytest.approx(3.0)
    assert compare(grey(0.1), grey(0.0)).relative is None
    assert compare(grey(0.0), grey(0.0)).psnr == math.inf


@pytest.mark.parametrize("wrong", [np.zeros((2, 2)), np.zeros((0, 2, 3)), grey(math.nan), grey(math.inf), grey(1e39)])
def test_arrays_that_are_no_pictures_are_refused(wrong: np.ndarray) -> None:
    for pair in ((wrong, grey(0.5)), (grey(0.5), wrong)):
        with pytest.raises(rt.InputError, match=r"^[ab]: expected"):
            compare(*pair)
    with pytest.raises(rt.InputError, match="one size, got 8x6 and 6x8"):
        compare(grey(0.5), grey(0.5, (6, 8)))
    with pytest.raises(rt.InputError, match="threshold"):
        compare(grey(0.5), grey(0.5), threshold=-1.0)


BOUNDED = """
import resource, sys
from raytracer.app.cli import main
before = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (before + (int(sys.argv[1]) << 20),) * 2)
sys.exit(main(["compare", *sys.argv[2:]]))
"""


def run_bounded(mib: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run `raytracer compare` with at most `mib` MiB more memory than the program takes by itself."""
    command = [sys.executable, "-c", BOUNDED, str(mib), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def begin_of_8k(bits: int) -> bytes:
    head = struct.pack(">2I5B", 7680, 4320, bits, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)


def end_of_8k(bits: int) -> bytes:
    rows = zlib.compressobj(1)
    data = b"".join(rows.compress(bytes(1 + 3 * 7680 * bits // 8)) for _ in range(4320)) + rows.flush()
    return chunk(b"IDAT", data) + chunk(b"IEND")


@pytest.mark.slow
@pytest.mark.parametrize("bits", [8, 16])
def test_two_pictures_of_8k_take_little_more_memory_than_their_pixels(tmp_path: Path, bits: int) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(begin_of_8k(bits) + end_of_8k(bits))
    ended = run_bounded(1200, path, path)
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
        ended = run_bounded(512, *pair)
        assert ended.returncode == 2, ended.stderr
        assert re.search(r"expected the size of|bytes beside its pixels", ended.stderr), ended.stderr


def test_the_command_shows_a_table_or_json_and_its_status_is_1_above_the_tolerance(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a, b = save(tmp_path / "a.npz", grey(0.5)), save(tmp_path / "b.npz", grey(0.25))
    assert main(["compare", a, b]) == 0
    table = dict(re.split("  +", line, maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert table["RMSE"] == "0.25" and table["relative"] == "1" and table["over 0.01"] == "100 % of the pixels"
    assert main(["compare", a, b, "--tolerance", "0.25"]) == 0
    assert main(["compare", a, b, "--tolerance", "0.2499"]) == 1
    assert "the RMSE is above the tolerance" in capsys.readouterr().out
    assert main(["compare", a, b, "--tolerance", "0.2499", "--json"]) == 1
    printed = json.loads(capsys.readouterr().out)
    assert printed["rmse"] == 0.25 and printed["within_tolerance"] is False and printed["pixel"] == [0, 0]
    assert printed["psnr"] == pytest.approx(20 * math.log10(4))

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    assert main(["compare", a, a, "--json"]) == 0
    assert json.loads(capsys.readouterr().out, parse_constant=refuse)["psnr"] is None
    for wrong, says in (
        (["--tolerance", "-1"], "--tolerance"),
        (["--threshold", "nan"], "--threshold"),
        (["-o", str(tmp_path / "d.npz")], "ends in .png or .svg or .pdf"),
    ):
        assert main(["compare", a, b, *wrong]) == 2
        assert says in capsys.readouterr().err


def test_pictures_of_two_sizes_are_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = save(tmp_path / "a.npz", grey(0.5)), save(tmp_path / "b.png", grey(0.5, (4, 3)))
    assert main(["compare", a, b]) == 2
    assert capsys.readouterr().err == f"raytracer: {a}: expected the size of {b}, 4x3, got 8x6\n"


def test_radiance_is_clipped_for_the_comparison_with_a_png(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    npz, png = save(tmp_path / "a.npz", grey(5.0)), save(tmp_path / "b.png", grey(5.0))
    for pair in ((npz, png), (png, npz)):
        assert main(["compare", *pair, "--tolerance", "0"]) == 0
        assert re.search(rf"clipped +{re.escape(npz)}, to \[0, 1\]", capsys.readouterr().out)
    assert main(["compare", npz, save(tmp_path / "c.npz", grey(1.0)), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["rmse"] == 4.0 and printed["clipped"] is None


def texts(svg: Path) -> list[str]:
    """The texts of an .svg file, which must be well-formed."""
    return [element.text or "" for element in ElementTree.parse(svg).iter("{http://www.w3.org/2000/svg}text")]


def test_the_figure_of_differences_names_its_quantity_its_files_and_its_scale(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    a, b = save(tmp_path / "a$_$.npz", grey(0.5)), save(tmp_path / "b.npz", grey(0.25))
    for suffix, begin in ((".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")):
        assert main(["compare", a, b, "-o", str(tmp_path / f"d{suffix}")]) == 0
        assert (tmp_path / f"d{suffix}").read_bytes().startswith(begin)
    shown = " ".join(texts(tmp_path / "d.svg"))
    for text in ("a$_$.npz", "b.npz", "RMSE 0.25", "at (0, 0)", "8x6", "channels", "linear radiance", "pixels"):
        assert text in shown
    assert {"0.0001", "0.001", "0.01", "0.1", "1"} <= {*texts(tmp_path / "d.svg")}, "the colour bar has values"


def test_the_axes_of_a_figure_of_one_pixel_have_a_tick_at_that_pixel(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    pixel = save(tmp_path / "pixel.npz", np.full((1, 1, 3), 0.5, np.float32))
    assert main(["compare", pixel, pixel, "-o", str(tmp_path / "pixel.svg")]) == 0
    ticks = [text for text in texts(tmp_path / "pixel.svg") if re.fullmatch(r"[-\N{MINUS SIGN}\d.]+", text)]
    assert ticks == ["0", "0", "0.0001", "0.001", "0.01", "0.1", "1"]


def test_the_colours_of_differences_get_lighter_with_each_factor_of_10() -> None:
    pytest.importorskip("matplotlib")
    from raytracer.analysis.difference_figure import BRIGHTEST, DARKEST, difference_colors

    shown = difference_colors(np.array([[0.0, DARKEST, 1e-3, 1e-2, 0.1, BRIGHTEST, 70.0]])).astype(int)[0]
    assert (shown[0] == shown[1]).all() and shown[0].max() <= 4 and (shown[5] == shown[6]).all()
    assert (np.diff(shown[1:6].sum(axis=1)) > 80).all()


def test_a_pixel_that_differs_is_seen_in_the_figure_of_a_large_picture() -> None:
    pytest.importorskip("matplotlib")
    from raytracer.analysis.difference_figure import _largest_of_blocks

    a, b = np.zeros((701, 1000, 3), np.float32), np.zeros((701, 1000, 3), np.float32)
    a[700, 998, 1], b[5, 6, 2] = 0.5, -0.25
    blocks = _largest_of_blocks(a, b, 4)
    assert blocks.shape == (176, 250) and blocks[175, 249] == 0.5 and blocks[1, 1] == 0.25
    assert np.count_nonzero(blocks) == 2


def test_without_matplotlib_the_figure_is_refused_before_pictures_are_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    a = save(tmp_path / "a.npz", grey(0.5))
    assert main(["compare", a, a]) == 0
    assert main(["compare", a, "nowhere.npz", "-o", str(tmp_path / "d.svg")]) == 2
    assert "in the checkout: pip install -e '.[plots]'" in capsys.readouterr().err


def test_flip_is_0_for_equal_pictures_and_grows_with_noise(tmp_path: Path) -> None:
    pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(5)
    picture = rng.uniform(0.2, 0.8, (32, 48, 3))
    noise = rng.normal(size=picture.shape)
    for kind in ("ldr", "hdr"):
        values = [compare(picture + s * noise, picture, flip=kind).flip for s in (0.0, 0.01, 0.1)]
        assert values[0] == 0 and values[1] is not None and values[2] is not None and 0 < values[1] < values[2] < 1
        # FLIP by itself would end the process for a nearly black reference.
        for level in (1e-30, 1e-7, 1e-6, 1e-5, 1e-4):
            assert compare(grey(0.0), grey(level) * (0, 0, 1), flip=kind).flip is not None
        assert compare(grey(0.0), grey(0.0), flip=kind).flip == 0
        assert compare(grey(1.0), grey(0.0), flip=kind).flip == pytest.approx(0.97, abs=0.01)
    bright = [compare(picture + 5.0 + 0.1 * noise, picture + 5.0, flip=kind).flip for kind in ("ldr", "hdr")]
    assert bright[0] == 0 and bright[1] is not None and bright[1] > 0, "only HDR-FLIP sees differences above 1"


def test_flip_without_its_package_names_the_extra(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    a = save(tmp_path / "a.npz", grey(0.5))
    assert main(["compare", a, a]) == 0
    assert main(["compare", a, a, "--flip"]) == 2
    assert "in the checkout: pip install -e '.[flip]'" in capsys.readouterr().err


def test_each_metric_is_in_the_help_the_table_and_the_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("flip_evaluator")
    picture = str(tmp_path / "a.npz")
    black = np.zeros((8, 8, 3))
    np.savez(picture, radiance=black)
    with pytest.raises(SystemExit):
        main(["compare", "--help"])
    says = " ".join(capsys.readouterr().out.split())
    optional = [metric for metric in METRICS if metric.measure]
    assert optional and all(f"--{metric.field} {metric.help}" in says for metric in optional)
    options = [f"--{metric.field}" for metric in optional]
    assert main(["compare", picture, picture, *options]) == 0
    table = [line.partition("  ")[0] for line in capsys.readouterr().out.splitlines()]
    comparison = compare(Image(black, alpha=black[..., 0]), black, flip="hdr")
    rows = [metric.row(comparison) for metric in METRICS]
    assert table == ["size", *(row[0] for row in rows if row and row[0] != "alpha")]
    assert main(["compare", picture, picture, *options, "--json"]) == 0
    assert {metric.field for metric in METRICS} <= {*json.loads(capsys.readouterr().out)}
