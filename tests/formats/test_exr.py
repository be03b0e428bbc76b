"""EXR files: channels as compositors expect them, read back to the last bit; damaged files are refused in a line."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.formats import image_exr
from raytracer.formats.image import Image
from raytracer.formats.image_files import load_picture, read_metadata, read_size
from raytracer.rendering.renderer import Renderer

SHAPE = (20, 33)
CAMERA = rt.Camera((1, 2, 3), (0, 0, 0), vertical_fov=40)
CHANNELS = {"R", "G", "B", "A", "Z", "distance.Z", "N.X", "N.Y", "N.Z", "error.Y", "material.id", "samples.Y"}


def full_image() -> Image:
    """Return a picture with all arrays."""
    rng = np.random.default_rng(1)
    return Image(
        rng.uniform(0, 5, (*SHAPE, 3)).astype(np.float32),
        depth=np.where(rng.random(SHAPE) < 0.5, np.inf, rng.uniform(1, 9, SHAPE)).astype(np.float32),
        normal=rng.normal(size=(*SHAPE, 3)).astype(np.float32),
        material=rng.integers(-1, 9, SHAPE).astype(np.int32),
        samples=rng.integers(1, 4096, SHAPE).astype(np.int32),
        error=np.full(SHAPE, np.nan, np.float32),
        alpha=rng.uniform(0, 1, SHAPE).astype(np.float32),
        camera=CAMERA,
        metadata={"Title": "Würfel, \u65e5\u672c", "Software": "a test", "Description": "33x20", "Error": "about 0"},
    )


def planes(names: str = "RGBA") -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    return {name: rng.random(SHAPE, dtype=np.float32) for name in names}


def exr(channels: dict[str, Any], **header: Any) -> bytes:
    """Return the bytes of a file that OpenEXR writes."""
    file = io.BytesIO()
    defaults = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    with OpenEXR.File(defaults | header, dict(channels)) as picture:
        picture.write(file)
    return file.getvalue()


def test_the_channels_hold_all_arrays_bit_for_bit(tmp_path: Path) -> None:
    image, path = full_image(), tmp_path / "a.exr"
    image.save(path)
    assert image.depth is not None and image.normal is not None and image.material is not None
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header, channels = file.header(), file.channels()
        assert {*channels} == CHANNELS
        assert header["compression"] == OpenEXR.ZIP_COMPRESSION and header["type"] == OpenEXR.scanlineimage
        np.testing.assert_allclose(header["chromaticities"], (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
        assert header["software"] == "a test" and header["comments"] == "Würfel, \u65e5\u672c; 33x20; about 0"
        arrays = {
            **{name: image.radiance[..., i] for i, name in enumerate("RGB")},
            **{f"N.{name}": image.normal[..., i] for i, name in enumerate("XYZ")},
            **{"A": image.alpha, "Z": image.planar_depth, "distance.Z": image.depth, "error.Y": image.error},
            "samples.Y": image.samples,
        }
        for name, array in arrays.items():
            np.testing.assert_array_equal(channels[name].pixels, array)
            assert channels[name].pixels.dtype == (np.uint32 if name == "samples.Y" else np.float32)
        number = channels["material.id"].pixels
        assert number.dtype == np.uint32 and (number[image.material < 0] == 0xFFFFFFFF).all()
        np.testing.assert_array_equal(number.view(np.int32), image.material)
    assert read_size(path) == SHAPE[::-1] and read_metadata(path) == image.metadata
    picture = load_picture(path)
    np.testing.assert_array_equal(picture.radiance[:], image.radiance)
    np.testing.assert_array_equal(picture.alpha, image.alpha)


def test_a_picture_of_radiance_alone_has_three_channels(tmp_path: Path) -> None:
    radiance = full_image().radiance
    Image(radiance).save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        assert {*file.channels()} == {"R", "G", "B"}
    assert load_picture(tmp_path / "a.exr").alpha is None


@pytest.mark.gl
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_planar_depth_of_a_wall_across_the_view_is_its_distance(renderer: Renderer, projection: Any) -> None:
    height = 3.0 if projection == "orthographic" else None
    camera = rt.Camera((1, 2, 9), (1, 2, 0), vertical_fov=70, projection=projection, height=height)
    scene = rt.Scene([rt.Plane((0, 0, 1), 2)], [], camera)  # 7 before the camera
    image = renderer.render(scene, (33, 20), rt.Settings())
    assert image.planar_depth is not None and image.depth is not None
    np.testing.assert_allclose(image.planar_depth, 7.0, rtol=1e-6)
    assert (image.depth.max() > 9) == (projection == "perspective")
    assert image.replace(camera=None).planar_depth is None


def multi_part() -> bytes:
    file = io.BytesIO()
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.PIZ_COMPRESSION}
    parts = [OpenEXR.Part(dict(header), planes("Z"), "depth"), OpenEXR.Part(dict(header), planes(), "colour")]
    OpenEXR.File(parts).write(file)
    return file.getvalue()


def tiled() -> bytes:
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 16
    return exr(planes(), type=OpenEXR.tiledimage, tiles=tiles)


def halves() -> bytes:
    return exr({name: values.astype(np.float16) for name, values in planes().items()})


@pytest.mark.parametrize("make", [multi_part, tiled, halves])
def test_files_of_other_forms_are_read(tmp_path: Path, make: Callable[[], bytes]) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(make())
    picture = load_picture(path)
    expected = np.stack([planes()[name] for name in "RGBA"], -1)
    kind = np.float16 if make is halves else np.float32
    np.testing.assert_array_equal(picture.radiance[:], expected[..., :3].astype(kind))
    np.testing.assert_array_equal(picture.alpha, expected[..., 3].astype(kind))
    assert read_metadata(path) == {}


def deep() -> bytes:
    pixels = np.empty(SHAPE, object)
    for place in np.ndindex(SHAPE):
        pixels[place] = np.ones(sum(place) % 3, np.float32)
    return exr({name: pixels for name in "RGB"}, type=OpenEXR.deepscanline, compression=OpenEXR.ZIPS_COMPRESSION)


def cropped() -> bytes:
    window = np.array([0, 0], np.int32), np.array([99, 9], np.int32)
    return exr(planes(), displayWindow=window)


def huge() -> bytes:
    """A file whose header states a picture of 65536 x 65536 pixels."""
    return exr(planes()).replace(bytes([32, 0, 0, 0, 19, 0, 0, 0]), bytes([255, 255, 0, 0, 255, 255, 0, 0]))


def many_channels() -> bytes:
    names = b"".join(b"c%d\0" % i + bytes([2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]) for i in range(40_000))
    return (
        exr(planes("RGB")).replace(b"channels\0chlist\0", b"channels\0chlist\0" + len(names).to_bytes(4, "little"))[:60]
        + names
    )


WRONG = {
    "empty": (lambda: b"", "expected an EXR file$"),
    "another file": (lambda: b"\x89PNG\r\n\x1a\n" * 9, "expected an EXR file$"),
    "another version": (lambda: b"\x76\x2f\x31\x01\x03\0\0\0", "expected an EXR file of version 2, got 3"),
    "only a luminance": (lambda: exr(planes("Y")), "expected channels R, G and B, got 'Y'"),
    "whole numbers": (
        lambda: exr({name: np.ones(SHAPE, np.uint32) for name in "RGB"}),
        "expected channels of floating-point numbers, got whole numbers",
    ),
    "deep pixels": (deep, "expected an EXR file of flat pixels, got deep or subsampled ones"),
    "two windows": (cropped, "expected data and display windows of one size, got 33x20 and 100x10"),
    "a huge picture": (huge, "expected at most 33554432 pixels, got 65536x65536"),
    "many channels": (many_channels, "its header is damaged"),
    "a cut header": (lambda: exr(planes())[:200], "its header is damaged"),
    "cut pixels": (lambda: exr(planes())[:-400], "its pixels are damaged or missing"),
    "damaged pixels": (lambda: exr(planes())[:-4000] + bytes(4000), "its pixels are damaged or missing"),
    "alpha above 1": (lambda: exr(planes("RGB") | {"A": 2 * np.ones(SHAPE, np.float32)}), r"A: expected numbers in"),
    "NaN": (lambda: exr({name: np.full(SHAPE, np.nan, np.float32) for name in "RGB"}), "expected finite numbers"),
}


@pytest.mark.parametrize(("make", "message"), WRONG.values(), ids=WRONG)
def test_a_file_that_is_no_picture_is_refused_in_one_line_and_without_noise(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], make: Callable[[], bytes], message: str
) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(make())
    assert main(["compare", str(path), str(path)]) == 2
    out, errors = capfd.readouterr()  # of the whole process: OpenEXR would print by itself
    assert not out and errors.startswith(f"raytracer: {path}: ") and errors.count("\n") == 1
    assert re.search(message, errors.strip())


def test_400_damaged_headers_are_read_or_refused(tmp_path: Path) -> None:
    file = io.BytesIO()
    full_image().write(file, ".exr")
    sound, rng, path = file.getvalue(), np.random.default_rng(5), tmp_path / "a.exr"
    refused = 0
    for number in range(400):
        data = bytearray(sound[: rng.integers(len(sound))] if number % 4 == 0 else sound)
        for place in rng.integers(0, min(len(data), 900), number % 4):
            data[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(data)
        for read in (read_size, read_metadata):
            try:
                read(path)
            except rt.InputError as error:
                refused += 1
                assert len(str(error)) < 400 and "\n" not in str(error)
    assert 100 < refused < 800


def test_a_file_that_is_cut_off_anywhere_has_no_metadata(tmp_path: Path) -> None:
    file = io.BytesIO()
    full_image().write(file, ".exr")
    sound, path = file.getvalue(), tmp_path / "a.exr"
    for end in (*range(0, len(sound), 97), len(sound) - 1):
        path.write_bytes(sound[:end])
        with pytest.raises(rt.InputError, match="expected an EXR file"):
            read_metadata(path)


@pytest.mark.parametrize("end", ["os.kill(os.getpid(), 11)", "print('noise'); sys.exit(3)", "os.abort()"])
def test_a_decoder_that_crashes_is_a_damaged_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], end: str
) -> None:
    full_image().save(tmp_path / "a.exr")
    monkeypatch.setattr(image_exr, "_DECODE", image_exr._DECODE.replace("import numpy, OpenEXR", end))
    with pytest.raises(rt.InputError, match="its pixels are damaged or missing"):
        load_picture(tmp_path / "a.exr")
    assert capfd.readouterr() == ("", "")


def test_without_openexr_the_extra_is_named_before_anything_is_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.exr"
    full_image().save(path)
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    assert read_size(path) == SHAPE[::-1] and read_metadata(path) == full_image().metadata
    for command in (
        ["render", "assignment", "-o", str(tmp_path / "b.exr")],
        ["reference", "assignment", "-o", str(tmp_path / "b.exr")],
        ["compare", str(path), str(path)],
    ):
        assert main(command) == 2
        errors = capsys.readouterr().err
        assert "pip install -e '.[exr]'" in errors and errors.count("\n") == 1
    assert not (tmp_path / "b.exr").exists()


@pytest.mark.gl
@pytest.mark.skipif(not shutil.which("oiiotool"), reason="oiiotool is not installed (Debian package openimageio-tools)")
def test_openimageio_reads_the_channels_the_colours_and_the_texts(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    command = ["render", "assignment", "-o", str(path), "--size", "33x20", "--samples", "4", "--transparent"]
    assert main(command) == 0
    told = subprocess.run(["oiiotool", "--info", "-v", str(path)], capture_output=True, text=True, check=True)
    assert not told.stderr and "33 x   20, 11 channel" in told.stdout
    names = re.search(r"channel list: (.*)", told.stdout)
    assert names and names[1].startswith("R (float), G (float), B (float), A (float), Z (float)")
    assert {name.partition(" ")[0] for name in names[1].split(", ")} == CHANNELS - {"samples.Y"}
    for text in (
        "chromaticities: 0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329",
        'compression: "zip"',
        'oiio:ColorSpace: "Linear"',
        'raytracer:Title: "assignment"',
    ):
        assert text in told.stdout
