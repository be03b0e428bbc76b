"""`raytracer sweep`: its files, its exit statuses and its messages."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

import raytracer as rt
from raytracer.app.cli import main
from raytracer.formats.image_files import load_picture
from tests import scenes

SIZE = ("--size", "32x20")


def sweep(folder: Path, *arguments: str) -> int:
    return main(["sweep", "assignment", "-o", str(folder), *SIZE, *arguments])


def read_table(folder: Path) -> list[dict[str, str]]:
    with (folder / "sweep.csv").open(newline="") as file:
        return [*csv.DictReader(file)]


@pytest.mark.gl
def test_a_sweep_writes_pictures_a_table_and_a_contact_sheet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new" / "folder"
    arguments = ("--set", "settings.samples=1:4:2:log", "--set", "lights.0.position=[4,7,4],[0,7,4]", "--format", "npz")
    assert sweep(folder, *arguments) == 0
    names = ["0000.npz", "0001.npz", "0002.npz", "0003.npz"]
    assert sorted(path.name for path in folder.iterdir()) == [*names, "contact-sheet.png", "sweep.csv"]
    rows = read_table(folder)
    assert [row["file"] for row in rows] == names
    assert [row["settings.samples"] for row in rows] == [row["samples"] for row in rows] == ["1", "1", "4", "4"]
    assert [row["lights.0.position"] for row in rows] == ["[4,7,4]", "[0,7,4]"] * 2
    assert [row["error_kind"] for row in rows] == ["unknown"] * 2 + ["about"] * 2
    first, last = (load_picture(folder / name).radiance[:] for name in (names[0], names[3]))
    scene = scenes.assignment()
    assert np.array_equal(first, rt.render(scene, (32, 20)).radiance)
    assert float(rows[3]["rmse"]) == rt.compare(last, first).rmse > 0 and rows[0]["rmse"] == "0.0"
    with Pillow.open(folder / "contact-sheet.png") as sheet:
        assert (sheet.width - 12) / 172 == 2  # a column for each position
    assert "wrote 4 pictures, sweep.csv and contact-sheet.png" in capsys.readouterr().out
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.npz")}
    assert sweep(folder, *arguments) == 0
    assert "0 drawn, 4 kept" in capsys.readouterr().out
    assert before == {path: path.stat().st_mtime_ns for path in folder.glob("*.npz")}


@pytest.mark.gl
def test_a_table_may_be_swept_against_a_picture_of_a_file(tmp_path: Path) -> None:
    table, reference = tmp_path / "values.csv", tmp_path / "reference.npz"
    table.write_text('lights.0.position,shapes.sphere4.sphere.radius\n"[4, 7, 4]",0.5\n"[0, 7, 4]",0.6\n')
    rt.render(scenes.assignment(), (32, 20), samples=16).save(reference)
    folder = tmp_path / "pictures"
    assert sweep(folder, "--table", str(table), "--reference", str(reference)) == 0
    rows = read_table(folder)
    assert [row["shapes.sphere4.sphere.radius"] for row in rows] == ["0.5", "0.6"]
    assert all(float(row["rmse"]) > 0 and row["reference"].startswith("reference.npz ") for row in rows)


@pytest.mark.gl
def test_refused_values_are_reported_and_all_others_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sweep(tmp_path, "--set", "lights.0.radius=0,-1,0.5") == 1
    error = capsys.readouterr().err
    assert "raytracer: picture 1 (lights.0.radius = -1): " in error and "got -1" in error
    assert "1 of 3 pictures are missing" in error
    assert [bool(row["problem"]) for row in read_table(tmp_path)] == [False, True, False]
    assert sorted(path.name for path in tmp_path.glob("0*")) == ["0000.png", "0002.png"]


@pytest.mark.gl
def test_a_missed_error_of_the_user_is_a_failure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sweep(tmp_path, "--set", "settings.max_error=1,1e-6", "--samples", "4") == 1
    assert [row["reached"] for row in read_table(tmp_path)] == ["yes", "no"]
    assert "1 of 2 pictures did not reach the requested error" in capsys.readouterr().err


@pytest.mark.gl
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "expected either --set or --table, got neither"),
        (["--set", "lights.0.radius=1", "--table", "v.csv"], "expected either --set or --table, got both"),
        (["--table", "v.csv"], "v.csv: expected a readable table: No such file"),
        (["--set", "lights.0.radius"], "--set lights.0.radius: expected PATH=VALUES, such as"),
        (["--set", "=1"], "--set =1: expected PATH=VALUES"),
        (["--set", "lights.0.radius="], "--set lights.0.radius=: expected values, got nothing"),
        (["--set", "lights.0.radius=1,,2"], "expected a value, got nothing"),
        (["--set", "lights.0.radius=1:2"], "expected a range from:to:n"),
        (["--set", "lights.0.radius=0:1:3:log"], "expected ends above 0"),
        (["--set", "lights.0.radius=1:2:200000"], "whole number n in [1, 100000]"),
        (["--set", "lights.0.radius=1,1"], "--set: expected different values, got 1 twice"),
        (["--set", "lights.0.radius=1", "--set", "lights.0.radius=2"], "expected different paths"),
        (["--set", "lights.0.position=[0,1,2]", "--set", "lights.0.position.0=2"], "is inside the other"),
        (["--set", "ambient.0=0:1:1000", "--set", "ambient.1=0:1:101"], "1000 x 101 = 101000"),
        (["--set", "lihgts.0.radius=1"], '--set: lihgts.0.radius: .*did you mean "lights"?'),
        (["--set", "lights.9.radius=1"], "lights.9.radius: .*expected an index in [0, 0] after lights, got 9"),
        (["--set", "lights.0.raidus=1"], 'unknown key `raidus` .*; did you mean "radius"?'),
        (["--set", "shapes.sphere1.sphere=1"], "shapes.sphere1.sphere is a table (known: center, radius)"),
        (
            ["--set", "shapes.sphere1.sphere.radius=1,big"],
            "expected numbers for shapes.sphere1.sphere.radius, got 'big'",
        ),
        (["--set", "settings.sampels=1"], 'unknown key `sampels` .*; did you mean "samples"?'),
        (["--set", "settings.samples=1,4", "--samples", "4"], "expected no samples beside a sweep of this setting"),
        (["--set", "settings.size=[32,20]"], "expected no size beside a sweep of this setting"),
        (["--set", "lights.0.radius=-1,-2"], "got -1 (with lights.0.radius = -1)"),
        (["--set", "lights.0.radius=1", "--format", "pgn"], '--format: expected png or .*; did you mean "png"?'),
        (
            ["--set", "lights.0.radius=1", "--reference", "1"],
            "--reference: expected a file, or the number of a picture",
        ),
        (["--set", "lights.0.radius=1", "--reference", "no.npz"], "no.npz: expected a picture that can be read"),
    ],
)
def test_a_wrong_sweep_is_refused_in_one_line_and_writes_nothing(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert sweep(Path("out"), *arguments) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("\n") == 1
    assert all(part in error for part in message.split(".*")), error
    assert [*tmp_path.iterdir()] == []


INTERRUPTED = """
import signal, sys
from raytracer.__main__ import main
from raytracer.farm import frame_store
write = frame_store.FrameStore.write
def interrupted(store, frame, data):
    write(store, frame, data)
    if frame == 2:
        signal.raise_signal(signal.SIGINT)
frame_store.FrameStore.write = interrupted
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["raytracer", *sys.argv[1:]]
sys.exit(main())
"""


@pytest.mark.gl
def test_ctrl_c_keeps_the_pictures_and_the_table_and_the_same_command_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--set", "lights.0.radius=0:1:5"]
    command = [sys.executable, "-c", INTERRUPTED, "sweep", "assignment", "-o", str(tmp_path), *SIZE, *arguments]
    done = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=100, env=os.environ)
    assert done.returncode == 128 + signal.SIGINT
    assert done.stderr == (
        f"raytracer: interrupted; 2 of 5 pictures are in {tmp_path}: the same command goes on with them\n"
    )
    assert len(read_table(tmp_path)) == 2
    assert sweep(tmp_path, *arguments) == 0
    assert "3 drawn, 2 kept" in capsys.readouterr().out
