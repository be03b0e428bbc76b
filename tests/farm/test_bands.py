"""Pictures in bands: the files of whole pictures, in any order of bands, with memory for one band."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Pillow

import raytracer as rt
from raytracer.app.cli import main
from raytracer.farm import band_rows
from raytracer.farm.bands import BandJob, DrawnBand, _in_order, write_bands
from raytracer.farm.tasks import Done, Failed, Run, run_here
from raytracer.formats.estimate import Estimate, join_estimates
from raytracer.formats.image_files import load_picture, read_metadata
from raytracer.scene.settings import Settings
from tests import scenes

SIZE = 70, 53


def run_shuffled(function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]]) -> Iterator[Done | Failed]:
    """Return the outcomes in another order, as workers do."""
    listed = list(jobs)
    for number in np.random.default_rng(2).permutation(len(listed)):
        yield from run_here(function, [listed[number]])


def run_failing(function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]]) -> Iterator[Done | Failed]:
    """Let the second job fail."""
    for outcome in run_here(function, jobs):
        yield Failed(1, "three workers died") if outcome.job == 1 else outcome


def no_progress(done: int, total: int) -> None:
    assert 0 <= done <= total


@pytest.mark.gl
@pytest.mark.parametrize(("suffix", "bits"), [(".png", None), (".png", 16), (".exr", None)])
@pytest.mark.parametrize(("run", "transparent"), [(run_here, False), (run_shuffled, True)])
def test_bands_make_the_file_of_the_whole_picture(
    tmp_path: Path, suffix: str, bits: int | None, run: Run, transparent: bool
) -> None:
    scene, settings = scenes.assignment(), Settings(samples=4)
    job = BandJob(scene, SIZE, settings, (0, SIZE[1]), suffix, bits, transparent)
    with (tmp_path / f"bands{suffix}").open("wb") as file:
        banded = write_bands(file, job, 16, run, no_progress)
    image = rt.render(scene, SIZE, settings, transparent=transparent)
    image.save(tmp_path / f"whole{suffix}", bits)
    bands, whole = (load_picture(tmp_path / f"{name}{suffix}") for name in ("bands", "whole"))
    np.testing.assert_array_equal(bands.radiance[:], whole.radiance[:])
    assert (bands.alpha is not None) == transparent
    if transparent:
        np.testing.assert_array_equal(bands.alpha, whole.alpha)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"bands{suffix}", f"whole{suffix}"]
    assert (banded.fewest, banded.most) == (4, 4)
    assert banded.estimate.samples == 4
    texts, expected = (read_metadata(tmp_path / f"{name}{suffix}") for name in ("bands", "whole"))
    assert texts == {**expected, "Seconds": texts["Seconds"], "Error": str(banded.estimate)}
    if suffix == ".png":
        with Pillow.open(tmp_path / "bands.png") as png:
            png.load()  # texts come behind the pixels
            assert png.info["Error"] == str(banded.estimate)


@pytest.mark.gl
def test_a_band_that_fails_ends_the_picture_and_leaves_no_file(tmp_path: Path) -> None:
    job = BandJob(scenes.assignment(), SIZE, Settings(), (0, SIZE[1]), ".png")
    with (tmp_path / "a.png").open("wb") as file, pytest.raises(rt.InputError, match="three workers died"):
        write_bands(file, job, 16, run_failing, no_progress)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_early_bands_wait_outside_the_memory(tmp_path: Path) -> None:
    def late_first() -> Iterator[Done | Failed]:
        for number in [*range(1, 40), 0]:
            yield Done(number, DrawnBand(np.full((16, 4096, 4), number, np.float32), Estimate(1.0, 0.0), 1, 1))

    tracemalloc.start()
    for number, band in enumerate(_in_order(late_first(), tmp_path)):
        assert band.pixels[0, 0, 0] == number
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5 * 2**20, "of 40 bands of 1 MiB"
    assert not list(tmp_path.iterdir())


def test_the_estimate_of_a_picture_follows_from_those_of_its_bands() -> None:
    sky = Estimate(2.0, 1.0, 0.1, 0.5, (3, 1), max_error=0.2)
    ground = Estimate(5.0, 3.0, 0.3, 0.7, (2, 4), max_error=0.2)
    joined = join_estimates([(sky, 300, 0), (ground, 100, 30)])
    assert joined.samples == (3 * 2.0 + 5.0) / 4
    assert joined.seconds == 4.0
    assert joined.rmse == pytest.approx(((3 * 0.01 + 0.09) / 4) ** 0.5)
    assert (joined.worst, joined.worst_at) == (0.7, (2, 34)), "rows count from the top of the picture"
    assert joined.reached
    assert join_estimates([(sky, 1, 0), (ground.replace(unknown="few"), 1, 1)]).uncertain
    unknown = join_estimates([(sky, 1, 0), (Estimate(1.0, 1.0, unknown="1 sample", max_error=0.2), 1, 1)])
    assert (unknown.rmse, unknown.unknown, unknown.reached) == (None, "1 sample", False)


@pytest.mark.parametrize(
    ("output", "options", "message"),
    [
        ("a.npz", ["--bands", "32"], "expected an output that ends in .png or .exr, got .npz"),
        ("a.png", ["--bands", "0"], "expected a multiple of 16 in [16, 65536], got 0"),
        ("a.png", ["--bands", "40"], "expected a multiple of 16 in [16, 65536], got 40"),
        ("a.png", ["--bands", "65552"], "expected a whole number in [0, 65536], got 65552"),
        ("a.png", ["--bands", "-16"], "expected"),
        ("a.png", ["--bands", "32", "--time", "1"], "cannot be combined with --time"),
        ("a.npz", ["--size", "65536x65536"], "--bands 64 and .png or .exr need far less"),
        ("a.png", ["--size", "65536x65536", "--max-error", "1"], "--bands 64 and .png or .exr need far less"),
        ("a.png", ["--size", "65537x16"], "in whole pixels in [1, 65536]"),
    ],
)
def test_bands_that_cannot_be_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], output: str, options: list[str], message: str
) -> None:
    assert main(["render", "assignment", "-o", str(tmp_path / output), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.gl
def test_a_picture_that_is_too_large_as_a_whole_is_drawn_in_bands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["render", "assignment", "--size", "1024x40", "-o"]
    assert main([*command, str(tmp_path / "whole.png")]) == 0
    monkeypatch.setattr(band_rows, "_WHOLE_BYTES", 2**18)
    monkeypatch.setattr(band_rows, "physical_memory", lambda: 2**18)
    monkeypatch.setattr(band_rows, "_BAND_PIXELS", 2**14)
    for name in ("bands.png", "bands.exr"):
        assert main([*command, str(tmp_path / name)]) == 0
    lines = capsys.readouterr().out
    assert "bands.png: 1024x40, in bands of 16 rows, 1 sample per pixel" in lines
    assert "bands hold radiance only: bands.exr has no depth" in lines
    whole, bands = (load_picture(tmp_path / f"{name}.png").radiance[:] for name in ("whole", "bands"))
    np.testing.assert_array_equal(bands, whole)


@pytest.mark.gl
def test_with_a_requested_error_the_status_tells_whether_the_bands_reached_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["render", "assignment", "--size", "64x40", "--bands", "16", "-o", str(tmp_path / "a.png"), "--max-error"]
    assert main([*command, "0.02"]) == 0
    assert main([*command, "1e-9", "--samples", "4"]) == 1
    assert "4 samples were not enough" in capsys.readouterr().err
