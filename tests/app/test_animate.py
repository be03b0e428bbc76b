"""`raytracer animate`: movies and frames, wrong arguments in one line, and Ctrl-C that keeps the frames."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import raytracer as rt
from raytracer.app.cli import main
from tests import scenes
from tests.scenes import GOOD

TABLE = """
[settings]
size = [48, 32]
[animation]
frames = 6
fps = 12
turntable = 90
[[animation.tracks]]
path = "shapes.a.sphere.radius"
keys = { 0 = 1.0, 5 = 1.5 }
"""
# The radius of frames 4 and 5 is not above 0.
WRONG = TABLE.replace("5 = 1.5", "4 = 0.0, 5 = -1.0").replace("0 = 1.0", "0 = 1.0, 3 = 1.0")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "good.toml"
    path.write_text(GOOD + TABLE)
    return path


def frame(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path))


@pytest.mark.gl
def test_a_movie_has_the_frames_and_leaves_nothing_else(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    movie = tmp_path / "new" / "folder" / "a.webp"
    assert main(["animate", str(scene), "-o", str(movie)]) == 0
    out = capsys.readouterr().out
    assert f"wrote {movie}: 6 frames at 12 fps, 48x32, 6 drawn" in out and "largest error" in out
    assert [*movie.parent.iterdir()] == [movie]
    animation = rt.animation(scene)
    with Image.open(movie) as read:
        for k in range(6):
            read.seek(k)
            expected = rt.render(animation.scene(k), (48, 32)).srgb8()
            assert np.array_equal(np.asarray(read.convert("RGB")), expected)


@pytest.mark.gl
def test_kept_frames_are_used_again_and_other_settings_draw_all_again(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    movie = tmp_path / "a.mp4"
    command = ["animate", str(scene), "-o", str(movie), "--keep"]
    assert main([*command, "--frames", "0:4"]) == 0
    frames = sorted((tmp_path / "a.mp4.frames").iterdir())
    assert [file.name for file in frames] == [f"{k:06}.png" for k in range(4)]
    times = [file.stat().st_mtime_ns for file in frames]
    assert main(command) == 0
    assert [file.stat().st_mtime_ns for file in frames] == times
    assert "2 drawn, 4 kept" in capsys.readouterr().out
    assert main([*command, "--samples", "2"]) == 0
    assert "6 drawn, " in capsys.readouterr().out


@pytest.mark.gl
def test_a_pattern_writes_a_file_for_each_chosen_frame(scene: Path, tmp_path: Path) -> None:
    pattern = tmp_path / "frames" / "f%03d.npz"
    assert main(["animate", str(scene), "-o", str(pattern), "--frames", "2:4", "--samples", "4"]) == 0
    assert sorted(file.name for file in pattern.parent.iterdir()) == ["f002.npz", "f003.npz"]
    for k in (2, 3):
        image = rt.render(rt.animation(scene).scene(k), (48, 32), samples=4)
        assert np.array_equal(np.load(pattern.parent / f"f{k:03}.npz")["radiance"], image.radiance)


@pytest.mark.gl
def test_refused_frames_are_named_and_all_others_made_without_a_movie(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene.write_text(GOOD + WRONG)
    movie = tmp_path / "a.png"
    assert main(["animate", str(scene), "-o", str(movie)]) == 1
    errors = capsys.readouterr().err
    assert "(in frame 4)" in errors and "(in frame 5)" in errors
    assert "2 of 6 frames failed; the others are in" in errors and "no a.png without the others" in errors
    assert not movie.exists() and len([*(tmp_path / "a.png.frames").iterdir()]) == 4
    assert main(["animate", str(scene), "-o", str(movie), "--frames", ":4"]) == 0
    with Image.open(movie) as read:
        assert getattr(read, "n_frames", 1) == 4


@pytest.mark.gl
def test_a_missed_error_is_status_1_also_when_the_frames_are_kept(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["animate", str(scene), "-o", str(tmp_path / "%d.png"), "--max-error", "1e-6", "--samples", "2"]
    for _ in range(2):
        assert main(command) == 1
        assert "6 of 6 frames did not reach the error 1e-06; try more --samples" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["-o", "a.gif"],
            "expected a movie that ends in .mp4, .webm, .webp, .png, or a pattern such as frames/%04d.png",
        ),
        (["-o", "a.mp5"], 'did you mean ".mp4"?'),
        (["-o", "a"], "expected a movie that ends in"),
        (["-o", "%04d.gif"], "expected a pattern that ends in .png or .npz"),
        (["-o", "%04d.mp4"], "expected a pattern that ends in .png or .npz"),
        (["-o", "%s.png"], "expected a pattern with one number"),
        (["-o", "%4d.png"], "expected a pattern with one number"),
        (["-o", "%d%d.png"], "expected a pattern with one number"),
        (["-o", "%d/a.png"], "expected a pattern with one number"),
        (["-o", "100%.png"], "expected a pattern with one number"),
        (["-o", "%%d.png"], "expected a pattern with one number"),
        (["-o", "%04d.png", "--keep"], "expected no --keep with a pattern"),
        (["-o", "%04d.png", "--crf", "18"], "expected --crf for .mp4 and .webm only"),
        (["-o", "a.webp", "--crf", "18"], "expected --crf for .mp4 and .webm only"),
        (["-o", "a.mp4", "--crf", "52"], "--crf: expected a whole number in [0, 51], got 52"),
        (["-o", "a.mp4", "--crf", "-1"], "--crf"),
        (["-o", "a.mp4", "--frames", "3"], "expected A:B, such as 0:24, got '3'"),
        (["-o", "a.mp4", "--frames", "-1:3"], "--frames"),
        (["-o", "a.mp4", "--frames", "3:3"], "--frames: expected A:B with 0 <= A < B <= 6, got 3:3"),
        (["-o", "a.mp4", "--frames", "4:2"], "--frames: expected A:B with 0 <= A < B <= 6, got 4:2"),
        (["-o", "a.mp4", "--frames", "0:7"], "--frames: expected A:B with 0 <= A < B <= 6, got 0:7"),
        (["-o", "a.mp4", "--frames", "6:"], "--frames: expected A:B with 0 <= A < B <= 6, got 6:6"),
        (["-o", "a.mp4", "--frame", "0:3", "--max-eror", "1"], "--max-eror"),
        (["-o", "good.toml/a.mp4"], "expected a place for a folder"),
        (["-o", "a.mp4", "--samples", "0"], "samples"),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(
    scene: Path,
    arguments: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(scene.parent)
    assert main(["animate", "good.toml", *arguments]) == 2
    errors = capsys.readouterr().err
    assert message in errors and errors.count("\n") == 1
    assert [*scene.parent.iterdir()] == [scene]


def test_a_scene_without_the_table_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["animate", "assignment", "-o", str(tmp_path / "a.mp4")]) == 2
    assert "assignment.toml: expected a table [animation]" in capsys.readouterr().err


# Presses Ctrl-C when frame 3 is about to be written.
INTERRUPTED = """
import signal, sys
from pathlib import Path
from raytracer.farm.frame_store import FrameStore
write = FrameStore.write
def interrupted(self, frame, data):
    if frame == 3:
        signal.raise_signal(signal.SIGINT)
    write(self, frame, data)
