"""`render` and `sweep` on workers: the files are those of one process."""

import csv
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from raytracer.app.cli import main
from raytracer.formats.image_files import load_picture

FARM = ("--workers", "2")

pytestmark = pytest.mark.gl


@pytest.mark.parametrize(
    ("suffix", "options"),
    [
        (".png", ["--samples", "4", "--transparent", "--bits", "16"]),
        (".exr", ["--samples", "4", "--adaptive", "0.01"]),
        (".png", ["--max-error", "0.05", "--bands", "48", "--shadows", "off"]),
    ],
)
def test_a_picture_of_workers_has_the_bits_of_one_process(tmp_path: Path, suffix: str, options: list[str]) -> None:
    pictures = []
    for name, farm in (("here", ()), ("farm", FARM)):
        path = tmp_path / f"{name}{suffix}"
        assert main(["render", "assignment", "-o", str(path), "--size", "70x90", *options, *farm]) == 0
        pictures.append(load_picture(path))
    here, farm = pictures
    np.testing.assert_array_equal(farm.radiance[:], here.radiance[:])
    np.testing.assert_array_equal(farm.alpha, here.alpha)
    assert (here.alpha is not None) == ("--transparent" in options)


REFUSED = {
    ("a.npz",): "raytracer: --workers: expected an output that ends in .png or .exr, got .npz",
    ("a.png", "--time=2"): "raytracer: --workers: cannot be combined with --time",
    ("a.png", "--max-error=0.1"): "raytracer: --workers: expected --bands ROWS, too",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_pictures_that_have_no_bands_are_refused_on_workers(
    tmp_path: Path, arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    output, *options = arguments
    assert main(["render", "assignment", "-o", str(tmp_path / output), *options, *FARM]) == 2
    assert capsys.readouterr().err.startswith(REFUSED[arguments]) and not [*tmp_path.iterdir()]


def test_a_sweep_of_workers_has_the_pictures_and_errors_of_one_process(tmp_path: Path) -> None:
    names = ["0000.png", "0001.png", "0002.png"]
    tables = []
    for name, farm in (("here", ()), ("farm", FARM)):
        folder = tmp_path / name
        command = ["sweep", "assignment", "-o", str(folder), "--size", "32x20", "--samples", "4", "--transparent"]
        assert main([*command, "--set", "lights.0.position=[4,7,4],[0,7,4],[-4,7,4]", *farm]) == 0
        with (folder / "sweep.csv").open(newline="") as file:
            tables.append([{**row, "seconds": ""} for row in csv.DictReader(file)])
    assert tables[0] == tables[1] and float(tables[0][2]["rmse"]) > 0
    for name in names:
        with Pillow.open(tmp_path / "here" / name) as here, Pillow.open(tmp_path / "farm" / name) as farm:
            assert here.mode == "RGBA" and here.tobytes() == farm.tobytes()