FrameStore.write = interrupted
signal.signal(signal.SIGINT, signal.default_int_handler)
from raytracer.__main__ import main
sys.argv = ["raytracer", "animate", *sys.argv[1:]]
sys.exit(main())
"""


@pytest.mark.gl
def test_ctrl_c_keeps_the_frames_and_says_how_to_go_on(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    movie = tmp_path / "a.webp"
    command = [sys.executable, "-c", INTERRUPTED, str(scene), "-o", str(movie)]
    done = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=100)
    expected = f"interrupted; 3 of 6 frames are in {movie}.frames: the same command goes on with them"
    assert (done.returncode, done.stderr) == (128 + signal.SIGINT, f"raytracer: {expected}\n")
    assert sorted(file.name for file in Path(f"{movie}.frames").iterdir()) == [f"{k:06}.png" for k in range(3)]
    assert main(["animate", str(scene), "-o", str(movie)]) == 0
    assert "3 drawn, 3 kept" in capsys.readouterr().out and not Path(f"{movie}.frames").exists()


@pytest.mark.gl
def test_a_full_disk_keeps_the_frames_before(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from raytracer.farm.frame_store import FrameStore

    write = FrameStore.write

    def full(self: FrameStore, frame: int, data: bytes) -> None:
        if frame == 2:
            raise OSError(28, "No space left on device")
        write(self, frame, data)

    monkeypatch.setattr(FrameStore, "write", full)
    assert main(["animate", str(scene), "-o", str(tmp_path / "a.mp4")]) == 1
    assert "No space left on device; 2 of 6 frames are in" in capsys.readouterr().err
